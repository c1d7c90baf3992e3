// Bodies that sleep, as contacts see them: out of the search for pairs, with what their touches did kept to be read.
//
// What sleeps and when is decided in `rigid/sleep.cpp`. A sleeper stays in the search for those that are awake, at
// rest and without forces: whatever gets a point with it wakes it, and that step is begun anew with its whole island.
#include <algorithm>

#include "contacts/contact_stage.hpp"

namespace spook {

void ContactStage::put_to_sleep(const std::vector<int>& bodies) {
    state_.asleep.resize(solver_index_.size(), 0);
    for (const int body : bodies) {
        state_.asleep[body] = 1;
        detection_.set_asleep(body, true);
    }
    const auto stay =
        std::stable_partition(state_.cache.begin(), state_.cache.end(), [this](const CachedContact& cached) {
            return !sleeps(cached.contact.first) && !sleeps(cached.contact.second);
        });
    const auto old = static_cast<std::ptrdiff_t>(state_.sleeping.size());
    state_.sleeping.insert(state_.sleeping.end(), stay, state_.cache.end());
    state_.cache.erase(stay, state_.cache.end());
    std::inplace_merge(
        state_.sleeping.begin(), state_.sleeping.begin() + old, state_.sleeping.end(),
        [](const CachedContact& a, const CachedContact& b) { return a.contact.key < b.contact.key; });
}

void ContactStage::wake(const std::vector<int>& bodies) {
    for (const int body : bodies) {
        state_.asleep[body] = 0;
        detection_.set_asleep(body, false);
    }
    const auto woken = std::stable_partition(
        state_.sleeping.begin(), state_.sleeping.end(), [this](const CachedContact& cached) {
            return sleeps(cached.contact.first) || sleeps(cached.contact.second);
        });
    const auto old = static_cast<std::ptrdiff_t>(state_.cache.size());
    state_.cache.insert(state_.cache.end(), woken, state_.sleeping.end());
    state_.sleeping.erase(woken, state_.sleeping.end());
    std::inplace_merge(
        state_.cache.begin(), state_.cache.begin() + old, state_.cache.end(),
        [](const CachedContact& a, const CachedContact& b) { return a.contact.key < b.contact.key; });
}

std::vector<int> ContactStage::touching(const std::vector<char>& is_moving) const {
    std::vector<int> found;
    for (const CachedContact& cached : state_.sleeping) {
        if (is_moving[cached.contact.first]) found.push_back(cached.contact.second);
        if (is_moving[cached.contact.second]) found.push_back(cached.contact.first);
    }
    return found;
}

bool ContactStage::conveys(const Contact& contact) const {
    if (!conveys_) return false;
    return norm(materials_[contact.first].surface_velocity) > 0.0 ||
           norm(materials_[contact.second].surface_velocity) > 0.0;
}

void ContactStage::wake_sleepers(const Contact& contact) {
    for (const int body : {contact.first, contact.second})
        if (sleeps(body)) woken_.push_back(body);
}

void ContactStage::sleep_through() {
    woken_.clear();
    points_.clear();
    correction_.clear();
}

/// What sleeps is what slept then, for the search as well.
void ContactStage::lie_as(const State& state) {
    woken_.clear();
    if (state_.asleep.empty() && state.asleep.empty()) return;
    state_.asleep.resize(solver_index_.size(), 0);
    for (std::size_t b = 0; b < solver_index_.size(); ++b) {
        const bool slept = !state.asleep.empty() && state.asleep[b] != 0;
        if (slept == sleeps(static_cast<int>(b))) continue;
        detection_.set_asleep(static_cast<int>(b), slept);
    }
}

}  // namespace spook

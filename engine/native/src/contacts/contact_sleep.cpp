// Bodies that sleep, as contacts see them: out of the search for pairs, with what their touches did kept to be read.
//
// What sleeps and when is decided in `rigid/sleep.cpp`. A sleeper stays in the search for those that are awake, at
// rest and without forces: whatever gets a point with it wakes it, and that step is begun anew with its whole island.
#include <algorithm>

#include "contacts/contact_stage.hpp"

namespace spook {

void ContactStage::put_to_sleep(const std::vector<int>& bodies) {
    asleep_.resize(solver_index_.size(), 0);
    for (const int body : bodies) {
        asleep_[body] = 1;
        detection_.set_asleep(body, true);
    }
    const auto stay =
        std::stable_partition(cache_.begin(), cache_.end(), [this](const CachedContact& cached) {
            return !sleeps(cached.contact.first) && !sleeps(cached.contact.second);
        });
    const auto old = static_cast<std::ptrdiff_t>(sleeping_cache_.size());
    sleeping_cache_.insert(sleeping_cache_.end(), stay, cache_.end());
    cache_.erase(stay, cache_.end());
    std::inplace_merge(
        sleeping_cache_.begin(), sleeping_cache_.begin() + old, sleeping_cache_.end(),
        [](const CachedContact& a, const CachedContact& b) { return a.contact.key < b.contact.key; });
}

void ContactStage::wake(const std::vector<int>& bodies) {
    for (const int body : bodies) {
        asleep_[body] = 0;
        detection_.set_asleep(body, false);
    }
    const auto woken = std::stable_partition(
        sleeping_cache_.begin(), sleeping_cache_.end(), [this](const CachedContact& cached) {
            return sleeps(cached.contact.first) || sleeps(cached.contact.second);
        });
    const auto old = static_cast<std::ptrdiff_t>(cache_.size());
    cache_.insert(cache_.end(), woken, sleeping_cache_.end());
    sleeping_cache_.erase(woken, sleeping_cache_.end());
    std::inplace_merge(
        cache_.begin(), cache_.begin() + old, cache_.end(),
        [](const CachedContact& a, const CachedContact& b) { return a.contact.key < b.contact.key; });
}

std::vector<int> ContactStage::touching(const std::vector<char>& is_moving) const {
    std::vector<int> found;
    for (const CachedContact& cached : sleeping_cache_) {
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

/// What sleeps is what slept then.
void ContactStage::lie_as(const Memory& memory) {
    sleeping_cache_ = memory.kept;
    woken_.clear();
    if (asleep_.empty() && memory.asleep.empty()) return;
    asleep_.resize(solver_index_.size(), 0);
    for (std::size_t b = 0; b < solver_index_.size(); ++b) {
        const bool slept = !memory.asleep.empty() && memory.asleep[b] != 0;
        if (slept == sleeps(static_cast<int>(b))) continue;
        asleep_[b] = slept;
        detection_.set_asleep(static_cast<int>(b), slept);
    }
}

}  // namespace spook

// Bodies that sleep, as contacts see them: out of the search for pairs, with what their touches did kept to be read.
//
// Who sleeps and when is decided in `rigid/rigid_sleep.cpp`. A sleeper stays in the search for those who are awake, at
// rest and without forces: whatever gets a point with it rouses it, and that step is begun anew with its whole island.
#include <algorithm>

#include "contacts/contact_stage.hpp"

namespace spook {

void ContactStage::put_to_sleep(const std::vector<int>& bodies) {
    asleep_.resize(unknown_.size(), 0);
    for (const int body : bodies) {
        asleep_[body] = 1;
        detection_.rest(body, true);
    }
    const auto stay = std::stable_partition(touches_.begin(), touches_.end(), [this](const Touch& touch) {
        return !sleeps(touch.contact.first) && !sleeps(touch.contact.second);
    });
    const auto old = static_cast<std::ptrdiff_t>(kept_.size());
    kept_.insert(kept_.end(), stay, touches_.end());
    touches_.erase(stay, touches_.end());
    std::inplace_merge(kept_.begin(), kept_.begin() + old, kept_.end(),
                       [](const Touch& a, const Touch& b) { return a.contact.key < b.contact.key; });
}

void ContactStage::wake(const std::vector<int>& bodies) {
    for (const int body : bodies) {
        asleep_[body] = 0;
        detection_.rest(body, false);
    }
    const auto woken = std::stable_partition(kept_.begin(), kept_.end(), [this](const Touch& touch) {
        return sleeps(touch.contact.first) || sleeps(touch.contact.second);
    });
    const auto old = static_cast<std::ptrdiff_t>(touches_.size());
    touches_.insert(touches_.end(), woken, kept_.end());
    kept_.erase(woken, kept_.end());
    std::inplace_merge(touches_.begin(), touches_.begin() + old, touches_.end(),
                       [](const Touch& a, const Touch& b) { return a.contact.key < b.contact.key; });
}

std::vector<int> ContactStage::touching(const std::vector<char>& stirs) const {
    std::vector<int> found;
    for (const Touch& touch : kept_) {
        if (stirs[touch.contact.first]) found.push_back(touch.contact.second);
        if (stirs[touch.contact.second]) found.push_back(touch.contact.first);
    }
    return found;
}

bool ContactStage::conveys(const Contact& contact) const {
    if (!conveys_) return false;
    return norm(materials_[contact.first].surface_velocity) > 0.0 ||
           norm(materials_[contact.second].surface_velocity) > 0.0;
}

void ContactStage::rouse(const Contact& contact) {
    for (const int body : {contact.first, contact.second})
        if (sleeps(body)) roused_.push_back(body);
}

void ContactStage::sleep_through() {
    roused_.clear();
    points_.clear();
    correction_.clear();
}

/// Who sleeps is who slept then.
void ContactStage::lie_as(const Memory& memory) {
    kept_ = memory.kept;
    roused_.clear();
    if (asleep_.empty() && memory.asleep.empty()) return;
    asleep_.resize(unknown_.size(), 0);
    for (std::size_t b = 0; b < unknown_.size(); ++b) {
        const bool slept = !memory.asleep.empty() && memory.asleep[b] != 0;
        if (slept == sleeps(static_cast<int>(b))) continue;
        asleep_[b] = slept;
        detection_.rest(static_cast<int>(b), slept);
    }
}

}  // namespace spook

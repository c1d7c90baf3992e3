// Bodies that sleep, as contacts see them: out of the search for pairs, with what their touches did kept to be read.
//
// What sleeps and when is decided in `rigid/sleep.cpp`. A sleeper stays in the search for those that are awake, at
// rest and without forces: whatever gets a point with it wakes it, and that step is begun anew with its whole island.
#include "contacts/contact_stage.hpp"

namespace spook {

void ContactStage::put_to_sleep(const std::vector<int>& bodies) {
    for (const int body : bodies) search_.detection.set_asleep(body, true);
    state_.cache.put_to_sleep(bodies, model_->bodies.count());
}

void ContactStage::wake(const std::vector<int>& bodies) {
    for (const int body : bodies) search_.detection.set_asleep(body, false);
    state_.cache.wake(bodies);
}

void ContactStage::sleep_through() {
    search_.woken.clear();
    points_.all.clear();
    correction_.clear();
}

/// What sleeps is what slept then, for the search as well.
void ContactStage::lie_as(const State& state) {
    search_.woken.clear();
    if (state_.cache.asleep.empty() && state.cache.asleep.empty()) return;
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        const int body = static_cast<int>(b);
        if (const bool slept = state.cache.sleeps(body); slept != state_.cache.sleeps(body))
            search_.detection.set_asleep(body, slept);
    }
}

}  // namespace spook

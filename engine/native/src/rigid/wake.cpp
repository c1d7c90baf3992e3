// Stage: waking. What a moving kinematic body touches or holds is awake from the start of the step; a sleeper that a point is
// found with, or that the position projection moves, wakes with its island, and the velocities of the step are found anew.
//
// reads: islands of sleepers, the contact cache, velocities of kinematic bodies. writes: live_.sleep, the contact
// stage's list of sleepers, warm starts of their rows.
#include <algorithm>

#include "rigid/sleeping.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::wake;

/// Wakes the bodies that a body that moves as it is told touches or holds.
void Sleeping::wake() {
    if (live_.sleep.sleepers == 0 || model_.driven.empty()) return;
    std::vector<char> told(model_.constants.size(), 0);
    bool some = false;
    for (const int i : model_.driven) {
        told[i] = is_moving(i);
        some = some || told[i] != 0;
        mixed_.contacts()->mark_moving(i, told[i] != 0);
    }
    if (!some) return;
    std::vector<int> met = mixed_.contacts()->cache().touching(told);
    for (const auto& [a, b] : rules_.ties) {
        if (told[a]) met.push_back(b);
        if (told[b]) met.push_back(a);
    }
    wake(met);
}

bool Sleeping::sleep_through() {
    if (live_.sleep.sleepers == 0 || live_.sleep.sleepers != model_.constrained.size() ||
        std::any_of(model_.driven.begin(), model_.driven.end(), [this](int i) { return is_moving(i); }))
        return false;
    mixed_.contacts()->sleep_through();
    mixed_.clear_touching();
    return true;
}

/// Whether a body that moves as it is told does so.
bool Sleeping::is_moving(int i) const noexcept {
    const BodyState& s = live_.bodies[i];
    return model_.constants[i].motion == Motion::kinematic &&
           norm(s.velocity) + rules_.reach[i] * norm(s.angular_velocity) >
               rounding * model_.method.sleep_speed;
}

/// Wakes the islands of some bodies; what is awake begins anew to be at rest.
void Sleeping::wake(const std::vector<int>& met) {
    Sleep& sleep = live_.sleep;
    std::vector<char> wakes(model_.constants.size() + 1, 0);
    for (const int body : met) {
        sleep.quiet[body] = 0;
        wakes[sleep.island[body]] = 1;
    }
    wakes[0] = 0;
    std::vector<int> woken;
    for (const int i : model_.constrained)
        if (wakes[sleep.island[i]]) woken.push_back(i);
    if (woken.empty()) return;
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k) {  // rows start from what they held
        const JointBlock& block = joints_.blocks()[k];
        if (!rests(block, live_)) continue;
        if (wakes[sleep.island[block.first >= 0 && live_.asleep(block.first) ? block.first : block.second]] ==
            0)
            continue;
        const JointSet::State& state = joints_.states[block.joint];
        const double* multiplier = state.multipliers(block.axial);
        std::copy_n(multiplier, block.size, mixed_.system.rows[k].multiplier.data());
        mixed_.system.rows[k].state.fill(RowState::free);
    }
    for (const int i : woken) sleep.island[i] = 0, sleep.quiet[i] = 0;
    sleep.sleepers -= woken.size();
    mixed_.contacts()->wake(woken);
}

/// What acts on a body has been changed from outside.
void Sleeping::wake_body(int body) {
    if (rules_.on() && body >= 0) wake({body});
}

void Sleeping::wake_joint(int joint) {
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k) {
        const JointBlock& block = joints_.blocks()[k];
        if (block.joint != joint) continue;
        wake_body(block.first);
        wake_body(block.second);
    }
}

}  // namespace spook

// Stage: waking. What a moving kinematic body touches or holds is awake from the start of the step; a sleeper that a point is
// found with, or that the position projection moves, wakes with its island, and the velocities of the step are found anew.
//
// reads: islands of sleepers, the contact cache, velocities of kinematic bodies. writes: live_.sleep, the contact
// stage's list of sleepers, warm starts of their rows.
#include <algorithm>

#include "rigid/rigid_system.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::wake;

}  // namespace

/// Wakes the bodies that a body that moves as it is told touches or holds.
void RigidSystem::wake() {
    if (live_.sleep.sleepers == 0 || driven_.empty()) return;
    std::vector<char> told(constants_.size(), 0);
    bool some = false;
    for (const int i : driven_) {
        told[i] = is_moving(i);
        some = some || told[i] != 0;
        contacts_->mark_moving(i, told[i] != 0);
    }
    if (!some) return;
    std::vector<int> met = contacts_->cache().touching(told);
    for (const auto& [a, b] : sleep_rules_.ties) {
        if (told[a]) met.push_back(b);
        if (told[b]) met.push_back(a);
    }
    wake(met);
}

/// Whether nothing moves: then the step is over.
bool RigidSystem::all_sleep() const noexcept {
    return live_.sleep.sleepers > 0 && live_.sleep.sleepers == constrained_.size() &&
           std::none_of(driven_.begin(), driven_.end(), [this](int i) { return is_moving(i); });
}

void RigidSystem::sleep_through() {
    contacts_->sleep_through();
    touching_ = false;
}

/// Sleepers get no part of their forces; the state is kept, since the velocities may show that some are met.
void RigidSystem::leave_out_sleepers_for_now() {
    if (live_.sleep.sleepers == 0) return;
    keep(before_waking_);
    residual_before_waking_ = residual_;
    share_.assign(constants_.size(), 1.0);
    leave_out_sleepers();
}

/// Whether sleepers were met: they are awake then, and all is as it was, to be found anew.
bool RigidSystem::wake_met() {
    if (live_.sleep.sleepers == 0) return false;
    share_.clear();
    if (contacts_->woken().empty()) return false;
    const std::vector<int> woken = contacts_->woken();
    go_back(before_waking_);
    residual_ = residual_before_waking_;
    wake(woken);
    return true;
}

/// Sleepers get no part of their forces.
void RigidSystem::leave_out_sleepers() {
    if (live_.sleep.sleepers == 0) return;
    for (const int i : constrained_)
        if (asleep(i)) share_[i] = 0.0;
}

/// Whether a body that moves as it is told does so.
bool RigidSystem::is_moving(int i) const noexcept {
    const BodyState& s = live_.bodies[i];
    return constants_[i].motion == Motion::kinematic &&
           norm(s.velocity) + sleep_rules_.reach[i] * norm(s.angular_velocity) >
               rounding * method_.sleep_speed;
}

/// Wakes the islands of some bodies; what is awake begins anew to be at rest.
void RigidSystem::wake(const std::vector<int>& met) {
    Sleep& sleep = live_.sleep;
    std::vector<char> wakes(constants_.size() + 1, 0);
    for (const int body : met) {
        sleep.quiet[body] = 0;
        wakes[sleep.island[body]] = 1;
    }
    wakes[0] = 0;
    std::vector<int> woken;
    for (const int i : constrained_)
        if (wakes[sleep.island[i]]) woken.push_back(i);
    if (woken.empty()) return;
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k) {  // rows start from what they held
        const JointBlock& block = joints_.blocks()[k];
        if (!rests(static_cast<int>(k))) continue;
        if (wakes[sleep.island[block.first >= 0 && asleep(block.first) ? block.first : block.second]] == 0)
            continue;
        const JointSet::State& state = joints_.states[block.joint];
        const double* multiplier = block.axial ? state.axial_multiplier.data() : state.multiplier.data();
        std::copy_n(multiplier, block.size, mixed_.rows[k].multiplier.data());
        mixed_.rows[k].state.fill(RowState::free);
    }
    for (const int i : woken) sleep.island[i] = 0, sleep.quiet[i] = 0;
    sleep.sleepers -= woken.size();
    contacts_->wake(woken);
}

/// What acts on a body has been changed from outside.
void RigidSystem::mark_moving(int body) {
    if (sleep_rules_.on() && body >= 0) wake({body});
}

void RigidSystem::wake_joint(int joint) {
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k) {
        const JointBlock& block = joints_.blocks()[k];
        if (block.joint != joint) continue;
        mark_moving(block.first);
        mark_moving(block.second);
    }
}

}  // namespace spook

// Energy that comes out of nothing: an outcome, not "completed". Asked of the methods whose rows can add to it and that keep it else:
// compositions, whose final state tells, and corrections, which may gain and lose on the way.
//
// reads: places and velocities of bodies, drives. writes: what the run has known of its energy.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rigid/rigid_system.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::energy_made;

}  // namespace

void RigidSystem::begin_energy() {
    live_.energy.most_kinetic = kinetic_energy();
    live_.energy.begun = live_.energy.most = live_.energy.most_kinetic + potential_energy();
    live_.energy.is_powered = false;
    if (composed_) return;
    // Of rows that begin violated, and of limits that begin overstepped, nothing says how much they give.
    double off[6];
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k) {
        joints_.overstep(k, live_.bodies, off);
        live_.energy.is_powered |= std::any_of(off, off + joints_.blocks()[k].size,
                                               [](double each) { return std::fabs(each) > OVERSTEPPED; });
    }
}

/// Whether something gives energy that no book of the run has: loads, drives, fluids, what moves as it is told.
bool RigidSystem::has_power() const noexcept {
    if (!fluids_.empty() || !load_follows_.empty() || joints_.drives()) return true;
    for (int i = 0; i < bodies(); ++i) {
        const bool led = !constants_[i].moves() &&
                         !(is_zero(live_.bodies[i].velocity) && is_zero(live_.bodies[i].angular_velocity));
        if (led || !is_zero(constants_[i].force) || !is_zero(constants_[i].torque)) return true;
    }
    return false;
}

/// After a step: what it came to, where position and velocity are of one moment.
void RigidSystem::note_energy() {
    if (half_step_ || live_.energy.is_powered) return;
    if (!curved_ && live_.moved % LOOKS != 0)
        return;  // in a plane each look costs a tenth of a step, and space is to answer alike
    if (at_hand_) write_plane();
    live_.energy.is_powered = has_power() || (live_.moved == 1 && penetration() > OVERSTEPPED);
    const double kinetic = kinetic_energy();
    live_.energy.most_kinetic = std::max(live_.energy.most_kinetic, kinetic);
    live_.energy.most = std::max(live_.energy.most, kinetic + potential_energy());
}

/// Asked once the final state was read.
void RigidSystem::judge_energy(RunReport& report) const {
    if (!(composed_ || method_.corrections > 0) || report.status != Status::completed || constrained_.empty())
        return;
    if (live_.energy.is_powered || has_power()) return;
    const double kinetic = kinetic_energy(), most = std::max(live_.energy.most_kinetic, kinetic);
    double reached = composed_ || !half_step_ ? kinetic + potential_energy() : live_.energy.most;
    if (!composed_) reached = std::max(reached, live_.energy.most);
    double least = ROUNDING * std::abs(live_.energy.begun);
    if (!composed_) {  // what a step's fall is worth: the first order of the step
        const double fall = h_ * norm(gravity_);
        for (const int i : constrained_)
            if (constants_[i].moves()) least += constants_[i].mass * fall * fall;
    }
    const double gained = reached - live_.energy.begun;
    if (!(gained > MOST_GAINED * most + least)) return;
    report.status = Status::unsettled;
    report.failed_step = report.steps;
    report.failed_body = *std::min_element(constrained_.begin(), constrained_.end(), [this](int a, int b) {
        return constants_[a].mass < constants_[b].mass;
    });
    char said[220];
    std::snprintf(
        said, sizeof said, "was found to move with %.3g J that came out of nothing, of %.3g J at most; %s",
        gained, most,
        composed_ ? "where light bodies carry much tension, T h²/(m l) above 0.3, take smaller steps or no "
                    "composition"
                  : "where bodies turn far in a step, take smaller steps or no corrections");
    report.reason = said;
}

}  // namespace spook

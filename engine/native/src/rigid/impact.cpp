// Stage: impacts. 0 <= nu ⟂ C v₊ + psi C v₋ >= 0 with friction against the slip, joints included and forces dropped; again as
// long as some contact or stop with restitution is approached. The law, and why it cannot raise the energy: contacts/impact_solver.hpp.
//
// reads: points, masses and rows of joints. writes: velocities of bodies and scratch_.velocities, impulses of impacts, share_ (the part of
// the forces still to act after an event), stops that were hit.
#include <algorithm>
#include <cmath>

#include "rigid/rigid_system.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::impact;

}  // namespace

/// Bodies moved to the time of an event take the part of their forces that acts before it.
void RigidSystem::lead_events() {
    share_.assign(constants_.size(), 1.0);
    leave_out_sleepers();
    for (int i : constrained_) {
        const double lead = contacts_->toi_fraction(i);
        if (lead == 0.0 || asleep(i)) continue;
        BodyState& s = live_.bodies[i];
        const Vec3 twist = lead * h_ * constants_[i].torque;
        const Vec3 dv = lead * kick(i), dw = turned_by(constants_[i], s, twist);
        s.velocity += dv;
        s.angular_momentum += twist;
        s.angular_velocity += dw;
        for (int k = 0; k < 3; ++k)
            scratch_.velocities[i][k] += dv[k], scratch_.velocities[i][3 + k] += dw[k];
        share_[i] = 1.0 - lead;
    }
}

/// Rows are those of the velocities before, and after it of those it leaves.
void RigidSystem::impact() {
    fill_momenta(false);
    contacts_->impact(mixed_, scratch_.impulses);
    judge_contacts();
    for (const int i : constrained_)
        if (contacts_->toi_fraction(i) > 0.0 && !asleep(i)) share_[i] = 1.0 - contacts_->toi_fraction(i);
    const auto add_to_before = [this](double sign) {
        if (!half_step_) return;
        for (const int i : constrained_) {
            live_.before[i].velocity += sign * live_.bodies[i].velocity;
            live_.before[i].angular_momentum += sign * live_.bodies[i].angular_momentum;
        }
    };
    add_to_before(1.0);
    take_velocities(true, [this](int k) { return !contacts_->has_rows(k); });
    add_to_before(-1.0);  // less what it has changed: see read_half_step()
    for (std::size_t k = 0; k < constrained_.size(); ++k)
        if (contacts_->has_rows(static_cast<int>(k)))
            scratch_.velocities[constrained_[k]] = mixed_.velocity[k];
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k)
        if (const StopRow& stop = mixed_.rows[k].stop; stop.answered || stop.limit_reached) {
            JointSet::State& state = joints_.states[joints_.blocks()[k].joint];
            const bool once = method_.impacts == ImpactOrder::simultaneous || stop.limit_reached;
            state.rebounds = once ? unbounded : again * std::abs(stop.rebound);
            if (!stop.answered) continue;
            if (stop.rebound == 0.0) state.met = mixed_.rows[k].lower[stop.row] == 0.0 ? 1 : -1;
        }
    fill_rows();
}

}  // namespace spook

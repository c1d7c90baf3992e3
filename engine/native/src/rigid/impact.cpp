// Stage: impacts. 0 <= nu ⟂ C v₊ + psi C v₋ >= 0 with friction against the slip, joints included and forces dropped; again as
// long as some contact or stop with restitution is approached. The law, and why it cannot raise the energy: contacts/impact_solver.hpp.
//
// reads: points, masses and rows of joints. writes: velocities of bodies and scratch_.velocities, impulses of impacts, share_ (the part of
// the forces still to act after an event), stops that were hit.
#include <algorithm>
#include <cmath>
#include <utility>

#include "rigid/mixed_rows.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::impact;

/// Bodies moved to the time of an event take the part of their forces that acts before it.
void MixedRows::act_before_events() {
    forces_.begin_shares();
    forces_.leave_out_sleepers();
    for (int i : model_.constrained) {
        const double lead = contacts_->toi_fraction(i);
        if (lead == 0.0 || live_.asleep(i)) continue;
        BodyState& s = live_.bodies[i];
        const Vec3 twist = lead * model_.h * model_.constants[i].torque;
        const Vec3 dv = lead * forces_.kick(i), dw = turned_by(model_.constants[i], s, twist);
        s.velocity += dv;
        s.angular_momentum += twist;
        s.angular_velocity += dw;
        for (int k = 0; k < 3; ++k)
            scratch_.velocities[i][k] += dv[k], scratch_.velocities[i][3 + k] += dw[k];
        forces_.set_share(i, 1.0 - lead);
    }
}

/// What is hit and is not a ball has turned until then: its inertia is that of the time of its impact, or one would give it energy.
void MixedRows::move_to_impact(StepMotion& motion) {
    for (std::size_t k = 0; k < model_.constrained.size(); ++k) {
        const int i = model_.constrained[k];
        const double until = motion.moved_until(i);
        if (until == 0.0) continue;
        scratch_.gone.resize(model_.constants.size());
        auto& [time, there] = scratch_.gone[i];
        if (!(until > time)) continue;
        const BodyConstants& body = model_.constants[i];
        if (time == 0.0) there = live_.bodies[i];
        there.angular_momentum = live_.bodies[i].angular_momentum;
        refresh(body, there);
        integrate(body, until - std::exchange(time, until), there);
        there.displacement = live_.bodies[i].displacement + until * linear(motion.predicted[i]);
        fill_mass(body, there, system.mass[k]);
        const Vec6& p = system.momentum[k];
        motion.turn_to_impact(i, axes(body, there), turned_by(body, there, {p[3], p[4], p[5]}));
    }
}

/// What forces give to the rates of stops that were left out, or whether some are hit that only forces lead to: then all is solved
/// again. What leads joints back to where they hold turns round with the rate and is no force.
bool MixedRows::find_pushes() {
    bool asked = false, late = false;
    const auto read_rates = [&](bool forces) {
        for (std::size_t k = 0; k < joints_.blocks().size(); ++k) {
            const StopRow& stop = system.rows[k].stop;
            if (!stop.asks) continue;
            const double rate = row_velocity(system.rows[k], stop.row, system.velocity);
            double& push = joints_.states[joints_.blocks()[k].joint].push;
            push = forces ? rate : push - rate;
            asked = true;
        }
    };
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k) {
        const StopRow& stop = system.rows[k].stop;
        if (!stop.may_be_late || system.rows[k].multiplier[stop.row] == 0.0) continue;
        late = joints_.states[joints_.blocks()[k].joint].late = true;
    }
    read_rates(true);
    if (!asked) return late;
    fill_momenta(false);
    if (solve_joints()) read_rates(false);
    return true;
}

/// J, that a solve takes from a body.
static double energy_taken(const Mat6& mass, const BodyState& begun, const Vec6& after) {
    const Vec3 v = begun.velocity, w = begun.angular_velocity;
    const Vec6 before{v.x, v.y, v.z, w.x, w.y, w.z};
    double taken = 0.0;
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
            taken += 0.5 * mass[6 * i + j] * (before[i] * before[j] - after[i] * after[j]);
    return taken;
}

/// Takes over what the contact stage has found of its last solve. What was stopped has lost no more than the solve took from all.
void MixedRows::judge_contacts() {
    const SolveQuality& found = contacts_->quality();
    live_.residual = std::max(live_.residual, found.residual);
    if (found.body >= 0) live_.note_unsettled(found.body, found.by, found.sunk);
    if (found.stopped.count == 0) return;
    double taken = 0.0;
    for (std::size_t k = 0; k < system.mass.size(); ++k)
        taken += energy_taken(system.mass[k], live_.bodies[model_.constrained[k]], system.velocity[k]);
    StoppedImpacts stopped = found.stopped;
    stopped.energy = std::min(stopped.energy, std::max(0.0, taken));
    live_.note_stopped(stopped);
}

/// Rows are those of the velocities before, and after it of those it leaves.
void MixedRows::impact() {
    fill_momenta(false);
    move_to_impact(contacts_->find_next_impact(system));
    contacts_->impact(system, scratch_.impulses);
    judge_contacts();
    const auto add_to_before = [this](double sign) {  // with the forces that are still to come
        if (!model_.half_step) return;
        for (const int i : model_.constrained) {
            live_.before[i].velocity += sign * (live_.bodies[i].velocity + forces_.kick(i));
            live_.before[i].angular_momentum +=
                sign * (live_.bodies[i].angular_momentum + forces_.angular_impulse(i));
        }
    };
    add_to_before(1.0);
    for (const int i : model_.constrained)
        if (contacts_->toi_fraction(i) > 0.0 && !live_.asleep(i))
            forces_.set_share(i, 1.0 - contacts_->toi_fraction(i));
    take_velocities(true, [this](int k) { return !contacts_->has_rows(k); });
    add_to_before(-1.0);  // less what it has changed: see HalfStep::read()
    for (std::size_t k = 0; k < model_.constrained.size(); ++k)
        if (contacts_->has_rows(static_cast<int>(k)))
            scratch_.velocities[model_.constrained[k]] = system.velocity[k];
    for (std::size_t k = 0; k < joints_.blocks().size(); ++k)
        if (const StopRow& stop = system.rows[k].stop; stop.answered || stop.limit_reached) {
            JointSet::State& state = joints_.states[joints_.blocks()[k].joint];
            const bool once = model_.method.impacts == ImpactOrder::simultaneous || stop.limit_reached;
            state.rebounds = once ? unbounded : again * std::abs(stop.rebound);
            if (!stop.answered) continue;
            live_.note_stopped(stop.cut * std::abs(scratch_.impulses[k][stop.row]),
                               model_.mover(joints_.blocks()[k]));
            if (stop.rebound == 0.0) state.met = system.rows[k].lower[stop.row] == 0.0 ? 1 : -1;
        }
    fill_rows();
}

}  // namespace spook

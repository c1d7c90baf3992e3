// The order of a step of h: what step() calls, each stage in the file of its name. A step first writes that it has begun,
// RigidState::step, and where bodies may sleep it notes where they are; then, unless a sample has asked for the velocities already,
// begin_velocities() begins the StepScratch.
//
//   wake               wake.cpp               what moving bodies touch or hold is awake; again, with all that follows, for what is met
//   apply forces       apply_forces.cpp       dv_ext = h M⁻¹ f
//   detect             detect.cpp             contact points: where, and when in the step
//   impact             impact.cpp             contacts and stops with restitution rebound; called by solve velocities
//   solve velocities   solve_velocities.cpp   v₊ with joints, contacts and friction; impacts that it brings about come first
//   integrate          integrate.cpp          q₊ = q + h v₊
//   project positions  project_positions.cpp  overlaps go, and leave no trace in v
//   sleep              sleep.cpp              islands at rest are left out of the coming steps
//   observe            observe.cpp            between steps: samples
//
// Steps of mechanisms that stay in a plane do the same by numbers of that plane (rigid_plane.cpp). Compositions of higher order
// (rigid_composition.cpp) have stages of their own.
#include <cstring>

#include "rigid/rigid_system.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::step;

void RigidSystem::step() {
    if (mixed_.contacts() || model_.constants.size() >= looking_from) Watch::look();
    ++live_.step;
    clock_.start();
    if (sleeping_.is_on()) sleeping_.note_places();
    if (!live_.velocity_ready) find_velocities();
    live_.velocity_ready = false;
    if (replaying_ &&
        early_joints_.empty()) {  // of a block that is taken again: as its first step leaves them
        deliver();
        early_joints_ = joints_.states;
    }
    integrate();
    clock_.mark(Stage::integrate_positions);
    if (!plane_.at_hand()) projection_.project_positions();  // in a plane nothing overlaps
    clock_.mark(Stage::project_positions);
    end_step();
    clock_.mark(Stage::integrate_positions);
    if (sleeping_.is_on()) sleeping_.sleep();
    clock_.mark(Stage::sleep);
}

/// From wake to solve velocities; also ahead of the step, for samples that need them.
void RigidSystem::find_velocities() {
    if (plane_.is_used() && plane_.solve()) return clock_.mark(Stage::solve_block);
    begin_velocities();
    sleeping_.wake();
    clock_.mark(Stage::sleep);
    do {
        if (sleeping_.sleep_through()) return;
        leave_out_sleepers();
        forces_.apply_forces();
        mixed_.detect();
        solve_velocities();
    } while (wake_met());
}

/// What the velocities of a step begin with, however often they are found: those of the step before, and loads that follow the time.
void RigidSystem::begin_velocities() {
    scratch_.begin();
    if (model_.rebounds)
        live_.stopped.most_kinetic = std::max(live_.stopped.most_kinetic, readings_.kinetic_energy());
    if (model_.half_step) half_step_.note_before();
    if (sleeping_.is_on()) sleeping_.note_velocities();
    if (forces_.follow_the_time()) forces_.follow_time();
}

/// Sleepers get no part of their forces; the state is kept, since the velocities may show that some are met.
void RigidSystem::leave_out_sleepers() {
    if (live_.sleep.sleepers == 0) return;
    keep_state(before_waking_);
    forces_.begin_shares();
    forces_.leave_out_sleepers();
}

/// Whether sleepers were met: they are awake then, and all is as it was, to be found anew.
bool RigidSystem::wake_met() {
    if (live_.sleep.sleepers == 0) return false;
    forces_.end_shares();
    if (mixed_.contacts()->woken().empty()) return false;
    const std::vector<int> woken = mixed_.contacts()->woken();
    go_back(before_waking_);
    sleeping_.wake(woken);
    return true;
}

/// By the solver of the method; rows that all hold go to one factorisation as long as nothing touches.
void RigidSystem::solve_velocities() {
    const ContactStage* contacts = mixed_.contacts();
    if (!mixed_.touching() && model_.solver == Solver::none) {
        for (int i : model_.constrained) forces_.kick_free_body(i);  // bodies that could touch but do not
        return clock_.mark({Stage::apply_gravity, Stage::apply_loads});
    }
    if (!mixed_.touching() && model_.bilateral && live_.sleep.sleepers == 0) {
        if (!bilateral_.find(contacts)) return;
        if (!contacts || !mixed_.find_late_contacts()) return bilateral_.take_velocities(contacts);
    }
    bilateral_.forget();
    if (!mixed_.touching()) mixed_.solve(false);
    else if (contacts->woken().empty()) mixed_.solve(true);  // else the step begins anew with their islands
}

void RigidSystem::end_step() {
    ++live_.moved;
    if (plane_.at_hand() && joints_.follows()) plane_.write();
    joints_.follow(live_.bodies);
    if (model_.method.corrections == 0 || model_.composed || !energy_.is_due()) return;
    if (plane_.at_hand()) plane_.write();
    energy_.note(live_.moved == 1 ? readings_.penetration() : 0.0);
}

#ifndef NDEBUG
/// A stage that reads what the step before has left reads NaN, or the index −1. No memory is given back or taken.
void StepScratch::spoil() noexcept {
    const auto all_ones = [](auto&... arrays) {
        (std::memset(static_cast<void*>(arrays.data()), 0xff, arrays.size() * sizeof(arrays[0])), ...);
    };
    other_ends.clear(), led_by_joints = false;
    all_ones(poses, velocities, free_velocities, next, start_of_contacts, impulses, left_open, anew, rows,
             answered, end_poses, before_projection, dissipated, overstep, overstep_at, place, joint_states,
             beyond);
    for (auto* nested : {&island_members, &island_blocks})
        for (std::vector<int>& each : *nested) each.clear();
    holding.rows.clear();
}
#endif

}  // namespace spook

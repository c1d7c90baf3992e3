// The order of a step of h: what step() calls, in this order, each stage in the file of its name.
//
//   wake               wake.cpp               what moving bodies touch or hold is awake; again, with all that follows, for what is met
//   apply forces       apply_forces.cpp       dv_ext = h M⁻¹ f
//   detect             detect.cpp             contact points: where, and when in the step
//   impact             impact.cpp             contacts and stops with restitution rebound
//   solve velocities   solve_velocities.cpp   v₊ with joints, contacts and friction; impacts that it brings about come first
//   integrate          integrate.cpp          q₊ = q + h v₊
//   project positions  project_positions.cpp  overlaps go, and leave no trace in v
//   sleep              sleep.cpp              islands at rest are left out of the coming steps
//   observe            observe.cpp            between steps: samples
//
// Steps of mechanisms that stay in a plane do the same by numbers of that plane (rigid_plane.cpp). Compositions of higher order
// (rigid_composition.cpp) have stages of their own.
#include "rigid/rigid_system.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::step;

}  // namespace

void RigidSystem::step() {
    begin_step();
    if (!live_.velocity_ready) find_velocities();
    live_.velocity_ready = false;
    keep_first_joints();
    integrate();
    if (clock_) clock_->mark(Stage::integrate_positions);
    project_positions();
    if (clock_) clock_->mark(Stage::project_positions);
    end_step();
    if (clock_) clock_->mark(Stage::integrate_positions);
    sleep();
    if (clock_) clock_->mark(Stage::sleep);
}

/// From wake to solve velocities; also ahead of the step, for samples that need them.
void RigidSystem::find_velocities() {
    if (in_plane_ && plane_velocities()) return;
    begin_velocities();
    wake();
    if (clock_) clock_->mark(Stage::sleep);
    do {
        if (all_sleep()) return sleep_through();
        leave_out_sleepers_for_now();
        apply_forces();
        detect();
        solve_velocities();  // in turn with impact()
    } while (wake_met());
}

void RigidSystem::begin_step() {
    if (contacts_ || constants_.size() >= looking_from) Watch::look();
    ++live_.step;
    if (clock_) clock_->start();
    if (sleep_rules_.on()) note_places();
}

/// What the velocities of a step begin with, however often they are found: those of the step before, and loads that follow the time.
void RigidSystem::begin_velocities() {
    scratch_.begin();
    if (half_step_)
        for (int i = 0; i < bodies(); ++i)
            live_.before[i] = {live_.bodies[i].velocity, live_.bodies[i].angular_momentum};
    if (sleep_rules_.on())
        for (const int i : constrained_) start_places_[i].velocity = live_.bodies[i].velocity;
    if (!load_follows_.empty() || !drives_.empty()) follow_time();
}

/// Of a block of steps that is taken again: its joints as the first step left them.
void RigidSystem::keep_first_joints() {
    if (!replaying_ || !early_joints_.empty()) return;
    deliver();
    early_joints_ = joints_.states;
}

void RigidSystem::end_step() {
    ++live_.moved;
    if (at_hand_ && joints_.follows()) write_plane();
    joints_.follow(live_.bodies);
    if (method_.corrections > 0 && !composed_) note_energy();
}

}  // namespace spook

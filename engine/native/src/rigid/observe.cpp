// Stage: observing. Samples are taken between steps; what they read and the coming steps do not is brought to where they read it.
// Velocities that live at mid-step are found ahead, and the state that goes on is put back.
//
// reads: whether velocities or forces are asked for, and what samplers do (RigidReadings): places, velocities, joints and their last
// rows, points and impulses of contacts. writes: the recorder; multipliers of joints; the velocities of the coming step, where they
// are found ahead.
#include <utility>

#include "rigid/rigid_system.hpp"

namespace spook {

void RigidSystem::observe(Recorder& recorder, std::int64_t sample) {
    clock_.start();
    if (velocities_seen_ && (model_.composed || model_.half_step)) {
        // What is seen lives at the sample; what goes on does not.
        LargeArray<BodyState> going;
        if (model_.half_step) {
            solve_ahead();
            going = live_.bodies;
            half_step_.read();
        } else {
            going = live_.bodies;
            composition_.read();
        }
        recorder.sample(sample);
        live_.bodies = std::move(going);
    } else {
        recorder.sample(sample);
    }
    clock_.mark(Stage::observe);
}

/// What the coming steps do not read, and a reader between them does.
void RigidSystem::deliver() {
    bilateral_.deliver();
    plane_.deliver();
}

/// The velocities of the coming step, before it is begun.
void RigidSystem::solve_ahead() {
    if (live_.velocity_ready) return;
    readings_.tell_kept({});
    if (mixed_.contacts()) keep_state(before_solve_ahead_);
    find_velocities();
    if (plane_.at_hand()) deliver();
    live_.velocity_ready = true;
}

}  // namespace spook

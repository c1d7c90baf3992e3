// Stage: observing. Samples are taken between steps; what they read and the coming steps do not is brought to where they read it.
// Velocities that live at mid-step are found ahead, and the state that goes on is put back.
//
// reads: everything. writes: the recorder; multipliers of joints; the velocities of the coming step, where they are found ahead.
#include <utility>

#include "rigid/rigid_system.hpp"

namespace spook {

void RigidSystem::observe(Recorder& recorder, std::int64_t sample) {
    if (clock_) clock_->start();
    if (velocities_seen_ && (composed_ || half_step_)) {
        // What is seen lives at the sample; what goes on does not.
        LargeArray<BodyState> going;
        if (half_step_) {
            solve_ahead();
            going = live_.bodies;
            read_half_step();
        } else {
            going = live_.bodies;
            read_composition();
        }
        recorder.sample(sample);
        live_.bodies = std::move(going);
    } else {
        recorder.sample(sample);
    }
    if (clock_) clock_->mark(Stage::observe);
}

/// What the coming steps do not read, and a reader between them does.
void RigidSystem::deliver() {
    if (undelivered_) locked_.deliver(joints_.states);
    undelivered_ = false;
    if (at_hand_) write_plane();
    if (at_hand_ && plane_values_) plane_.deliver(joints_.states);
}

/// The velocities of the coming step, before it is begun.
void RigidSystem::solve_ahead() {
    if (live_.velocity_ready) return;
    if (contacts_) keep(before_solve_ahead_);
    find_velocities();
    if (at_hand_) deliver();
    live_.velocity_ready = true;
}

}  // namespace spook

// Stage: places. q₊ = q + h v₊, and every orientation by the turn h w₊ of its body (rigid_state.hpp). Bodies of an event went with
// v₋ until its time: what that makes of their way is added.
//
// reads: velocities of bodies, the contact stage's correction(). writes: places and orientations of bodies,
// speeds of rotors.
#include "rigid/rigid_system.hpp"
#include "rigid/rotors.hpp"

namespace spook {

void RigidSystem::integrate() {
    if (in_plane_ && half_step_ && !at_hand_) take_plane();  // also where its velocities were found in space
    if (at_hand_) return move_in_plane();
    if (live_.whirling < 0) live_.whirling = find_whirling(constrained_);
    if (!constrained_are_moved_)
        for (int i : constrained_)
            if (!asleep(i)) spook::integrate(constants_[i], h_, live_.bodies[i]);
    constrained_are_moved_ = false;
    for (int i : free_) spook::integrate(constants_[i], h_, live_.bodies[i]);
    for (int i : driven_) spook::integrate(constants_[i], h_, live_.bodies[i]);
    if (contacts_ && !contacts_->correction().empty()) {
        const std::vector<Vec6>& extra = contacts_->correction();
        for (std::size_t k = 0; k < constrained_.size(); ++k)
            if (!asleep(constrained_[k]))
                displace(constants_[constrained_[k]], h_, {extra[k][0], extra[k][1], extra[k][2]},
                         {extra[k][3], extra[k][4], extra[k][5]}, live_.bodies[constrained_[k]]);
    }
    for (const int k : joints_.rotors()) {
        const JointBlock& block = joints_.blocks()[k];
        JointState& state = joints_.states[block.joint];
        if (rests(k)) state.rotor = state.rotor_lead = 0.0;
        else turn_rotor(joints_, k, live_.bodies, h_);
    }
}

}  // namespace spook

// Plain and half-step steps by numbers of a plane (plane_step.hpp), where the scene and its state allow it.
//
// A step is left to the rows of the space where those of the plane are too nearly dependent, and where a loop is due a look
// for rows that lock (rigid_locking.cpp): so refusals are found, and worded, in one place.
#include "rigid/rigid_system.hpp"

namespace spook {

/// Whether nothing of the scene but its joints, steady forces and steps of the plain kind bears on the bodies.
bool RigidSystem::may_lie_in_plane(const RigidScene& scene) const {
    return solver_ == RigidSolver::block && locked_.empty() && !composed_ && !stiff_ && !fresh_contacts_ &&
           !method_.force_block && !scene.loads_change && force_.empty() && load_follows_.empty() &&
           drives_.empty() && free_.empty() && driven_.empty();
}

void RigidSystem::take_plane() {
    plane_.read(live_.bodies);
    at_hand_ = true;
    if (method_.corrections > 0) plane_.read_violations(live_.last_violation);
    if (!half_step_) return;
    for (std::size_t k = 0; k < constrained_.size(); ++k) {
        const BodyMomenta& before = live_.before[constrained_[k]];
        plane_.read_before(static_cast<int>(k), before.velocity, before.angular_momentum);
    }
}

void RigidSystem::write_plane() {
    plane_.write(live_.bodies);
    if (method_.corrections > 0) plane_.write_violations(live_.last_violation);
    if (!half_step_) return;
    for (std::size_t k = 0; k < constrained_.size(); ++k)
        live_.before[constrained_[k]] = {plane_.velocity_before(static_cast<int>(k)),
                                         plane_.spin_before(static_cast<int>(k))};
}

/// The bodies as steps in space need them.
void RigidSystem::leave_plane() {
    if (at_hand_) write_plane();
    at_hand_ = false;
    for (int i : constrained_) refresh(constants_[i], live_.bodies[i]);
}

/// False if the step is one for the space.
bool RigidSystem::plane_velocities() {
    if (!at_hand_) take_plane();
    if (!plane_.find_velocities() || (!loops_.empty() && wants_look())) {
        leave_plane();
        return false;
    }
    plane_.take_velocities();
    plane_values_ = true;
    ++plane_solves_;
    if (clock_) clock_->mark(Stage::solve_block);
    return true;
}

void RigidSystem::move_in_plane() {
    const int body = plane_.move();
    if (body >= 0 && live_.whirling < 0) {
        deliver();
        live_.whirling = find_whirling({&body, 1});
    }
}

}  // namespace spook

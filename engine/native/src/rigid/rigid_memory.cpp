// Going back and going on: what a run keeps, and what is set from outside between its steps.
#include <algorithm>
#include <stdexcept>

#include "rigid/rigid_system.hpp"

namespace spook {

void RigidSystem::keep(Snapshot& kept) const {
    if (contacts_ && live_.velocity_ready) {
        kept = before_solve_ahead_;
        return;
    }
    kept.state = live_;
    kept.joints = joints_;
    kept.warm.mixed = mixed_;
    for (RowBlock& rows : kept.warm.mixed.rows)
        rows.further = {};  // of this system; every step shows them anew
    kept.warm.redundancy = redundant_.memory();
    if (contacts_) contacts_->keep(kept.contacts);
    if (!stiff_) return;
    kept.warm.jacobians.clear();
    const auto blocks = joints_.blocks();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const double* rows = jacobian(static_cast<int>(k), true);
        kept.warm.jacobians.insert(kept.warm.jacobians.end(), rows, rows + 6 * blocks[k].size);
    }
}

void RigidSystem::go_back(const Snapshot& kept) {
    at_hand_ = false;
    share_.clear();  // of a step that was left unfinished
    live_ = kept.state;
    static_cast<JointStates&>(joints_) = kept.joints;
    mixed_ = kept.warm.mixed;
    redundant_.restore(matrix_, kept.warm.redundancy);
    if (contacts_) contacts_->go_back(kept.contacts);
    if (!stiff_) return;
    const auto blocks = joints_.blocks();
    const double* rows = kept.warm.jacobians.data();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const int numbers = 6 * blocks[k].size;
        std::copy_n(rows, numbers, jacobian(static_cast<int>(k), true));
        rows += numbers;
    }
}

void RigidSystem::place(std::span<const double> state) {
    for (int i = 0; i < bodies(); ++i) {
        const double* s = state.data() + 13 * static_cast<std::size_t>(i);
        const BodyConstants& body = constants_[i];
        BodyState& at = start_[i];
        at.displacement = Vec3{s[0], s[1], s[2]} - body.start;
        at.velocity = {s[7], s[8], s[9]};
        at.angular_velocity = {s[10], s[11], s[12]};
        if (body.particle) continue;
        at.turn = unit(Quat{s[3], s[4], s[5], s[6]} * conjugate(body.start_turn));
        const Vec3 w = at.angular_velocity;
        refresh(body, at);  // for the inertia
        if (body.moves()) at.angular_momentum = at.inertia * w;
        at.angular_velocity = w;
    }
}

void RigidSystem::set_load(int body, Vec3 force, Vec3 torque) {
    if (!stages_.runs(Stage::apply_loads)) throw std::invalid_argument("loads need the stage apply_loads");
    BodyConstants& constants = constants_[body];
    if (!constants.moves()) return;
    if (in_plane_) leave_plane();
    in_plane_ = false;
    const Load before = steady_.empty() ? Load{constants.force, constants.torque} : steady_[body];
    if (is_zero(force - before.force) && is_zero(torque - before.torque)) return;
    mark_moving(body);
    catch_up();
    const Vec3 gravity = stages_.runs(Stage::apply_gravity) ? gravity_ : Vec3{};
    constants.force = force;
    constants.torque = torque;
    if (!steady_.empty()) steady_[body] = {force, torque};
    acceleration_[body] = gravity + (1.0 / constants.mass) * force;
}

void RigidSystem::set_velocity(int body, Vec3 velocity, Vec3 angular_velocity) {
    if (constants_[body].motion != Motion::kinematic)
        throw std::invalid_argument("only a kinematic body moves as it is told");
    live_.bodies[body].velocity = velocity;
    live_.bodies[body].angular_velocity = angular_velocity;
}

}  // namespace spook

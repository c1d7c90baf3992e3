// Going back and going on: what a run keeps, and what is set from outside between its steps.
#include <algorithm>
#include <stdexcept>

#include "rigid/rigid_system.hpp"

namespace spook {

void RigidSystem::save() {
    keep_state(saved_);
    work_kept_ = work_done();
}

void RigidSystem::restore() {
    go_back(saved_);
    work_taken_back_ = work_taken_back_ + (work_done() - work_kept_);
    replaying_ = true;
    early_joints_.clear();
}

void RigidSystem::keep(Snapshot& kept) const {
    keep_state(kept);
    kept.wrenches
        .clear();  // found by a solve of their own where steps have velocities elsewhere than samples
    if (!model_.half_step && !model_.composed && !model_.method.runge_kutta)
        kept.wrenches = readings_.wrenches();
}

void RigidSystem::keep_state(Snapshot& kept) const {
    if (mixed_.contacts() && live_.velocity_ready) {
        kept = before_solve_ahead_;
        return;
    }
    kept.state = live_;
    kept.joints = joints_;
    kept.warm.mixed = mixed_.system;
    for (RowBlock& rows : kept.warm.mixed.rows)
        rows.further = {};  // of this system; every step shows them anew
    kept.warm.redundancy = rows_.memory();
    if (mixed_.contacts()) mixed_.contacts()->keep(kept.contacts);
    if (!model_.stiff) return;
    kept.warm.jacobians.clear();
    const auto blocks = joints_.blocks();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const double* rows = mixed_.jacobian(rows_, static_cast<int>(k), true);
        kept.warm.jacobians.insert(kept.warm.jacobians.end(), rows, rows + 6 * blocks[k].size);
    }
}

void RigidSystem::go_back(const Snapshot& kept) {
    plane_.forget();
    forces_.end_shares();  // of a step that was left unfinished
    live_ = kept.state;
    static_cast<JointStates&>(joints_) = kept.joints;
    mixed_.system = kept.warm.mixed;
    rows_.restore(kept.warm.redundancy);
    if (mixed_.contacts()) mixed_.contacts()->go_back(kept.contacts);
    readings_.tell_kept(kept.wrenches);
    if (!model_.stiff) return;
    const auto blocks = joints_.blocks();
    const double* rows = kept.warm.jacobians.data();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const int numbers = 6 * blocks[k].size;
        std::copy_n(rows, numbers, mixed_.jacobian(rows_, static_cast<int>(k), true));
        rows += numbers;
    }
}

void RigidSystem::place(std::span<const double> state) {
    for (int i = 0; i < model_.bodies(); ++i) {
        const double* s = state.data() + 13 * static_cast<std::size_t>(i);
        const BodyConstants& body = model_.constants[i];
        BodyState& at = model_.start[i];
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
    if (!model_.stages.runs(Stage::apply_loads))
        throw std::invalid_argument("loads need the stage apply_loads");
    if (!model_.constants[body].moves()) return;
    plane_.give_up();
    if (!forces_.is_new_load(body, force, torque)) return;
    sleeping_.wake_body(body);
    composition_.catch_up();
    forces_.set_load(body, force, torque);
}

void RigidSystem::set_motor(int joint, double speed, double max_force) {
    if (joints_.drives().set_motor(joint, speed, max_force)) sleeping_.wake_joint(joint);
}

void RigidSystem::set_rest(int joint, double rest) {
    composition_.catch_up();
    if (joints_.drives().set_rest(joint, rest)) sleeping_.wake_joint(joint);
}

void RigidSystem::set_velocity(int body, Vec3 velocity, Vec3 angular_velocity) {
    if (model_.constants[body].motion != Motion::kinematic)
        throw std::invalid_argument("only a kinematic body moves as it is told");
    live_.bodies[body].velocity = velocity;
    live_.bodies[body].angular_velocity = angular_velocity;
}

}  // namespace spook

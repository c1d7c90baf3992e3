// Loads that change from step to step: functions of time, springs that hold bodies beside their centres, and the
// fluids bodies float in.
//
// A load is taken at the beginning of a step, where forces that depend on places are, and so is the force of a motor;
// the speed of a motor and the rest of a spring where the step's velocities live: at its end, at mid-step with
// half_step_velocities; a kinematic body's pace at mid-step, so that its place is second order; a path or an angle gives
// the velocity that leads to where the step ends.
#include "collision/submerged.hpp"
#include "rigid/rigid_system.hpp"

namespace spook {

void RigidSystem::take_loads(const RigidScene& scene) {
    if (stages_.runs(Stage::follow_time)) drives_ = scene.drives;
    if (stages_.runs(Stage::apply_fluids)) {
        fluids_ = scene.fluids;
        floaters_.resize(constants_.size());
        for (const Collider& floater : scene.floaters) floaters_[floater.body].push_back(floater);
    }
    std::vector<char> follows(constants_.size(), 0);
    for (const TimeDrive& drive : drives_) {
        if (drive.kind == DriveKind::load) follows[drive.index] = 1;
        if (drive.kind == DriveKind::rest) joints_.let_rest_move(drive.index);
    }
    for (std::size_t i = 0; i < floaters_.size(); ++i)
        if (!floaters_[i].empty()) follows[i] = 1;
    for (const SpringForce& spring : turning_springs_)
        for (const End& end : spring.ends)
            if (end.body >= 0) follows[end.body] = 1;
    for (int i = 0; i < bodies(); ++i)
        if (follows[i] && constants_[i].moves()) load_follows_.push_back(i);
    if (load_follows_.empty()) return;
    for (const BodyConstants& body : constants_) steady_.push_back({body.force, body.torque});
}

void RigidSystem::follow_time() {
    const double now = static_cast<double>(live_.moved) * h_;
    const double middle = now + 0.5 * h_, live = half_step_ ? middle : now + h_;
    for (const TimeDrive& drive : drives_) {
        const TimeFunction& f = drive.function;
        switch (drive.kind) {
            case DriveKind::load: break;
            case DriveKind::motor: joints_.set_speed(drive.index, f.at(live)); break;
            case DriveKind::push: joints_.set_push(drive.index, f.at(now)); break;
            case DriveKind::rest: {
                const double rest = f.at(now);
                joints_.set_moving_rest(drive.index, rest, (rest - f.at(now - h_)) / h_,
                                        (f.at(now + h_) - rest) / h_);
                break;
            }
            case DriveKind::pace: {
                const double pace = f.at(middle);
                live_.bodies[drive.index].velocity = pace * drive.linear;
                live_.bodies[drive.index].angular_velocity = pace * drive.angular;
                break;
            }
            case DriveKind::spin:
                live_.bodies[drive.index].angular_velocity = f.at(middle) * drive.angular;
                break;
            case DriveKind::path: {
                const Vec3 ahead = f.at(now + h_) * drive.linear;
                const Vec3 here{drive.linear.x * position_of(drive.index).x,
                                drive.linear.y * position_of(drive.index).y,
                                drive.linear.z * position_of(drive.index).z};
                const Vec3 other{1.0 - drive.linear.x, 1.0 - drive.linear.y, 1.0 - drive.linear.z};
                Vec3& v = live_.bodies[drive.index].velocity;
                v = Vec3{other.x * v.x, other.y * v.y, other.z * v.z} + (1.0 / h_) * (ahead - here);
                break;
            }
            case DriveKind::angle:
                live_.bodies[drive.index].angular_velocity =
                    ((f.at(now + h_) - f.at(now)) / h_) * drive.angular;
                break;
        }
    }
    if (clock_ && !drives_.empty()) clock_->mark(Stage::follow_time);
    if (!load_follows_.empty()) find_loads(now);
}

void RigidSystem::find_loads(double time) {
    for (int i : load_follows_) {
        acceleration_[i] = steady_[i].force;
        constants_[i].torque = steady_[i].torque;
    }
    for (const TimeDrive& drive : drives_) {
        if (drive.kind != DriveKind::load || !constants_[drive.index].moves()) continue;
        const double part = drive.function.at(time);
        acceleration_[drive.index] += part * drive.linear;
        constants_[drive.index].torque += part * drive.angular;
    }
    if (clock_ && !drives_.empty()) clock_->mark(Stage::follow_time);
    for (const SpringForce& spring : turning_springs_) pull_aside(spring);
    if (clock_ && !turning_springs_.empty()) clock_->mark(Stage::apply_springs);
    const Vec3 gravity = stages_.runs(Stage::apply_gravity) ? gravity_ : Vec3{};
    for (int i : load_follows_) {
        for (const Fluid& fluid : fluids_) add_fluid(fluid, i, acceleration_[i], constants_[i].torque);
        acceleration_[i] = gravity + (1.0 / constants_[i].mass) * acceleration_[i];
    }
    if (clock_ && !fluids_.empty()) clock_->mark(Stage::apply_fluids);
}

/// Where an end of a spring is, and how fast.
RigidSystem::SpringEnd RigidSystem::spring_end(const End& end) const noexcept {
    if (end.body < 0) return {end.point, {}, {}};
    const BodyState& s = live_.bodies[end.body];
    const Vec3 centre = position_of(end.body);
    if (is_zero(end.point)) return {centre, s.velocity, {}};
    const Vec3 arm = axes(constants_[end.body], s) * end.point;
    return {centre + arm, s.velocity + cross(s.angular_velocity, arm), arm};
}

void RigidSystem::pull_aside(const SpringForce& spring) noexcept {
    const SpringEnd first = spring_end(spring.ends[0]), second = spring_end(spring.ends[1]);
    const Vec3 pull = spook::pull(spring, second.place - first.place, second.velocity - first.velocity);
    const auto act = [&](int body, Vec3 force, Vec3 arm) {
        if (body < 0 || !constants_[body].moves()) return;
        acceleration_[body] += force;
        constants_[body].torque += cross(arm, force);
    };
    act(spring.ends[0].body, pull, first.arm);
    act(spring.ends[1].body, -pull, second.arm);
}

/// Archimedes' force, −ρ V g at the centre of the submerged volume V, and the drag −½ ρ C A |u| u there, u the speed
/// of that point through the fluid and A the shadow of the whole part along u, times the submerged share of it.
void RigidSystem::add_fluid(const Fluid& fluid, int body, Vec3& force, Vec3& torque) const noexcept {
    const BodyState& s = live_.bodies[body];
    const Pose pose{position_of(body), axes(constants_[body], s)};
    for (const Collider& floater : floaters_[body]) {
        const Pose at = placed(pose, floater.part);
        const Submerged below = submerged(floater.shape, at, fluid.up, fluid.level);
        if (below.volume == 0.0) continue;
        const Vec3 arm = below.centre - pose.position;
        Vec3 push = -(fluid.density * below.volume) * gravity_;
        const Vec3 through = s.velocity + cross(s.angular_velocity, arm) - fluid.velocity;
        const double speed = norm(through);
        if (fluid.drag > 0.0 && speed > 0.0) {
            const double share = below.volume / volume(floater.shape);
            const double area = share * shadow(floater.shape, at, (1.0 / speed) * through);
            push -= (0.5 * fluid.density * fluid.drag * area * speed) * through;
        }
        force += push;
        torque += cross(arm, push);
    }
}

}  // namespace spook

// Loads that change from step to step: functions of time, springs that hold bodies beside their centres, and the
// fluids bodies float in.
//
// A load is taken at the beginning of a step, where forces that depend on places are, and so is the force of a motor;
// the speed of a motor and the rest of a spring where the step's velocities live: at its end, at mid-step with
// half_step_velocities; a kinematic body's pace at mid-step, so that its place is second order; a path or an angle gives
// the velocity that leads to where the step ends.
//
// reads: the time, places and velocities of bodies. writes: loads, forces on bodies, drives of joints, velocities of kinematic bodies.
#include <algorithm>
#include <limits>

#include "collision/submerged.hpp"
#include "rigid/forces.hpp"

namespace spook {

void Forces::take(const RigidScene& scene) {
    for (const BodyConstants& body : model_.constants)
        acceleration_.push_back(body.moves() ? gravity() + (1.0 / body.mass) * body.force : Vec3{});
    if (!springs_.empty() || !fields_.empty()) force_.resize(model_.constants.size());
    if (model_.stages.runs(Stage::follow_time)) drives_ = scene.drives;
    if (model_.stages.runs(Stage::apply_fluids)) {
        fluids_ = scene.fluids;
        floaters_.resize(model_.constants.size());
        for (const Collider& floater : scene.floaters) floaters_[floater.body].push_back(floater);
    }
    std::vector<char> follows(model_.constants.size(), 0);
    for (const TimeDrive& drive : drives_) {
        if (drive.kind == DriveKind::load) follows[drive.index] = 1;
        if (drive.kind == DriveKind::rest) joints_.drives().let_rest_move(drive.index);
    }
    for (std::size_t i = 0; i < floaters_.size(); ++i)
        if (!floaters_[i].empty()) follows[i] = 1;
    for (const SpringForce& spring : turning_springs_)
        for (const End& end : spring.ends)
            if (end.body >= 0) follows[end.body] = 1;
    for (int i = 0; i < model_.bodies(); ++i)
        if (follows[i] && model_.constants[i].moves()) load_follows_.push_back(i);
    if (load_follows_.empty()) return;
    for (const BodyConstants& body : model_.constants) steady_.push_back({body.force, body.torque});
}

void Forces::follow_time() {
    const double now = static_cast<double>(live_.moved) * model_.h;
    const double middle = now + 0.5 * model_.h, live = model_.half_step ? middle : now + model_.h;
    for (const TimeDrive& drive : drives_) {
        const TimeFunction& f = drive.function;
        switch (drive.kind) {
            case DriveKind::load: break;
            case DriveKind::motor: joints_.drives().set_speed(drive.index, f.at(live)); break;
            case DriveKind::push: joints_.drives().set_push(drive.index, f.at(now)); break;
            case DriveKind::rest: {
                const double rest = f.at(now);
                joints_.drives().set_moving_rest(drive.index, rest, (rest - f.at(now - model_.h)) / model_.h,
                                                 (f.at(now + model_.h) - rest) / model_.h);
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
                const Vec3 ahead = f.at(now + model_.h) * drive.linear;
                const Vec3 here{drive.linear.x * model_.position(drive.index, live_.bodies).x,
                                drive.linear.y * model_.position(drive.index, live_.bodies).y,
                                drive.linear.z * model_.position(drive.index, live_.bodies).z};
                const Vec3 other{1.0 - drive.linear.x, 1.0 - drive.linear.y, 1.0 - drive.linear.z};
                Vec3& v = live_.bodies[drive.index].velocity;
                v = Vec3{other.x * v.x, other.y * v.y, other.z * v.z} + (1.0 / model_.h) * (ahead - here);
                break;
            }
            case DriveKind::angle:
                live_.bodies[drive.index].angular_velocity =
                    ((f.at(now + model_.h) - f.at(now)) / model_.h) * drive.angular;
                break;
        }
    }
    if (!drives_.empty()) clock_.mark(Stage::follow_time);
    if (!load_follows_.empty()) find_loads(now);
}

void Forces::find_at(double time) {
    for (const TimeDrive& drive : drives_)
        if (drive.kind == DriveKind::rest)
            joints_.drives().set_moving_rest(drive.index, drive.function.at(time), 0.0, 0.0);
    if (!load_follows_.empty()) find_loads(time);
    find();
}

double Forces::next_knot(double time) const noexcept {
    double next = std::numeric_limits<double>::infinity();
    for (const TimeDrive& drive : drives_) next = std::min(next, drive.function.next_knot(time));
    return next;
}

void Forces::find_loads(double time) {
    for (int i : load_follows_) {
        acceleration_[i] = steady_[i].force;
        model_.constants[i].torque = steady_[i].torque;
    }
    for (const TimeDrive& drive : drives_) {
        if (drive.kind != DriveKind::load || !model_.constants[drive.index].moves()) continue;
        const double part = drive.function.at(time);
        acceleration_[drive.index] += part * drive.linear;
        model_.constants[drive.index].torque += part * drive.angular;
    }
    if (!drives_.empty()) clock_.mark(Stage::follow_time);
    for (const SpringForce& spring : turning_springs_) pull_aside(spring);
    if (!turning_springs_.empty()) clock_.mark(Stage::apply_springs);
    for (int i : load_follows_) {
        for (const Fluid& fluid : fluids_) add_fluid(fluid, i, acceleration_[i], model_.constants[i].torque);
        acceleration_[i] = gravity() + (1.0 / model_.constants[i].mass) * acceleration_[i];
    }
    if (!fluids_.empty()) clock_.mark(Stage::apply_fluids);
}

/// Where an end of a spring is, and how fast.
Forces::SpringEnd Forces::spring_end(const End& end) const noexcept {
    if (end.body < 0) return {end.point, {}, {}};
    const BodyState& s = live_.bodies[end.body];
    const Vec3 centre = model_.position(end.body, live_.bodies);
    if (is_zero(end.point)) return {centre, s.velocity, {}};
    const Vec3 arm = axes(model_.constants[end.body], s) * end.point;
    return {centre + arm, s.velocity + cross(s.angular_velocity, arm), arm};
}

void Forces::pull_aside(const SpringForce& spring) noexcept {
    const SpringEnd first = spring_end(spring.ends[0]), second = spring_end(spring.ends[1]);
    const Vec3 pull = spook::pull(spring, second.place - first.place, second.velocity - first.velocity);
    const auto act = [&](int body, Vec3 force, Vec3 arm) {
        if (body < 0 || !model_.constants[body].moves()) return;
        acceleration_[body] += force;
        model_.constants[body].torque += cross(arm, force);
    };
    act(spring.ends[0].body, pull, first.arm);
    act(spring.ends[1].body, -pull, second.arm);
}

/// Archimedes' force, −ρ V g at the centre of the submerged volume V, and the drag −½ ρ C A |u| u there, u the speed
/// of that point through the fluid and A the shadow of the whole part along u, times the submerged share of it.
void Forces::add_fluid(const Fluid& fluid, int body, Vec3& force, Vec3& torque) const noexcept {
    const BodyState& s = live_.bodies[body];
    const Pose pose{model_.position(body, live_.bodies), axes(model_.constants[body], s)};
    for (const Collider& floater : floaters_[body]) {
        const Pose at = placed(pose, floater.part);
        const Submerged below = submerged(floater.shape, at, fluid.up, fluid.level);
        if (below.volume == 0.0) continue;
        const Vec3 arm = below.centre - pose.position;
        Vec3 push = -(fluid.density * below.volume) * model_.gravity;
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

// Stage: external forces. A body that never has rows gets its whole dv_ext = h M⁻¹ f at once, p ← p + h f; the others get theirs
// with the solve for their rows. Loads that follow the time were set before, see rigid_loads.cpp.
//
// reads: places and velocities of bodies, springs, fields, loads. writes: forces on bodies, velocities of free bodies; joints begin
// a step.
#include <algorithm>
#include <cmath>

#include "rigid/forces.hpp"

namespace spook {

void Forces::take_stages(const RigidScene& scene) {
    model_.stages.take(Stage::apply_gravity);
    model_.stages.take(Stage::apply_loads);
    model_.stages.take(Stage::follow_time);
    model_.stages.take(Stage::apply_fluids);
    if (model_.stages.take(Stage::apply_central_gravity)) fields_ = scene.fields;
    if (model_.stages.take(Stage::apply_springs))
        for (const SpringForce& spring : scene.springs)
            (spring.turns() ? turning_springs_ : springs_).push_back(spring);
}

void Forces::apply_forces() {
    find();
    joints_.stops().begin_step(joints_.states);
    for (int i : model_.free) kick_free_body(i);
    clock_.mark({Stage::apply_gravity, Stage::apply_loads});
}

/// Of central fields and of springs between centres.
void Forces::find_all() {
    std::fill(force_.begin(), force_.end(), Vec3{});
    for (const CentralField& field : fields_)
        for (int i = 0; i < model_.bodies(); ++i) {
            if (!model_.constants[i].moves()) continue;
            const Vec3 d = model_.position(i, live_.bodies) - field.centre;
            const double r2 = dot(d, d);
            force_[i] -= (model_.constants[i].mass * field.strength / (r2 * std::sqrt(r2))) * d;
        }
    if (!fields_.empty()) clock_.mark(Stage::apply_central_gravity);
    for (const SpringForce& spring : springs_) {
        const auto velocity = [&](const End& end) {
            return end.body < 0 ? Vec3{} : live_.bodies[end.body].velocity;
        };
        const auto& [first, second] = spring.ends;
        const Vec3 pull =
            spook::pull(spring, place(second) - place(first), velocity(second) - velocity(first));
        if (first.body >= 0 && model_.constants[first.body].moves()) force_[first.body] += pull;
        if (second.body >= 0 && model_.constants[second.body].moves()) force_[second.body] -= pull;
    }
    if (!springs_.empty()) clock_.mark(Stage::apply_springs);
}

void Forces::kick_free_body(int i) noexcept {
    BodyState& s = live_.bodies[i];
    s.velocity += kick(i);
    s.angular_momentum += angular_impulse(i);
}

double Forces::potential_energy() const noexcept {
    double sum = 0.0;
    for (int i = 0; i < model_.bodies(); ++i) {
        if (!model_.constants[i].moves()) continue;
        const Vec3 x = model_.position(i, live_.bodies);
        sum -= model_.constants[i].mass * dot(model_.gravity, x);
        for (const CentralField& field : fields_)
            sum -= model_.constants[i].mass * field.strength / norm(x - field.centre);
    }
    for (const SpringForce& spring : springs_)
        sum += energy(spring, place(spring.ends[1]) - place(spring.ends[0]));
    for (const SpringForce& spring : turning_springs_)
        sum += energy(spring, spring_end(spring.ends[1]).place - spring_end(spring.ends[0]).place);
    sum += joints_.spring_energy(live_.bodies);
    const double now = static_cast<double>(live_.moved) * model_.h;
    for (const TimeDrive& drive : drives_)
        if (drive.kind == DriveKind::rest)
            sum += joints_.spring_energy(drive.index, drive.function.at(now), live_.bodies);
    return sum;
}

bool Forces::is_new_load(int body, Vec3 force, Vec3 torque) const noexcept {
    const BodyConstants& constants = model_.constants[body];
    const Load before = steady_.empty() ? Load{constants.force, constants.torque} : steady_[body];
    return !(is_zero(force - before.force) && is_zero(torque - before.torque));
}

void Forces::set_load(int body, Vec3 force, Vec3 torque) noexcept {
    BodyConstants& constants = model_.constants[body];
    constants.force = force;
    constants.torque = torque;
    if (!steady_.empty()) steady_[body] = {force, torque};
    acceleration_[body] = gravity() + (1.0 / constants.mass) * force;
}

std::int64_t Forces::evaluations() const noexcept {
    std::int64_t moving = 0;
    for (const BodyConstants& body : model_.constants) moving += body.moves() ? 1 : 0;
    return static_cast<std::int64_t>(springs_.size() + turning_springs_.size()) +
           static_cast<std::int64_t>(fields_.size()) * moving;
}

}  // namespace spook

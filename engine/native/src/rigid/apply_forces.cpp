// Stage: external forces. A body that never has rows gets its whole dv_ext = h M⁻¹ f at once, p ← p + h f; the others get theirs
// with the solve for their rows. Loads that follow the time were set before, see rigid_loads.cpp.
//
// reads: places and velocities of bodies, springs, fields, loads. writes: force_, velocities of free bodies; joints begin a step.
#include <algorithm>
#include <cmath>

#include "rigid/rigid_system.hpp"

namespace spook {

void RigidSystem::apply_forces() {
    if (!force_.empty()) find_forces();
    joints_.begin_step();
    for (int i : free_) kick_free_body(i);
    if (clock_) clock_->mark({Stage::apply_gravity, Stage::apply_loads});
}

/// Of central fields and of springs between centres.
void RigidSystem::find_forces() {
    std::fill(force_.begin(), force_.end(), Vec3{});
    for (const CentralField& field : fields_)
        for (int i = 0; i < bodies(); ++i) {
            if (!constants_[i].moves()) continue;
            const Vec3 d = position_of(i) - field.centre;
            const double r2 = dot(d, d);
            force_[i] -= (constants_[i].mass * field.strength / (r2 * std::sqrt(r2))) * d;
        }
    if (clock_ && !fields_.empty()) clock_->mark(Stage::apply_central_gravity);
    for (const SpringForce& spring : springs_) {
        const auto velocity = [&](const End& end) {
            return end.body < 0 ? Vec3{} : live_.bodies[end.body].velocity;
        };
        const auto& [first, second] = spring.ends;
        const Vec3 pull =
            spook::pull(spring, place(second) - place(first), velocity(second) - velocity(first));
        if (first.body >= 0 && constants_[first.body].moves()) force_[first.body] += pull;
        if (second.body >= 0 && constants_[second.body].moves()) force_[second.body] -= pull;
    }
    if (clock_ && !springs_.empty()) clock_->mark(Stage::apply_springs);
}

void RigidSystem::kick_free_body(int i) noexcept {
    BodyState& s = live_.bodies[i];
    s.velocity += kick(i);
    s.angular_momentum += twist(i);
}

}  // namespace spook

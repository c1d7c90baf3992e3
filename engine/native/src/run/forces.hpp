// Plain forces, the same for particles and rigid bodies: springs and centres of gravity.
#pragma once

#include "linear/vec.hpp"

namespace spook {

/// One end of a spring or distance: a body by index, or (body < 0) a point of the world. A spring on a rigid body
/// holds it at `point` of the body's axes, from its centre.
struct End {
    int body = -1;
    Vec3 point;  // m
};

struct SpringForce {
    End ends[2];
    double stiffness = 0.0, rest_length = 0.0, viscosity = 0.0;  // N/m, m, N s/m
    /// Whether it holds some body beside its centre, and so turns it.
    bool turns() const noexcept {
        return (ends[0].body >= 0 && !is_zero(ends[0].point)) ||
               (ends[1].body >= 0 && !is_zero(ends[1].point));
    }
};

struct CentralField {
    double strength = 0.0;  // m³/s²
    Vec3 centre;            // m
};

/// Force [N] on the first end, towards the second: apart = x₂ − x₁, separation_rate = v₂ − v₁. Without a direction (ends at
/// one place) only a spring of rest length 0 pulls.
inline Vec3 pull(const SpringForce& spring, Vec3 apart, Vec3 separation_rate) noexcept {
    Vec3 pull = spring.stiffness * apart;
    if (spring.rest_length > 0.0 || spring.viscosity > 0.0) {
        const double length = norm(apart);
        const Vec3 u = length > 0.0 ? (1.0 / length) * apart : Vec3{};
        const double rate = spring.viscosity * dot(u, separation_rate);
        pull += (rate - spring.stiffness * spring.rest_length) * u;
    }
    return pull;
}

/// Energy [J] of a spring whose ends are `apart`.
inline double energy(const SpringForce& spring, Vec3 apart) noexcept {
    const double stretch = norm(apart) - spring.rest_length;
    return 0.5 * spring.stiffness * stretch * stretch;
}

}  // namespace spook

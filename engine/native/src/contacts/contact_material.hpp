// How two surfaces behave together.
#pragma once

#include <algorithm>
#include <cmath>

#include "linear/vec.hpp"

namespace spook {

struct SurfaceMaterial {
    double friction = 0.0;         // mu, 1
    double restitution = 0.0;      // psi, 0 … 1
    double compliance = 0.0;       // eps, m/N per contact point
    double damping = 0.0;          // tau, s
    double slip_compliance = 0.0;  // gamma, m/(N s)
    double rolling = 0.0;          // rho, m: the torque that rolling meets, over the normal force
    double torsional = 0.0;        // sigma, m: the same of turning about the normal
    Vec3 surface_velocity;  // of the surface along itself, body axes, m/s; a body's own, never combined
    double friction_across = 0.0;  // mu across `direction`, where there is one; along it is `friction`
    Vec3 direction;  // unit, body axes; zero: the same friction in all directions; never combined
    double tangential_restitution = 0.0;  // psi_t, 0 … 1

    bool is_oriented() const noexcept { return dot(direction, direction) > 0.0; }
    bool resists_turning() const noexcept { return rolling > 0.0 || torsional > 0.0; }
    bool operator==(const SurfaceMaterial&) const noexcept = default;
};

/// What two surfaces make of it: of a contact there are many, so no more than they share is in it.
struct PairMaterial {
    double friction = 0.0, restitution = 0.0, compliance = 0.0, damping = 0.0, slip_compliance = 0.0,
           rolling = 0.0, torsional = 0.0;

    bool resists_turning() const noexcept { return rolling > 0.0 || torsional > 0.0; }
};

/// Friction by the geometric mean, restitution, damping, rolling and torsional friction by the larger, compliances by
/// the sum.
inline PairMaterial combined(const SurfaceMaterial& a, const SurfaceMaterial& b) noexcept {
    return {std::sqrt(a.friction * b.friction),    std::max(a.restitution, b.restitution),
            a.compliance + b.compliance,           std::max(a.damping, b.damping),
            a.slip_compliance + b.slip_compliance, std::max(a.rolling, b.rolling),
            std::max(a.torsional, b.torsional)};
}

/// How two bodies' surfaces rub on each other, whatever each says of itself.
struct PairFriction {
    int first = 0, second = 0;
    double friction = 0.0, rolling = 0.0, torsional = 0.0;

    bool resists_turning() const noexcept { return rolling > 0.0 || torsional > 0.0; }
};

}  // namespace spook

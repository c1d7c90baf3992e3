// How two surfaces behave together.
#pragma once

#include <algorithm>
#include <cmath>

namespace spook {

struct SurfaceMaterial {
    double friction = 0.0;         // mu, 1
    double restitution = 0.0;      // psi, 0 … 1
    double compliance = 0.0;       // eps, m/N per contact point
    double damping = 0.0;          // tau, s
    double slip_compliance = 0.0;  // gamma, m/(N s)
};

/// Friction by the geometric mean, restitution and damping by the larger, compliances by the sum.
inline SurfaceMaterial combined(const SurfaceMaterial& a, const SurfaceMaterial& b) noexcept {
    return {std::sqrt(a.friction * b.friction), std::max(a.restitution, b.restitution),
            a.compliance + b.compliance, std::max(a.damping, b.damping),
            a.slip_compliance + b.slip_compliance};
}

}  // namespace spook

// Which rows of a mixed system are Coulomb friction, and how they are bounded.
#pragma once

#include <cmath>
#include <vector>

#include "contacts/pivot_system.hpp"
#include "run/named_enum.hpp"

namespace spook {

/// cone: |beta| <= mu nu, isotropic. box: each |beta_i| <= mu nu of the step before, tangents along world axes.
/// scaled_box: the box with the normal force of this step.
SPOOK_NAMED_ENUM(FrictionModel, cone, box, scaled_box)

/// A block of three rows of one contact: 0 the normal, 1 and 2 the tangents.
struct FrictionPoint {
    int block = 0;               // in MixedSystem::rows
    double coefficient = 0.0;    // mu
    double slip_softness = 0.0;  // gamma / h, of both tangent rows
    double normal = -1.0;        // nu of the step before; then of this step, N s; negative: unknown
};

struct FrictionReport {
    int rounds = 0;  // solves of the whole system
    int pivots = 0;  // rows that changed state
    int sweeps = 0;
    double residual = 0.0;  // of the friction law, relative (direct) or m/s (iterative)
    bool converged = true;
    bool finite = true;
};

/// The row that is furthest from its law, and by how much: each multiplier against where a step of projection would
/// put it, as a velocity [m/s]. For the box `FrictionPoint::normal` is the bound's.
struct RowsResidual {
    double residual = 0.0;
    int row = 0;  // index into MixedSystem::rows
};
RowsResidual rows_residual(const MixedSystem& system, const std::vector<FrictionPoint>& points,
                           FrictionModel model);

/// Slip velocity along tangent i (1 or 2), with what slip compliance gives way: D v + (gamma/h) beta.
inline double slip(const RowBlock& block, const FrictionPoint& point, int i,
                   const std::vector<Vec6>& velocity) noexcept {
    return row_velocity(block, i, velocity) - block.right[i] + point.slip_softness * block.multiplier[i];
}

/// Turns both tangents of the block so that the first points along c t₁ + s t₂ (c² + s² = 1).
inline void turn_tangents(RowBlock& block, double c, double s) noexcept {
    auto turn = [c, s](double& x, double& y) noexcept {
        const double first = c * x + s * y;
        y = c * y - s * x;
        x = first;
    };
    for (int a = 0; a < 6; ++a) {
        turn(block.first_jacobian[1][a], block.first_jacobian[2][a]);
        turn(block.second_jacobian[1][a], block.second_jacobian[2][a]);
    }
    turn(block.right[1], block.right[2]);
    turn(block.multiplier[1], block.multiplier[2]);
}

}  // namespace spook

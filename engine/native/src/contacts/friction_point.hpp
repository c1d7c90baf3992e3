// Which rows of a mixed system are Coulomb friction, and how they are bounded.
#pragma once

#include <vector>

#include "contacts/mass_factors.hpp"
#include "contacts/pivot_system.hpp"
#include "run/named_enum.hpp"

namespace spook {

/// cone: |beta| <= mu nu, an ellipse where friction differs with the direction (ContactPoints). box: each |beta_i| <= mu nu of
/// the step before, tangents along world axes; scaled_box: of this step.
SPOOK_NAMED_ENUM(FrictionModel, cone, box, scaled_box)

/// Rows of one contact's block that its normal, row 0, bounds: 1 and 2 the tangents; where turning meets friction, too,
/// 3 and 4 rolling about the tangents, and 5 alone the turning about the normal. Points of one block follow each other.
struct FrictionPoint {
    int block = 0;               // in MixedSystem::rows
    double coefficient = 0.0;    // mu
    double slip_softness = 0.0;  // gamma / h, of both tangent rows
    double normal = -1.0;   // nu of the step before, N s; negative: unknown; then, but for the box, of this
    int row = 1, size = 2;  // which rows: two obey a disc (or box), one an interval
    bool anisotropic = false;  // the two rows differ in scale: solved exactly, not by projection
};

/// Whether the point is rolling or torsional friction.
inline bool turns(const FrictionPoint& point) noexcept { return point.row != 1; }

struct FrictionReport {
    int rounds = 0;  // solves of the whole system
    int pivots = 0;  // rows that changed state
    int pgs_iterations = 0;
    double residual = 0.0;  // of the friction law, relative (direct), or a change, m/s (iterations)
    bool converged = true;
    bool finite = true;
};

/// The row that is furthest from its law, and by how much: each multiplier against where a step of projection would put it, as
/// a velocity [m/s]. This is *the* residual that a result reports and an "unsettled" run is judged by, for every solver
/// (`PgsSolver::worst` measures it over its own contacts; PGS ends on the largest change of an iteration instead). For the box
/// `FrictionPoint::normal` is the bound's. Residuals up to `enough` are not told apart.
struct RowsResidual {
    double residual = 0.0;
    int row = 0;  // index into MixedSystem::rows
};
/// G M⁻¹ Gᵀ + Sig of one row: the scale between an impulse and a velocity.
double own_inertia(const MixedSystem& system, const RowBlock& block, int i);
/// The same where many are asked.
double own_inertia(const MassFactors& mass, const RowBlock& block, int i);

RowsResidual rows_residual(const MixedSystem& system, const std::vector<FrictionPoint>& points,
                           FrictionModel model, double enough = 0.0);

/// Whether velocities and multipliers in `system` are the answer already, as those of the step before are at rest: rows hold to
/// 1e-14 of the speed that forces give in a step, and impulses balance to 1e-13 of the largest. Costs no factor.
bool still_right(const MixedSystem& system, const std::vector<FrictionPoint>& points, FrictionModel model);

/// Slip velocity of row i, with what slip compliance gives way: D v + (gamma/h) beta.
inline double slip(const RowBlock& block, const FrictionPoint& point, int i,
                   const std::vector<Vec6>& velocity) noexcept {
    return row_velocity(block, i, velocity) - block.right[i] + point.slip_softness * block.multiplier[i];
}

/// Turns both rows of the point so that the first points along c t₁ + s t₂ (c² + s² = 1).
inline void turn_tangents(RowBlock& block, const FrictionPoint& point, double c, double s) noexcept {
    const int one = point.row, two = point.row + 1;
    auto turn = [c, s](double& x, double& y) noexcept {
        const double first = c * x + s * y;
        y = c * y - s * x;
        x = first;
    };
    for (int a = 0; a < 6; ++a) {
        turn(block.first_jacobian[one][a], block.first_jacobian[two][a]);
        turn(block.second_jacobian[one][a], block.second_jacobian[two][a]);
    }
    turn(block.right[one], block.right[two]);
    turn(block.multiplier[one], block.multiplier[two]);
}

}  // namespace spook

// Projected Gauss–Seidel on the Schur form: all rows one after the other.
#pragma once

#include "contacts/friction_point.hpp"
#include "contacts/pivot_system.hpp"

namespace spook {

/// Iterates over all rows in index order on one thread until the largest change of an iteration, as a velocity, is at
/// most `tolerance` [m/s], or `iterations` are done; the report's residual is that change. Starts from the
/// multipliers in `system`. Bilateral blocks are solved whole, bounded rows one by one, cone friction in pairs:
/// beta ← disc[beta − (S beta + q)/lambda_max(S_tt)]. Inverting S_tt before projecting has a wrong fixed point.
FrictionReport solve_iterative(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                               int iterations, double tolerance);

}  // namespace spook

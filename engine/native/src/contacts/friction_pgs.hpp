// Projected Gauss–Seidel on the Schur form: all rows one after the other, or friction alone.
#pragma once

#include "contacts/friction_point.hpp"
#include "contacts/pivot_solver.hpp"

namespace spook {

/// Iterates over all rows in index order on one thread until the largest change of an iteration, as a velocity, is at
/// most `tolerance` [m/s], or `iterations` are done; the report's residual is that change. Starts from the
/// multipliers in `system`. Bilateral blocks are solved whole, bounded rows one by one, cone friction in pairs:
/// beta ← disc[beta − (S beta + q)/lambda_max(S_tt)]. Inverting S_tt before projecting has a wrong fixed point.
FrictionReport solve_iterative(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                               int iterations, double tolerance);

/// Alternates direct solves of joints and normals, friction held, with iterations over friction, the rest held,
/// until the normal forces and the friction change by less than `tolerance` [m/s] or after `iterations` rounds. Rows that
/// contradict each other, as between walls that close in, have no direct solve: where pivoting has found none to
/// `tolerance`, all rows are updated, and for some solves after that at once.
FrictionReport solve_hybrid(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                            PivotSolver& solver, RetryBackoff& backoff, int iterations, double tolerance);

}  // namespace spook

#include "contacts/friction_pgs.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/pgs_rows.hpp"
#include "contacts/tolerances.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

using namespace tolerances::friction_pgs;

/// One per thread: its memory outlives a solve, its values do not.
PgsRows& pgs_rows() {
    static thread_local PgsRows own;
    return own;
}

/// The box bounds friction by the step before; where there was none, by the load of this step's first guess.
void guess_unknown_normals(const MixedSystem& system, std::vector<FrictionPoint>& points) {
    for (FrictionPoint& point : points)
        if (point.normal < 0.0) point.normal = system.rows[point.block].multiplier[0];
}

}  // namespace

FrictionReport solve_iterative(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                               int iterations, double tolerance) {
    FrictionReport report;
    guess_unknown_normals(system, points);
    PgsRows& pgs = pgs_rows();
    pgs.prepare(system, points, model);
    report.residual = unbounded;
    while (report.pgs_iterations < iterations && report.residual > tolerance) {
        Watch::look();
        report.residual = pgs.iterate(points, false);
        ++report.pgs_iterations;
    }
    pgs.write(system);
    if (system.rows.empty()) report.residual = 0.0;
    report.converged = report.residual <= tolerance;
    report.finite = !std::isnan(report.residual);
    for (FrictionPoint& point : points)
        if (model != FrictionModel::box) point.normal = system.rows[point.block].multiplier[0];
    return report;
}

FrictionReport solve_hybrid(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                            PivotSolver& solver, RetryBackoff& backoff, int iterations, double tolerance) {
    if (backoff.waits()) return solve_iterative(system, points, model, iterations, tolerance);
    FrictionReport report;
    const RoundLimitKept kept(solver);
    solver.round_limit = search_rounds;
    bool same_matrix = false;
    for (int round = 0; round < iterations; ++round) {
        for (const FrictionPoint& point : points) {
            RowBlock& block = system.rows[point.block];
            for (int i = point.row; i < point.row + point.size; ++i)
                block.lower[i] = block.upper[i] = block.multiplier[i];
        }
        const PivotReport pivots = solver.solve(system, same_matrix);
        same_matrix = true;
        ++report.rounds;
        report.pivots += pivots.flips;
        report.converged = pivots.converged;
        report.finite = pivots.finite;
        if (!pivots.finite) return report;
        if (!pivots.converged && rows_residual(system, {}, model, tolerance).residual > tolerance) {
            backoff.failed();
            for (RowBlock& block : system.rows) block.multiplier.fill(0.0);  // they may be anything
            FrictionReport updated = solve_iterative(system, points, model, iterations, tolerance);
            updated.rounds += report.rounds, updated.pivots += report.pivots,
                updated.pgs_iterations += report.pgs_iterations;
            return updated;
        }
        backoff.succeeded();
        if (points.empty()) return report;
        guess_unknown_normals(system, points);

        PgsRows& pgs = pgs_rows();
        pgs.prepare(system, points, model);
        double largest = 0.0, change = unbounded;
        for (int inner = 0; inner < iterations && change > 0.1 * tolerance; ++inner) {
            Watch::look();
            change = pgs.iterate(points, true);
            if (inner == 0) largest = change;
            ++report.pgs_iterations;
        }
        pgs.write(system);
        for (FrictionPoint& point : points) {
            const double normal = system.rows[point.block].multiplier[0];
            if (model != FrictionModel::box) point.normal = normal;
        }
        report.residual = largest;
        if (largest <= tolerance) return report;
    }
    report.converged = false;
    return report;
}

}  // namespace spook

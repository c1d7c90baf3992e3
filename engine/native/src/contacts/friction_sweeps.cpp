#include "contacts/friction_sweeps.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/sweep_rows.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

constexpr int search_rounds = 200;  // of pivoting: searches that end take fewer

/// One per thread: its memory outlives a solve, its values do not.
Sweeper& sweeper() {
    static thread_local Sweeper own;
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
    Sweeper& sweeps = sweeper();
    sweeps.prepare(system, points, model);
    report.residual = unbounded;
    while (report.sweeps < iterations && report.residual > tolerance) {
        Watch::look();
        report.residual = sweeps.sweep(points, false);
        ++report.sweeps;
    }
    sweeps.write(system);
    if (system.rows.empty()) report.residual = 0.0;
    report.converged = report.residual <= tolerance;
    report.finite = !std::isnan(report.residual);
    for (FrictionPoint& point : points)
        if (model != FrictionModel::box) point.normal = system.rows[point.block].multiplier[0];
    return report;
}

FrictionReport solve_hybrid(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                            PivotSolver& solver, Patience& patience, int iterations, double tolerance) {
    if (patience.waits()) return solve_iterative(system, points, model, iterations, tolerance);
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
            patience.failed();
            for (RowBlock& block : system.rows) block.multiplier.fill(0.0);  // they may be anything
            FrictionReport swept = solve_iterative(system, points, model, iterations, tolerance);
            swept.rounds += report.rounds, swept.pivots += report.pivots, swept.sweeps += report.sweeps;
            return swept;
        }
        patience.succeeded();
        if (points.empty()) return report;
        guess_unknown_normals(system, points);

        Sweeper& sweeps = sweeper();
        sweeps.prepare(system, points, model);
        double largest = 0.0, sweep = unbounded;
        for (int inner = 0; inner < iterations && sweep > 0.1 * tolerance; ++inner) {
            Watch::look();
            sweep = sweeps.sweep(points, true);
            if (inner == 0) largest = sweep;
            ++report.sweeps;
        }
        sweeps.write(system);
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

#include "contacts/solve_islands.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "contacts/friction_pgs.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

/// Whether an answer is one: an island on which next to nothing acts may have none to rounding.
bool is_finite(const MixedSystem& system) {
    const auto finite = [](double x) { return std::isfinite(x); };
    for (const Vec6& v : system.velocity)
        if (!std::all_of(v.begin(), v.end(), finite)) return false;
    for (const RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i) {
            const bool good =
                finite(block.right[i]) && finite(block.multiplier[i]) &&
                std::all_of(block.first_jacobian[i].begin(), block.first_jacobian[i].end(), finite) &&
                std::all_of(block.second_jacobian[i].begin(), block.second_jacobian[i].end(), finite);
            if (!good) return false;
        }
    return true;
}

/// PGS; where it stops with few rows off by more than `enough`, as in the rough impact of an end whose pushing and
/// rubbing turn it alike, more of them go in circles, and a direct solve costs little.
FrictionReport pgs_or_direct(const ContactOptions& o, FrictionModel model, double enough, MixedSystem& island,
                             std::vector<FrictionPoint>& points, DirectSolver& solver) {
    static thread_local MixedSystem start;  // their memory outlives a solve
    static thread_local std::vector<FrictionPoint> fresh;
    start = island, fresh = points;
    FrictionReport report = solve_iterative(island, points, model, o.iterations, o.residual_tolerance);
    if (!report.finite || report.converged) return report;
    const double left = rows_residual(island, points, model).residual;
    if (!(left > enough)) return report;
    const FrictionReport direct = solve_friction_direct(start, fresh, model, solver);
    if (direct.finite && is_finite(start) && rows_residual(start, fresh, model).residual < left) {
        island = start, points = fresh;
        for (const FrictionPoint& point : points)  // what is left is the direct solver's own
            for (int i = point.row; i < point.row + point.size; ++i)
                island.rows[point.block].softness[i] = point.slip_softness;
        report.converged = direct.converged;
    }
    report.rounds += direct.rounds, report.pivots += direct.pivots,
        report.pgs_iterations += direct.pgs_iterations;
    return report;
}

}  // namespace

FrictionReport solve_islands(MixedSystem& system, std::vector<FrictionPoint>& points, IslandSolver& islands,
                             const ContactOptions& options, const IslandRules& rules,
                             ContactCounters& counters, const std::vector<char>* answered) {
    const bool direct = options.solver == SolverKind::direct;
    if (direct && system.velocity.size() == system.mass.size() && still_right(system, points, rules.friction))
        return {};
    const std::size_t most = direct ? system.rows.size() : rules.few_enough;
    const auto solve = [&options, &rules, most](MixedSystem& island, std::vector<FrictionPoint>& own,
                                                DirectSolver& solver) {
        solver.warm_started = rules.warm_started;
        if (island.rows.size() <= most) return solve_friction_direct(island, own, rules.friction, solver);
        if (island.rows.size() > few_rows)
            return solve_iterative(island, own, rules.friction, options.iterations,
                                   options.residual_tolerance);
        return pgs_or_direct(options, rules.friction, rules.enough, island, own, solver);
    };
    const FrictionReport report = islands.run(system, points, std::cref(solve), answered);
    counters.add(report);
    counters.unsettled += !report.converged;
    return report;
}

}  // namespace spook

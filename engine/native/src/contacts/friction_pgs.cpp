#include "contacts/friction_pgs.hpp"

#include <cmath>

#include "contacts/pgs_rows.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

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
        report.residual = pgs.iterate(points);
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

}  // namespace spook

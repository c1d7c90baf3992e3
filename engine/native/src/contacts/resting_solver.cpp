#include "contacts/resting_solver.hpp"

#include <algorithm>

#include "contacts/contact_rows.hpp"

namespace spook {

const FrictionReport& RestingSolver::solve(MixedSystem& system, std::size_t joints, const IslandRules& rules,
                                           bool again, const StepMotion& motion, ContactPoints& points,
                                           ContactCounters& counters) {
    const ContactBodies& bodies = motion.bodies();
    const ContactOptions& options = motion.options();
    islands_.floor = options.floor;
    islands_.refinements = options.refinements;
    const ContactRows rows{motion, points};
    system.rows.resize(joints);
    friction_.clear();
    answered_.assign(joints, 1);
    for (StepContact& point : points.all) {
        system.rows.push_back(rows.resting_block(point));
        answered_.push_back(point.answered);
        if (system.rows.back().size > 1)
            rows.add_friction(point, static_cast<int>(system.rows.size()) - 1, friction_);
    }
    if (!again) {  // at rest, the velocities before are those after
        report_ = {};
        system.velocity.resize(system.mass.size());
        for (std::size_t b = 0; b < bodies.count(); ++b)
            if (bodies.moves(b)) system.velocity[bodies.solver_index[b]] = motion.velocity[b];
    }
    const FrictionReport before = report_;
    const bool late = again && options.solver == SolverKind::direct;
    report_ =
        solve_islands(system, friction_, islands_, options, rules, counters, late ? &answered_ : nullptr);
    report_.rounds += before.rounds, report_.pgs_iterations += before.pgs_iterations;
    report_.converged = report_.converged && before.converged;  // islands may have been left as they were
    if (options.friction == FrictionModel::box)
        for (const FrictionPoint& point : friction_)
            points.own_extras(points.all[point.block - joints]).guessed = point.normal;
    return report_;
}

void RestingSolver::store(const MixedSystem& system, std::size_t joints, const ContactBodies& bodies,
                          ContactPoints& points) {
    for (std::size_t k = 0; k < system.rows.size() - joints; ++k)
        store_solution(bodies, system.rows[joints + k], points, points.all[k]);
}

SolveQuality RestingSolver::deliver(MixedSystem& system, std::size_t joints, const JudgedStep& step,
                                    ContactPoints& points, EnergyLimit& energy,
                                    std::vector<CachedContact>& cache) {
    SolveQuality quality = judge(step, system, friction_, report_);
    if (!report_.converged) {
        const auto pushes = [&](std::size_t k) {
            const RowBlock& block = system.rows[joints + k];
            return std::any_of(block.multiplier.begin(), block.multiplier.begin() + block.size,
                               [](double each) { return each != 0.0; });
        };
        const std::vector<double>& share = energy.shorten(system, joints, step.motion, points, pushes);
        for (std::size_t k = joints; k < system.rows.size(); ++k)
            for (double& z : system.rows[k].multiplier)
                z *= share[std::max(system.rows[k].first, system.rows[k].second)];
    }
    const ContactRows rows{step.motion, points};
    cache.clear();
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        StepContact& point = points.all[k];
        const Vec3 along = store_solution(step.motion.bodies(), system.rows[joints + k], points, point);
        CachedContact& cached = cache_contact(rows, system, point, point.normal, along, cache);
        quality.stopped.note(step.motion.given_back(point, point.normal),
                             step.motion.bodies().mover(point.contact));
        std::copy_n(points.extras(point).turning, 3, cached.turning);
    }
    return quality;
}

}  // namespace spook

// Resting contact by rows: blocks of a point each behind those of joints, solved island by island.
#pragma once

#include <vector>

#include "contacts/contact_points.hpp"
#include "contacts/solve_islands.hpp"
#include "contacts/solve_quality.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

class RestingSolver {
public:
    /// Appends a row block per point behind the `joints` of joints and solves. `again`: points have come since the last solve of this
    /// step; islands that are answered are left as they are.
    const FrictionReport& solve(MixedSystem& system, std::size_t joints, const IslandRules& rules, bool again,
                                const StepMotion& motion, ContactPoints& points, ContactCounters& counters);
    /// What the rows hold, as where the next solve of this step starts.
    static void store(const MixedSystem& system, std::size_t joints, const ContactBodies& bodies,
                      ContactPoints& points);
    /// How near to its law the last solve is, shortened where it did not settle; what each point did is cached.
    SolveQuality deliver(MixedSystem& system, std::size_t joints, const JudgedStep& step,
                         ContactPoints& points, EnergyLimit& energy, std::vector<CachedContact>& cache);

    IslandSolver& islands() noexcept { return islands_; }
    const IslandSolver& islands() const noexcept { return islands_; }

private:
    IslandSolver islands_;
    FrictionReport report_;  // of the solves of this step
    std::vector<FrictionPoint> friction_;
    std::vector<char> answered_;  // per row: the solve before found it an answer
};

}  // namespace spook

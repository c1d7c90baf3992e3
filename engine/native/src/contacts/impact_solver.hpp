// Impacts: the velocities that bodies part with when some point with restitution is approached, or a stop is hit.
//
// Why the impact cannot raise the kinetic energy E = ½ vᵀ M v. Let v_p be the plastic impact (psi = 0): with
// impulse P, M (v_p − v₋) = P and E_p − E₋ = v_p·P − ½ |v_p − v₋|²_M, where v_p·P = Σ nu C v_p + beta·D v_p, whose
// first part is zero by complementarity and whose second is negative, friction acting against the slip. So
// E_p <= E₋. Newton's law, v_N, can raise E where restitutions differ, or where friction turns a slip round: then
// v₊ = v_p + s (v_N − v_p) with the largest s in 0 … 1 for which E(v₊) <= E₋, island by island. It exists, E being
// convex in s and E(v_p) <= E₋; and v₊ obeys all that v_p and v_N obey: C v₊ >= 0, nu >= 0, |beta| <= mu nu are convex.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "contacts/contact_points.hpp"
#include "contacts/impact_queue.hpp"
#include "contacts/open_pairs.hpp"
#include "contacts/solve_islands.hpp"
#include "contacts/solve_quality.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

class ImpactSolver {
public:
    void begin_step(const ContactModel& model);
    /// From now on in this step impacts too slow to rebound are met as plastic ones. Whether they were not yet.
    bool meet_slow_too() noexcept { return !std::exchange(slow_too_, true); }
    /// Approach, push and part in the impact of every point, from the current velocities. `reach`: see SearchMargins.
    /// Whether an impact is needed.
    bool measure(const StepMotion& motion, const std::vector<double>& reach, ContactPoints& points);
    /// The same after an impact, of points that are measured: what was hit already is not hit again.
    bool look_again(const ContactModel& model, const ContactPoints& points);
    bool needed(const MixedSystem& system, const ContactBodies& bodies, const ContactPoints& points) {
        return needed_ || stop_is_hit(system, bodies, points);
    }
    /// Whether some stop is hit where contacts are to hear of it: what it sets in motion may push them, and
    /// Newton's law for it and resting rows for them would raise the energy. A stop alone is left to the resting stage.
    bool stop_is_hit(const MixedSystem& system, const ContactBodies& bodies, const ContactPoints& points);

    /// Finds the points of the next impact, and moves bodies there. Of the pairs that are open some may be next.
    void find_next(MixedSystem& system, const OpenPairs& open, StepMotion& motion, ContactPoints& points);
    /// See ContactStage::impact(). `few_enough`: see IslandRules. Gives how near to its law the worst solve was left.
    SolveQuality solve(MixedSystem& system, std::size_t few_enough, StepMotion& motion, ContactPoints& points,
                       std::vector<Vec6>& impulses, ContactCounters& counters);
    /// What took part in it.
    const std::vector<RowBlock>& hit_rows() const noexcept { return work_.hit.rows; }

    ImpactQueue& queue() noexcept { return queue_; }
    IslandSolver& solver() noexcept { return solver_; }
    const IslandSolver& solver() const noexcept { return solver_; }

private:
    bool is_hit(const RowBlock& block) const noexcept;
    bool is_impact(const StepContact& point) const noexcept;
    const Islands& connected(const MixedSystem& system, const ContactBodies& bodies,
                             const ContactPoints& points);
    void take_part(MixedSystem& system, const ContactModel& model, const ContactPoints& points);
    void share_impact(MixedSystem& hit, std::size_t joints, const ContactPoints& points);
    void add_points(const StepMotion& motion, const ContactPoints& points);
    template <class Solve> void keep_energy(std::size_t joints, const Solve& solve);
    void deliver(std::size_t joints, std::vector<Vec6>& impulses, ContactPoints& points) const;
    void solve_rows(MixedSystem& hit, std::size_t joints, std::vector<FrictionPoint>& friction,
                    const IslandRules& rules, const StepMotion& motion, ContactCounters& counters,
                    SolveQuality& quality);

    IslandSolver solver_;
    ImpactQueue queue_;
    bool needed_ = false;
    bool plastic_too_ = false;  // impacts without rebound are met as well: others may follow from them
    bool slow_too_ = false;     // and those that are too slow to rebound
    int rounds_ = 0;            // impacts of this step
    /// Of one impact; energies, shares and flags by island.
    struct Arrays {
        MixedSystem hit, start, plastic;
        std::vector<FrictionPoint> friction, fresh, plastic_friction, first_friction;
        std::vector<std::size_t> hit_points,
            pushed;  // points; rows against what moves as it is told, or along itself
        std::vector<std::pair<int, int>> pairs;
        std::vector<Vec6> before, mixed;
        std::vector<std::array<double, 2>> returned;  // of the slip of each point, m/s
        std::vector<double> limit, energy, share, low, high, asked;
        std::vector<char> rises, answered, touched, taking_part;
    };
    Arrays work_;
    std::vector<std::size_t> joints_hit_;  // blocks of the step's rows that take part in it
    IslandFinder connected_;
};

}  // namespace spook

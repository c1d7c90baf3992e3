// Resting contact by projected Gauss–Seidel (PGS), for as many bodies as there are.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "contacts/contact_points.hpp"
#include "contacts/pgs_solver.hpp"
#include "contacts/solve_quality.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

class ContactPgs {
public:
    /// Takes masses, momenta and rows of joints; no points yet.
    void start(MixedSystem& system, FrictionModel friction) { solver_.start(system, friction); }
    /// Gives the iterations the points they do not have yet.
    void hand_over(const StepMotion& motion, ContactPoints& points);
    /// Hands over the points found since `known`, with what they did in the step before.
    void take_in(std::size_t known, const ContactCache& cache, const StepMotion& motion,
                 ContactPoints& points);
    /// Iterates as the method asks for, see PgsSolver::run().
    FrictionReport run(const ContactOptions& options, const std::function<bool(bool)>& more);
    /// Takes down the velocities so far, per body of the scene, and which have changed; `all`: every one has.
    void follow(const ContactBodies& bodies, bool all, std::vector<Vec6>& velocity,
                std::vector<char>& changed) const;

    /// Notes how far the iterations are from their law, and if that is more than the method asks for, which body is. Whether a joint
    /// is furthest.
    bool judge(MixedSystem& system, const StepMotion& motion, const ContactPoints& points,
               SolveQuality& quality);
    /// Whether the iterations have made far more energy than there is. No answer does, but where friction on a long arm loads
    /// the contact that it stems from, each iteration's may be larger than the one before.
    bool runs_away(const MixedSystem& system, const StepMotion& motion, const ContactPoints& points) const;

    /// The islands that have points from `known` on: no solve has answered those yet. How many points the largest has.
    std::size_t find_unanswered(const ContactBodies& bodies, std::size_t known, const ContactPoints& points);
    /// What the iterations found for these points, as where the next solve starts.
    void store_unanswered(ContactPoints& points) const;

    /// Caches what each point did, and marks bodies that some push; an unsettled answer is shortened.
    void deliver(MixedSystem& system, bool unsettled, const StepMotion& motion, const ContactPoints& points,
                 EnergyLimit& energy, std::vector<char>& has_rows, std::vector<CachedContact>& cache,
                 StoppedImpacts& stopped) const;
    /// By key: iterations take points as they are found.
    void order(std::vector<CachedContact>& cache) { order_by_key(cache, unordered_, places_); }

    PgsSolver& solver() noexcept { return solver_; }

private:
    PgsSolver solver_;
    struct Unanswered {
        std::vector<int> island;          // of each point
        std::vector<char> open;           // islands to be solved
        std::vector<std::size_t> points;  // of each
    };
    Unanswered unanswered_;
    IslandFinder connected_;
    std::vector<CachedContact> unordered_;
    std::vector<std::pair<std::uint64_t, std::size_t>> places_;  // of points, by key
};

}  // namespace spook

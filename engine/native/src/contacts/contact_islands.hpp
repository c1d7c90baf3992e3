// Bodies that are connected by rows are solved together, the others apart.
#pragma once

#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "contacts/friction_direct.hpp"
#include "contacts/islands.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

/// Splits a system into its islands and solves each with a solver and arrays of its own, which are kept from solve to
/// solve, and the solver's analysis as long as the island does not change. Equal input gives equal bits.
class IslandSolver {
public:
    using Solve = std::function<FrictionReport(MixedSystem&, std::vector<FrictionPoint>&, DirectSolver&)>;

    double floor = 1e-12;
    int refinements = 1;

    /// Fills velocity, multipliers and points of `system`; the report sums counts and takes the largest residual. An island whose
    /// rows are all `answered` is left as it is.
    FrictionReport run(MixedSystem& system, std::vector<FrictionPoint>& points, const Solve& solve,
                       const std::vector<char>* answered = nullptr);

    BlockLdlt::Counters counters() const noexcept;

    /// Of every island, by its first body.
    using BackoffOf = std::vector<std::pair<int, RetryBackoff>>;
    void backoff(BackoffOf& found) const;
    void set_backoff(const BackoffOf& backoff);

private:
    /// What an island has from solve to solve: its solver, its part of the system, and what became of it.
    struct Own {
        DirectSolver solver;
        MixedSystem system;
        std::vector<FrictionPoint> points;
        std::vector<FurtherBody> further;  // of its rows, with the places of their bodies
        FrictionReport report;
    };
    Own& own_of(int first_body);
    void take_apart(MixedSystem& system, const Islands& islands, std::vector<FrictionPoint>& points);
    void copy_rows(Own& own) const;
    void put_together(MixedSystem& system, const Islands& islands, std::vector<FrictionPoint>& points);

    std::map<int, Own> own_;  // by the island's first body
    IslandFinder finder_;
    // Of one run:
    std::vector<char> open_;                           // islands to be solved
    std::vector<Own*> parts_, open_parts_;             // of each island, null where it is not; of those alone
    std::vector<int> place_, row_island_, row_place_;  // of bodies and rows in their island's part
    std::vector<std::size_t> next_;
};

}  // namespace spook

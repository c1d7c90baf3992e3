// Bodies that hang together by rows are solved together, the others apart.
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "contacts/friction_direct.hpp"

namespace spook {

/// Island of each body of the system: islands are numbered by their first body's index, upwards from 0; a body
/// without rows has −1. Ends that do not move (−1 in a row) join nothing, so bodies on the same ground stay apart.
struct Islands {
    struct Tie {
        int first, second;
    };
    std::vector<int> of_body;
    int count = 0;
};
/// A tie per block of rows, and one for each body beyond its first two: one of the first two always moves by itself.
void add_ties(const RowBlock& block, std::vector<Islands::Tie>& ties);
Islands find_islands(int bodies, const std::vector<Islands::Tie>& ties);
Islands find_islands(const MixedSystem& system);

inline constexpr std::size_t few_rows = 24;  // blocks: so many are solved directly at little cost

/// Splits a system into its islands and solves each with a solver of its own, which keeps its analysis as long as
/// the island does not change. Islands are done in order on one thread: equal input gives equal bits.
class IslandSolver {
public:
    using Solve = std::function<FrictionReport(MixedSystem&, std::vector<FrictionPoint>&, DirectSolver&)>;

    double floor = 1e-12;
    int refinements = 1;

    /// Fills velocity, multipliers and points of `system`; the report sums rounds, pivots and sweeps and takes the
    /// largest residual.
    /// Where `answered` says of all rows of an island that they are an answer already, it is left as it is.
    FrictionReport run(MixedSystem& system, std::vector<FrictionPoint>& points, const Solve& solve,
                       const std::vector<char>* answered = nullptr);

    BlockLdlt::Counters counters() const noexcept;

    /// Of every island, by its first body.
    std::map<int, Patience> patience() const;
    void be_patient(const std::map<int, Patience>& patience);

private:
    std::map<int, DirectSolver> solvers_;  // by the island's first body
};

}  // namespace spook

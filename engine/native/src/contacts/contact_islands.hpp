// Bodies that hang together by rows are solved together, the others apart.
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "contacts/friction_direct.hpp"
#include "run/team.hpp"

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
/// the island does not change. Equal input gives equal bits, on however many threads islands are shared out.
class IslandSolver {
public:
    using Solve = std::function<FrictionReport(MixedSystem&, std::vector<FrictionPoint>&, DirectSolver&)>;

    double floor = 1e-12;
    int refinements = 1;
    Team* team = nullptr;  // who else solves islands; `solve` must then be good for several at once

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
    /// One island's part of a system.
    struct Part {
        MixedSystem* system;
        std::vector<FrictionPoint>* points;
        DirectSolver* solver;
        FrictionReport report;
    };
    void solve_all(std::vector<Part>& parts, const Solve& solve) const;

    std::map<int, DirectSolver> solvers_;  // by the island's first body
};

}  // namespace spook

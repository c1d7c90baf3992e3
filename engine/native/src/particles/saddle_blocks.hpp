// Distance rows that branch or close loops, and strings made stiff: the saddle system in blocks.
//
// Unknowns are the change of velocity beyond the kick, dv, and μ = −λ:
//     [ M̃  Gᵀ  ] [ dv ]   [ −K̃ kick − D̃ (v + kick) ]      M̃ = M + K̃ + D̃
//     [ G  −Sig ] [ μ  ] = [ rhs of the Schur form     ]
// Without string stiffness K̃ = D̃ = 0. With it K̃ = (h²/4) Σ (T/l)(I − u uᵀ), T the tension of the step before:
// the transverse stiffness of a taut row averaged over ¼ (x₊ + 2x + x₋) like a compliance, and D̃ a damping only
// where the explicit step would be near its limit T h²/(m l) = 1. Its forces stand across the rows, so that those at
// a row's two ends turn what nothing holds to the world: a turn of the whole, which no row feels, gives the angular
// momentum back.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linear/block_ldlt.hpp"
#include "linear/redundant_rows.hpp"
#include "particles/distance_rows.hpp"

namespace spook {

class SaddleBlocks {
public:
    struct Options {
        double time_step = 0.0;
        double floor = 0.0;
        int refinements = 1;
        bool stiff_strings = false;
        bool may_contradict =
            true;  // false: the lengths agree at the start, so rows cannot contradict each other
    };
    void analyse(const Nodes& nodes, const DistanceRows& rows, const Options& options);

    /// At the directions of the links.
    void factor(const Nodes& nodes, const DistanceRows& rows);
    /// The same with Sig = 0.
    void factor_rigidly(const Nodes& nodes, const DistanceRows& rows);
    /// λ of every row from its right side, with the factor as it is; not a number if there is none.
    void substitute(const Nodes& nodes, DistanceRows& rows);
    /// v += dv of the last solve: what stiff strings need, whose forces are not along the rows.
    void add_moves(std::vector<Vec3>& v) const noexcept;

    /// A body held by rows that cannot hold together, or −1.
    int contradicted() const noexcept { return contradicted_; }
    void reset() {
        contradicted_ = -1;
        redundant_.reset(ldlt_);
        count_from_here();
    }
    const RedundantRows::Memory& memory() const noexcept { return redundant_.memory(); }
    void restore(const RedundantRows::Memory& memory) {
        contradicted_ = -1;
        redundant_.restore(ldlt_, memory);
    }
    void count_from_here() noexcept { operations_before_ = ldlt_.counters().block_operations; }
    std::int64_t operations() const noexcept {
        return static_cast<std::int64_t>(ldlt_.counters().block_operations - operations_before_);
    }

private:
    struct RowBlocks {
        int row, a, b;  // block of the row, edges to its bodies; −1 where a world point stands
        int between;    // edge between its bodies, for string stiffness
    };
    void stiffen_strings(const Nodes& nodes, const DistanceRows& rows);
    void find_islands(const Nodes& nodes, const DistanceRows& rows);
    void keep_angular_momentum(const Nodes& nodes);
    bool rows_hold(const Nodes& nodes, const DistanceRows& rows, std::span<const double> residuals) const;
    void find_contradiction(const Nodes& nodes, const DistanceRows& rows);

    Options options_;
    BlockLdlt ldlt_;
    RedundantRows redundant_;
    std::vector<int> block_of_node_;
    std::vector<RowBlocks> row_blocks_;
    std::vector<std::vector<int>> islands_;  // of nodes that nothing holds to the world, for string stiffness
    std::vector<double> rhs_, solution_;
    std::uint64_t operations_before_ = 0;
    int contradicted_ = -1;
};

}  // namespace spook

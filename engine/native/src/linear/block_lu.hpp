// Sparse systems in 6×6 blocks whose pattern is symmetric and whose values are not: A = L U.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linear/block_lu_kernels.hpp"
#include "linear/ordering.hpp"

namespace spook {

/// analyse() once per pattern, then clear(), fill, factor() and solve(). The factor takes the place of the values, so
/// they are filled anew each time. Pivots are sought within a diagonal block only: A should be a positive definite
/// matrix with something less added. Nothing is allocated after analyse(). Equal input gives equal bits.
class BlockLu {
public:
    /// edges: the pairs of coupled blocks, first < second, each once. Blocks of fewer unknowns than six are told by their
    /// sizes, for the order; constraints are eliminated after what they tie.
    void analyse(std::span<const int> sizes, std::span<const BlockEdge> edges,
                 std::span<const std::uint8_t> is_constraint);

    void clear() noexcept;
    /// Row-major blocks of A: the diagonal's, and of an edge A(first, second) and A(second, first).
    double* diagonal(int block) noexcept {
        return pivot_.data() + 36 * static_cast<std::size_t>(position_[block]);
    }
    double* forth(int edge) noexcept {
        return edge_[edge].forth_is_upper ? upper(edge_[edge].at) : lower(edge_[edge].at);
    }
    double* back(int edge) noexcept {
        return edge_[edge].forth_is_upper ? lower(edge_[edge].at) : upper(edge_[edge].at);
    }

    /// False when a pivot vanished or was not finite: nothing solve() gives may be used.
    bool factor();
    /// x ← A⁻¹ x, six numbers per block in the caller's order.
    void solve(double* x) const noexcept;

    int blocks() const noexcept { return static_cast<int>(order_.size()); }
    /// Products of blocks in one factorisation.
    std::int64_t operations() const noexcept { return operations_; }

private:
    struct EdgePlace {
        std::int64_t at = 0;
        bool forth_is_upper = true;
    };
    LuFactor view() noexcept;
    double* lower(std::int64_t at) noexcept { return lower_.data() + 36 * at; }
    double* upper(std::int64_t at) noexcept { return upper_.data() + 36 * at; }

    std::vector<int> order_, position_;
    std::vector<std::int64_t> column_start_;
    std::vector<int> column_rows_;       // positions of the later blocks that a column couples to, ascending
    std::vector<std::int64_t> targets_;  // per column, for each pair of its rows r < s: the block (r, s)
    std::vector<EdgePlace> edge_;
    std::vector<double> pivot_, lower_, upper_;  // by position; the pivots are inverted in the factor
    std::int64_t operations_ = 0;
};

}  // namespace spook

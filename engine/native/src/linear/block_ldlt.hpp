// Sparse symmetric saddle systems in blocks of 1 to 6 unknowns: A = Uᵀ D U, and solutions refined against A.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linear/block_kernels.hpp"
#include "linear/large_array.hpp"
#include "linear/ordering.hpp"

namespace spook {

/// Factors [[M, Gᵀ], [G, −Sig]]: blocks of bodies have positive pivots, blocks of constraints negative ones.
///
/// analyse() once per topology, then fill diagonal() and coupling(), factor() and solve() each step; nothing is
/// allocated after analyse(), which keeps the memory it had. Vectors are in the caller's block order, at offset(i). Results depend on the input
/// only, not on the instruction set.
class BlockLdlt {
public:
    struct Counters {  // exact, equal on every machine
        std::uint64_t factorisations = 0, block_operations = 0, floored_pivots = 0, solves = 0;
        void add(const Counters& more) noexcept {
            factorisations += more.factorisations, block_operations += more.block_operations;
            floored_pivots += more.floored_pivots, solves += more.solves;
        }
    };

    /// sizes[i] in 1 … 6; edges are the non-zero blocks off the diagonal, first < second, each pair once;
    /// is_constraint[i] says the sign of the pivots. Sets all values to zero. Throws std::invalid_argument.
    /// With `thin_constraints` the diagonal blocks of constraints are diagonal and only that is stored.
    void analyse(std::span<const int> sizes, std::span<const BlockEdge> edges,
                 std::span<const std::uint8_t> is_constraint, bool thin_constraints = false);

    /// Row-major square block; the caller fills all of it, symmetric. A constraint's holds −Sig; if thin, it is a
    /// vector.
    double* diagonal(int block) noexcept { return values_.data() + diagonal_at_[block]; }
    const double* diagonal(int block) const noexcept { return values_.data() + diagonal_at_[block]; }
    /// Row-major block of the edge: rows of its first block, columns of its second.
    double* coupling(int edge) noexcept { return values_.data() + coupling_at_[edge]; }
    const double* coupling(int edge) const noexcept { return values_.data() + coupling_at_[edge]; }

    /// Factors the current values. A pivot below floor × (the sum of magnitudes it came from) is replaced by
    /// √floor × that sum, in the factor only: a redundant row then takes no share that the others can carry, and
    /// refinement removes the rest. False when a value was not finite, or a pivot vanished with floor 0.
    bool factor(double floor);

    /// From the next factorisation on, every constraint counts as softer by so much, in the factor only. Solutions
    /// refined from zero then tend to the one of least norm where constraints are redundant.
    void shift_constraints(double shift) noexcept { shift_ = shift; }
    /// The largest sum of magnitudes that a constraint's pivot came from in the last factorisation.
    double largest_constraint_scale() const noexcept;

    /// x ← F⁻¹ x with the factor F as it is.
    void solve(double* x) const;

    /// Columns of the factor, in order, that a forward substitution of what is zero outside these blocks writes to:
    /// their ways to the root.
    void reach(std::span<const int> blocks, std::vector<int>& columns) const;
    /// x ← U⁻ᵀ x along such columns. Of two results y₁ and y₂, y₁ᵀ D⁻¹ y₂ is x₁ᵀ F⁻¹ x₂.
    void forward(std::span<const int> columns, double* x) const;
    /// D⁻¹ of a column's unknowns, and where they begin.
    struct Pivots {
        int offset = 0;
        std::span<const double> inverse;
    };
    Pivots pivots(int column) const noexcept;

    /// x ← A⁻¹ rhs from zero, with so many residual corrections against the true A. rhs and x do not overlap.
    void solve_refined(const double* rhs, double* x, int refinements);

    /// factor() and solve_refined() with one pass over the factor less.
    bool factor_and_solve(double floor, const double* rhs, double* x, int refinements);

    /// r ← rhs − A x.
    void residual(const double* rhs, const double* x, double* r) const;

    int block_count() const noexcept { return static_cast<int>(size_.size()); }
    int size(int block) const noexcept { return size_[block]; }
    int offset(int block) const noexcept { return offset_[block]; }
    int unknowns() const noexcept { return unknowns_; }
    std::span<const BlockEdge> edges() const noexcept { return edges_; }
    std::span<const int> order() const noexcept { return order_; }
    /// Blocks of the factor off the diagonal that are not in the matrix.
    std::int64_t fill() const noexcept { return static_cast<std::int64_t>(row_size_.size() - edges_.size()); }
    Counters counters() const noexcept { return counters_; }
    void clear_counters() noexcept { counters_ = {}; }

private:
    struct Analysis;
    void place_columns(Analysis& analysis);
    void place_work(Analysis& analysis);
    void place_loads(Analysis& analysis);
    void find_raw(Analysis& analysis);
    void raw_scales();
    void refine(const double* rhs, double* x, int refinements);
    bool factor_with(double floor, double* x);
    kernel::Factor view() const noexcept;

    std::vector<int> size_, offset_, order_;
    std::vector<int> column_of_, parent_;  // of blocks; of columns, −1: a root
    std::vector<BlockEdge> edges_;
    std::vector<std::uint8_t> is_constraint_;
    bool thin_ = false;
    int unknowns_ = 0, uniform_size_ = 0;
    double shift_ = 0.0;
    std::int64_t operations_per_factor_ = 0;
    std::vector<std::int64_t> piece_ends_;  // columns after which a factorisation may be ended

    std::vector<std::int64_t> diagonal_at_, coupling_at_;
    LargeArray<double> values_;

    LargeArray<kernel::Column> columns_;
    std::vector<std::uint8_t> row_size_;
    std::vector<std::int32_t> row_offset_;
    LargeArray<std::int64_t> targets_;
    LargeArray<kernel::Load> loads_;
    LargeArray<std::int64_t> load_start_;
    std::vector<int> raw_start_, raw_blocks_, raw_edges_;
    LargeArray<double> factor_, work_, scale_, residual_;
    Counters counters_;
};

}  // namespace spook

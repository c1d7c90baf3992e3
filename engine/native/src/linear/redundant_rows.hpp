// Rows that say what others say (G without full rank, Sig = 0), solved so that all of them share the load.
//
// A factor with floors gives such a row nothing. A slight softness of all rows, in the factor only, makes refinement
// from zero tend to the impulses of least norm instead; quickly, unless rows are nearly dependent as well (long
// rings). Then, and until the next run, the factor with floors does it.
#pragma once

#include <algorithm>
#include <vector>

#include "linear/block_ldlt.hpp"

namespace spook {

/// One factor and its solves, step after step. `settled(left)` is asked with left = rhs − A x, and says whether every
/// row holds to rounding. Allocates nothing after prepare().
class RedundantRows {
public:
    void prepare(const BlockLdlt& matrix) { left_.assign(static_cast<std::size_t>(matrix.unknowns()), 0.0); }
    /// As if no redundant row had been met yet.
    void reset(BlockLdlt& matrix) { restore(matrix, {}); }
    /// What is kept from step to step.
    struct Memory {
        double share = 0.0;   // the softness, 1/kg; −1: rows cannot share their load
        bool shared = false;  // they did, before
    };
    const Memory& memory() const noexcept { return memory_; }
    void restore(BlockLdlt& matrix, const Memory& memory) {
        memory_ = memory;
        matrix.shift_constraints(std::max(0.0, memory.share));
    }
    /// Rows that were redundant and shared their load are independent of the others by now: they say other things.
    bool parted() const noexcept { return finite_ && !floored_ && memory_.shared && memory_.share < 0.0; }

    /// False when a value was not finite: nothing the factor gives may be used.
    bool factor(BlockLdlt& matrix, double floor) {
        const std::uint64_t before = matrix.counters().floored_pivots;
        finite_ = matrix.factor(floor);
        floored_ = matrix.counters().floored_pivots != before;
        return finite_;
    }
    bool finite() const noexcept { return finite_; }

    /// x ← A⁻¹ rhs with the factor as it is, factored anew only where rows turn out to be redundant. True when they
    /// could not share the load, so that they may contradict each other.
    template <class Settled>
    bool solve(BlockLdlt& matrix, double floor, const double* rhs, double* x, int refinements,
               Settled settled) {
        if (floored_ && memory_.share == 0.0) {
            memory_.share = 1e-7 * matrix.largest_constraint_scale();
            matrix.shift_constraints(memory_.share);
            factor(matrix, floor);
        }
        if (memory_.share > 0.0) {
            if (finite_ && shares(matrix, rhs, x, std::max(2, refinements), settled)) return false;
            memory_.share = -1.0;
            matrix.shift_constraints(0.0);
            factor(matrix, floor);
        }
        matrix.solve_refined(rhs, x, refinements);
        return floored_;
    }

    /// factor() and solve(), with one pass over the factor less where no row is redundant.
    template <class Settled>
    bool factor_and_solve(BlockLdlt& matrix, double floor, const double* rhs, double* x, int refinements,
                          Settled settled) {
        if (memory_.share > 0.0) {
            factor(matrix, floor);
            return solve(matrix, floor, rhs, x, refinements, settled);
        }
        const std::uint64_t before = matrix.counters().floored_pivots;
        finite_ = matrix.factor_and_solve(floor, rhs, x, refinements);
        floored_ = finite_ && matrix.counters().floored_pivots != before;
        if (!floored_ || memory_.share < 0.0) return floored_;
        return solve(matrix, floor, rhs, x, refinements, settled);
    }

    /// rhs − A x.
    const std::vector<double>& residual(const BlockLdlt& matrix, const double* rhs, const double* x) {
        matrix.residual(rhs, x, left_.data());
        return left_;
    }

private:
    template <class Settled>
    bool shares(BlockLdlt& matrix, const double* rhs, double* x, int refinements, Settled settled) {
        matrix.solve_refined(rhs, x, refinements);
        for (int round = 0;; ++round) {
            if (settled(residual(matrix, rhs, x))) return memory_.shared = true;
            if (round == 6) return false;
            matrix.solve(left_.data());
            for (std::size_t i = 0; i < left_.size(); ++i) x[i] += left_[i];
        }
    }

    Memory memory_;
    bool floored_ = false, finite_ = true;
    std::vector<double> left_;
};

}  // namespace spook

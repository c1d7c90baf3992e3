// Direct solver of a mixed system: which rows sit at a bound, found by pivoting; the rest by block LDLᵀ.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contacts/mass_factors.hpp"
#include "contacts/pivot_system.hpp"
#include "linear/block_ldlt.hpp"

namespace spook {

struct PivotReport {
    int rounds = 0;         // linear systems solved
    int flips = 0;          // rows that changed state
    int restarts = 0;       // times the search stalled and began anew
    bool converged = true;  // no row is on the wrong side of its complementarity
    bool finite = true;     // the factorisation met only finite values
};

/// Solves MixedSystem by block pivoting: free every row that wants to leave its bound, bind every row that broke
/// one, all at once. Five rounds without fewer offenders are a stall. Rigid redundant contacts may contradict each
/// other by rounding, so at each stall the tolerance, 1e-11 of the system's speed at first, is loosened tenfold, to
/// 1e-7 at most; from the third on Gauss–Seidel iterations guess the free set anew (fixed bounds make a convex quadratic
/// problem, which iterations descend); after seven only the offender of the largest index is flipped (Murty 1974), which
/// ends for P-matrices. Rows start from RowBlock::state; bilateral rows never leave the free set.
///
/// Singular systems (four rigid corners, Sig = 0): the factored matrix carries a compliance of `relief` times each
/// bounded row's own (G M⁻¹ Gᵀ)ᵢᵢ, and the relief is then taken out again against the true equations, by conjugate
/// gradients with the factor as preconditioner. That gives the solution of least norm among equals, weighted by
/// (G M⁻¹ Gᵀ)ᵢᵢ, and changes no equation. A factor 1e-6 is small enough for a few rounds and large enough that the
/// rounding of gaps, divided by it, stays out of the loads. Rows that rest at zero with nothing to spare are freed
/// once before the search ends, or which of the equal answers it is would hang on where it began. What only the relieved
/// matrix has an answer to, as rows that say nearly the same between tight bounds, keeps the relief in it.
class PivotSolver {
public:
    double floor = 1e-12;  // of BlockLdlt::factor
    double relief = 1e-6;  // of bounded rows, in the factor only
    int refinements = 1;   // against the true equations, after each solve
    int max_directions = 30;
    int round_limit = 1 << 30;  // give up after so many rounds; without it the search ends by itself

    /// Fills velocity, multipliers and states. With `same_matrix` the caller promises that mass, Jacobians and
    /// softness are those of the call before: a factor of the same free set is then used again.
    PivotReport solve(MixedSystem& system, bool same_matrix = false);

    BlockLdlt::Counters counters() const noexcept { return counters_; }
    std::uint64_t analyses() const noexcept { return analyses_; }

private:
    bool analyse(const MixedSystem& system);
    void find_graph(const MixedSystem& system);
    void measure(const MixedSystem& system);
    bool factor(const MixedSystem& system);
    void solve_free(MixedSystem& system, bool refined);
    double refine(int rounds);
    bool conjugate_directions();
    double residual();
    void guess_by_pgs(MixedSystem& system, int iterations);
    int offenders(const MixedSystem& system, bool mark_all);
    int free_degenerate_rows(MixedSystem& system);
    int begin_states(MixedSystem& system) const;
    bool is_stale(const MixedSystem& system) const;
    int flip_offenders(MixedSystem& system) const;
    void count_work();
    void begin_again(MixedSystem& system, int restarts);

    struct Bounded {  // a row that is not bilateral
        int block, row;
        double own;  // its (G M⁻¹ Gᵀ)ᵢᵢ
    };
    struct Relieved {
        int at;  // in the vectors of matrix_
        double relief;
    };
    struct Pattern {
        int first, second, size;
        bool operator==(const Pattern&) const = default;
    };
    struct Graph {  // which bodies the rows tie, and its elimination
        BlockLdlt matrix;
        int bodies = -1;
        std::vector<Pattern> pattern;
        std::vector<int> first_edge, second_edge;  // per row block, −1 if there is none
        std::vector<int> further,
            further_edge;  // rows over more bodies: block and body of each, and its edge

        bool is_of(const MixedSystem& system) const noexcept;
    };
    Graph graph_;
    std::vector<Graph>
        others_;  // of the solves before, the latest first: a step solves several systems in turn
    BlockLdlt::Counters counters_{}, last_{};
    std::uint64_t analyses_ = 0;
    std::vector<Bounded> bounded_;
    bool factored_ = false;
    std::vector<std::uint8_t> factored_free_, offends_;  // per bounded row
    double tolerance_ = 0.0;                             // of this solve
    double speed_ = 0.0, force_ = 0.0;                   // the scales of this system, m/s and N s
    std::vector<double> right_, state_, residual_, solution_, direction_, image_, gradient_;
    std::vector<Relieved> relieved_;
    MassFactors mass_;
    std::vector<Vec6> free_velocity_;  // M⁻¹ p
};

/// What the solves before tell the next one: a run that goes back must take it along. Pivoting that failed is asked again
/// after 1, 2, 4, … and at most 16 other solves.
struct RetryBackoff {
    int wait = 0;      // solves until it is asked again
    int failures = 0;  // of it in a row

    /// Whether this solve is to do without.
    bool waits() noexcept {
        if (wait == 0) return false;
        --wait;
        return true;
    }
    void failed() noexcept {
        wait = failures < 4 ? 1 << failures : 16;
        ++failures;
    }
    void succeeded() noexcept { failures = 0; }
};

/// Gives a solver back the limit of rounds it had.
class RoundLimitKept {
public:
    explicit RoundLimitKept(PivotSolver& solver) : solver_(solver), limit_(solver.round_limit) {}
    RoundLimitKept(const RoundLimitKept&) = delete;
    RoundLimitKept& operator=(const RoundLimitKept&) = delete;
    ~RoundLimitKept() { solver_.round_limit = limit_; }

private:
    PivotSolver& solver_;
    int limit_;
};

}  // namespace spook

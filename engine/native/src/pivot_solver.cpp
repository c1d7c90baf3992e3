#include "pivot_solver.hpp"

#include <algorithm>
#include <cmath>

#include "friction_sweeps.hpp"

namespace spook {

namespace {

constexpr int patience = 5;          // rounds without fewer offenders before Murty's rule
constexpr int max_restarts = 7;      // then Murty's rule
constexpr double tightest = 1e-11;   // tolerance of a velocity, relative to the system's scale
constexpr double loosest = 1e-7;     // where contradicting rigid contacts leave no exact answer

bool bilateral(const RowBlock& block, int i) noexcept { return block.lower[i] == -unbounded && block.upper[i] == unbounded; }
bool is_free(const RowBlock& block, int i) noexcept { return block.state[i] == RowState::free; }

}  // namespace

Mat6 cholesky(const Mat6& m) noexcept {
    Mat6 l{};
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j <= i; ++j) {
            double sum = m[6 * i + j];
            for (int k = 0; k < j; ++k) sum -= l[6 * i + k] * l[6 * j + k];
            l[6 * i + j] = i == j ? std::sqrt(sum) : sum / l[6 * j + j];
        }
    return l;
}

void cholesky_solve(const Mat6& l, Vec6& x) noexcept {
    for (int i = 0; i < 6; ++i) {
        for (int k = 0; k < i; ++k) x[i] -= l[6 * i + k] * x[k];
        x[i] /= l[6 * i + i];
    }
    for (int i = 5; i >= 0; --i) {
        for (int k = i + 1; k < 6; ++k) x[i] -= l[6 * k + i] * x[k];
        x[i] /= l[6 * i + i];
    }
}

bool PivotSolver::analyse(const MixedSystem& system) {
    const int bodies = static_cast<int>(system.mass.size());
    std::vector<Pattern> pattern(system.rows.size());
    for (std::size_t k = 0; k < pattern.size(); ++k)
        pattern[k] = {system.rows[k].first, system.rows[k].second, system.rows[k].size};
    if (bodies == bodies_ && pattern == pattern_) return false;

    std::vector<int> sizes(bodies, 6);
    std::vector<std::uint8_t> is_constraint(bodies, 0);
    std::vector<BlockEdge> edges;
    first_edge_.assign(pattern.size(), -1);
    second_edge_.assign(pattern.size(), -1);
    row_start_.assign(1, 0);
    for (std::size_t k = 0; k < pattern.size(); ++k) {
        const int block = bodies + static_cast<int>(k);
        sizes.push_back(pattern[k].size);
        is_constraint.push_back(1);
        row_start_.push_back(row_start_.back() + pattern[k].size);
        if (pattern[k].first >= 0) first_edge_[k] = static_cast<int>(edges.size()), edges.push_back({pattern[k].first, block});
        if (pattern[k].second >= 0) second_edge_[k] = static_cast<int>(edges.size()), edges.push_back({pattern[k].second, block});
    }
    matrix_.analyse(sizes, edges, is_constraint);
    ++analyses_;
    last_ = {};
    bodies_ = bodies;
    pattern_ = std::move(pattern);
    factored_free_.clear();
    solution_.assign(matrix_.unknowns(), 0.0);
    residual_.assign(matrix_.unknowns(), 0.0);
    own_.assign(row_start_.back(), 0.0);
    offends_.assign(row_start_.back(), 0);
    return true;
}

void PivotSolver::measure(const MixedSystem& system) {
    mass_factor_.resize(system.mass.size());
    free_velocity_.resize(system.mass.size());
    for (std::size_t b = 0; b < system.mass.size(); ++b) {
        mass_factor_[b] = cholesky(system.mass[b]);
        free_velocity_[b] = system.momentum[b];
        cholesky_solve(mass_factor_[b], free_velocity_[b]);
    }
    speed_ = 0.0;
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        for (int i = 0; i < block.size; ++i) {
            double own = 0.0;
            for (const auto& [body, jacobian] : {std::pair{block.first, &block.first_jacobian[i]}, std::pair{block.second, &block.second_jacobian[i]}}) {
                if (body < 0) continue;
                Vec6 x = *jacobian;
                cholesky_solve(mass_factor_[body], x);
                own += dot(*jacobian, x);
            }
            own_[row_start_[k] + i] = own;
            speed_ = std::max(speed_, std::abs(block.right[i]) + std::abs(row_velocity(block, i, free_velocity_)));
        }
    }
}

bool PivotSolver::factor(const MixedSystem& system) {
    for (int b = 0; b < bodies_; ++b) std::copy_n(system.mass[b].data(), 36, matrix_.diagonal(b));
    factored_free_.resize(row_start_.back());
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        const int n = block.size;
        double* diagonal = matrix_.diagonal(bodies_ + static_cast<int>(k));
        std::fill_n(diagonal, n * n, 0.0);
        for (int i = 0; i < n; ++i) {
            const bool free = is_free(block, i);
            const double relieved = bilateral(block, i) ? 0.0 : relief * own_[row_start_[k] + i];
            diagonal[i * n + i] = free ? -(block.softness[i] + relieved) : -1.0;
            factored_free_[row_start_[k] + i] = free;
        }
        for (const auto& [edge, jacobian] : {std::pair{first_edge_[k], &block.first_jacobian}, std::pair{second_edge_[k], &block.second_jacobian}}) {
            if (edge < 0) continue;
            double* coupling = matrix_.coupling(edge);
            for (int a = 0; a < 6; ++a)
                for (int i = 0; i < n; ++i) coupling[a * n + i] = is_free(block, i) ? (*jacobian)[i][a] : 0.0;
        }
    }
    return matrix_.factor(floor);
}

/// residual_ ← right side − true matrix × (velocity, multipliers); the largest entry relative to its scale.
double PivotSolver::residual(const MixedSystem& system) {
    double largest = 0.0, force = 0.0;
    for (int b = 0; b < bodies_; ++b)
        for (int a = 0; a < 6; ++a) {
            double sum = system.momentum[b][a];
            for (int c = 0; c < 6; ++c) sum -= system.mass[b][6 * a + c] * system.velocity[b][c];
            residual_[6 * b + a] = sum;
            force = std::max(force, std::abs(system.momentum[b][a]));
        }
    double slip = 0.0;
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        double* r = residual_.data() + matrix_.offset(bodies_ + static_cast<int>(k));
        for (int i = 0; i < block.size; ++i) {
            const double z = block.multiplier[i];
            for (int a = 0; a < 6; ++a) {
                if (block.first >= 0) residual_[6 * block.first + a] += block.first_jacobian[i][a] * z;
                if (block.second >= 0) residual_[6 * block.second + a] += block.second_jacobian[i][a] * z;
            }
            r[i] = is_free(block, i) ? -row_residual(block, i, system.velocity) : 0.0;
            slip = std::max(slip, std::abs(r[i]));
        }
    }
    for (int i = 0; i < 6 * bodies_; ++i) largest = std::max(largest, std::abs(residual_[i]));
    return std::max(force > 0.0 ? largest / force : largest, speed_ > 0.0 ? slip / speed_ : slip);
}

void PivotSolver::correct(MixedSystem& system, const std::vector<double>& direction, double length) {
    for (int b = 0; b < bodies_; ++b)
        for (int a = 0; a < 6; ++a) system.velocity[b][a] += length * direction[6 * b + a];
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        RowBlock& block = system.rows[k];
        const double* y = direction.data() + matrix_.offset(bodies_ + static_cast<int>(k));
        for (int i = 0; i < block.size; ++i)
            if (is_free(block, i)) block.multiplier[i] -= length * y[i];  // the unknown is −z
    }
}

double PivotSolver::refine(MixedSystem& system, int rounds) {
    double before = unbounded, now = residual(system);
    for (int round = 0; round < rounds && now > 1e-16 && now < 0.25 * before; ++round) {
        before = now;
        solution_ = residual_;
        matrix_.solve(solution_.data());
        correct(system, solution_, 1.0);
        now = residual(system);
    }
    return now;
}

void PivotSolver::solve_free(MixedSystem& system, bool refined) {
    // Start from zero velocities and free multipliers, the bound ones in place: the first residual is the right side.
    for (Vec6& v : system.velocity) v.fill(0.0);
    for (RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i)
            block.multiplier[i] = is_free(block, i) ? 0.0 : block.state[i] == RowState::at_lower ? block.lower[i] : block.upper[i];
    refine(system, refined ? 3 : 1);
    if (refined && conjugate_directions(system)) refine(system, 2);
}

/// Takes the relief out of the solution. In the multipliers of relieved rows, all else eliminated, the true equations
/// read S z = b and the factor solves with P = S + relief: conjugate gradients with P as preconditioner need one
/// solve per round and about as many rounds as S has eigenvalues below the relief (a heavy body on a light one).
bool PivotSolver::conjugate_directions(MixedSystem& system) {
    relieved_.clear();
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        const int offset = matrix_.offset(bodies_ + static_cast<int>(k));
        for (int i = 0; i < block.size; ++i)
            if (is_free(block, i) && !bilateral(block, i)) relieved_.push_back({offset + i, relief * own_[row_start_[k] + i]});
    }
    auto only_relieved = [&] {  // the rest is rounding; directions are scaled, so leave it to refine()
        solution_.assign(residual_.size(), 0.0);
        double largest = 0.0;
        for (const Relieved& row : relieved_) {
            solution_[row.at] = residual_[row.at];
            largest = std::max(largest, std::abs(residual_[row.at]));
        }
        return largest;
    };
    double residual_before = only_relieved(), product_before = 0.0;
    const double small = 1e-15 * speed_;
    int round = 0, stalled = 0;
    for (; round < max_directions && residual_before > small && stalled < 8; ++round) {
        gradient_.resize(relieved_.size());
        for (std::size_t k = 0; k < relieved_.size(); ++k) gradient_[k] = residual_[relieved_[k].at];
        matrix_.solve(solution_.data());
        double product = 0.0;
        for (std::size_t k = 0; k < relieved_.size(); ++k) product -= gradient_[k] * solution_[relieved_[k].at];
        if (!(product > 0.0)) break;
        const double turn = round == 0 ? 0.0 : product / product_before;
        if (round == 0) {
            direction_ = solution_;
            image_ = gradient_;
        } else {
            for (std::size_t i = 0; i < direction_.size(); ++i) direction_[i] = solution_[i] + turn * direction_[i];
            for (std::size_t k = 0; k < relieved_.size(); ++k) image_[k] = gradient_[k] + turn * image_[k];
        }
        double curvature = 0.0;  // pᵀ S p, with S p = P p − relief p
        for (std::size_t k = 0; k < relieved_.size(); ++k) {
            const double p = -direction_[relieved_[k].at];
            curvature += p * (image_[k] - relieved_[k].relief * p);
        }
        if (!(curvature > 1e-14 * product)) break;  // a direction of equal solutions: nothing to gain
        correct(system, direction_, product / curvature);
        residual(system);
        const double now = only_relieved();
        stalled = now < 0.5 * residual_before ? 0 : stalled + 1;
        residual_before = now;
        product_before = product;
    }
    return round > 0;
}

void PivotSolver::guess_by_sweeps(MixedSystem& system, int sweeps) {
    for (RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i) block.multiplier[i] = std::clamp(block.multiplier[i], block.lower[i], block.upper[i]);
    std::vector<FrictionPoint> none;
    solve_iterative(system, none, FrictionModel::cone, sweeps, 0.0);
    for (RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i) {
            if (bilateral(block, i) || block.lower[i] == block.upper[i]) continue;
            block.state[i] = block.multiplier[i] <= block.lower[i]   ? RowState::at_lower
                             : block.multiplier[i] >= block.upper[i] ? RowState::at_upper
                                                                     : RowState::free;
        }
}

int PivotSolver::offenders(const MixedSystem& system, bool mark_all) {
    const double slip = tolerance_ * speed_;
    int count = 0, last = -1;
    std::fill(offends_.begin(), offends_.end(), 0);
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        for (int i = 0; i < block.size; ++i) {
            if (bilateral(block, i) || block.lower[i] == block.upper[i]) continue;
            const int row = row_start_[k] + i;
            bool offends;
            if (is_free(block, i)) {
                const double slack = slip / (own_[row] + block.softness[i]);
                offends = block.multiplier[i] < block.lower[i] - slack || block.multiplier[i] > block.upper[i] + slack;
            } else {
                const double w = row_residual(block, i, system.velocity);
                offends = block.state[i] == RowState::at_lower ? w < -slip : w > slip;
            }
            if (!offends) continue;
            ++count;
            last = row;
            if (mark_all) offends_[row] = 1;
        }
    }
    if (!mark_all && last >= 0) offends_[last] = 1;
    return count;
}

PivotReport PivotSolver::solve(MixedSystem& system, bool same_matrix) {
    PivotReport report;
    report.converged = false;
    tolerance_ = tightest;
    system.velocity.resize(system.mass.size());
    if (analyse(system)) same_matrix = false;
    measure(system);

    int bounded = 0;
    for (RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i) {
            if (bilateral(block, i)) block.state[i] = RowState::free;
            else if (block.lower[i] == block.upper[i]) block.state[i] = RowState::at_lower;
            else if (block.state[i] == RowState::at_lower && block.lower[i] == -unbounded) block.state[i] = RowState::free;
            else if (block.state[i] == RowState::at_upper && block.upper[i] == unbounded) block.state[i] = RowState::free;
            bounded += !bilateral(block, i) && block.lower[i] != block.upper[i];
        }

    // After so many rounds the singular problem may be cycling: decide then on the relieved matrix, a P-matrix.
    const int refined_rounds = 50 + 4 * bounded;
    const int last_round = std::min(round_limit, refined_rounds + 50 + 8 * bounded);
    int best = 1 << 30, left = patience;
    for (int round = 0; round < last_round; ++round) {
        bool stale = !same_matrix || factored_free_.empty();
        for (std::size_t k = 0; k < system.rows.size() && !stale; ++k)
            for (int i = 0; i < system.rows[k].size; ++i)
                stale = stale || is_free(system.rows[k], i) != static_cast<bool>(factored_free_[row_start_[k] + i]);
        if (stale && !factor(system)) {
            report.finite = false;
            factored_free_.clear();
            break;
        }
        same_matrix = true;
        const bool refined = round < refined_rounds;
        solve_free(system, refined);
        ++report.rounds;

        int count = offenders(system, true);
        if (count == 0 && !refined) solve_free(system, true);
        if (count == 0) {
            report.converged = true;
            break;
        }
        if (count < best && refined) best = count, left = patience;
        else if (left > 0) --left;
        if (left == 0 && report.restarts < max_restarts) {
            tolerance_ = std::min(10.0 * tolerance_, loosest);
            if (report.restarts > 1) guess_by_sweeps(system, 5 << report.restarts);
            ++report.restarts;
            best = 1 << 30, left = patience;
            if (report.restarts > 2) continue;
        }
        const bool all = left > 0 && refined;
        if (!all) offenders(system, false);
        for (std::size_t k = 0; k < system.rows.size(); ++k) {
            RowBlock& block = system.rows[k];
            for (int i = 0; i < block.size; ++i) {
                if (!offends_[row_start_[k] + i]) continue;
                ++report.flips;
                if (!is_free(block, i)) block.state[i] = RowState::free;
                else block.state[i] = block.multiplier[i] < block.lower[i] ? RowState::at_lower : RowState::at_upper;
            }
        }
    }
    const BlockLdlt::Counters now = matrix_.counters();
    counters_.factorisations += now.factorisations - last_.factorisations;
    counters_.block_operations += now.block_operations - last_.block_operations;
    counters_.floored_pivots += now.floored_pivots - last_.floored_pivots;
    counters_.solves += now.solves - last_.solves;
    last_ = now;
    return report;
}

}  // namespace spook

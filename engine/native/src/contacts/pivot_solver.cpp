#include "contacts/pivot_solver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "contacts/friction_pgs.hpp"
#include "contacts/tolerances.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

using namespace tolerances::pivot_solver;

bool bilateral(const RowBlock& block, int i) noexcept {
    return block.lower[i] == -unbounded && block.upper[i] == unbounded;
}
bool is_free(const RowBlock& block, int i) noexcept { return block.state[i] == RowState::free; }

}  // namespace

/// Whether the system's blocks tie the bodies they tied when it was analysed.
bool PivotSolver::Graph::is_of(const MixedSystem& system) const noexcept {
    if (static_cast<int>(system.mass.size()) != bodies || system.rows.size() != pattern.size()) return false;
    std::size_t beyond = 0;
    for (std::size_t k = 0; k < pattern.size(); ++k) {
        const RowBlock& block = system.rows[k];
        if (pattern[k] != Pattern{block.first, block.second, block.size}) return false;
        for (const FurtherBody& other : block.further) {
            if (beyond == further.size() || further[beyond] != static_cast<int>(k) ||
                further[beyond + 1] != other.body)
                return false;
            beyond += 2;
        }
    }
    return beyond == further.size();
}

bool PivotSolver::analyse(const MixedSystem& system) {
    if (graph_.is_of(system)) return false;
    const auto known =
        std::find_if(others_.begin(), others_.end(), [&](const Graph& graph) { return graph.is_of(system); });
    if (known != others_.end()) {
        std::swap(graph_, *known);
        std::rotate(others_.begin(), known, known + 1);
    } else {
        if (graph_.bodies >= 0 && graph_.pattern.size() <= most_kept_rows) {
            if (others_.size() < kept_graphs) others_.emplace_back();
            std::rotate(others_.begin(), others_.end() - 1, others_.end());
            std::swap(graph_, others_.front());
        }
        find_graph(system);
        ++analyses_;
    }
    graph_.matrix.clear_counters();
    last_ = {};
    factored_ = false;
    for (auto* each : {&solution_, &residual_, &state_, &right_}) each->assign(graph_.matrix.unknowns(), 0.0);
    return true;
}

void PivotSolver::find_graph(const MixedSystem& system) {
    static thread_local struct {  // its memory outlives an analysis
        std::vector<int> sizes;
        std::vector<std::uint8_t> is_constraint;
        std::vector<BlockEdge> edges;
    } found;
    auto& [sizes, is_constraint, edges] = found;
    auto& [matrix, bodies, pattern, first_edge, second_edge, further, further_edge] = graph_;
    bodies = -1;  // until the analysis is whole
    const int count = static_cast<int>(system.mass.size());
    pattern.clear();
    further.clear();
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        pattern.push_back({block.first, block.second, block.size});
        for (const FurtherBody& other : block.further)
            further.push_back(static_cast<int>(k)), further.push_back(other.body);
    }
    sizes.assign(count, 6);
    is_constraint.assign(count, 0);
    edges.clear();
    first_edge.assign(pattern.size(), -1);
    second_edge.assign(pattern.size(), -1);
    for (std::size_t k = 0; k < pattern.size(); ++k) {
        const int block = count + static_cast<int>(k);
        sizes.push_back(pattern[k].size);
        is_constraint.push_back(1);
        if (pattern[k].first >= 0)
            first_edge[k] = static_cast<int>(edges.size()), edges.push_back({pattern[k].first, block});
        if (pattern[k].second >= 0)
            second_edge[k] = static_cast<int>(edges.size()), edges.push_back({pattern[k].second, block});
    }
    further_edge.clear();
    for (std::size_t k = 0; k < further.size(); k += 2) {
        further_edge.push_back(static_cast<int>(edges.size()));
        edges.push_back({further[k + 1], count + further[k]});
    }
    matrix.analyse(sizes, edges, is_constraint);
    bodies = count;
}

void PivotSolver::measure(const MixedSystem& system) {
    mass_.find(system.mass);
    free_velocity_.resize(system.mass.size());
    for (std::size_t b = 0; b < system.mass.size(); ++b) {
        free_velocity_[b] = system.momentum[b];
        solve_six(mass_[b], free_velocity_[b]);
    }
    speed_ = 0.0;
    bounded_.clear();
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        double first[6] = {}, second[6] = {};
        bool known = false;
        for (int i = 0; i < block.size; ++i) {
            speed_ =
                std::max(speed_, std::abs(block.right[i]) + std::abs(row_velocity(block, i, free_velocity_)));
            if (bilateral(block, i)) continue;
            if (!std::exchange(known, true)) {
                if (block.first >= 0)
                    own_inertias(mass_[block.first], block.first_jacobian.data(), block.size, first);
                if (block.second >= 0)
                    own_inertias(mass_[block.second], block.second_jacobian.data(), block.size, second);
            }
            double own = 0.0;
            if (block.first >= 0) own += first[i];
            if (block.second >= 0) own += second[i];
            for (const FurtherBody& other : block.further) {
                Vec6 x = other.jacobian;
                solve_six(mass_[other.body], x);
                own += dot(other.jacobian, x);
            }
            bounded_.push_back({static_cast<int>(k), i, own});
        }
    }
}

bool PivotSolver::factor(const MixedSystem& system) {
    for (int b = 0; b < graph_.bodies; ++b) std::copy_n(system.mass[b].data(), 36, graph_.matrix.diagonal(b));
    std::size_t beyond = 0;
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        const int n = block.size;
        double* diagonal = graph_.matrix.diagonal(graph_.bodies + static_cast<int>(k));
        std::fill_n(diagonal, n * n, 0.0);
        for (int i = 0; i < n; ++i) diagonal[i * n + i] = is_free(block, i) ? -block.softness[i] : -1.0;
        for (int end = 0; end < 2; ++end) {
            const int edge = end == 0 ? graph_.first_edge[k] : graph_.second_edge[k];
            if (edge < 0) continue;
            const auto& jacobian = end == 0 ? block.first_jacobian : block.second_jacobian;
            double* coupling = graph_.matrix.coupling(edge);
            for (int a = 0; a < 6; ++a)
                for (int i = 0; i < n; ++i) coupling[a * n + i] = is_free(block, i) ? jacobian[i][a] : 0.0;
        }
        for (const FurtherBody& other : block.further) {
            double* coupling = graph_.matrix.coupling(graph_.further_edge[beyond++]);
            for (int a = 0; a < 6; ++a) coupling[a] = is_free(block, 0) ? other.jacobian[a] : 0.0;
        }
    }
    factored_free_.resize(bounded_.size());
    for (std::size_t b = 0; b < bounded_.size(); ++b) {
        const auto [k, i, own] = bounded_[b];
        const bool free = is_free(system.rows[k], i);
        factored_free_[b] = free;
        if (free) graph_.matrix.diagonal(graph_.bodies + k)[i * system.rows[k].size + i] -= relief * own;
    }
    const bool finite = graph_.matrix.factor(floor);
    for (const auto& [k, i, own] :
         bounded_)  // the factor keeps its relief; residuals are of the true equations
        if (is_free(system.rows[k], i))
            graph_.matrix.diagonal(graph_.bodies + k)[i * system.rows[k].size + i] =
                -system.rows[k].softness[i];
    return finite;
}

/// residual_ ← right side − true matrix × state_; the largest entry relative to its scale.
double PivotSolver::residual() {
    graph_.matrix.residual(right_.data(), state_.data(), residual_.data());
    double force = 0.0, slip = 0.0;
    for (int i = 0; i < 6 * graph_.bodies; ++i) force = std::max(force, std::abs(residual_[i]));
    for (int i = 6 * graph_.bodies; i < graph_.matrix.unknowns(); ++i)
        slip = std::max(slip, std::abs(residual_[i]));
    return std::max(force_ > 0.0 ? force / force_ : force, speed_ > 0.0 ? slip / speed_ : slip);
}

double PivotSolver::refine(int rounds) {
    double before = unbounded, now = residual();
    for (int round = 0; round < rounds && now > 1e-16 && now < 0.25 * before; ++round) {
        before = now;
        graph_.matrix.solve(residual_.data());
        for (int i = 0; i < graph_.matrix.unknowns(); ++i) state_[i] += residual_[i];
        now = residual();
    }
    return now;
}

void PivotSolver::solve_free(MixedSystem& system, bool refined) {
    force_ = 0.0;
    for (int b = 0; b < graph_.bodies; ++b)
        for (int a = 0; a < 6; ++a) {
            right_[6 * b + a] = system.momentum[b][a];
            force_ = std::max(force_, std::abs(system.momentum[b][a]));
        }
    for (std::size_t k = 0; k < system.rows.size(); ++k)
        std::copy_n(system.rows[k].right.data(), system.rows[k].size,
                    right_.data() + graph_.matrix.offset(graph_.bodies + static_cast<int>(k)));
    relieved_.clear();
    for (const auto& [k, i, own] : bounded_) {
        RowBlock& block = system.rows[k];
        const int at = graph_.matrix.offset(graph_.bodies + k) + i;
        if (is_free(block, i)) {
            relieved_.push_back({at, relief * own});
            continue;
        }
        const double z = block.state[i] == RowState::at_lower ? block.lower[i] : block.upper[i];
        right_[at] = z;
        if (z == 0.0) continue;
        for (int a = 0; a < 6; ++a) {
            if (block.first >= 0) right_[6 * block.first + a] += block.first_jacobian[i][a] * z;
            if (block.second >= 0) right_[6 * block.second + a] += block.second_jacobian[i][a] * z;
            for (const FurtherBody& other : block.further)
                right_[6 * other.body + a] += other.jacobian[a] * z;
        }
    }
    state_ = right_;
    graph_.matrix.solve(state_.data());
    if (refined) {
        refine(refinements + 1);
        if (conjugate_directions()) refine(refinements + 1);
    }
    for (int b = 0; b < graph_.bodies; ++b) std::copy_n(state_.data() + 6 * b, 6, system.velocity[b].data());
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const double* y = state_.data() + graph_.matrix.offset(graph_.bodies + static_cast<int>(k));
        for (int i = 0; i < system.rows[k].size; ++i) system.rows[k].multiplier[i] = -y[i];
    }
    for (const auto& [k, i, own] : bounded_) {
        RowBlock& block = system.rows[k];
        if (!is_free(block, i))
            block.multiplier[i] = block.state[i] == RowState::at_lower ? block.lower[i] : block.upper[i];
    }
}

/// Takes the relief out of the solution. In the multipliers of relieved rows, all else eliminated, the true equations
/// read S z = b and the factor solves with P = S + relief: conjugate gradients with P as preconditioner need one
/// solve per round and about as many rounds as S has eigenvalues below the relief (a heavy body on a light one).
bool PivotSolver::conjugate_directions() {
    const auto only_relieved =
        [this] {  // the rest is rounding; directions are scaled, so leave it to refine()
            gradient_.resize(relieved_.size());
            double largest = 0.0;
            for (std::size_t k = 0; k < relieved_.size(); ++k) {
                gradient_[k] = residual_[relieved_[k].at];
                largest = std::max(largest, std::abs(gradient_[k]));
            }
            return largest;
        };
    residual();
    double before = only_relieved(), product_before = 0.0;
    const double small = 1e-15 * speed_;
    int round = 0, stalled = 0;
    for (; round < max_directions && before > small && stalled < 8; ++round) {
        Watch::look();
        solution_.assign(residual_.size(), 0.0);
        for (std::size_t k = 0; k < relieved_.size(); ++k) solution_[relieved_[k].at] = gradient_[k];
        graph_.matrix.solve(solution_.data());
        double product = 0.0;
        for (std::size_t k = 0; k < relieved_.size(); ++k)
            product -= gradient_[k] * solution_[relieved_[k].at];
        if (!(product > 0.0)) break;
        if (round == 0) {
            direction_ = solution_;
            image_ = gradient_;
        } else {
            const double turn = product / product_before;
            for (std::size_t i = 0; i < direction_.size(); ++i)
                direction_[i] = solution_[i] + turn * direction_[i];
            for (std::size_t k = 0; k < relieved_.size(); ++k) image_[k] = gradient_[k] + turn * image_[k];
        }
        double curvature = 0.0;  // pᵀ S p, with S p = P p − relief p
        for (std::size_t k = 0; k < relieved_.size(); ++k) {
            const double p = -direction_[relieved_[k].at];
            curvature += p * (image_[k] - relieved_[k].relief * p);
        }
        if (!(curvature > 1e-14 * product)) break;  // a direction of equal solutions: nothing to gain
        const double length = product / curvature;
        for (std::size_t i = 0; i < state_.size(); ++i) state_[i] += length * direction_[i];
        residual();
        const double now = only_relieved();
        stalled = now < 0.5 * before ? 0 : stalled + 1;
        before = now;
        product_before = product;
    }
    return round > 0;
}

void PivotSolver::guess_by_pgs(MixedSystem& system, int iterations) {
    for (RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i)
            block.multiplier[i] = std::clamp(block.multiplier[i], block.lower[i], block.upper[i]);
    std::vector<FrictionPoint> none;
    solve_iterative(system, none, FrictionModel::cone, iterations, 0.0);
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
    offends_.assign(bounded_.size(), 0);
    for (std::size_t b = 0; b < bounded_.size(); ++b) {
        const auto& [k, i, own] = bounded_[b];
        const RowBlock& block = system.rows[k];
        if (block.lower[i] == block.upper[i]) continue;
        bool offends;
        if (is_free(block, i)) {
            const double slack = slip / (own + block.softness[i]);
            offends =
                block.multiplier[i] < block.lower[i] - slack || block.multiplier[i] > block.upper[i] + slack;
        } else {
            const double w = row_residual(block, i, system.velocity);
            offends = block.state[i] == RowState::at_lower ? w < -slip : w > slip;
        }
        if (!offends) continue;
        ++count;
        last = static_cast<int>(b);
        if (mark_all) offends_[b] = 1;
    }
    if (!mark_all && last >= 0) offends_[last] = 1;
    return count;
}

/// Frees rigid rows that rest at zero without need: four corners on three is one answer of many, and rounding would
/// choose. With them free, the relief finds the one of least norm.
int PivotSolver::free_degenerate_rows(MixedSystem& system) {
    int count = 0;
    for (const auto& [k, i, own] : bounded_) {
        RowBlock& block = system.rows[k];
        if (block.state[i] != RowState::at_lower || block.lower[i] != 0.0 || block.upper[i] != unbounded)
            continue;
        if (block.softness[i] > 0.0) continue;
        if (std::abs(row_residual(block, i, system.velocity)) > tightest * speed_) continue;
        block.state[i] = RowState::free;
        ++count;
    }
    return count;
}

/// The states that bounds allow; how many rows have a choice.
int PivotSolver::begin_states(MixedSystem& system) const {
    int bounded = 0;
    for (RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i)
            if (bilateral(block, i)) block.state[i] = RowState::free;
    for (const auto& [k, i, own] : bounded_) {
        RowBlock& block = system.rows[k];
        const RowState state = block.state[i];
        if (block.lower[i] == block.upper[i]) block.state[i] = RowState::at_lower;
        else if (state == RowState::at_lower && block.lower[i] == -unbounded) block.state[i] = RowState::free;
        else if (state == RowState::at_upper && block.upper[i] == unbounded) block.state[i] = RowState::free;
        bounded += block.lower[i] != block.upper[i];
    }
    return bounded;
}

/// Whether other rows are free than when the matrix was factored.
bool PivotSolver::is_stale(const MixedSystem& system) const {
    for (std::size_t b = 0; b < bounded_.size(); ++b)
        if (is_free(system.rows[bounded_[b].block], bounded_[b].row) != static_cast<bool>(factored_free_[b]))
            return true;
    return false;
}

int PivotSolver::flip_offenders(MixedSystem& system) const {
    int flips = 0;
    for (std::size_t b = 0; b < bounded_.size(); ++b) {
        if (!offends_[b]) continue;
        const auto& [k, i, own] = bounded_[b];
        RowBlock& block = system.rows[k];
        ++flips;
        if (!is_free(block, i)) block.state[i] = RowState::free;
        else block.state[i] = block.multiplier[i] < block.lower[i] ? RowState::at_lower : RowState::at_upper;
    }
    return flips;
}

void PivotSolver::count_work() {
    const BlockLdlt::Counters now = graph_.matrix.counters();
    counters_.factorisations += now.factorisations - last_.factorisations;
    counters_.block_operations += now.block_operations - last_.block_operations;
    counters_.floored_pivots += now.floored_pivots - last_.floored_pivots;
    counters_.solves += now.solves - last_.solves;
    last_ = now;
}

/// With less asked, and after the first two times from another guess.
void PivotSolver::begin_again(MixedSystem& system, int restarts) {
    tolerance_ = std::min(10.0 * tolerance_, loosest);
    if (restarts > 1) guess_by_pgs(system, 5 << restarts);
}

PivotReport PivotSolver::solve(MixedSystem& system, bool same_matrix) {
    PivotReport report;
    report.converged = false;
    system.velocity.resize(system.mass.size());
    if (analyse(system)) same_matrix = false;
    tolerance_ = tightest;
    if (!same_matrix) measure(system);

    const int bounded = begin_states(system);
    // After so many rounds the singular problem may be cycling: decide then on the relieved matrix, a P-matrix.
    const int refined_rounds = 50 + 4 * bounded;
    const int last_round = std::min(round_limit, refined_rounds + 50 + 8 * bounded);
    int best = 1 << 30, left = backoff;
    bool tied = false;  // whether ties were freed
    for (int round = 0; round < last_round; ++round) {
        Watch::look();
        if (!same_matrix || !factored_ || is_stale(system)) {
            factored_ = false;
            report.finite = factor(system);
        }
        if (!report.finite) break;
        factored_ = same_matrix = true;
        const bool refined = round < refined_rounds;
        solve_free(system, refined);
        ++report.rounds;

        int count = offenders(system, true);
        if (count == 0 && !refined) {  // without the relief some may have no answer: then with it
            solve_free(system, true);
            if (offenders(system, true) > 0) solve_free(system, false);
        }
        if (count == 0) {
            report.converged = true;
            if (tied || free_degenerate_rows(system) == 0) break;
            tied = true;
            report.converged = false;
            continue;
        }
        if (round == 0 && round_limit <= short_search && count > few_offenders + bounded / offending_share)
            break;
        if (count < best && refined) best = count, left = backoff;
        else if (left > 0) --left;
        if (left == 0 && report.restarts < max_restarts) {
            begin_again(system, report.restarts++);
            best = 1 << 30, left = backoff;
            if (report.restarts > 2) continue;
        }
        const bool all = left > 0 && refined;
        if (!all) offenders(system, false);
        report.flips += flip_offenders(system);
    }
    count_work();
    return report;
}

}  // namespace spook

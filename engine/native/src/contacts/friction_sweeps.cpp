#include "contacts/friction_sweeps.hpp"

#include <algorithm>
#include <cmath>

#include "linear/elementary.hpp"

namespace spook {

namespace {

/// What one block needs in every sweep: M⁻¹ Gᵀ, and S = G M⁻¹ Gᵀ + Sig.
struct PreparedBlock {
    std::array<Vec6, 6> first, second;  // M⁻¹ Gᵀ, one per row
    Mat6 schur{};
    bool bilateral = true;
    int point = -1;                   // its friction point
    double step = 0.0;                // 1/lambda_max of the tangents' part
    std::array<double, 36> factor{};  // of schur, of a bilateral block
};

class Sweeper {
public:
    Sweeper(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model)
        : system_(system), points_(points), model_(model), blocks_(system.rows.size()) {
        for (std::size_t k = 0; k < points.size(); ++k) blocks_[points[k].block].point = static_cast<int>(k);
        std::vector<Mat6> mass_factor;
        mass_factor.reserve(system.mass.size());
        for (const Mat6& mass : system.mass) mass_factor.push_back(factor_six(mass));
        for (std::size_t k = 0; k < blocks_.size(); ++k) prepare(system.rows[k], blocks_[k], mass_factor);
        system.velocity = system.momentum;
        for (std::size_t b = 0; b < system.mass.size(); ++b) solve_six(mass_factor[b], system.velocity[b]);
        for (std::size_t k = 0; k < blocks_.size(); ++k)
            for (int i = 0; i < system.rows[k].size; ++i) push(k, i, system.rows[k].multiplier[i]);
    }

    /// One sweep; the largest change of a row, as a velocity. With `friction_only` all but tangents is held.
    double sweep(bool friction_only) {
        double change = 0.0;
        for (std::size_t k = 0; k < blocks_.size(); ++k) {
            const PreparedBlock& prepared = blocks_[k];
            if (prepared.point >= 0) {
                if (!friction_only) change = std::max(change, update_row(k, 0));
                change = std::max(change, update_tangents(k));
            } else if (!friction_only) {
                if (prepared.bilateral) change = std::max(change, update_block(k));
                else
                    for (int i = 0; i < system_.rows[k].size; ++i)
                        change = std::max(change, update_row(k, i));
            }
        }
        return change;
    }

    double normal_scale(int block) const noexcept { return blocks_[block].schur[0]; }

private:
    void prepare(RowBlock& block, PreparedBlock& prepared, const std::vector<Mat6>& mass_factor) {
        const int n = block.size;
        for (int i = 0; i < n; ++i) {
            prepared.first[i] = block.first_jacobian[i];
            prepared.second[i] = block.second_jacobian[i];
            if (block.first >= 0) solve_six(mass_factor[block.first], prepared.first[i]);
            if (block.second >= 0) solve_six(mass_factor[block.second], prepared.second[i]);
            prepared.bilateral =
                prepared.bilateral && block.lower[i] == -unbounded && block.upper[i] == unbounded;
        }
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) {
                double& s = prepared.schur[6 * i + j];
                if (block.first >= 0) s += dot(block.first_jacobian[i], prepared.first[j]);
                if (block.second >= 0) s += dot(block.second_jacobian[i], prepared.second[j]);
                if (i == j) s += block.softness[i];
            }
        for (int i = n; i < 6; ++i) prepared.schur[6 * i + i] = 1.0;
        if (prepared.point >= 0) {
            const double a = prepared.schur[7], b = prepared.schur[14], c = prepared.schur[8];
            prepared.step = 1.0 / (0.5 * (a + b) + length(0.5 * (a - b), c));
        } else if (prepared.bilateral) {
            // A body tied twice to the world makes no singular block; a rigid joint without inertia would.
            Mat6 guarded = prepared.schur;
            for (int i = 0; i < n; ++i) guarded[7 * i] *= 1.0 + 1e-12;
            prepared.factor = factor_six(guarded);
        }
    }

    void push(std::size_t k, int i, double impulse) noexcept {
        const RowBlock& block = system_.rows[k];
        const PreparedBlock& prepared = blocks_[k];
        for (int a = 0; a < 6; ++a) {
            if (block.first >= 0) system_.velocity[block.first][a] += prepared.first[i][a] * impulse;
            if (block.second >= 0) system_.velocity[block.second][a] += prepared.second[i][a] * impulse;
        }
    }

    double update_row(std::size_t k, int i) noexcept {
        RowBlock& block = system_.rows[k];
        const double own = blocks_[k].schur[7 * i], old = block.multiplier[i];
        if (!(own > 0.0)) return 0.0;
        block.multiplier[i] =
            std::clamp(old - row_residual(block, i, system_.velocity) / own, block.lower[i], block.upper[i]);
        push(k, i, block.multiplier[i] - old);
        return std::abs(block.multiplier[i] - old) * own;
    }

    double update_block(std::size_t k) noexcept {
        RowBlock& block = system_.rows[k];
        Vec6 change{};
        double largest = 0.0;
        for (int i = 0; i < block.size; ++i) {
            change[i] = -row_residual(block, i, system_.velocity);
            largest = std::max(largest, std::abs(change[i]));
        }
        solve_six(blocks_[k].factor, change);
        for (int i = 0; i < block.size; ++i) {
            block.multiplier[i] += change[i];
            push(k, i, change[i]);
        }
        return largest;
    }

    double update_tangents(std::size_t k) noexcept {
        RowBlock& block = system_.rows[k];
        const PreparedBlock& prepared = blocks_[k];
        const FrictionPoint& point = points_[prepared.point];
        if (model_ != FrictionModel::cone) {
            const double bound =
                point.coefficient *
                std::max(0.0, model_ == FrictionModel::box ? point.normal : block.multiplier[0]);
            double change = 0.0;
            for (int i = 1; i <= 2; ++i) {
                block.lower[i] = -bound;
                block.upper[i] = bound;
                change = std::max(change, update_row(k, i));
            }
            return change;
        }
        const double b1 = block.multiplier[1], b2 = block.multiplier[2];
        double d1 = b1 - prepared.step * row_residual(block, 1, system_.velocity);
        double d2 = b2 - prepared.step * row_residual(block, 2, system_.velocity);
        const double bound = point.coefficient * std::max(0.0, block.multiplier[0]), reach = length(d1, d2);
        if (reach > bound) d1 *= bound / reach, d2 *= bound / reach;
        block.multiplier[1] = d1;
        block.multiplier[2] = d2;
        push(k, 1, d1 - b1);
        push(k, 2, d2 - b2);
        return length(d1 - b1, d2 - b2) / prepared.step;
    }

    MixedSystem& system_;
    std::vector<FrictionPoint>& points_;
    FrictionModel model_;
    std::vector<PreparedBlock> blocks_;
};

/// The box bounds friction by the step before; where there was none, by the load of this step's first guess.
void guess_unknown_normals(const MixedSystem& system, std::vector<FrictionPoint>& points) {
    for (FrictionPoint& point : points)
        if (point.normal < 0.0) point.normal = system.rows[point.block].multiplier[0];
}

}  // namespace

FrictionReport solve_iterative(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                               int iterations, double tolerance) {
    FrictionReport report;
    guess_unknown_normals(system, points);
    Sweeper sweeper(system, points, model);
    report.residual = unbounded;
    while (report.sweeps < iterations && report.residual > tolerance) {
        report.residual = sweeper.sweep(false);
        ++report.sweeps;
    }
    if (system.rows.empty()) report.residual = 0.0;
    report.converged = report.residual <= tolerance;
    report.finite = !std::isnan(report.residual);
    for (FrictionPoint& point : points) point.normal = system.rows[point.block].multiplier[0];
    return report;
}

FrictionReport solve_hybrid(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                            PivotSolver& solver, int iterations, double tolerance) {
    FrictionReport report;
    bool same_matrix = false;
    for (int round = 0; round < iterations; ++round) {
        for (const FrictionPoint& point : points) {
            RowBlock& block = system.rows[point.block];
            for (int i = 1; i <= 2; ++i) block.lower[i] = block.upper[i] = block.multiplier[i];
        }
        const PivotReport pivots = solver.solve(system, same_matrix);
        same_matrix = true;
        ++report.rounds;
        report.pivots += pivots.flips;
        report.converged = pivots.converged;
        report.finite = pivots.finite;
        if (points.empty() || !pivots.finite) return report;
        guess_unknown_normals(system, points);

        Sweeper sweeper(system, points, model);
        double largest = 0.0, sweep = unbounded;
        for (int inner = 0; inner < iterations && sweep > 0.1 * tolerance; ++inner) {
            sweep = sweeper.sweep(true);
            if (inner == 0) largest = sweep;
            ++report.sweeps;
        }
        for (FrictionPoint& point : points) {
            const double normal = system.rows[point.block].multiplier[0];
            if (model != FrictionModel::box) point.normal = normal;
        }
        report.residual = largest;
        if (largest <= tolerance) return report;
    }
    report.converged = false;
    return report;
}

}  // namespace spook

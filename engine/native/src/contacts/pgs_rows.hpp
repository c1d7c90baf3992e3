// Rows laid out for iterating: what projected Gauss–Seidel reads, one behind the other.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "contacts/disc.hpp"
#include "contacts/friction_point.hpp"
#include "contacts/pgs_kernel.hpp"
#include "contacts/pivot_solver.hpp"
#include "linear/elementary.hpp"
#include "linear/large_array.hpp"

namespace spook {

/// The larger of two changes; what is not a number stays.
inline double larger(double a, double b) noexcept { return a >= b || std::isnan(a) ? a : b; }

/// One row as an iteration reads it: Jacobian of both ends, M⁻¹ Gᵀ, own inertia. An end that does not move is zero and
/// belongs to a spare body behind the others, so that no row needs a branch.
struct PgsRow {
    Vec6 first, second;            // G
    Vec6 first_push, second_push;  // M⁻¹ Gᵀ
    double diagonal = 0.0;         // (G M⁻¹ Gᵀ + Sig)ᵢᵢ
    double softness = 0.0, right = 0.0, lower = 0.0, upper = 0.0, multiplier = 0.0;
};

/// A body beyond the first two of a row.
struct PgsFurtherBody {
    int body = 0;
    Vec6 row, push;  // G, M⁻¹ Gᵀ
};

/// One block of rows, and what is solved together in it.
struct PgsBlock {
    enum class Kind : unsigned char { bilateral, bounded, contact } kind = Kind::bounded;
    int first = 0, second = 0;         // bodies
    int row = 0, size = 0;             // rows_[row] … rows_[row + size)
    int point = -1, end = -1;          // its friction points, one behind the other
    int factor = -1;                   // of a bilateral block, in factors_
    double step[3] = {0, 0, 0};        // of these: 1/lambda_max of their own part
    int further = 0, further_end = 0;  // of its one row, in further_
};

/// Lays a system out for iterating: rows one behind the other, velocities in one array. Memory is kept from use to
/// use, so that nothing is allocated once the largest system has been seen.
class PgsRows {
public:
    void prepare(MixedSystem& system, const std::vector<FrictionPoint>& points, FrictionModel model) {
        model_ = model;
        const std::size_t bodies = system.mass.size();
        mass_factor_.resize(bodies);
        bodies_.resize(bodies + 1);
        for (std::size_t b = 0; b < bodies; ++b) {
            mass_factor_[b] = factor_six(system.mass[b]);
            bodies_[b].velocity = system.momentum[b];
            solve_six(mass_factor_[b], bodies_[b].velocity);
        }
        bodies_[bodies] = {};
        rows_.clear();
        factors_.clear();
        further_.clear();
        blocks_.assign(system.rows.size(), {});
        for (std::size_t k = 0; k < points.size(); ++k) {
            PgsBlock& block = blocks_[points[k].block];
            if (block.point < 0) block.point = static_cast<int>(k);
            block.end = static_cast<int>(k) + 1;
        }
        for (std::size_t k = 0; k < blocks_.size(); ++k)
            add(system.rows[k], points, blocks_[k], static_cast<int>(bodies));
        for (const PgsBlock& block : blocks_)
            for (int i = 0; i < block.size; ++i)
                push(block, rows_[block.row + i], rows_[block.row + i].multiplier);
    }

    /// One iteration; the largest change of a row, as a velocity.
    double iterate(std::vector<FrictionPoint>& points) noexcept {
        double change = 0.0;
        for (const PgsBlock& block : blocks_) {
            if (block.kind == PgsBlock::Kind::contact) {
                change = larger(change, update_row(block, rows_[block.row]));
                for (int k = block.point; k < block.end; ++k)
                    change = larger(change, update_rubbing(block, points[k], block.step[k - block.point]));
            } else {
                change = larger(change, update_joint(block));
            }
        }
        return change;
    }

    /// The update of one block of a joint.
    double update_joint(std::size_t block) noexcept { return update_joint(blocks_[block]); }

    /// All bodies, and the spare one behind them, which stays at rest; their velocities, for whatever else iterates.
    LargeArray<PgsBody>& bodies() noexcept { return bodies_; }
    const LargeArray<PgsBody>& bodies() const noexcept { return bodies_; }
    void write_velocities(MixedSystem& system) const {
        system.velocity.resize(bodies_.size() - 1);
        for (std::size_t b = 0; b < system.velocity.size(); ++b) system.velocity[b] = bodies_[b].velocity;
    }

    void write(MixedSystem& system) const {
        write_velocities(system);
        for (std::size_t k = 0; k < blocks_.size(); ++k)
            for (int i = 0; i < blocks_[k].size; ++i) {
                const PgsRow& row = rows_[blocks_[k].row + i];
                system.rows[k].multiplier[i] = row.multiplier;
                system.rows[k].lower[i] = row.lower;
                system.rows[k].upper[i] = row.upper;
            }
    }

private:
    void add(const RowBlock& given, const std::vector<FrictionPoint>& points, PgsBlock& block, int spare) {
        block.first = given.first >= 0 ? given.first : spare;
        block.second = given.second >= 0 ? given.second : spare;
        block.row = static_cast<int>(rows_.size());
        block.size = given.size;
        bool bilateral = true;
        for (int i = 0; i < given.size; ++i) {
            PgsRow& row = rows_.emplace_back();
            if (given.first >= 0) {
                row.first = row.first_push = given.first_jacobian[i];
                solve_six(mass_factor_[given.first], row.first_push);
            }
            if (given.second >= 0) {
                row.second = row.second_push = given.second_jacobian[i];
                solve_six(mass_factor_[given.second], row.second_push);
            }
            row.softness = given.softness[i];
            row.right = given.right[i];
            row.lower = given.lower[i];
            row.upper = given.upper[i];
            row.multiplier = given.multiplier[i];
            row.diagonal = schur(row, row) + row.softness;
            block.further = static_cast<int>(further_.size());
            for (const FurtherBody& other : given.further) {
                PgsFurtherBody& far =
                    further_.emplace_back(PgsFurtherBody{other.body, other.jacobian, other.jacobian});
                solve_six(mass_factor_[other.body], far.push);
                row.diagonal += dot(far.row, far.push);
            }
            block.further_end = static_cast<int>(further_.size());
            bilateral = bilateral && row.lower == -unbounded && row.upper == unbounded;
        }
        if (block.point >= 0) {
            block.kind = PgsBlock::Kind::contact;
            for (int k = block.point; k < block.end; ++k) {
                if (points[k].size != 2) continue;
                const PgsRow &one = rows_[block.row + points[k].row], &two = (&one)[1];
                block.step[k - block.point] =
                    1.0 / (0.5 * (one.diagonal + two.diagonal) +
                           length(0.5 * (one.diagonal - two.diagonal), schur(one, two)));
            }
        } else if (bilateral) {
            block.kind = PgsBlock::Kind::bilateral;
            Mat6 whole{};
            for (int i = 0; i < 6; ++i) whole[7 * i] = 1.0;
            for (int i = 0; i < block.size; ++i)
                for (int j = 0; j < block.size; ++j)
                    whole[6 * i + j] = i == j ? rows_[block.row + i].diagonal
                                              : schur(rows_[block.row + i], rows_[block.row + j]);
            // A body tied twice to the world makes no singular block; a rigid joint without inertia would.
            for (int i = 0; i < block.size; ++i) whole[7 * i] *= 1.0 + 1e-12;
            block.factor = static_cast<int>(factors_.size());
            factors_.push_back(factor_six(whole));
        }
    }

    static double schur(const PgsRow& a, const PgsRow& b) noexcept {
        return dot(a.first, b.first_push) + dot(a.second, b.second_push);
    }

    double residual(const PgsBlock& block, const PgsRow& row) const noexcept {
        double left = dot(row.first, bodies_[block.first].velocity) +
                      dot(row.second, bodies_[block.second].velocity) + row.softness * row.multiplier -
                      row.right;
        for (int k = block.further; k < block.further_end; ++k)
            left += dot(further_[k].row, bodies_[further_[k].body].velocity);
        return left;
    }

    void push(const PgsBlock& block, const PgsRow& row, double impulse) noexcept {
        Vec6 &v = bodies_[block.first].velocity, &w = bodies_[block.second].velocity;
        for (int a = 0; a < 6; ++a) v[a] += row.first_push[a] * impulse;
        for (int a = 0; a < 6; ++a) w[a] += row.second_push[a] * impulse;
        for (int k = block.further; k < block.further_end; ++k)
            for (int a = 0; a < 6; ++a)
                bodies_[further_[k].body].velocity[a] += further_[k].push[a] * impulse;
    }

    double update_row(const PgsBlock& block, PgsRow& row) noexcept {
        if (!(row.diagonal > 0.0)) return std::isnan(row.diagonal) ? row.diagonal : 0.0;
        const double old = row.multiplier;
        row.multiplier = std::clamp(old - residual(block, row) / row.diagonal, row.lower, row.upper);
        const double change = row.multiplier - old;
        if (change == 0.0) return 0.0;
        push(block, row, change);
        return std::abs(change) * row.diagonal;
    }

    double update_joint(const PgsBlock& block) noexcept {
        if (block.kind == PgsBlock::Kind::bilateral) return update_block(block);
        double change = 0.0;
        for (int i = 0; i < block.size; ++i) change = larger(change, update_row(block, rows_[block.row + i]));
        return change;
    }

    double update_block(const PgsBlock& block) noexcept {
        Vec6 change{};
        double largest = 0.0;
        for (int i = 0; i < block.size; ++i) {
            change[i] = -residual(block, rows_[block.row + i]);
            largest = larger(largest, std::abs(change[i]));
        }
        solve_six(factors_[block.factor], change);
        for (int i = 0; i < block.size; ++i) {
            rows_[block.row + i].multiplier += change[i];
            push(block, rows_[block.row + i], change[i]);
        }
        return largest;
    }

    double update_rubbing(const PgsBlock& block, const FrictionPoint& point, double step) noexcept {
        PgsRow &one = rows_[block.row + point.row], &two = rows_[block.row + point.row + point.size - 1];
        const double normal = model_ == FrictionModel::box ? point.normal : rows_[block.row].multiplier;
        const double bound = point.coefficient * std::max(0.0, normal);
        if (model_ != FrictionModel::cone || point.size != 2) {
            one.lower = two.lower = -bound;
            one.upper = two.upper = bound;
            const double change = update_row(block, one);
            return point.size != 2 ? change : larger(change, update_row(block, two));
        }
        const double b1 = one.multiplier, b2 = two.multiplier;
        double d1 = b1 - step * residual(block, one);
        double d2 = b2 - step * residual(block, two);
        const double reach = length(d1, d2);
        if (point.anisotropic) {
            const double tangents[3] = {one.diagonal, schur(one, two), two.diagonal};
            least_on_disc(tangents, b1, b2, residual(block, one), residual(block, two), bound, d1, d2);
        } else if (reach > bound) {
            d1 *= bound / reach, d2 *= bound / reach;
        }
        one.multiplier = d1;
        two.multiplier = d2;
        push(block, one, d1 - b1);
        push(block, two, d2 - b2);
        return length(d1 - b1, d2 - b2) / step;
    }

    FrictionModel model_ = FrictionModel::cone;
    std::vector<Mat6> mass_factor_, factors_;
    LargeArray<PgsBody> bodies_;
    std::vector<PgsRow> rows_;
    std::vector<PgsFurtherBody> further_;
    std::vector<PgsBlock> blocks_;
};

}  // namespace spook

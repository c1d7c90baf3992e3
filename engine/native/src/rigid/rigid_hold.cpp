// The impulses Λ of one stage for which it ends on the rows: see rigid_composition.cpp.
//
// Each round solves with the matrix at the start of the stage, which contracts by about the angle turned in it;
// Anderson's mixing learns the rest. Few rows make one dense matrix G M⁻¹ Gᵀ, many the block factorisation.
#include <algorithm>
#include <cmath>
#include <limits>

#include "rigid/rotors.hpp"
#include "rigid/row_curvature.hpp"
#include "rigid/stage_hold.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::rigid_hold;

void StageHold::begin() {
    const std::size_t rows = rows_.rows();
    const auto blocks = joints_.blocks();
    trial_ = live_.bodies;
    violation_.assign(rows, 0.0);
    step_.assign(rows, 0.0);
    change_.assign(rows, 0.0);
    last_plain_ = last_step_ = change_;
    mixing_.assign(2 * rows * mixing_depth, 0.0);
    axes_.assign(model_.constrained.size(), {});
    extent_.clear();
    for (int k = 0; k < static_cast<int>(blocks.size()); ++k)
        for (int i = 0; i < blocks[k].size; ++i) extent_.push_back(joints_.gain(k, i).extent);
    dense_ = model_.bilateral && rows_.rows() <= max_dense_rows;
    if (!dense_) return;
    dense_rows_.prepare(static_cast<int>(rows_.rows()));
    couplings_.clear();
    std::vector<int> first_row{0};
    for (const JointBlock& block : blocks) first_row.push_back(first_row.back() + block.size);
    const auto moving = [&](int k, int end) {
        const int body = rows_.end_body(k, end);
        return body >= 0 && model_.constants[body].moves() ? body : -1;
    };
    for (int k = 0; k < static_cast<int>(blocks.size()); ++k)
        for (int end = 0; end < rows_.ends(k); ++end)
            for (int l = 0; l <= k && moving(k, end) >= 0; ++l)
                for (int other = 0; other < rows_.ends(l); ++other)
                    if (moving(l, other) == moving(k, end))
                        couplings_.push_back({k, l, first_row[k], first_row[l], end, other, moving(k, end)});
}

/// G M⁻¹ Gᵀ from the Jacobians as assembled.
bool StageHold::factor_dense() {
    const auto blocks = joints_.blocks();
    const int rows = static_cast<int>(rows_.rows());
    for (int i = 0; i < rows; ++i) std::fill_n(dense_rows_.row(i), i + 1, 0.0);
    for (const Coupling& m : couplings_) {
        const int body = m.body;
        const double *mine = rows_.end_rows(m.block, m.end), *its = rows_.end_rows(m.other, m.other_end);
        const double over = 1.0 / model_.constants[body].mass;
        const BodyConstants& c = model_.constants[body];
        const Mat3& r = axes_[model_.solver_index[body]];
        for (int i = 0; i < blocks[m.block].size; ++i, mine += 6) {
            const Vec3 push = over * Vec3{mine[0], mine[1], mine[2]};
            Vec3 twist;
            if (!c.particle) {
                const Vec3 t = transposed_times(r, {mine[3], mine[4], mine[5]});
                twist = r * Vec3{t.x / c.inertia.x, t.y / c.inertia.y, t.z / c.inertia.z};
            }
            double* entry = dense_rows_.row(m.row + i) + m.column;
            const int count = m.block == m.other ? i + 1 : blocks[m.other].size;
            const double* j = its;
            for (int l = 0; l < count; ++l, j += 6)
                entry[l] += j[0] * push.x + j[1] * push.y + j[2] * push.z + j[3] * twist.x + j[4] * twist.y +
                            j[5] * twist.z;
        }
    }
    for (const int k : joints_.rotors()) {
        const int row = rows_.matrix.offset(k) + blocks[k].rotor;
        dense_rows_.row(row)[row] += blocks[k].softness[blocks[k].rotor];
    }
    return dense_rows_.factor(model_.method.floor);
}

/// Violations where the momenta lead in τ; the largest, in sizes of its joint.
double StageHold::violations_ahead(double tau) {
    for (std::size_t k = 0; k < model_.constrained.size(); ++k)
        lead(model_.constants[model_.constrained[k]], axes_[k], tau, live_.bodies[model_.constrained[k]],
             trial_[model_.constrained[k]]);
    violations_at(joints_, trial_, violation_.data());
    for (const int k : joints_.rotors()) {
        const int row = rows_.matrix.offset(k) + joints_.blocks()[k].rotor;
        violation_[row] = rotor_gap(joints_, k, live_.bodies, trial_, tau, multiplier_[row]);
    }
    double worst = 0.0;
    for (std::size_t row = 0; row < extent_.size(); ++row) {
        const double off = std::fabs(violation_[row]) / extent_[row];
        if (!(off <= worst)) worst = off;
    }
    return worst;
}

/// Anderson's mixing (J. ACM 12 (1965) 547): takes out of the step step_ what the rounds before this one have shown of
/// the difference between the matrix at the start of the stage and the true derivative. `kept` pairs are remembered.
void StageHold::mix(int iteration, int& kept) {
    const std::size_t rows = rows_.rows();
    if (iteration > 0 && kept < mixing_depth) {
        // One more pair: how the plain step changed (made orthonormal) when Λ went on by so much.
        double* turned = mixing_.data() + 2 * rows * static_cast<std::size_t>(kept);
        double* moved = turned + rows;
        for (std::size_t row = 0; row < rows; ++row) {
            turned[row] = step_[row] - last_plain_[row];
            moved[row] = last_step_[row] + turned[row];
        }
        double all = 0.0, left = 0.0;
        for (std::size_t row = 0; row < rows; ++row) all += turned[row] * turned[row];
        for (int k = 0; k < kept; ++k) {
            const double* q = mixing_.data() + 2 * rows * static_cast<std::size_t>(k);
            double share = 0.0;
            for (std::size_t row = 0; row < rows; ++row) share += q[row] * turned[row];
            for (std::size_t row = 0; row < 2 * rows; ++row) turned[row] -= share * q[row];
        }
        for (std::size_t row = 0; row < rows; ++row) left += turned[row] * turned[row];
        if (left > 1e-8 * all) {
            const double scale = 1.0 / std::sqrt(left);
            for (std::size_t row = 0; row < 2 * rows; ++row) turned[row] *= scale;
            ++kept;
        }
    }
    std::copy_n(step_.begin(), rows, last_plain_.begin());  // a tree has more coordinates than rows
    for (int k = 0; k < kept; ++k) {
        const double* q = mixing_.data() + 2 * rows * static_cast<std::size_t>(k);
        double share = 0.0;
        for (std::size_t row = 0; row < rows; ++row) share += q[row] * last_plain_[row];
        for (std::size_t row = 0; row < rows; ++row) step_[row] -= share * q[rows + row];
    }
}

/// change_: what Λ has gained. False if it does not come near.
bool StageHold::iterate(double tau, bool dense) {
    const std::size_t rows = rows_.rows();
    std::fill(change_.begin(), change_.end(), 0.0);
    double before = std::numeric_limits<double>::infinity();
    int kept = 0;
    bool plain = false;
    for (int iteration = 0;; ++iteration) {
        const double off = violations_ahead(tau), ratio = off / before;
        ++live_.newton_iterations;
        if (off <= settled) return true;
        if (off < 1e-12 &&
            ratio > 0.5) {  // down in the rounding, which mixing of redundant rows makes larger
            if (plain) return true;
            plain = true;
        }
        if (!(off < max_predicted_violation) || iteration == max_iterations) return false;
        const double over = -1.0 / tau;
        if (dense) {
            for (std::size_t row = 0; row < rows; ++row) step_[row] = over * violation_[row];
            dense_rows_.solve(step_.data());
        } else {
            std::fill(rows_.solution.begin(), rows_.solution.end(), 0.0);
            for (std::size_t row = 0; row < rows; ++row) rows_.solution[row] = over * violation_[row];
            rows_.matrix.solve(rows_.solution.data());
            for (std::size_t row = 0; row < rows; ++row) step_[row] = -rows_.solution[row];
        }
        if (!plain) mix(iteration, kept);
        for (std::size_t row = 0; row < rows; ++row) {
            last_step_[row] = step_[row];
            multiplier_[row] += step_[row];
            change_[row] += step_[row];
        }
        rows_.push(step_.data());
        before = off;
    }
}

bool StageHold::hold(double tau, std::vector<double>& multiplier) {
    multiplier_ = multiplier.data();
    if (!seek(tau)) return false;
    for (int i : model_.constrained) {
        BodyState& s = live_.bodies[i];
        s.displacement = trial_[i].displacement;
        if (model_.constants[i].particle) continue;
        s.turn = trial_[i].turn;
        refresh(model_.constants[i], s);
    }
    return true;
}

/// Λ for which the rows, assembled at the start of the stage, hold at its end. False if there is none near.
bool StageHold::seek(double tau) {
    for (std::size_t k = 0; k < model_.constrained.size(); ++k)
        if (!model_.constants[model_.constrained[k]].particle)
            axes_[k] =
                inertia_axes(model_.constants[model_.constrained[k]], live_.bodies[model_.constrained[k]]);
    for (int i : model_.driven) {
        trial_[i] = live_.bodies[i];
        move(model_.constants[i], tau, trial_[i]);
    }
    if (!dense_) rows_.fill_inertias();
    if ((dense_ ? factor_dense() : rows_.matrix.factor(model_.method.floor)) && iterate(tau, dense_))
        return true;
    // Near a singular position the chord along the rows that become redundant points the wrong way: again from the
    // same momenta, with little trust in those rows.
    const std::size_t rows = rows_.rows();
    for (std::size_t row = 0; row < rows; ++row) step_[row] = -change_[row];
    rows_.push(step_.data());
    for (std::size_t row = 0; row < rows; ++row) multiplier_[row] += step_[row];
    if (dense_) rows_.fill_inertias();
    return rows_.matrix.factor(singular_pivot) && iterate(tau, false);
}

}  // namespace spook

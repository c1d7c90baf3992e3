#include "rigid/load_dependent_bounds.hpp"

#include <algorithm>
#include <cmath>

#include "linear/elementary.hpp"
#include "rigid/rigid_system.hpp"

namespace spook {

void LoadDependentBounds::take(const JointSet& joints, bool eyes, bool tyres, bool bearings) {
    for (int k = 0; eyes && k < static_cast<int>(joints.eyes().size()); ++k) eyes_.push_back(k);
    for (int k = 0; tyres && k < static_cast<int>(joints.tyres().size()); ++k) tyres_.push_back(k);
    for (int k = 0; bearings && k < static_cast<int>(joints.bearings().size()); ++k) bearings_.push_back(k);
    last_.resize(eyes_.size());
}

double LoadDependentBounds::follow(MixedSystem& solved, JointSet& joints) {
    off_ = 0.0;
    for (int k = 0; k < static_cast<int>(eyes_.size()); ++k) follow_eye(k, solved, joints);
    for (int k : tyres_) follow_tyre(k, solved, joints);
    for (int k : bearings_) follow_bearing(k, solved, joints);
    ++round_;
    return off_;
}

void LoadDependentBounds::follow_eye(int eye, MixedSystem& solved, JointSet& joints) {
    const EyeRow& row = joints.eyes()[eyes_[eye]];
    RowBlock& own = solved.rows[row.block];
    double pull = -solved.rows[row.wire].multiplier[0];  // T₁ h
    for (int block : row.before) pull -= solved.rows[block].multiplier[0];
    const double friction = std::abs(own.multiplier[0]), both = 2.0 * pull - own.multiplier[0];
    const double bound = own.upper[0], answer = row.grip * std::max(both, 0.0);
    if (friction < bound || answer < bound)
        see(std::max(0.0, friction - answer) / std::max(both, bound), row.block);
    else if (answer > bound) see((answer - bound) / both, row.block);
    double next = answer;
    Guess& last = last_[eye];
    if (round_ > 0 && bound != last.bound) {
        const double slope = (answer - last.answer) / (bound - last.bound);
        if (std::abs(slope) <= row.grip) next = std::max(0.0, bound + (answer - bound) / (1.0 - slope));
    }
    last = {bound, answer};
    own.lower[0] = -next;
    own.upper[0] = next;
    joints.states[joints.blocks()[row.block].joint].bound[0] = next;
}

void LoadDependentBounds::follow_tyre(int tyre, MixedSystem& solved, JointSet& joints) {
    const TyreRows& of = joints.tyres()[tyre];
    RowBlock& rows = solved.rows[of.block];
    const double load = std::max(0.0, rows.multiplier[0]);
    double asked[2], share[2];
    for (int k = 0; k < 2; ++k) {
        asked[k] = (rows.right[1 + k] - row_velocity(rows, 1 + k, solved.velocity)) / rows.softness[1 + k];
        share[k] = of.friction[k] > 0.0 ? asked[k] / of.friction[k] : 0.0;
    }
    const double total = length(share[0], share[1]);
    JointSet::State& state = joints.states[joints.blocks()[of.block].joint];
    for (int k = 0; k < 2; ++k) {
        double next = total > 0.0 ? of.friction[k] * load * std::abs(share[k]) / total : 0.0;
        const double right = std::clamp(asked[k], -next, next);
        if (load > 0.0 || rows.multiplier[1 + k] != 0.0)
            see(std::abs(right - rows.multiplier[1 + k]) / std::max(load, std::abs(rows.multiplier[1 + k])),
                of.block);
        if (round_ > 8) next = 0.5 * (next + state.bound[k]);  // two directions may take turns
        state.bound[k] = next;
        rows.lower[1 + k] = -next;
        rows.upper[1 + k] = next;
    }
}

void LoadDependentBounds::follow_bearing(int bearing, MixedSystem& solved, JointSet& joints) {
    const BearingRow& of = joints.bearings()[bearing];
    RowBlock& rows = solved.rows[of.block];
    const RowBlock& holding = solved.rows[of.holding];
    const int joint = joints.blocks()[of.block].joint, linear = joints.constants(joint).holds.linear();
    double square = 0.0;
    for (int i = 0; i < linear; ++i) square += holding.multiplier[i] * holding.multiplier[i];
    JointSet::State& state = joints.states[joint];
    const double answer = state.broken ? 0.0 : of.share * std::sqrt(square);
    const double friction = std::abs(rows.multiplier[of.row]), bound = rows.upper[of.row];
    const double next = state.broken ? 0.0 : of.constant + answer;
    if (friction < bound || next < bound) {
        if (friction > next) see((friction - next) / friction, of.block);
    } else if (next > bound) {
        see((next - bound) / next, of.block);
    }
    state.bound[of.way] = answer;
    rows.lower[of.row] = -next;
    rows.upper[of.row] = next;
}

/// Rows with bounds and without contacts: solved again while bounds that follow other rows move.
bool RigidSystem::pivot_rows() {
    load_dependent_.begin();
    for (int round = 0;; ++round) {
        const PivotReport report = pivot_.solve(mixed_, round > 0);
        rounds_ += static_cast<std::uint64_t>(report.rounds);
        if (!report.finite || load_dependent_.empty()) return report.finite;
        const double off = load_dependent_.follow(mixed_, joints_);
        if (off <= LoadDependentBounds::AGREED) return true;
        if (round < LoadDependentBounds::MOST_ROUNDS) continue;
        // In speeds: what the missing impulse would have given the lightest of its bodies.
        const RowBlock& rows = mixed_.rows[load_dependent_.worst()];
        const int body = constrained_[rows.second >= 0 ? rows.second : rows.first];
        const double missed = off * std::abs(rows.multiplier[0]) / constants_[body].mass;
        if (missed > method_.unsettled_residual) note_unsettled(body, missed);
        return true;
    }
}

}  // namespace spook

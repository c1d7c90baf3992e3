#include "rigid/load_dependent_bounds.hpp"

#include <algorithm>
#include <cmath>

#include "linear/elementary.hpp"

namespace spook {

void LoadDependentBounds::take(const JointSet& joints, bool eyes, bool tyres, bool bearings) {
    for (int k = 0; eyes && k < static_cast<int>(joints.eyes().size()); ++k) eyes_.push_back(k);
    for (int k = 0; tyres && k < static_cast<int>(joints.tyres().size()); ++k) tyres_.push_back(k);
    for (int k = 0; bearings && k < static_cast<int>(joints.drives().bearings().size()); ++k)
        bearings_.push_back(k);
    last_.resize(eyes_.size() + tyres_.size());
}

LoadDependentBounds::Followed LoadDependentBounds::follow(MixedSystem& solved, JointSet& joints, bool late) {
    off_ = 0.0;
    bool same_matrix = true;
    for (int k = 0; k < static_cast<int>(eyes_.size()); ++k) follow_eye(k, solved, joints);
    for (int k = 0; k < static_cast<int>(tyres_.size()); ++k) {
        if (late) follow_tyre_late(k, solved, joints);
        else if (follow_tyre(k, solved, joints)) same_matrix = false;
    }
    for (int k : bearings_) follow_bearing(k, solved, joints);
    ++round_;
    return {off_, same_matrix};
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

namespace {

/// What a tyre's rows along and across have: the load N h, what the slip asks of them at their full stiffness, and that over µ.
struct Slip {
    double load = 0.0, asked[2] = {}, share[2] = {}, total = 0.0;  // N s

    Slip(const TyreRows& of, const RowBlock& rows, double slides, const std::vector<Vec6>& velocity) noexcept
        : load(std::max(0.0, rows.multiplier[0])) {
        for (int k = 0; k < 2; ++k) {
            asked[k] =
                slides * (rows.right[1 + k] - row_velocity(rows, 1 + k, velocity)) / rows.softness[1 + k];
            share[k] = of.friction[k] > 0.0 ? asked[k] / of.friction[k] : 0.0;
        }
        total = length(share[0], share[1]);
    }
};

/// |F| of a tyre over µ, as its rows carry it.
double length_over(const RowBlock& rows, const std::array<double, 2>& friction) noexcept {
    return length(friction[0] > 0.0 ? rows.multiplier[1] / friction[0] : 0.0,
                  friction[1] > 0.0 ? rows.multiplier[2] / friction[1] : 0.0);
}

}  // namespace

/// Whether the factor of its rows has changed.
bool LoadDependentBounds::follow_tyre(int tyre, MixedSystem& solved, JointSet& joints) {
    const TyreRows& of = joints.tyres()[tyres_[tyre]];
    RowBlock& rows = solved.rows[of.block];
    JointSet::State& state = joints.states[joints.blocks()[of.block].joint];
    Guess& last = last_[eyes_.size() + static_cast<std::size_t>(tyre)];
    const Slip slip(of, rows, state.slides, solved.velocity);
    const bool free = rows.upper[1] == unbounded || rows.upper[2] == unbounded;
    const double now = free && slip.total > 0.0 ? state.slides / slip.total : 0.0;  // 1/|F|
    // |F| that it may have. A wheel that its own friction lifts would be let go and caught in turn: it goes half the way.
    double may = slip.load, next = 1.0;
    if (round_ > patient_rounds) may = 0.5 * (may + length_over(rows, of.friction));
    if (may > 0.0 && slip.total > may) {
        next = slip.total / may;
        const double rise = round_ > 0 && last.answer > 0.0 && now > 0.0
                                ? (now - last.answer) / (state.slides - last.bound)
                                : 0.0;
        if (rise > 0.0 && rise < unbounded) next = std::max(1.0, state.slides + (1.0 / may - now) / rise);
    }
    last = {state.slides, now};
    const double part = slip.total > slip.load ? slip.load / slip.total : 1.0;
    for (int k = 0; k < 2; ++k) {
        const double own = rows.multiplier[1 + k], right = of.friction[k] > 0.0 ? part * slip.asked[k] : 0.0;
        if (slip.load > 0.0 || own != 0.0)
            see(std::abs(right - own) / std::max(slip.load, std::abs(own)), of.block);
        rows.softness[1 + k] *= next / state.slides;
        state.bound[k] = may > 0.0 && of.friction[k] > 0.0 ? unbounded : 0.0;
        rows.lower[1 + k] = -state.bound[k];
        rows.upper[1 + k] = state.bound[k];
    }
    const bool changed = next != state.slides;
    state.slides = next;
    return changed;
}

void LoadDependentBounds::follow_tyre_late(int tyre, MixedSystem& solved, JointSet& joints) {
    const TyreRows& of = joints.tyres()[tyres_[tyre]];
    JointSet::State& state = joints.states[joints.blocks()[of.block].joint];
    const Slip slip(of, solved.rows[of.block], state.slides, solved.velocity);
    for (int k = 0; k < 2; ++k)
        state.bound[k] =
            slip.total > 0.0 ? of.friction[k] * slip.load * std::abs(slip.share[k]) / slip.total : 0.0;
    state.slides = 1.0;
}

void LoadDependentBounds::follow_bearing(int bearing, MixedSystem& solved, JointSet& joints) {
    const BearingRow& of = joints.drives().bearings()[bearing];
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

}  // namespace spook

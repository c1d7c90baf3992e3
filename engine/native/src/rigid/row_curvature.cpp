// The curvature of the rows of joints. The averaged law ¼(g₊ + 2g + g₋) keeps it in the right side:
// rhs −= (4/h) Ups [(c₊ + c₋)/4 + θ c₊], c₋ of the way here and c₊ of the way on, which a solve tells and the next one uses.
#include "rigid/row_curvature.hpp"

#include <algorithm>

namespace spook {

void violations_at(const JointSet& joints, const LargeArray<BodyState>& at, double* out) {
    for (const JointBlock& block : joints.blocks()) {
        if (block.axial) std::fill_n(out, block.size, 0.0);
        else joints.violation(block.joint, at, out);
        out += block.size;
    }
}

void RowCurvature::begin() {
    trial_ = live_.bodies;
    violation_.assign(rows_.rows(), 0.0);
    live_.last_violation.assign(rows_.rows(), 0.0);
    ahead_.assign(rows_.rows(), 0.0);
}

void RowCurvature::begin_where_it_stands() {
    for (int i = 0; i < model_.bodies(); ++i) {
        trial_[i] = live_.bodies[i];
        move(model_.constants[i], -model_.h, trial_[i]);
    }
    violations_at(joints_, trial_, live_.last_violation.data());
}

void RowCurvature::take_solution(const double* x, int body, BodyState& s) const noexcept {
    s.velocity = {x[0], x[1], x[2]};
    if (model_.constants[body].particle) return;
    s.angular_velocity = {x[3], x[4], x[5]};
    s.angular_momentum = s.inertia * s.angular_velocity;
}

void RowCurvature::curve(bool solved, const std::vector<Vec6>* mixed) {
    from_.resize(live_.bodies.size());
    trial_.resize(live_.bodies.size());
    behind_.resize(live_.bodies.size());
    const auto look = [this, solved, mixed](int i) {
        from_[i] = live_.bodies[i];
        if (const int k = model_.solver_index[i]; solved && k >= 0)
            take_solution(mixed ? (*mixed)[k].data() : rows_.solution.data() + rows_.body_at(k), i, from_[i]);
        trial_[i] = from_[i];
        move(model_.constants[i], model_.h, trial_[i]);
        if (solved) return;
        behind_[i] = live_.bodies[i];
        move(model_.constants[i], -model_.h, behind_[i]);
    };
    for (int i : model_.constrained)
        if (!live_.asleep(i)) look(i);
    for (int i : model_.driven) look(i);
    taken_.resize(rows_.rows());
    past_.resize(rows_.rows());
    std::size_t row = 0;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k) {
        const JointBlock& block = joints_.blocks()[k];
        double ahead[6] = {}, back[6] = {};
        if (!block.axial && !rests(block, live_)) {
            joints_.curvature(block.joint, from_, trial_, model_.h, ahead);
            if (!solved) joints_.curvature(block.joint, live_.bodies, behind_, -model_.h, back);
        }
        for (int i = 0; i < block.size; ++i, ++row) {
            const JointSet::RowGain gain = joints_.gain(k, i);
            const double cap = model_.method.correction_cap * gain.extent;
            if (!solved) past_[row] = gain.violation * 0.25 * std::clamp(back[i], -cap, cap);
            taken_[row] =
                past_[row] + gain.violation * (0.25 + gain.relaxation) * std::clamp(ahead[i], -cap, cap);
        }
    }
}

void RowCurvature::keep_right() {
    first_right_.assign(rows_.right.begin(), rows_.right.begin() + static_cast<std::ptrdiff_t>(rows_.rows()));
}

void RowCurvature::predict_curvature() {
    keep_right();
    curve(false);
    for (std::size_t row = 0; row < rows_.rows(); ++row) rows_.right[row] -= taken_[row];
}

void RowCurvature::refine_curvature() {
    for (int round = 0; round < model_.method.corrections; ++round) {
        curve(true);
        for (std::size_t row = 0; row < rows_.rows(); ++row)
            rows_.right[row] = first_right_[row] - taken_[row];
        rows_.solve_again();
    }
}

void RowCurvature::take_past_curvature() {
    violations_at(joints_, live_.bodies, violation_.data());
    std::size_t row = 0;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row) {
            if (joints_.blocks()[k].axial) continue;
            const double back =
                live_.last_violation[row] - violation_[row] + model_.h * rows_.row_speed(k, i, false);
            const JointSet::RowGain gain = joints_.gain(k, i);
            const double cap = model_.method.correction_cap * gain.extent;
            rows_.right[row] -= gain.violation * 0.25 * std::clamp(back, -cap, cap);
        }
    keep_right();
    live_.last_violation = violation_;
}

void RowCurvature::correct() {
    const int row_blocks = static_cast<int>(joints_.blocks().size());
    for (int round = 0; round < model_.method.corrections; ++round) {
        const double* x = rows_.solution.data() + rows_.rows();
        for (int i : model_.constrained) {
            BodyState& s = trial_[i];
            s = live_.bodies[i];
            s.velocity = {x[0], x[1], x[2]};
            x += 3;
            if (!model_.constants[i].particle) {
                s.angular_momentum = s.inertia * Vec3{x[0], x[1], x[2]};
                x += 3;
            }
            move(model_.constants[i], model_.h, s);
        }
        for (int i : model_.driven) {
            trial_[i] = live_.bodies[i];
            move(model_.constants[i], model_.h, trial_[i]);
        }
        violations_at(joints_, trial_, ahead_.data());
        std::size_t row = 0;
        for (int k = 0; k < row_blocks; ++k)
            for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row) {
                if (joints_.blocks()[k].axial) continue;
                const double curved = ahead_[row] - violation_[row] - model_.h * rows_.row_speed(k, i, true);
                const JointSet::RowGain gain = joints_.gain(k, i);
                const double cap = model_.method.correction_cap * gain.extent;
                rows_.right[row] = first_right_[row] -
                                   gain.violation * (0.25 + gain.relaxation) * std::clamp(curved, -cap, cap);
            }
        rows_.solve_again();
    }
}

}  // namespace spook

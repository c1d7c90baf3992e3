// Beyond the linearised, whole-step scheme: velocities at mid-step, and the curvature of the rows.
//
// With v and ℓ at mid-step the step is the variational one: ℓ₊ = ℓ₋ + h torque + Gᵀλ in world axes, and the turn
// of ℓ₊ over h, so that gyroscopic terms are of order 2 as well. Only the start has to be found.
#include <algorithm>
#include <cmath>

#include "rigid/rigid_system.hpp"
#include "rigid/rotors.hpp"

namespace spook {

/// Per row, G v' for the accelerations that keep the row still: −(second derivative of the row at constant twists)
/// + G I⁻¹ (w × ℓ), with the sign turned.
void RigidSystem::find_bias(double* bias) const {
    const auto blocks = joints_.blocks();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        joints_.bias(static_cast<int>(k), live_.bodies, bias);
        for (int end = 0; end < ends(static_cast<int>(k)); ++end) {
            const int body = end_body(static_cast<int>(k), end);
            if (body < 0 || !constants_[body].moves() || constants_[body].particle) continue;
            const BodyState& s = live_.bodies[body];
            const Vec3 gyro = turned_by(constants_[body], s, cross(s.angular_velocity, s.angular_momentum));
            const double* rows = end_rows(static_cast<int>(k), end) + 3;
            for (int i = 0; i < blocks[k].size; ++i)
                bias[i] -= dot({rows[6 * i], rows[6 * i + 1], rows[6 * i + 2]}, gyro);
        }
        bias += blocks[k].size;
    }
}

/// Places for what each step compares, also where surfaces may touch and none does.
void RigidSystem::make_room_for_half_step() {
    const std::size_t rows = static_cast<std::size_t>(rows_);
    trial_ = live_.bodies;
    violation_.assign(rows, 0.0);
    live_.last_violation.assign(rows, 0.0);
    bias_.assign(rows, 0.0);
    live_.before.resize(live_.bodies.size());
}

/// Velocities half a step back: v −= (h/2) v', ℓ −= (h/2) ℓ' with the accelerations the rows allow.
void RigidSystem::start_half_step() {
    const std::size_t rows = static_cast<std::size_t>(rows_);
    if (half_step_) {
        if (!force_.empty()) find_forces();
        const auto back = [this](int i, Vec3 velocity, Vec3 momentum) {
            BodyState& s = live_.bodies[i];
            s.velocity -= 0.5 * (velocity - s.velocity);
            s.angular_momentum -= 0.5 * (momentum - s.angular_momentum);
            if (!constants_[i].particle) refresh(constants_[i], s);
        };
        for (int i : free_)
            back(i, live_.bodies[i].velocity + kick(i),
                 live_.bodies[i].angular_momentum + h_ * constants_[i].torque);
        if (solver_ == RigidSolver::block) {
            assemble_blocks();
            fill_inertias();
            fill_block_momenta();
            find_bias(bias_.data());
            for (std::size_t row = 0; row < rows; ++row) right_[row] -= h_ * bias_[row];
            if (!factor_and_solve()) live_.not_solved = constrained_.front();
            for (const int k : joints_.rotors()) {
                const JointBlock& block = joints_.blocks()[k];
                joints_.states[block.joint].rotor -=
                    0.5 * block.softness[block.rotor] * solution_[matrix_.offset(k) + block.rotor];
            }
            const double* x = solution_.data() + rows;
            for (int i : constrained_) {
                const Vec3 v{x[0], x[1], x[2]};
                x += 3;
                if (constants_[i].particle) {
                    back(i, v, {});
                } else {
                    back(i, v, live_.bodies[i].inertia * Vec3{x[0], x[1], x[2]});
                    x += 3;
                }
            }
        }
    }
    if (method_.corrections > 0 && solver_ == RigidSolver::block && !curved_) {
        move_all(-h_);
        violations_at(trial_, live_.last_violation.data());
    }
    matrix_.clear_counters();
}

/// The same with contacts, which have no accelerations to ask for: half of what a whole step would change once its impacts
/// are over. So a step is solved twice from the same places, and the first takes the impacts.
void RigidSystem::start_half_step_touching() {
    const RigidState start = live_;
    const MixedSystem mixed = mixed_;
    const auto rotors = joints_.rotors();
    const auto rotor = [this](int k) -> double& { return joints_.states[joints_.blocks()[k].joint].rotor; };
    const auto start_from = [&](const LargeArray<BodyState>& from) {
        live_ = start;
        live_.bodies = from;
        mixed_ = mixed;
        contacts_ = fresh_contacts_;
        std::fill(joints_.states.begin(), joints_.states.end(), JointSet::State{});
        rounds_ = pgs_iterations_ = 0;
        residual_ = 0.0;
    };
    find_velocities();
    LargeArray<BodyState> once = live_.bodies;
    for (int i = 0; i < bodies(); ++i)
        if (!constants_[i].particle) refresh(constants_[i], once[i]);
    start_from(once);
    find_velocities();
    const LargeArray<BodyState> whole = live_.bodies;
    std::vector<double> gained;  // by rotors
    for (const int k : rotors) gained.push_back(rotor_change(joints_, k));
    start_from(start.bodies);
    for (std::size_t i = 0; i < rotors.size(); ++i)
        rotor(rotors[i]) = rotor_speed(joints_, rotors[i], live_.bodies) - 0.5 * gained[i];
    for (int i = 0; i < bodies(); ++i) {
        if (!constants_[i].moves()) continue;
        BodyState& s = live_.bodies[i];
        s.velocity -= 0.5 * (whole[i].velocity - once[i].velocity);
        s.angular_momentum -= 0.5 * (whole[i].angular_momentum - once[i].angular_momentum);
        if (!constants_[i].particle) refresh(constants_[i], s);
    }
}

/// trial_: where every body is after h with its present velocities.
void RigidSystem::move_all(double h) {
    for (int i = 0; i < bodies(); ++i) {
        trial_[i] = live_.bodies[i];
        move(constants_[i], h, trial_[i]);
    }
}

/// Violations per row at other poses; zero for the rows of a free coordinate, which have no curvature to speak of.
void RigidSystem::violations_at(const LargeArray<BodyState>& at, double* out) const {
    for (const JointBlock& block : joints_.blocks()) {
        if (block.axial) std::fill_n(out, block.size, 0.0);
        else joints_.violation(block.joint, at, out);
        out += block.size;
    }
}

/// G v per row, with the velocities of the bodies as they are, or of the solution.
double RigidSystem::row_speed(int block, int row, bool solved) const {
    double sum = 0.0;
    for (int end = 0; end < ends(block); ++end) {
        const int body = end_body(block, end);
        if (body < 0 || constants_[body].motion == Motion::fixed) continue;
        const double* j = end_rows(block, end) + 6 * row;
        const BodyState& s = live_.bodies[body];
        Vec3 v = s.velocity, w = s.angular_velocity;
        if (solved && solver_index_[body] >= 0) {
            const double* x = solution_.data() +
                              matrix_.offset(static_cast<int>(joints_.blocks().size()) + solver_index_[body]);
            v = {x[0], x[1], x[2]};
            w = constants_[body].particle ? Vec3{} : Vec3{x[3], x[4], x[5]};
        }
        sum += dot({j[0], j[1], j[2]}, v) + dot({j[3], j[4], j[5]}, w);
    }
    return sum;
}

/// The velocities of a solve, for the k-th of the constrained bodies.
void RigidSystem::take_solution(int k, BodyState& s) const noexcept {
    const BodyConstants& body = constants_[constrained_[k]];
    const double* x = mixed_values_
                          ? mixed_.velocity[k].data()
                          : solution_.data() + matrix_.offset(static_cast<int>(joints_.blocks().size()) + k);
    s.velocity = {x[0], x[1], x[2]};
    if (body.particle) return;
    s.angular_velocity = {x[3], x[4], x[5]};
    s.angular_momentum = s.inertia * s.angular_velocity;
}

/// bend_: the same curvature where steps keep no violations and are solved more than once: beside contacts and rows with bounds.
/// c₋ and, before the first solve, c₊ are those of the velocities at hand, so that what spins steadily is right at once;
/// then c₊ is that of the solution.
void RigidSystem::curve_rows(bool solved) {
    from_.resize(live_.bodies.size());
    trial_.resize(live_.bodies.size());
    behind_.resize(live_.bodies.size());
    const auto look = [this, solved](int i) {
        from_[i] = live_.bodies[i];
        if (solved && solver_index_[i] >= 0) take_solution(solver_index_[i], from_[i]);
        trial_[i] = from_[i];
        move(constants_[i], h_, trial_[i]);
        if (solved) return;
        behind_[i] = live_.bodies[i];
        move(constants_[i], -h_, behind_[i]);
    };
    for (int i : constrained_)
        if (!asleep(i)) look(i);
    for (int i : driven_) look(i);
    bend_.resize(rows_);
    bent_.resize(rows_);
    std::size_t row = 0;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k) {
        const JointBlock& block = joints_.blocks()[k];
        double ahead[6] = {}, back[6] = {};
        if (!block.axial && !rests(k)) {
            joints_.curvature(block.joint, from_, trial_, h_, ahead);
            if (!solved) joints_.curvature(block.joint, live_.bodies, behind_, -h_, back);
        }
        for (int i = 0; i < block.size; ++i, ++row) {
            const JointSet::RowGain gain = joints_.gain(k, i);
            const double cap = method_.correction_cap * gain.extent;
            if (!solved) bent_[row] = gain.violation * 0.25 * std::clamp(back[i], -cap, cap);
            bend_[row] =
                bent_[row] + gain.violation * (0.25 + gain.relaxation) * std::clamp(ahead[i], -cap, cap);
        }
    }
}

/// The averaged law ¼(g₊ + 2g + g₋) keeps its curvature in the right side: rhs −= (4/h) Ups [(c₊ + c₋)/4 + θ c₊].
/// c₋, from where the rows came, is known before the first solve.
void RigidSystem::bend_rows_back() {
    violations_at(live_.bodies, violation_.data());
    std::size_t row = 0;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row) {
            if (joints_.blocks()[k].axial) continue;
            const double back = live_.last_violation[row] - violation_[row] + h_ * row_speed(k, i, false);
            const JointSet::RowGain gain = joints_.gain(k, i);
            const double cap = method_.correction_cap * gain.extent;
            right_[row] -= gain.violation * 0.25 * std::clamp(back, -cap, cap);
        }
    first_right_.assign(right_.begin(), right_.begin() + static_cast<std::ptrdiff_t>(rows_));
    live_.last_violation = violation_;
}

/// c₊ is where the solution, then the corrected one, would take the rows.
void RigidSystem::correct_curvature() {
    if (curved_) {
        for (int round = 0; round < method_.corrections; ++round) {
            curve_rows(true);
            for (std::size_t row = 0; row < static_cast<std::size_t>(rows_); ++row)
                right_[row] = first_right_[row] - bend_[row];
            solve_again();
        }
        return;
    }
    const int row_blocks = static_cast<int>(joints_.blocks().size());
    std::vector<double>& ahead = bias_;
    for (int round = 0; round < method_.corrections; ++round) {
        const double* x = solution_.data() + rows_;
        for (int i : constrained_) {
            BodyState& s = trial_[i];
            s = live_.bodies[i];
            s.velocity = {x[0], x[1], x[2]};
            x += 3;
            if (!constants_[i].particle) {
                s.angular_momentum = s.inertia * Vec3{x[0], x[1], x[2]};
                x += 3;
            }
            move(constants_[i], h_, s);
        }
        for (int i : driven_) {
            trial_[i] = live_.bodies[i];
            move(constants_[i], h_, trial_[i]);
        }
        violations_at(trial_, ahead.data());
        std::size_t row = 0;
        for (int k = 0; k < row_blocks; ++k)
            for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row) {
                if (joints_.blocks()[k].axial) continue;
                const double curved = ahead[row] - violation_[row] - h_ * row_speed(k, i, true);
                const JointSet::RowGain gain = joints_.gain(k, i);
                const double cap = method_.correction_cap * gain.extent;
                right_[row] = first_right_[row] -
                              gain.violation * (0.25 + gain.relaxation) * std::clamp(curved, -cap, cap);
            }
        solve_again();
    }
}

/// Velocities at the sample: the mean of those half a step before and after, less what an impact within the step makes of
/// them, which comes later: impact() has taken it from `before`.
void RigidSystem::read_half_step() {
    for (int i = 0; i < bodies(); ++i) {
        if (!constants_[i].moves()) continue;
        BodyState& s = live_.bodies[i];
        s.velocity = 0.5 * (s.velocity + live_.before[i].velocity);
        s.angular_momentum = 0.5 * (s.angular_momentum + live_.before[i].angular_momentum);
        if (!constants_[i].particle) refresh(constants_[i], s);
    }
}

}  // namespace spook

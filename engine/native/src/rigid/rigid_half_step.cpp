// With v and ℓ at mid-step the step is the variational one: ℓ₊ = ℓ₋ + h torque + Gᵀλ in world axes, and the turn
// of ℓ₊ over h, so that gyroscopic terms are of order 2 as well. Only the start has to be found.
//
// reads: bodies, accelerations that the rows allow. writes: velocities and momenta at the start and at samples, speeds of rotors.
#include <algorithm>

#include "rigid/half_step.hpp"
#include "rigid/rotors.hpp"

namespace spook {

/// v −= (h/2) v', ℓ −= (h/2) ℓ'; given are v and ℓ after a whole step.
void HalfStep::go_back(int i, Vec3 velocity, Vec3 momentum) noexcept {
    BodyState& s = live_.bodies[i];
    s.velocity -= 0.5 * (velocity - s.velocity);
    s.angular_momentum -= 0.5 * (momentum - s.angular_momentum);
    if (!model_.constants[i].particle) refresh(model_.constants[i], s);
}

void HalfStep::start() {
    live_.before.resize(live_.bodies.size());
    forces_.find();
    for (int i : model_.free)
        go_back(i, live_.bodies[i].velocity + forces_.kick(i),
                live_.bodies[i].angular_momentum + model_.h * model_.constants[i].torque);
    if (model_.bilateral) {
        rows_.assemble();
        rows_.fill_inertias();
        rows_.fill_momenta();
        std::vector<double> bias(rows_.rows());
        rows_.find_bias(bias.data());
        for (std::size_t row = 0; row < bias.size(); ++row) rows_.right[row] -= model_.h * bias[row];
        if (!rows_.factor_and_solve()) live_.not_solved = model_.constrained.front();
        for (const int k : joints_.rotors()) {
            const JointBlock& block = joints_.blocks()[k];
            joints_.states[block.joint].rotor -=
                0.5 * block.softness[block.rotor] * rows_.solution[rows_.matrix.offset(k) + block.rotor];
        }
        const double* x = rows_.solution.data() + rows_.rows();
        for (int i : model_.constrained) {
            const Vec3 v{x[0], x[1], x[2]};
            x += 3;
            if (model_.constants[i].particle) {
                go_back(i, v, {});
            } else {
                go_back(i, v, live_.bodies[i].inertia * Vec3{x[0], x[1], x[2]});
                x += 3;
            }
        }
    }
}

/// Contacts have no accelerations to ask for: half of what a whole step would change once its impacts are over. So a step
/// is solved twice from the same places, and the first takes the impacts. What those of the second change, where bodies go to and fro
/// within a step, `before` has less.
void HalfStep::start_touching(const std::function<void()>& find_velocities,
                              const std::function<void()>& begin_again) {
    const RigidState start = live_;
    const auto rotors = joints_.rotors();
    const auto rotor = [this](int k) -> double& { return joints_.states[joints_.blocks()[k].joint].rotor; };
    const auto start_from = [&](const LargeArray<BodyState>& from) {
        live_ = start;
        live_.bodies = from;
        std::fill(joints_.states.begin(), joints_.states.end(), JointSet::State{});
        begin_again();
    };
    find_velocities();
    LargeArray<BodyState> once = live_.bodies;
    for (int i = 0; i < model_.bodies(); ++i)
        if (!model_.constants[i].particle) refresh(model_.constants[i], once[i]);
    start_from(once);
    find_velocities();
    const LargeArray<BodyState> whole = live_.bodies;
    const LargeArray<BodyMomenta> less = live_.before;
    std::vector<double> gained;  // by rotors
    for (const int k : rotors) gained.push_back(rotor_change(joints_, k));
    start_from(start.bodies);
    for (std::size_t i = 0; i < rotors.size(); ++i)
        rotor(rotors[i]) = rotor_speed(joints_, rotors[i], live_.bodies) - 0.5 * gained[i];
    for (int i = 0; i < model_.bodies(); ++i) {
        if (!model_.constants[i].moves()) continue;
        BodyState& s = live_.bodies[i];
        s.velocity -= 0.5 * (whole[i].velocity - once[i].velocity - (once[i].velocity - less[i].velocity));
        s.angular_momentum -= 0.5 * (whole[i].angular_momentum - once[i].angular_momentum -
                                     (once[i].angular_momentum - less[i].angular_momentum));
        if (!model_.constants[i].particle) refresh(model_.constants[i], s);
    }
}

void HalfStep::note_before() {
    live_.before.resize(live_.bodies.size());
    for (int i = 0; i < model_.bodies(); ++i)
        live_.before[i] = {live_.bodies[i].velocity, live_.bodies[i].angular_momentum};
}

void HalfStep::read() {
    for (int i = 0; i < model_.bodies(); ++i) {
        if (!model_.constants[i].moves()) continue;
        BodyState& s = live_.bodies[i];
        s.velocity = 0.5 * (s.velocity + live_.before[i].velocity);
        s.angular_momentum = 0.5 * (s.angular_momentum + live_.before[i].angular_momentum);
        if (!model_.constants[i].particle) refresh(model_.constants[i], s);
    }
}

}  // namespace spook

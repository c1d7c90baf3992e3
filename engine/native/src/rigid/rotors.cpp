#include "rigid/rotors.hpp"

#include <cmath>

namespace spook {

namespace {

AxialRow row_of(const JointSet& joints, const JointBlock& block, std::span<const BodyState> bodies) noexcept {
    return axial_row(joints.constants(block.joint), state_of(block.first, bodies),
                     state_of(block.second, bodies));
}

/// From a place of the coordinate to where the bodies are; `near`: to within half a turn of a hinge.
double way_of(const JointSet& joints, const JointBlock& block, double from, std::span<const BodyState> to,
              double near) noexcept {
    return unwrapped(joints.constants(block.joint), row_of(joints, block, to).coordinate - from, near);
}

}  // namespace

double rotor_right(JointState& state, double rate) noexcept {
    if (std::isnan(state.rotor)) state.rotor = rate;
    return state.rotor - state.rotor_lead;
}

double rotor_change(const JointSet& joints, int index) noexcept {
    const JointBlock& block = joints.blocks()[index];
    return -block.softness[block.rotor] * joints.states[block.joint].axial_multiplier[block.rotor];
}

double rotor_speed(const JointSet& joints, int index, std::span<const BodyState> bodies) noexcept {
    const JointBlock& block = joints.blocks()[index];
    const JointState& state = joints.states[block.joint];
    return state.broken ? state.rotor : row_of(joints, block, bodies).rate;
}

double rotor_energy(const JointSet& joints, std::span<const BodyState> bodies) noexcept {
    double sum = 0.0;
    for (const int index : joints.rotors()) {
        const JointBlock& block = joints.blocks()[index];
        const double speed = rotor_speed(joints, index, bodies);
        sum += 0.5 * speed * speed / block.softness[block.rotor];
    }
    return sum;
}

double rotor_gap(const JointSet& joints, int index, std::span<const BodyState> from,
                 std::span<const BodyState> to, double time, double impulse) noexcept {
    const JointBlock& block = joints.blocks()[index];
    const double goes = time * (joints.states[block.joint].rotor - block.softness[block.rotor] * impulse);
    return way_of(joints, block, row_of(joints, block, from).coordinate, to, goes) - goes;
}

void turn_rotor(JointSet& joints, int index, std::span<const BodyState> bodies, double h) noexcept {
    const JointBlock& block = joints.blocks()[index];
    JointState& state = joints.states[block.joint];
    state.rotor += rotor_change(joints, index);
    const double rate = state.rotor - state.rotor_lead;
    state.rotor_lead = 0.0;
    if (state.broken) return;
    state.rotor_lead = way_of(joints, block, state.angle, bodies, h * rate) / h - rate;
}

}  // namespace spook

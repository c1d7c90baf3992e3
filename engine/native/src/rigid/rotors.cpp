#include "rigid/rotors.hpp"

#include <cmath>
#include <numbers>

namespace spook {

namespace {

AxialRow row_of(const JointSet& joints, const JointBlock& block, std::span<const BodyState> bodies) noexcept {
    static const BodyState world;
    const auto body = [&](int index) -> const BodyState& { return index < 0 ? world : bodies[index]; };
    return axial_row(joints.constants(block.joint), body(block.first), body(block.second));
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

void turn_rotor(JointSet& joints, int index, std::span<const BodyState> bodies, double h,
                bool evenly) noexcept {
    const JointBlock& block = joints.blocks()[index];
    JointState& state = joints.states[block.joint];
    state.rotor += rotor_change(joints, index);
    const double rate = state.rotor - state.rotor_lead;
    state.rotor_lead = 0.0;
    if (!evenly || state.broken) return;
    double way = row_of(joints, block, bodies).coordinate - state.angle;
    if (joints.kind(block.joint) == JointKind::hinge) {
        constexpr double turn = 2.0 * std::numbers::pi;
        way += turn * std::round((h * rate - way) / turn);
    }
    state.rotor_lead = way / h - rate;
}

}  // namespace spook

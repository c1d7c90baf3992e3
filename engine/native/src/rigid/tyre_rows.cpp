#include "rigid/tyre_rows.hpp"

#include "rigid/joint_set.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

Stand stand(const JointConstants& joint, double radius, const BodyState& road,
            const BodyState& wheel) noexcept {
    const Vec3 axle = carried(wheel, joint.axes[0]);
    Stand at;
    at.normal = carried(road, joint.axes[1]);
    // From the road's point to the hub; what moved is small beside the span and added last.
    const Vec3 hub =
        joint.span + ((wheel.displacement - road.displacement) +
                      (wheel.turn_less_one * joint.second_arm - road.turn_less_one * joint.first_arm));
    const Vec3 upright = at.normal - dot(at.normal, axle) * axle;
    const double lean = norm(upright);
    Vec3 radial;
    if (lean > 0.0) {
        radial = (1.0 / lean) * upright;
        at.forward = (1.0 / lean) * cross(axle, at.normal);
        at.sideways = cross(at.normal, at.forward);
    }
    at.height = dot(hub, at.normal) - radius * lean;
    at.second_reach = carried(wheel, joint.second_arm) - radius * radial;
    at.first_reach = carried(road, joint.first_arm) + hub - radius * radial;
    return at;
}

void JointSet::assemble_tyre(const Joint& joint, State& state, std::span<const BodyState> bodies,
                             double* first, double* second, BlockRight& right) noexcept {
    const BodyState &road = state_of(joint.first, bodies), &wheel = state_of(joint.second, bodies);
    TyreForm& form = tyre_forms_[joint.tyre];
    const Stand at = stand(joint.constants, form.radius, road, wheel);
    state.first_reach = at.first_reach;
    state.second_reach = at.second_reach;
    const Vec3 under = road.velocity + cross(road.angular_velocity, at.first_reach);
    const Vec3 slip = wheel.velocity + cross(wheel.angular_velocity, at.second_reach) - under;
    const auto put = [&](int row, Vec3 direction) {
        const Vec3 linear[2] = {-direction, direction};
        const Vec3 angular[2] = {-cross(at.first_reach, direction), cross(at.second_reach, direction)};
        for (int k = 0; k < 3; ++k) {
            first[6 * row + k] = linear[0][k], first[6 * row + 3 + k] = angular[0][k];
            second[6 * row + k] = linear[1][k], second[6 * row + 3 + k] = angular[1][k];
        }
    };
    put(0, at.normal);
    put(1, at.forward);
    put(2, at.sideways);
    right.right[0] = joint.gain[0].upsilon * dot(at.normal, slip) - joint.gain[0].violation * at.height;
    right.lower[0] = 0.0;
    const double speed = std::abs(dot(at.forward, wheel.velocity - under)) + creep_speed;
    form.softness[0] = blocks_[joint.block].softness[0];
    for (int k = 0; k < 2; ++k) {
        form.softness[1 + k] = state.slides * speed / (form.slip_stiffness[k] * time_step_);
        right.right[1 + k] = 0.0;
        right.lower[1 + k] = -state.bound[k];
        right.upper[1 + k] = state.bound[k];
    }
    right.softness = form.softness.data();
}

}  // namespace spook

// The rows of every joint: violation, rate and Jacobian at the bodies' current state.
#pragma once

#include <cmath>
#include <numbers>
#include <span>

#include "rigid/rigid_scene.hpp"
#include "rigid/rigid_state.hpp"

namespace spook {

/// Where a joint's rows are written: Jacobians row-major with six columns (linear, angular), world axes. Entries
/// that are always zero are not written: the caller clears the memory once.
struct JointRows {
    double* first;   // rows × 6
    double* second;  // rows × 6
    double violation[6];
    double rate[6];  // G v
};

/// Constant geometry of a joint: arms at the start, from each body's centre, world axes.
struct JointConstants {
    JointKind kind = JointKind::lock;
    JointHolds holds = holds_of(JointKind::lock);
    int rows = 6;
    Vec3 first_arm, second_arm;
    Vec3 span;  // distance: second point minus first point at the start
    std::array<Vec3, 3> axes;
    double rest_length = 0.0;
};

JointConstants constants_of(const JointSpec& spec, const Vec3* first_start,
                            const Vec3* second_start) noexcept;
inline JointConstants constants_of(const RigidScene& scene, const JointSpec& spec) noexcept {
    const auto start = [&](int body) { return body < 0 ? nullptr : &scene.bodies[body].position; };
    return constants_of(spec, start(spec.first), start(spec.second));
}

/// Of a body of the scene, or of the world (−1).
inline const BodyState& state_of(int body, std::span<const BodyState> bodies) noexcept {
    static const BodyState world;
    return body < 0 ? world : bodies[body];
}

/// Violations are measured in the frame fixed to the first body:
/// - translation: the second end's point minus the first's, along the joint's axes;
/// - lock and prismatic rotation: 2 × the vector part of the relative quaternion, along the joint's axes, with
///   its exact derivative, so that a compliant row is a linear spring to O(angle³) and does no work on its own;
/// - hinge, cylindrical and planar: axis × (axis as the second body carries it), along both normals;
/// - universal: axis · (cross axis as the second body carries it);
/// - distance: |d| − rest length, free of cancellation.
/// The reaction acts at the second body's point on both bodies, so momenta are conserved for any violation.
/// Returns that point minus each body's centre in first_reach, second_reach.
void assemble_joint(const JointConstants& joint, const BodyState& first, const BodyState& second,
                    JointRows& rows, Vec3& first_reach, Vec3& second_reach) noexcept;

/// The violations alone, to the same bits.
void joint_violation(const JointConstants& joint, const BodyState& first, const BodyState& second,
                     double* out) noexcept;

/// What the rows' second time derivatives are when both ends go on with constant velocity and angular velocity.
void joint_bias(const JointConstants& joint, const BodyState& first, const BodyState& second,
                double* bias) noexcept;

/// Where the gap that a joint has left open between its ends goes while they turn: along with its first body, as its rows see it; or it
/// stays in place, where it can be closed however far that body turns in the step.
enum class OpenGap { goes_along, stays };

/// Per row g(there) − g − h G v: what a linear row leaves out of the way over h, or back over −h, on which the ends turn from
/// where they are to `there`. Centres go as the joint lets them, not as their velocities point now, which turn as well.
void joint_curvature(const JointConstants& joint, const BodyState& first, const BodyState& second,
                     const BodyState& first_there, const BodyState& second_there, double h, OpenGap gap,
                     double* out) noexcept;

/// What bias says for the rate of the free coordinate.
double axial_bias(const JointConstants& joint, const BodyState& first, const BodyState& second) noexcept;

/// The free coordinate of a hinge (angle within ±π) or prismatic joint [rad or m], its rate and one Jacobian row.
struct AxialRow {
    double coordinate = 0.0, rate = 0.0;
    double first[6] = {}, second[6] = {};
};
AxialRow axial_row(const JointConstants& joint, const BodyState& first, const BodyState& second) noexcept;
/// The free coordinate with the turns of a hinge counted: the nearest to `near` of what an angle within ±π may mean.
inline double unwrapped(const JointConstants& joint, double coordinate, double near) noexcept {
    if (joint.kind != JointKind::hinge) return coordinate;
    constexpr double turn = 2.0 * std::numbers::pi;
    return coordinate + turn * std::round((near - coordinate) / turn);
}
/// The slide along the axis, or the turn about it, of a joint that may have both.
AxialRow axial_row(const JointConstants& joint, const BodyState& first, const BodyState& second,
                   bool slides) noexcept;

}  // namespace spook

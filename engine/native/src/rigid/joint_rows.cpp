#include "rigid/joint_rows.hpp"

#include <limits>

#include "linear/elementary.hpp"
#include "run/quantities.hpp"

namespace spook {
namespace {

/// What all rows of one joint share.
struct Ends {
    Ends(const JointConstants& joint, const BodyState& first, const BodyState& second) noexcept
        : first_arm(joint.first_arm + first.turn_less_one * joint.first_arm),
          second_arm(joint.second_arm + second.turn_less_one * joint.second_arm),
          gap(second.displacement - first.displacement + second.turn_less_one * joint.second_arm -
              first.turn_less_one * joint.first_arm) {}

    Vec3 first_arm, second_arm, gap;
};

struct Writer {
    JointRows& rows;
    Vec3 first_reach, second_reach, slip, spin;  // relative velocity at the joint, relative angular velocity
    int next = 0;

    void linear(Vec3 direction, double violation) noexcept {
        double* a = rows.first + 6 * next;
        double* b = rows.second + 6 * next;
        put(a, -direction);
        put(a + 3, -cross(first_reach, direction));
        put(b, direction);
        put(b + 3, cross(second_reach, direction));
        rows.violation[next] = violation;
        rows.rate[next] = dot(direction, slip);
        ++next;
    }
    void angular(Vec3 axis, double violation) noexcept {
        put(rows.first + 6 * next + 3, -axis);
        put(rows.second + 6 * next + 3, axis);
        rows.violation[next] = violation;
        rows.rate[next] = dot(axis, spin);
        ++next;
    }
};

/// |d| − rest of d = span + gap, and |d|. |d|² − |span|² without cancellation; span and rest differ only if the scene
/// says so.
double stretch(const JointConstants& joint, Vec3 gap, double& length) noexcept {
    length = norm(joint.span + gap);
    const double span = norm(joint.span);
    return (dot(gap, gap) + 2.0 * dot(joint.span, gap)) / (length + span) + (span - joint.rest_length);
}

void assemble_distance(const JointConstants& joint, const BodyState& first, const BodyState& second,
                       const Ends& ends, JointRows& rows) noexcept {
    double length = 0.0;
    rows.violation[0] = stretch(joint, ends.gap, length);
    const Vec3 direction = (1.0 / length) * (joint.span + ends.gap);
    const Vec3 slip = second.velocity + cross(second.angular_velocity, ends.second_arm) - first.velocity -
                      cross(first.angular_velocity, ends.first_arm);
    put(rows.first, -direction);
    put(rows.first + 3, -cross(ends.first_arm, direction));
    put(rows.second, direction);
    put(rows.second + 3, cross(ends.second_arm, direction));
    rows.rate[0] = dot(direction, slip);
}

}  // namespace

/// From one place to another, none where it is rounding of both: lengths are measured by it.
Vec3 arm_between(Vec3 from, Vec3 to) noexcept {
    constexpr double rounding = 4.0 * std::numeric_limits<double>::epsilon();
    const Vec3 arm = to - from;
    return norm(arm) <= rounding * (norm(from) + norm(to)) ? Vec3{} : arm;
}

JointConstants constants_of(const JointSpec& spec, const Vec3* first_start,
                            const Vec3* second_start) noexcept {
    JointConstants joint;
    joint.kind = spec.kind;
    joint.holds = holds_of(spec.kind);
    joint.rows = row_count(spec.kind);
    if (first_start) joint.first_arm = arm_between(*first_start, spec.first_point);
    if (second_start) joint.second_arm = arm_between(*second_start, spec.second_point);
    joint.span = arm_between(spec.first_point, spec.second_point);
    joint.axes = spec.axes;
    joint.rest_length = spec.rest_length;
    return joint;
}

void assemble_joint(const JointConstants& joint, const BodyState& first, const BodyState& second,
                    JointRows& rows, Vec3& first_reach, Vec3& second_reach) noexcept {
    const Ends ends(joint, first, second);
    first_reach = ends.first_arm;
    second_reach = ends.second_arm;
    if (joint.kind == JointKind::distance) return assemble_distance(joint, first, second, ends, rows);
    first_reach += ends.gap;
    Writer write{rows, first_reach, second_reach,
                 second.velocity + cross(second.angular_velocity, second_reach) - first.velocity -
                     cross(first.angular_velocity, first_reach),
                 second.angular_velocity - first.angular_velocity};
    Vec3 axes[3];
    for (int k = 0; k < 3; ++k) axes[k] = carried(first, joint.axes[k]);
    const JointHolds holds = joint.holds;
    for (int k = holds.linear_first; k < holds.linear_end; ++k) write.linear(axes[k], dot(axes[k], ends.gap));
    if (holds.turning == Turning::free) return;
    const Quat q = relative_turn(first, second);
    const Vec3 e{q.x, q.y, q.z};
    if (holds.turning == Turning::held) {
        const Vec3 world = carried(first, e);
        for (int k = 0; k < 3; ++k)
            write.angular(q.w * axes[k] + cross(world, axes[k]), 2.0 * dot(joint.axes[k], e));
        return;
    }
    const Mat3 tilt = rotation_less_one(q);
    if (holds.turning == Turning::swing) {
        const Vec3 moved = tilt * joint.axes[0];  // how far the second body's axis has left the first's
        const Vec3 axis = carried(second, joint.axes[0]);
        // n × axis for the two normals: n1 × a = −n2 and n2 × a = n1.
        write.angular(cross(axis, -axes[2]), -dot(joint.axes[2], moved));
        write.angular(cross(axis, axes[1]), dot(joint.axes[1], moved));
        return;
    }
    write.angular(cross(carried(second, joint.axes[1]), axes[0]), dot(joint.axes[0], tilt * joint.axes[1]));
}

void joint_violation(const JointConstants& joint, const BodyState& first, const BodyState& second,
                     double* out) noexcept {
    const Ends ends(joint, first, second);
    if (joint.kind == JointKind::distance) {
        double length = 0.0;
        *out = stretch(joint, ends.gap, length);
        return;
    }
    const JointHolds holds = joint.holds;
    for (int k = holds.linear_first; k < holds.linear_end; ++k)
        *out++ = dot(carried(first, joint.axes[k]), ends.gap);
    if (holds.turning == Turning::free) return;
    const Quat q = relative_turn(first, second);
    if (holds.turning == Turning::held) {
        for (int k = 0; k < 3; ++k) *out++ = 2.0 * dot(joint.axes[k], Vec3{q.x, q.y, q.z});
        return;
    }
    const Mat3 tilt = rotation_less_one(q);
    if (holds.turning == Turning::swing) {
        const Vec3 moved = tilt * joint.axes[0];
        *out++ = -dot(joint.axes[2], moved);
        *out++ = dot(joint.axes[1], moved);
        return;
    }
    *out++ = dot(joint.axes[0], tilt * joint.axes[1]);
}

void joint_bias(const JointConstants& joint, const BodyState& first, const BodyState& second,
                double* bias) noexcept {
    const Ends ends(joint, first, second);
    const Vec3 w1 = first.angular_velocity, w2 = second.angular_velocity;
    const auto spun = [](Vec3 w, Vec3 r) { return cross(w, cross(w, r)); };
    const Vec3 bend = spun(w2, ends.second_arm) - spun(w1, ends.first_arm);
    const Vec3 separation_rate =
        second.velocity + cross(w2, ends.second_arm) - first.velocity - cross(w1, ends.first_arm);
    if (joint.kind == JointKind::distance) {
        const Vec3 d = joint.span + ends.gap;
        const double length = norm(d), along = dot(d, separation_rate) / length;
        *bias = (dot(separation_rate, separation_rate) - along * along + dot(d, bend)) / length;
        return;
    }
    Vec3 axes[3];
    for (int k = 0; k < 3; ++k) axes[k] = carried(first, joint.axes[k]);
    const JointHolds holds = joint.holds;
    for (int k = holds.linear_first; k < holds.linear_end; ++k)
        *bias++ = dot(axes[k], bend) + 2.0 * dot(cross(w1, axes[k]), separation_rate) +
                  dot(spun(w1, axes[k]), ends.gap);
    if (holds.turning == Turning::free) return;
    if (holds.turning == Turning::held) {
        // q = t₁* t₂ with t' = ½ w t gives q'' = ¼ t₁* (d w₂ − w₁ d) t₂, d = w₂ − w₁.
        const Vec3 d = w2 - w1;
        const Quat inner = {dot(w1, d) - dot(d, w2), 0, 0, 0};
        const Vec3 turned = cross(d, w2) - cross(w1, d);
        const Quat q = conjugate(first.turn) * Quat{inner.w, turned.x, turned.y, turned.z} * second.turn;
        const Quat plain = conjugate(first.turn) * second.turn;
        const double sign = plain.w < 0.0 ? -0.5 : 0.5;
        for (int k = 0; k < 3; ++k) *bias++ = sign * dot(joint.axes[k], Vec3{q.x, q.y, q.z});
        return;
    }
    const auto angle_bias = [&](Vec3 a, Vec3 b) {  // of a · b, a carried by the first body, b by the second
        return dot(spun(w1, a), b) + 2.0 * dot(cross(w1, a), cross(w2, b)) + dot(a, spun(w2, b));
    };
    if (holds.turning == Turning::swing) {
        const Vec3 axis = carried(second, joint.axes[0]);
        *bias++ = -angle_bias(axes[2], axis);
        *bias++ = angle_bias(axes[1], axis);
        return;
    }
    *bias++ = angle_bias(axes[0], carried(second, joint.axes[1]));
}

void joint_curvature(const JointConstants& joint, const BodyState& first, const BodyState& second,
                     const BodyState& first_there, const BodyState& second_there, double h, OpenGap gap,
                     double* out) noexcept {
    JointRows rows{};
    double spare[2][36], there[6];
    rows.first = spare[0], rows.second = spare[1];
    Vec3 first_reach, second_reach;
    assemble_joint(joint, first, second, rows, first_reach, second_reach);
    joint_violation(joint, first_there, second_there, there);
    for (int k = 0; k < joint.rows; ++k) out[k] = there[k] - rows.violation[k] - h * rows.rate[k];
    if (joint.kind == JointKind::distance) return;
    const JointHolds holds = joint.holds;
    const Vec3 spins =
        cross(second.angular_velocity, second_reach) - cross(first.angular_velocity, first_reach);
    Vec3 slide = second.velocity - first.velocity + spins;  // along what no row holds
    Vec3 slid = second.displacement - first.displacement + second.turn_less_one * joint.second_arm -
                first.turn_less_one * joint.first_arm;
    const Vec3 bend =
        (second_there.turn_less_one * joint.second_arm - second.turn_less_one * joint.second_arm) -
        (first_there.turn_less_one * joint.first_arm - first.turn_less_one * joint.first_arm);
    for (int k = holds.linear_first; k < holds.linear_end; ++k) {
        const Vec3 axis = carried(first, joint.axes[k]);
        slide -= dot(axis, slide) * axis;
        if (gap == OpenGap::stays) slid -= dot(axis, slid) * axis;
    }
    // What has slid goes along with the first body, and slides on.
    const Quat turned = first_there.turn * conjugate(first.turn);
    const Vec3 ahead = slid + h * slide;
    const Vec3 way = ahead + rotation_less_one(turned) * ahead - slid;
    for (int k = holds.linear_first; k < holds.linear_end; ++k)
        *out++ = dot(carried(first, joint.axes[k]), bend - h * spins - way);
}

double axial_bias(const JointConstants& joint, const BodyState& first, const BodyState& second) noexcept {
    const Vec3 w1 = first.angular_velocity, w2 = second.angular_velocity;
    const Vec3 axis = carried(first, joint.axes[0]), turning = cross(w1, axis);
    if (joint.kind != JointKind::prismatic) return dot(turning, w2 - w1);
    const Ends ends(joint, first, second);
    const Vec3 bend = cross(w2, cross(w2, ends.second_arm)) - cross(w1, cross(w1, ends.first_arm));
    const Vec3 separation_rate =
        second.velocity + cross(w2, ends.second_arm) - first.velocity - cross(w1, ends.first_arm);
    return dot(axis, bend) + 2.0 * dot(turning, separation_rate) + dot(cross(w1, turning), ends.gap);
}

AxialRow axial_row(const JointConstants& joint, const BodyState& first, const BodyState& second) noexcept {
    return axial_row(joint, first, second, joint.kind == JointKind::prismatic);
}

AxialRow axial_row(const JointConstants& joint, const BodyState& first, const BodyState& second,
                   bool slides) noexcept {
    AxialRow row;
    const Ends ends(joint, first, second);
    const Vec3 axis = carried(first, joint.axes[0]), reach = ends.first_arm + ends.gap;
    if (slides) {
        put(row.first, -axis);
        put(row.first + 3, -cross(reach, axis));
        put(row.second, axis);
        put(row.second + 3, cross(ends.second_arm, axis));
        row.coordinate = dot(axis, ends.gap);
        row.rate = dot(axis, second.velocity + cross(second.angular_velocity, ends.second_arm) -
                                 first.velocity - cross(first.angular_velocity, reach));
        return row;
    }
    const Quat q = relative_turn(first, second);
    put(row.first + 3, -axis);
    put(row.second + 3, axis);
    row.coordinate = 2.0 * arc_tangent(dot(joint.axes[0], Vec3{q.x, q.y, q.z}), q.w);
    row.rate = dot(axis, second.angular_velocity - first.angular_velocity);
    return row;
}

}  // namespace spook

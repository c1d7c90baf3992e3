// A capsule against a box: the core segment against the box, then the radius.
//
// Apart, the closest points decide; over a face both ends of the stretch above that face are taken, so a lying
// capsule rests on two points. When the core itself cuts the box, the axis of least overlap among the box's
// faces and the three cross directions decides.
#include <algorithm>
#include <utility>

#include "collision/narrow_phase.hpp"
#include "collision/segment.hpp"

namespace spook {

namespace {

struct Builder {
    const Pose& box_pose;
    Vec3 half;
    double radius, margin;
    Segment core;  // box axes
    Manifold manifold;

    void add(Vec3 surface, Vec3 normal, double height, std::uint32_t feature) noexcept {
        const double gap = height - radius;
        if (gap <= margin)
            manifold.add(apply(box_pose, surface + 0.5 * gap * normal), box_pose.rotation * normal, gap,
                         feature);
    }

    /// Both ends of the part of the core above face `axis`, `sign`; false if there is none.
    bool add_face(int axis, double sign) noexcept {
        double low = -core.half, high = core.half;
        for (int i = 0; i < 3; ++i) {
            if (i == axis) continue;
            const double speed = core.direction[i], start = core.centre[i], reach = half[i] * (1.0 + 1e-9);
            if (std::abs(speed) < 1e-14) {
                if (std::abs(start) > reach) return false;
                continue;
            }
            double enter = (-reach - start) / speed, leave = (reach - start) / speed;
            if (enter > leave) std::swap(enter, leave);
            if (enter > low) low = enter;
            if (leave < high) high = leave;
        }
        if (low > high) return false;
        const std::uint32_t face = 2 * axis + (sign > 0.0);
        const bool upright = high - low < 1e-6 * core.half || std::abs(core.direction[axis]) > 1.0 - 1e-9;
        if (upright) {  // only the end nearer to the face
            const double t = sign * core.direction[axis] > 0.0 ? low : high;
            add_at(axis, sign, t, 4 * face);
            return true;
        }
        add_at(axis, sign, low, 4 * face + 1);
        add_at(axis, sign, high, 4 * face + 2);
        return true;
    }

    void add_at(int axis, double sign, double t, std::uint32_t feature) noexcept {
        Vec3 normal, surface = core.at(t);
        const double height = sign * surface[axis] - half[axis];
        normal[axis] = sign;
        surface[axis] = sign * half[axis];
        add(surface, normal, height, feature);
    }
};

void add_apart(Builder& builder, const SegmentBox& closest) noexcept {
    const Vec3 half = builder.half;
    const Vec3 p = builder.core.at(0.5 * (closest.low + closest.high));
    const Vec3 on_box{clamped(p.x, -half.x, half.x), clamped(p.y, -half.y, half.y),
                      clamped(p.z, -half.z, half.z)};
    const Vec3 normal = (1.0 / closest.distance) * (p - on_box);
    for (int i = 0; i < 3; ++i)
        if (std::abs(normal[i]) > 1.0 - 1e-9 && builder.add_face(i, normal[i] > 0.0 ? 1.0 : -1.0)) return;
    const bool line = closest.high > closest.low;
    std::uint32_t feature = line ? 25 : 24;
    for (const double t : {closest.low, closest.high}) {
        const Vec3 q = builder.core.at(t);
        const Vec3 surface{clamped(q.x, -half.x, half.x), clamped(q.y, -half.y, half.y),
                           clamped(q.z, -half.z, half.z)};
        builder.add(surface, normal, dot(normal, q - surface), feature++);
        if (!line) return;
    }
}

void add_cut(Builder& builder) noexcept {
    const Vec3 half = builder.half;
    const Segment& core = builder.core;
    int face = 0, cross_axis = -1;
    double best = -1e300;
    for (int i = 0; i < 3; ++i) {
        const double separation =
            std::abs(core.centre[i]) - core.half * std::abs(core.direction[i]) - half[i];
        if (separation > best) best = separation, face = i;
    }
    const double slop = 1e-4 * std::min({half.x, half.y, half.z});
    Vec3 normal;
    for (int i = 0; i < 3; ++i) {
        Vec3 unit;
        unit[i] = 1.0;
        const Vec3 axis = cross(unit, core.direction);
        const double length = norm(axis);
        if (length < 1e-4) continue;
        Vec3 n = (1.0 / length) * axis;
        if (dot(n, core.centre) < 0.0) n = -n;
        const double separation =
            dot(n, core.centre) - half.x * std::abs(n.x) - half.y * std::abs(n.y) - half.z * std::abs(n.z);
        if (separation > best + slop) best = separation, cross_axis = i, normal = n;
    }
    if (cross_axis < 0) {
        builder.add_face(face, core.centre[face] < 0.0 ? -1.0 : 1.0);
        return;
    }
    Segment edge{{}, {}, half[cross_axis]};
    edge.direction[cross_axis] = 1.0;
    for (int i = 0; i < 3; ++i)
        if (i != cross_axis) edge.centre[i] = normal[i] < 0.0 ? -half[i] : half[i];
    const SegmentPair closest = closest_parameters(core, edge);
    builder.add(edge.at(closest.second), normal,
                dot(normal, core.at(closest.first) - edge.at(closest.second)), 27 + cross_axis);
}

}  // namespace

Manifold capsule_box(const Primitive& capsule, const Pose& at, const Primitive& box, const Pose& at_box,
                     double margin) noexcept {
    const Segment world = capsule_core(capsule, at);
    Builder builder{at_box,
                    box.half,
                    capsule.radius,
                    margin,
                    {local(at_box.rotation, world.centre - at_box.position),
                     local(at_box.rotation, world.direction), world.half},
                    {}};
    const SegmentBox closest = closest_to_box(builder.core, box.half);
    if (closest.distance - capsule.radius > margin) return {};
    if (closest.distance > 1e-9 * capsule.radius) add_apart(builder, closest);
    else add_cut(builder);
    return builder.manifold;
}

}  // namespace spook

// Cylinders and cones against everything bounded: where something flat decides, what overlaps of the two sides that face
// each other; else the point where the features meet, or two points where a line of a side lies along another line.
#include <algorithm>

#include "collision/narrow_phase.hpp"
#include "collision/overlay.hpp"

namespace spook {

namespace {

constexpr std::uint32_t beside = 128;  // features beyond those of an overlay

template <class Other, class Facing, class Line>
Manifold meet(const Frustum& frustum, const Other& other, double radius, double thickness, double margin,
              Facing facing_of, Line line_of) noexcept {
    const SeparatingAxes axes = separating_axes(frustum, other, margin);
    if (axes.best().gap > margin) return {};
    const double smallest = std::min(frustum.thickness, thickness), slop = overlay_slop * smallest;
    const double tie = prefer_flat * smallest;
    const auto lines_along = [&](const SeparatingAxis& axis) noexcept {
        const Segment theirs = line_of(axis, slop);
        Manifold met =
            lines(farthest_line(frustum, axis.normal, slop), theirs, axis.normal, axis.gap, radius, margin);
        // Of a needle rounding may choose the wrong end: the whole line then.
        if (met.count == 0)
            met = lines(farthest_line(frustum, axis.normal, HUGE_VAL), theirs, axis.normal, axis.gap, radius,
                        margin);
        return met;
    };
    if (axes.curved.gap <= axes.flat.gap + tie) {
        const SeparatingAxis& axis = axes.flat;
        const Patch theirs = facing_of(axis.normal);
        const Patch ours = facing(frustum, axis.normal, theirs.normal);
        double least;
        Manifold manifold = overlay(ours, theirs, axis, radius, margin, slop, least);
        if (least <= axis.gap + slop) return manifold;
        // The deepest point lies beside the other's patch: off the face that looks along the axis most, or where the axis
        // that the tie kept off meets it. Apart, it is added; else it would arrive before those found.
        if (axis.gap > 0.0) {
            if (manifold.count > 0 && least <= axes.best().gap + tie) return manifold;
            if (axes.curved.gap > axis.gap + slop) {  // else the two are one direction
                const Manifold nearest = lines_along(axes.curved);
                for (int k = 0; k < nearest.count; ++k) {
                    const ContactPoint& point = nearest.points[static_cast<std::size_t>(k)];
                    manifold.add(point.position, point.normal, point.gap, beside + point.feature);
                }
                return manifold;
            }
        }
        const bool on_cap = std::abs(dot(axis.normal, frustum.axis)) > 1.0 - 1e-9;
        const Segment line = line_of(axis, 0.0);
        const Vec3 cap = frustum.centre[dot(axis.normal, frustum.axis) > 0.0];
        const Vec3 deepest =
            on_cap ? line.at(closest_parameter(line, cap)) - (radius + 0.5 * axis.gap) * axis.normal
                   : farthest_line(frustum, axis.normal, 0.0).centre + 0.5 * axis.gap * axis.normal;
        manifold.add(deepest, axis.normal, axis.gap, beside);
        return manifold;
    }
    return lines_along(axes.curved);
}

Manifold turned(
    Manifold manifold) noexcept {  // axes point from the frustum to the other: from first to second
    for (int k = 0; k < manifold.count; ++k) {
        Vec3& normal = manifold.points[static_cast<std::size_t>(k)].normal;
        normal = -normal;
    }
    return manifold;
}

}  // namespace

Manifold facets_frustum(const Primitive& facets, const Pose& at, const Primitive& frustum,
                        const Pose& at_frustum, double margin) noexcept {
    const Facets other(facets, at);
    return meet(
        Frustum(frustum, at_frustum), other, other.radius, other.thickness, margin,
        [&](Vec3 n) { return facing(other, -n); },
        [&](const SeparatingAxis& axis, double slop) {
            return lowest_line(other, axis.normal, axis.edge, slop);
        });
}

Manifold frustum_frustum(const Primitive& first, const Pose& at_first, const Primitive& second,
                         const Pose& at_second, double margin) noexcept {
    const Frustum one(first, at_first), two(second, at_second);
    return turned(meet(
        one, two, 0.0, two.thickness, margin,
        [&](Vec3 n) {
            const Patch plain = facing(one, n, {});
            return facing(two, -n, plain.normal);
        },
        [&](const SeparatingAxis& axis, double slop) { return farthest_line(two, -axis.normal, slop); }));
}

}  // namespace spook

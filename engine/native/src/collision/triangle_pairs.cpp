// Everything bounded against a triangle of a mesh: as against a face, an edge or a corner, but only where it is genuine.
#include <algorithm>

#include "collision/narrow_phase.hpp"
#include "collision/overlay.hpp"
#include "collision/triangle.hpp"

namespace spook {

namespace {

Patch face_of(const Triangle& triangle, Vec3 n) noexcept {
    Patch patch;
    patch.kind = Patch::polygon;
    patch.normal = triangle.normal;
    patch.count = 3;
    for (std::size_t k = 0; k < 3; ++k) patch.corners[k] = triangle.facets.corners[k];
    const unsigned hidden = triangle.hidden(n);
    patch.hidden_corners = hidden & 7u, patch.hidden_sides = hidden >> 3;
    return patch;
}

/// A mesh is met from outside: what has its centre below the face is let alone.
template <class Other, class Facing, class Line>
Manifold meet(const Triangle& triangle, const Other& other, Vec3 centre, double radius, double thickness,
              double margin, Facing facing_of, Line line_of) noexcept {
    if (!(dot(triangle.normal, centre - triangle.facets.corners[0]) > 0.0)) return {};
    const TriangleAxes axes = separating_axes(triangle, other, margin);
    if (axes.all.gap > margin) return {};
    const double slop = overlay_slop * thickness;
    // Apart, only what is nearest counts: else another point of the two would arrive before those named here.
    const double nearest = axes.all.gap > slop ? axes.all.gap + slop : 1e300;
    const SeparatingAxis& axis = axes.curved;
    if (axis.gap <= axes.flat.gap + prefer_flat * thickness) {
        double least;
        const Vec3 n = axes.flat.normal;
        const Manifold found =
            overlay(face_of(triangle, n), facing_of(n), axes.flat, radius, margin, slop, least);
        // Apart and yet below the face: it has passed the rim and lies behind.
        const bool behind = axes.all.gap > slop && least < 0.0;
        if (found.count > 0) return least <= nearest && !behind ? found : Manifold{};
        if (axis.gap < axes.flat.gap) return {};
    }
    // Along the face's own normal an edge or a corner holds what the faces round it do not: nothing.
    if (axis.gap + slop < axes.all.gap || norm(axis.normal - triangle.normal) < 1e-8) return {};
    return lines(lowest_line(triangle.facets, -axis.normal, -1, slop), line_of(axis, slop), axis.normal,
                 axis.gap, radius, margin);
}

}  // namespace

Manifold facets_triangle(const Primitive& facets, const Pose& at, const Primitive& triangle,
                         const Pose& at_triangle, double margin) noexcept {
    const Facets other(facets, at);
    return meet(
        Triangle(triangle, at_triangle), other, at.position, other.radius, other.thickness, margin,
        [&](Vec3 n) { return facing(other, -n); },
        [&](const SeparatingAxis& axis, double slop) {
            return lowest_line(other, axis.normal, axis.edge, slop);
        });
}

Manifold frustum_triangle(const Primitive& frustum, const Pose& at, const Primitive& triangle,
                          const Pose& at_triangle, double margin) noexcept {
    const Frustum other(frustum, at);
    const Triangle face(triangle, at_triangle);
    return meet(
        face, other, at.position, 0.0, other.thickness, margin,
        [&](Vec3 n) { return facing(other, -n, face.normal); },
        [&](const SeparatingAxis& axis, double slop) { return farthest_line(other, -axis.normal, slop); });
}

}  // namespace spook

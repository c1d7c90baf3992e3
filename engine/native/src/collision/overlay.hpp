// Contact points of two convex features that face each other along a direction: discs, polygons, lines.
#pragma once

#include <array>

#include "collision/frustum.hpp"
#include "collision/manifold.hpp"
#include "collision/segment.hpp"
#include "collision/tolerances.hpp"

namespace spook {

/// What faces the other shape: a disc, a polygon, or a line; its shape's radius lies between it and the surface.
struct Patch {
    enum Kind { line, polygon, disc } kind = line;
    std::array<Vec3, Polytope::most_round_a_face> corners{};  // a disc's: four points of its rim
    int count = 0;
    Vec3 normal;  // unit, out of its shape; of a line none
    Vec3 centre;  // of a disc
    double radius = 0.0;
    unsigned hidden_corners = 0, hidden_sides = 0;  // in bits: those that hold nothing
};

/// Of a frustum towards `n`; `other` is the opposite flat's normal, if it has one.
Patch facing(const Frustum& frustum, Vec3 n, Vec3 other) noexcept;
Patch facing(const Facets& facets, Vec3 n) noexcept;

/// Points of both patches that lie before each other along the axis (from first to second), with the gaps there.
/// `radius` is that of the second, `least` the least of the gaps.
Manifold overlay(const Patch& first, const Patch& second, const SeparatingAxis& axis, double radius,
                 double margin, double slop, double& least) noexcept;

/// The line or the point of a shape that is farthest along `n`, or lowest: the edge that is named, if any.
Segment farthest_line(const Frustum& frustum, Vec3 n, double slop) noexcept;
Segment lowest_line(const Facets& facets, Vec3 n, int edge, double slop) noexcept;

/// Where two lines or points meet along `n` (from first to second): one point, or two where they lie along each other.
Manifold lines(const Segment& first, const Segment& second, Vec3 n, double gap, double radius,
               double margin) noexcept;

}  // namespace spook

// Cylinders and cones as one: the hull of two discs on an axis, and along which directions others may part from it.
#pragma once

#include "collision/polytope.hpp"
#include "collision/shape.hpp"

namespace spook {

/// A cylinder or a cone where it stands, world axes.
struct Frustum {
    Vec3 axis;            // unit, from the low to the high end
    Vec3 centre[2];       // of both ends, m
    double radius[2];     // of both ends, m; zero is an apex
    double sine, cosine;  // its side's normals are cosine · radial + sine · axis
    Vec3 sideways;        // a unit vector across the axis, fixed in the body
    double thickness;     // m

    Frustum(const Primitive& primitive, const Pose& at) noexcept;

    /// Largest n · p over one end, given |n × axis|.
    double end(int i, Vec3 n, double across) const noexcept { return dot(n, centre[i]) + radius[i] * across; }
    double reach(Vec3 n) const noexcept {
        const double across = norm(cross(n, axis));
        return std::max(end(0, n, across), end(1, n, across));
    }
    Vec3 radial(Vec3 v) const noexcept { return v - dot(v, axis) * axis; }
    /// What lies across the axis but for rounding, as a unit vector that does; one fixed in the body where only rounding
    /// is left.
    Vec3 unit_across(Vec3 v) const noexcept;
    /// The unit vector across the axis nearest to n; of one along the axis the one fixed in the body.
    Vec3 outward(Vec3 n) const noexcept;
};

/// Corners, edges and faces where they stand, world axes, grown by a radius: a ball has one corner, a capsule one edge.
struct Facets {
    static constexpr int most_faces = 2 * Polytope::most_corners;
    int corner_count = 0, edge_count = 0, face_count = 0;
    Vec3 corners[Polytope::most_corners], normals[most_faces];
    const Polytope::Edge* edges = nullptr;
    const Polytope* shape = nullptr;       // none: without faces
    double radius = 0.0, thickness = 0.0;  // m

    Facets(const Primitive& primitive,
           const Pose& at) noexcept;  // not of a plane, nor of what has rims

    double lowest(Vec3 n) const noexcept;  // least n · corner
};

struct Triangle;

/// A direction in which two shapes may part, from the frustum to the other; the gap along it is a lower bound of their
/// distance, and the largest over all directions is that distance, or minus the least overlap.
struct SeparatingAxis {
    double gap = -1e300;  // m
    Vec3 normal;
    int edge = -1;  // of the other, where one is met
};

/// The best axis normal to something flat, and the best of all others: normals of the side at a corner, an edge or
/// another side, and of rims with corners, edges, sides and rims. The maximum over all directions is among them, as it
/// is a stationary point of the gap that some pair of features gives. Stops where one exceeds `margin` [m].
struct SeparatingAxes {
    SeparatingAxis flat, curved, all;
    const SeparatingAxis& best() const noexcept { return curved.gap > flat.gap ? curved : flat; }
};
/// Of a triangle only its genuine axes count for `flat` and `curved`; `all` holds the best of any kind.
SeparatingAxes separating_axes(const Frustum& frustum, const Facets& other, double margin,
                               const Triangle* sheet = nullptr) noexcept;
SeparatingAxes separating_axes(const Frustum& frustum, const Frustum& other, double margin) noexcept;

}  // namespace spook

// Contact points of two primitives.
#pragma once

#include "collision/manifold.hpp"
#include "collision/shape.hpp"

namespace spook {

/// Contact points of `first` and `second` whose gap is at most `margin` [m]; normals from second to first.
/// Any two kinds; two planes never touch. Pure: equal input gives equal bits. Degenerate positions (coincident
/// centres, parallel edges, a centre inside a box) get a fixed normal instead of none. Within `margin` but
/// apart, boxes facing each other only at corners give no point: their faces do not overlap yet.
Manifold collide(const Primitive& first, const Pose& at_first, const Primitive& second, const Pose& at_second,
                 double margin) noexcept;

// The pairs, lower kind first; `collide` chooses among them.
Manifold sphere_sphere(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold sphere_capsule(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold sphere_box(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold sphere_plane(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold capsule_capsule(const Primitive&, const Pose&, const Primitive&, const Pose&,
                         double margin) noexcept;
Manifold capsule_box(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold capsule_plane(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold box_box(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
/// Two boxes or hulls, not both boxes: separating axes and clipped faces.
Manifold solid_solid(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold sphere_hull(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold capsule_hull(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
/// A ball, capsule, box or hull and a cylinder or cone.
Manifold facets_frustum(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
/// Two cylinders or cones.
Manifold frustum_frustum(const Primitive&, const Pose&, const Primitive&, const Pose&,
                         double margin) noexcept;
Manifold sphere_cylinder(const Primitive&, const Pose&, const Primitive&, const Pose&,
                         double margin) noexcept;
Manifold cylinder_plane(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
/// Anything bounded and a triangle of a mesh: no point where a neighbouring triangle is met first.
Manifold facets_triangle(const Primitive&, const Pose&, const Primitive&, const Pose&,
                         double margin) noexcept;
Manifold frustum_triangle(const Primitive&, const Pose&, const Primitive&, const Pose&,
                          double margin) noexcept;
Manifold cone_plane(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold hull_plane(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;
Manifold box_plane(const Primitive&, const Pose&, const Primitive&, const Pose&, double margin) noexcept;

}  // namespace spook

#include "collision/narrow_phase.hpp"

namespace spook {

namespace {

using Pair = Manifold (*)(const Primitive&, const Pose&, const Primitive&, const Pose&, double) noexcept;

Manifold never(const Primitive&, const Pose&, const Primitive&, const Pose&, double) noexcept { return {}; }

// By kind of the first (row) and the second (column), in the order of ShapeKind.
constexpr Pair pairs[8][8] = {
    {sphere_sphere, sphere_capsule, sphere_box, sphere_hull, sphere_cylinder, facets_frustum, sphere_plane,
     facets_triangle},
    {nullptr, capsule_capsule, capsule_box, capsule_hull, facets_frustum, facets_frustum, capsule_plane,
     facets_triangle},
    {nullptr, nullptr, box_box, solid_solid, facets_frustum, facets_frustum, box_plane, facets_triangle},
    {nullptr, nullptr, nullptr, solid_solid, facets_frustum, facets_frustum, hull_plane, facets_triangle},
    {nullptr, nullptr, nullptr, nullptr, frustum_frustum, frustum_frustum, cylinder_plane, frustum_triangle},
    {nullptr, nullptr, nullptr, nullptr, nullptr, frustum_frustum, cone_plane, frustum_triangle},
    {nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, never, never},
    {nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, never},
};

}  // namespace

Manifold collide(const Primitive& first, const Pose& at_first, const Primitive& second, const Pose& at_second,
                 double margin) noexcept {
    const int i = static_cast<int>(first.kind), j = static_cast<int>(second.kind);
    if (i <= j) return pairs[i][j](first, at_first, second, at_second, margin);
    Manifold swapped = pairs[j][i](second, at_second, first, at_first, margin);
    for (int k = 0; k < swapped.count; ++k) swapped.points[k].normal = -swapped.points[k].normal;
    return swapped;
}

}  // namespace spook

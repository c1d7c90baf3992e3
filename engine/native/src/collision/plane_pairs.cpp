// Sphere, capsule and box against a half-space: one point per ball, per cap, per vertex.
#include "collision/narrow_phase.hpp"

namespace spook {

namespace {

struct WorldPlane {
    Vec3 normal;
    Vec3 origin;
    double height(Vec3 p) const noexcept { return dot(normal, p - origin); }
};

WorldPlane placed_plane(const Primitive& plane, const Pose& at) noexcept {
    return {at.rotation * plane.normal, at.position};
}

void add_ball(Manifold& manifold, Vec3 centre, double radius, const WorldPlane& plane, double margin,
              std::uint32_t feature) noexcept {
    const double gap = plane.height(centre) - radius;
    if (gap <= margin) manifold.add(centre - (radius + 0.5 * gap) * plane.normal, plane.normal, gap, feature);
}

}  // namespace

Manifold sphere_plane(const Primitive& sphere, const Pose& at, const Primitive& plane, const Pose& at_plane,
                      double margin) noexcept {
    Manifold manifold;
    add_ball(manifold, at.position, sphere.radius, placed_plane(plane, at_plane), margin, 0);
    return manifold;
}

Manifold capsule_plane(const Primitive& capsule, const Pose& at, const Primitive& plane, const Pose& at_plane,
                       double margin) noexcept {
    Manifold manifold;
    const WorldPlane ground = placed_plane(plane, at_plane);
    const Vec3 axis = capsule.half_length * column(at.rotation, 2);
    add_ball(manifold, at.position - axis, capsule.radius, ground, margin, 0);
    add_ball(manifold, at.position + axis, capsule.radius, ground, margin, 1);
    return manifold;
}

Manifold box_plane(const Primitive& box, const Pose& at, const Primitive& plane, const Pose& at_plane,
                   double margin) noexcept {
    Manifold manifold;
    const WorldPlane ground = placed_plane(plane, at_plane);
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
        const Vec3 sign{corner & 1 ? 1.0 : -1.0, corner & 2 ? 1.0 : -1.0, corner & 4 ? 1.0 : -1.0};
        const Vec3 point = apply(at, {sign.x * box.half.x, sign.y * box.half.y, sign.z * box.half.z});
        const double gap = ground.height(point);
        if (gap <= margin) manifold.add(point - 0.5 * gap * ground.normal, ground.normal, gap, corner);
    }
    return manifold;
}

}  // namespace spook

// Cylinders against planes and spheres, cones against planes, in closed form.
#include "collision/cylinder.hpp"

#include "collision/frustum.hpp"
#include "collision/narrow_phase.hpp"
#include "collision/segment.hpp"

namespace spook {

/// Four points a rim: the lowest, its opposite and the two between. A disc that leans in any direction is held at its
/// very edge there; while it lies flat the lowest point is not defined, and it stands on the corners of a square. As it leans
/// the two between draw in to the middle: a disc that lands flat has them at its edge, and a wheel has no surface there.
Manifold cylinder_plane(const Primitive& cylinder, const Pose& at, const Primitive& plane,
                        const Pose& at_plane, double margin) noexcept {
    const Vec3 n = at_plane.rotation * plane.normal, axis = column(at.rotation, 2);
    const Vec3 level = -n + dot(n, axis) * axis;
    const Vec3 flat = column(at.rotation, 0);
    const Vec3 down = norm(level) > 1e-12 ? unit_across(level, axis, flat) : flat;
    const Vec3 aside = std::abs(dot(n, axis)) * cross(axis, down);
    const Vec3 spokes[4] = {down, aside, -down, -aside};
    Manifold manifold;
    for (std::uint32_t k = 0; k < 8; ++k) {
        const Vec3 point = at.position + (k < 4 ? -cylinder.half_length : cylinder.half_length) * axis +
                           cylinder.radius * spokes[k % 4];
        const double gap = dot(n, point - at_plane.position);
        if (gap <= margin) manifold.add(point - 0.5 * gap * n, n, gap, k);
    }
    return manifold;
}

/// The apex, and four points of the rim as of a cylinder's.
Manifold cone_plane(const Primitive& cone, const Pose& at, const Primitive& plane, const Pose& at_plane,
                    double margin) noexcept {
    const Vec3 n = at_plane.rotation * plane.normal;
    const Frustum frustum(cone, at);
    const Vec3 down = frustum.outward(-n);
    const Vec3 aside = std::abs(dot(n, frustum.axis)) * cross(frustum.axis, down);
    const Vec3 spokes[5] = {down, aside, -down, -aside, {}};
    Manifold manifold;
    for (std::uint32_t k = 0; k < 5; ++k) {
        const Vec3 point = k < 4 ? frustum.centre[0] + cone.radius * spokes[k] : frustum.centre[1];
        const double gap = dot(n, point - at_plane.position);
        if (gap <= margin) manifold.add(point - 0.5 * gap * n, n, gap, k);
    }
    return manifold;
}

Nearest nearest_on_cylinder(const Primitive& cylinder, Vec3 p) noexcept {
    const double r = cylinder.radius, half = cylinder.half_length;
    const double away = std::sqrt(p.x * p.x + p.y * p.y);
    const Vec3 out = away > 0.0 ? Vec3{p.x / away, p.y / away, 0.0} : Vec3{1.0, 0.0, 0.0};
    const double beside = away - r, beyond = std::abs(p.z) - half, side = p.z < 0.0 ? -1.0 : 1.0;
    if (beside <= 0.0 && beyond <= 0.0) {  // inside: the nearer of side and cap
        if (beside > beyond) return {{r * out.x, r * out.y, p.z}, out, beside};
        return {{p.x, p.y, side * half}, {0.0, 0.0, side}, beyond};
    }
    const double rho = std::min(away, r), z = clamped(p.z, -half, half);
    const Vec3 on{rho * out.x, rho * out.y, z}, between = p - on;
    const double distance = norm(between);
    if (distance > 0.0) return {on, (1.0 / distance) * between, distance};
    return {on, beside > beyond ? out : Vec3{0.0, 0.0, side}, 0.0};  // outside by less than rounding
}

Manifold sphere_cylinder(const Primitive& sphere, const Pose& at, const Primitive& cylinder,
                         const Pose& at_cylinder, double margin) noexcept {
    Manifold manifold;
    const Nearest near =
        nearest_on_cylinder(cylinder, local(at_cylinder.rotation, at.position - at_cylinder.position));
    const double gap = near.height - sphere.radius;
    if (gap <= margin)
        manifold.add(apply(at_cylinder, near.on + 0.5 * gap * near.normal),
                     at_cylinder.rotation * near.normal, gap, 0);
    return manifold;
}

}  // namespace spook

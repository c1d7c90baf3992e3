// Pairs of round things: spheres and capsules with each other, and a sphere with a box.
#include "collision/narrow_phase.hpp"
#include "collision/segment.hpp"

namespace spook {

namespace {

struct Ball {
    Vec3 centre;
    double radius;
};

/// Adds the point of two balls. `fallback` is the normal if their centres coincide.
void add_balls(Manifold& manifold, Ball first, Ball second, Vec3 fallback, double margin,
               std::uint32_t feature) noexcept {
    const Vec3 between = first.centre - second.centre;
    const double distance = norm(between);
    const double gap = distance - first.radius - second.radius;
    if (gap > margin) return;
    const bool coincident = distance <= 1e-14 * (first.radius + second.radius);
    const Vec3 normal = coincident ? fallback : (1.0 / distance) * between;
    manifold.add(second.centre + (second.radius + 0.5 * gap) * normal, normal, gap, feature);
}

}  // namespace

Manifold sphere_sphere(const Primitive& first, const Pose& at_first, const Primitive& second,
                       const Pose& at_second, double margin) noexcept {
    Manifold manifold;
    add_balls(manifold, {at_first.position, first.radius}, {at_second.position, second.radius}, {0, 0, 1},
              margin, 0);
    return manifold;
}

Manifold sphere_capsule(const Primitive& sphere, const Pose& at, const Primitive& capsule,
                        const Pose& at_capsule, double margin) noexcept {
    Manifold manifold;
    const Segment core = capsule_core(capsule, at_capsule);
    const Vec3 nearest = core.at(closest_parameter(core, at.position));
    add_balls(manifold, {at.position, sphere.radius}, {nearest, capsule.radius},
              any_normal_to(core.direction), margin, 0);
    return manifold;
}

Manifold capsule_capsule(const Primitive& first, const Pose& at_first, const Primitive& second,
                         const Pose& at_second, double margin) noexcept {
    Manifold manifold;
    const Segment one = capsule_core(first, at_first), two = capsule_core(second, at_second);
    const SegmentPair closest = closest_parameters(one, two);
    const Vec3 sine = cross(one.direction, two.direction);
    const Vec3 fallback = closest.parallel ? any_normal_to(one.direction) : (1.0 / norm(sine)) * sine;
    if (closest.parallel) {  // a line of contact: one point at each end of the shared stretch
        const double middle = dot(two.centre - one.centre, one.direction);
        const double low = clamped(middle - two.half, -one.half, one.half);
        const double high = clamped(middle + two.half, -one.half, one.half);
        if (high - low > 1e-6 * (one.half + two.half)) {
            std::uint32_t feature = 1;
            for (const double t : {low, high}) {
                const Vec3 p = one.at(t);
                add_balls(manifold, {p, first.radius}, {two.at(closest_parameter(two, p)), second.radius},
                          fallback, margin, feature++);
            }
            return manifold;
        }
    }
    add_balls(manifold, {one.at(closest.first), first.radius}, {two.at(closest.second), second.radius},
              fallback, margin, 0);
    return manifold;
}

Manifold sphere_box(const Primitive& sphere, const Pose& at, const Primitive& box, const Pose& at_box,
                    double margin) noexcept {
    Manifold manifold;
    const Vec3 p = local(at_box.rotation, at.position - at_box.position), half = box.half;
    const Vec3 inside{clamped(p.x, -half.x, half.x), clamped(p.y, -half.y, half.y),
                      clamped(p.z, -half.z, half.z)};
    const Vec3 outward = p - inside;
    const double distance = norm(outward);
    Vec3 normal, surface = inside;
    double height = distance;
    if (distance > 0.0) {
        normal = (1.0 / distance) * outward;
    } else {  // the centre is inside: leave through the nearest face
        int face = 0;
        for (int i = 1; i < 3; ++i)
            if (std::abs(p[i]) - half[i] > std::abs(p[face]) - half[face]) face = i;
        const double sign = p[face] < 0.0 ? -1.0 : 1.0;
        normal[face] = sign;
        surface[face] = sign * half[face];
        height = std::abs(p[face]) - half[face];
    }
    const double gap = height - sphere.radius;
    if (gap <= margin)
        manifold.add(apply(at_box, surface + 0.5 * gap * normal), at_box.rotation * normal, gap, 0);
    return manifold;
}

}  // namespace spook

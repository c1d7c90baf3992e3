#include "collision/shape_cast.hpp"

#include <algorithm>
#include <cmath>

#include "collision/advance.hpp"
#include "collision/bounds.hpp"
#include "collision/cylinder.hpp"
#include "collision/frustum.hpp"
#include "collision/segment.hpp"
#include "collision/solid_pairs.hpp"
#include "collision/triangle.hpp"
#include "linear/elementary.hpp"

namespace spook {

namespace {

Segment core(const Primitive& shape, const Pose& at) noexcept {
    return shape.kind == ShapeKind::capsule ? capsule_core(shape, at)
                                            : Segment{at.position, {0.0, 0.0, 1.0}, 0.0};
}

double box_reach(const Primitive& box, const Pose& at, Vec3 n) noexcept {
    const Vec3 m = local(at.rotation, n);
    return box.half.x * std::abs(m.x) + box.half.y * std::abs(m.y) + box.half.z * std::abs(m.z);
}

Separation from_points(Vec3 between, double radii, Vec3 fallback) noexcept {
    const double distance = norm(between);
    return {distance - radii, distance > 1e-14 * radii ? (1.0 / distance) * between : fallback};
}

Separation round_round(const Primitive& first, const Pose& at_first, const Primitive& second,
                       const Pose& at_second) noexcept {
    const double radii = first.radius + second.radius;
    if (first.kind == ShapeKind::sphere && second.kind == ShapeKind::sphere)
        return from_points(at_first.position - at_second.position, radii, {0, 0, 1});
    const Segment one = core(first, at_first), two = core(second, at_second);
    if (one.half == 0.0)
        return from_points(one.centre - two.at(closest_parameter(two, one.centre)), radii,
                           any_normal_to(two.direction));
    const SegmentPair closest = closest_parameters(one, two);
    return from_points(one.at(closest.first) - two.at(closest.second), radii, any_normal_to(one.direction));
}

Separation round_box(const Primitive& round, const Pose& at, const Primitive& box,
                     const Pose& at_box) noexcept {
    Segment segment = core(round, at);
    segment.centre = local(at_box.rotation, segment.centre - at_box.position);
    segment.direction = local(at_box.rotation, segment.direction);
    Vec3 p = segment.centre;
    if (segment.half > 0.0) {
        const SegmentBox closest = closest_to_box(segment, box.half);
        p = segment.at(0.5 * (closest.low + closest.high));
    }
    const Vec3 on{clamped(p.x, -box.half.x, box.half.x), clamped(p.y, -box.half.y, box.half.y),
                  clamped(p.z, -box.half.z, box.half.z)};
    const double distance = norm(p - on);
    if (distance > 0.0) return {distance - round.radius, at_box.rotation * ((1.0 / distance) * (p - on))};
    int face = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(p[i]) - box.half[i] > std::abs(p[face]) - box.half[face]) face = i;
    Vec3 normal;
    normal[face] = p[face] < 0.0 ? -1.0 : 1.0;
    return {std::abs(p[face]) - box.half[face] - round.radius, at_box.rotation * normal};
}

Separation box_box(const Primitive& first, const Pose& at_first, const Primitive& second,
                   const Pose& at_second) noexcept {
    const Vec3 between = at_first.position - at_second.position;
    Separation best{-1e300, {}};
    auto improve = [&](Vec3 n) noexcept {
        const double along = dot(n, between);
        const double gap = std::abs(along) - box_reach(first, at_first, n) - box_reach(second, at_second, n);
        if (gap > best.gap) best = {gap, along < 0.0 ? -n : n};
    };
    for (int i = 0; i < 3; ++i) improve(column(at_first.rotation, i));
    for (int i = 0; i < 3; ++i) improve(column(at_second.rotation, i));
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const Vec3 n = cross(column(at_first.rotation, i), column(at_second.rotation, j));
            const double length = norm(n);
            if (length > 1e-6) improve((1.0 / length) * n);
        }
    return best;
}

Separation round_hull(const Primitive& round, const Pose& at, const Primitive& hull,
                      const Pose& at_hull) noexcept {
    Segment segment = core(round, at);
    segment.centre = local(at_hull.rotation, segment.centre - at_hull.position);
    if (segment.half == 0.0) {
        const Nearest near = nearest(*hull.hull, segment.centre);
        return {near.height - round.radius, at_hull.rotation * near.normal};
    }
    segment.direction = local(at_hull.rotation, segment.direction);
    const SegmentSolid near = segment_solid(segment, *hull.hull);
    return {near.gap - round.radius, at_hull.rotation * near.normal};
}

Separation solids(const Primitive& first, const Pose& at_first, const Primitive& second,
                  const Pose& at_second, double far) noexcept {
    const SolidAxes axes = solid_axes(Solid(first, at_first), Solid(second, at_second), far);
    const SolidAxes::Best* best = &axes.first_face;
    if (axes.second_face.gap > best->gap) best = &axes.second_face;
    if (axes.edges.gap > best->gap) best = &axes.edges;
    return {best->gap, best->normal};
}

Separation from_plane(const Primitive& shape, const Pose& at, const Primitive& plane,
                      const Pose& at_plane) noexcept {
    const Vec3 n = at_plane.rotation * plane.normal;
    const double height = dot(n, at.position - at_plane.position);
    switch (shape.kind) {
        case ShapeKind::sphere: return {height - shape.radius, n};
        case ShapeKind::capsule:
            return {height - shape.radius - shape.half_length * std::abs(dot(n, column(at.rotation, 2))), n};
        case ShapeKind::cylinder: return {height - cylinder_reach(shape, column(at.rotation, 2), n), n};
        case ShapeKind::cone: return {-Frustum(shape, at).reach(-n) - dot(n, at_plane.position), n};
        case ShapeKind::hull: return {height - farthest(*shape.hull, -local(at.rotation, n)), n};
        case ShapeKind::box: return {height - box_reach(shape, at, n), n};
        case ShapeKind::triangle:
        case ShapeKind::plane: break;
    }
    return {1e300, n};  // both are fixed
}

}  // namespace

Separation separation(const Primitive& first, const Pose& at_first, const Primitive& second,
                      const Pose& at_second, double far) noexcept {
    if (first.kind > second.kind) {
        Separation swapped = separation(second, at_second, first, at_first, far);
        swapped.normal = -swapped.normal;
        return swapped;
    }
    if (second.kind == ShapeKind::triangle) {
        if (first.kind == ShapeKind::plane) return {1e300, {0.0, 0.0, 1.0}};  // both are fixed
        if (first.has_rims()) {  // from the first, and of neighbours nothing is asked
            const SeparatingAxis best =
                separating_axes(Frustum(first, at_first), Facets(second, at_second), far).all;
            return {best.gap, -best.normal};
        }
        const SeparatingAxis best =
            separating_axes(Triangle(second, at_second), Facets(first, at_first), far).all;
        return {best.gap, best.normal};
    }
    if (second.kind == ShapeKind::plane) return from_plane(first, at_first, second, at_second);
    if (second.has_rims() && !(first.kind == ShapeKind::sphere && second.kind == ShapeKind::cylinder)) {
        const Frustum frustum(second, at_second);
        const SeparatingAxis best = first.has_rims()
                                        ? separating_axes(frustum, Frustum(first, at_first), far).best()
                                        : separating_axes(frustum, Facets(first, at_first), far).best();
        return {best.gap, best.normal};
    }
    if (second.kind == ShapeKind::cylinder) {
        const Nearest near =
            nearest_on_cylinder(second, local(at_second.rotation, at_first.position - at_second.position));
        return {near.height - first.radius, at_second.rotation * near.normal};
    }
    if (second.kind == ShapeKind::hull)
        return first.faceted() ? solids(first, at_first, second, at_second, far)
                               : round_hull(first, at_first, second, at_second);
    if (first.kind == ShapeKind::box) return box_box(first, at_first, second, at_second);
    if (second.kind == ShapeKind::box) return round_box(first, at_first, second, at_second);
    return round_round(first, at_first, second, at_second);
}

Pose Mover::body_at(double time) const noexcept {
    const double rate = norm(spin), angle = time * rate;
    Pose pose{body.position + time * velocity, body.rotation};
    if (angle == 0.0 || (shape.kind == ShapeKind::sphere && norm(part.position) == 0.0)) return pose;
    const Vec3 n = (1.0 / rate) * spin;
    const SineCosine turn = sine_cosine(angle);
    const double s = turn.sine, c = 1.0 - turn.cosine;
    for (int k = 0; k < 3; ++k) {  // Rodrigues, column by column
        const Vec3 e = column(body.rotation, k), ne = cross(n, e);
        const Vec3 turned = e + s * ne + c * cross(n, ne);
        for (int i = 0; i < 3; ++i) pose.rotation.m[3 * i + k] = turned[i];
    }
    return pose;
}

double turning_arm(const Primitive& shape, const Pose& part) noexcept {
    const double offset = norm(part.position);
    switch (shape.kind) {
        case ShapeKind::sphere: return offset;
        case ShapeKind::capsule: return offset + shape.half_length;
        case ShapeKind::box:
        case ShapeKind::cylinder:
        case ShapeKind::cone:
        case ShapeKind::hull:
        case ShapeKind::triangle:
        case ShapeKind::plane: break;
    }
    return offset + reach(shape);
}

namespace {

/// How fast a body's spin can move its shape along any direction, m/s; `far` bounds how far away it may act.
double turning_speed(const Mover& mover, double far) noexcept {
    return norm(mover.spin) *
           (mover.shape.kind == ShapeKind::plane ? far : turning_arm(mover.shape, mover.part));
}

/// How fast a body's spin can move its shape along n, m/s, now and at any later time: a spin about n moves nothing
/// along it, and neither does a capsule that rolls about its own axis. `far` bounds how far away it may act.
double turning_speed(const Mover& mover, Vec3 n, double far) noexcept {
    const double rate = norm(cross(mover.spin, n));
    if (rate == 0.0) return 0.0;
    if (mover.shape.kind == ShapeKind::plane) return rate * far;
    if (mover.shape.kind == ShapeKind::capsule) {
        const Vec3 axis = mover.body.rotation * column(mover.part.rotation, 2);
        return rate * norm(mover.part.position) +
               std::min(rate, norm(cross(mover.spin, axis))) * mover.shape.half_length;
    }
    return rate * turning_arm(mover.shape, mover.part);
}

}  // namespace

double time_of_impact(const Mover& first, const Mover& second, double duration, double slop) noexcept {
    const double far =
        norm(first.body.position - second.body.position) + duration * norm(first.velocity - second.velocity);
    const double first_far = far + turning_arm(second.shape, second.part),
                 second_far = far + turning_arm(first.shape, first.part);
    const Vec3 approach = second.velocity - first.velocity;
    const double fastest =
        norm(approach) + turning_speed(first, first_far) + turning_speed(second, second_far);
    // A ball beside its body's centre is one that joints may lead straight on: it only seems to circle away.
    const auto on_arm = [](const Mover& mover) {
        return mover.shape.kind == ShapeKind::sphere && norm(mover.part.position) > 0.0;
    };
    const bool led = on_arm(first) || on_arm(second);
    double time = 0.0;
    constexpr int rounds = 200;  // a factor of two each where a round surface is met at a slant
    for (int round = 0; round < rounds; ++round) {
        const Separation apart = separation(first.shape, first.at(time), second.shape, second.at(time),
                                            fastest * (duration - time));
        const double turning =
            turning_speed(first, apart.normal, first_far) + turning_speed(second, apart.normal, second_far);
        const double closing = dot(apart.normal, approach), left = duration - time;
        const double speed = std::max(0.0, closing) + turning;
        if (apart.gap <= -0.5 * slop) {
            const double back =
                closing > 0.0 ? apart.gap / closing : 0.0;  // negative: to where the gap is zero
            return std::max(0.0, -back < 0.1 * duration ? time + back : time);
        }
        if (!(speed * left > apart.gap + slop)) return -1.0;
        double until = (apart.gap + slop) / speed;
        if (round > 0 && turning > 0.0 && !led) {  // what turns away beside a surface would never get past it
            until = std::max(until, separated_for(first, second, apart.normal, time, left, slop));
            if (until >= left) return -1.0;
        }
        time += until;
    }
    return time;  // so slow an approach at a slant that it counts as touching
}

}  // namespace spook

// Convex hulls against planes, spheres and capsules.
#include <algorithm>
#include <array>

#include "collision/narrow_phase.hpp"
#include "collision/segment.hpp"
#include "collision/solid_pairs.hpp"

namespace spook {

/// A point for every corner within the margin. Of more than a manifold holds the lowest are kept: a face has fewer.
Manifold hull_plane(const Primitive& hull, const Pose& at, const Primitive& plane, const Pose& at_plane,
                    double margin) noexcept {
    const Vec3 n = at_plane.rotation * plane.normal;
    std::array<ContactPoint, Polytope::most_corners> near;
    std::size_t count = 0;
    for (std::size_t k = 0; k < hull.hull->corners.size(); ++k) {
        const Vec3 corner = apply(at, hull.hull->corners[k]);
        const double gap = dot(n, corner - at_plane.position);
        if (gap <= margin) near[count++] = {corner - 0.5 * gap * n, n, gap, static_cast<std::uint32_t>(k)};
    }
    const auto begin = near.begin(), end = begin + static_cast<std::ptrdiff_t>(count);
    if (count > static_cast<std::size_t>(Manifold::capacity)) {
        std::sort(begin, end, [](const ContactPoint& a, const ContactPoint& b) { return a.gap < b.gap; });
        count = Manifold::capacity;
        std::sort(begin, begin + Manifold::capacity,
                  [](const ContactPoint& a, const ContactPoint& b) { return a.feature < b.feature; });
    }
    Manifold manifold;
    for (std::size_t k = 0; k < count; ++k)
        manifold.add(near[k].position, near[k].normal, near[k].gap, near[k].feature);
    return manifold;
}

Manifold sphere_hull(const Primitive& sphere, const Pose& at, const Primitive& hull, const Pose& at_hull,
                     double margin) noexcept {
    Manifold manifold;
    const Nearest near = nearest(*hull.hull, local(at_hull.rotation, at.position - at_hull.position));
    const double gap = near.height - sphere.radius;
    if (gap <= margin)
        manifold.add(apply(at_hull, near.on + 0.5 * gap * near.normal), at_hull.rotation * near.normal, gap,
                     0);
    return manifold;
}

namespace {

/// The stretch of `core` over a face, by the planes through its rim.
bool over_face(const Segment& core, const Polytope& polytope, const Polytope::Face& face, double& low,
               double& high) noexcept {
    low = -core.half, high = core.half;
    for (int k = 0; k < face.count; ++k) {
        const Vec3 from = polytope.corner_of(face, k), along = polytope.corner_of(face, k + 1) - from;
        const Vec3 across = cross(along, face.normal);
        const Vec3 out = (1.0 / norm(across)) * across;
        const double start = dot(out, core.centre - from) - 1e-9 * polytope.thickness,
                     speed = dot(out, core.direction);
        if (std::abs(speed) < 1e-14) {
            if (start > 0.0) return false;
        } else if (speed > 0.0) {
            high = std::min(high, -start / speed);
        } else {
            low = std::max(low, -start / speed);
        }
    }
    return low <= high;
}

Segment edge_of(const Polytope& polytope, const Polytope::Edge& edge) noexcept {
    const Vec3 a = polytope.corners[static_cast<std::size_t>(edge.from)],
               b = polytope.corners[static_cast<std::size_t>(edge.to)];
    const double half = 0.5 * norm(b - a);
    return {0.5 * (a + b), (0.5 / half) * (b - a), half};
}

}  // namespace

SegmentSolid segment_solid(const Segment& core, const Polytope& polytope) noexcept {
    double enter = -core.half, leave = core.half;
    const Polytope::Face* nearest_face = polytope.faces.data();  // also of what is no number
    double overlap = -1e300;
    for (const Polytope::Face& face : polytope.faces) {
        const double start = dot(face.normal, core.centre) - face.offset,
                     speed = dot(face.normal, core.direction);
        if (std::abs(speed) < 1e-14) {
            if (start > 0.0) leave = enter - 1.0;
        } else if (speed > 0.0) {
            leave = std::min(leave, -start / speed);
        } else {
            enter = std::max(enter, -start / speed);
        }
        const double lowest = start - core.half * std::abs(speed);
        if (lowest > overlap) overlap = lowest, nearest_face = &face;
    }
    if (enter <= leave) {  // it cuts the polytope
        SegmentSolid found{overlap, nearest_face->normal, 0.0, -1, true};
        found.t = dot(nearest_face->normal, core.direction) > 0.0 ? -core.half : core.half;
        const double prefer = 5e-5 * polytope.thickness;
        for (std::size_t k = 0; k < polytope.edges.size(); ++k) {
            const Segment edge = edge_of(polytope, polytope.edges[k]);
            const Vec3 axis = cross(edge.direction, core.direction);
            const double length = norm(axis);
            if (length < 1e-4) continue;
            for (const double side : {1.0, -1.0}) {
                const Vec3 n = (side / length) * axis;
                const double gap = dot(n, core.centre) - farthest(polytope, n);
                if (gap <= found.gap + prefer || dot(n, edge.centre) < farthest(polytope, n) - prefer)
                    continue;
                found = {gap, n, closest_parameters(core, edge).first, static_cast<int>(k), true};
            }
        }
        return found;
    }
    SegmentSolid found{1e300, {}, 0.0, -1, false};
    for (const double t : {-core.half, core.half}) {
        const Nearest near = nearest(polytope, core.at(t));
        if (near.height < found.gap) found = {near.height, near.normal, t, -1, false};
    }
    for (std::size_t k = 0; k < polytope.edges.size(); ++k) {
        const Segment edge = edge_of(polytope, polytope.edges[k]);
        const SegmentPair closest = closest_parameters(core, edge);
        const Vec3 between = core.at(closest.first) - edge.at(closest.second);
        const double distance = norm(between);
        if (distance < found.gap * (1.0 - 1e-12) && distance > 0.0)
            found = {distance, (1.0 / distance) * between, closest.first, static_cast<int>(k), false};
    }
    return found;
}

Manifold capsule_hull(const Primitive& capsule, const Pose& at, const Primitive& hull, const Pose& at_hull,
                      double margin) noexcept {
    Manifold manifold;
    const Polytope& polytope = *hull.hull;
    const Segment world = capsule_core(capsule, at);
    const Segment core{local(at_hull.rotation, world.centre - at_hull.position),
                       local(at_hull.rotation, world.direction), world.half};
    const SegmentSolid near = segment_solid(core, polytope);
    if (near.gap - capsule.radius > margin) return manifold;
    const auto add = [&](double t, Vec3 normal, double height, std::uint32_t feature) {
        const double gap = height - capsule.radius;
        if (gap <= margin)
            manifold.add(apply(at_hull, core.at(t) + (0.5 * gap - height) * normal),
                         at_hull.rotation * normal, gap, feature);
    };
    for (std::size_t k = 0; k < polytope.faces.size(); ++k) {
        const Polytope::Face& face = polytope.faces[k];
        double low, high;
        if (dot(near.normal, face.normal) < 1.0 - 1e-9 || !over_face(core, polytope, face, low, high))
            continue;
        const auto tag = static_cast<std::uint32_t>(4 * k);
        const auto height = [&](double t) { return dot(face.normal, core.at(t)) - face.offset; };
        const double slope = dot(core.direction, face.normal);
        if (high - low < 1e-6 * core.half || std::abs(slope) > 1.0 - 1e-9) {  // upright: only the nearer end
            add(slope > 0.0 ? low : high, face.normal, height(slope > 0.0 ? low : high), tag);
        } else {
            add(low, face.normal, height(low), tag + 1);
            add(high, face.normal, height(high), tag + 2);
        }
        if (manifold.count > 0) return manifold;
    }
    const auto tag = static_cast<std::uint32_t>(512 + 4 * (near.edge + 1));
    if (near.edge >= 0 && !near.cut) {
        const Segment edge = edge_of(polytope, polytope.edges[static_cast<std::size_t>(near.edge)]);
        if (norm(cross(edge.direction, core.direction)) <
            1e-6) {  // along an edge: both ends of what they share
            const double middle = dot(edge.centre - core.centre, core.direction);
            const double low = clamped(middle - edge.half, -core.half, core.half),
                         high = clamped(middle + edge.half, -core.half, core.half);
            if (high - low > 1e-6 * core.half) {
                const auto height = [&](double t) { return dot(near.normal, core.at(t) - edge.centre); };
                add(low, near.normal, height(low), tag + 1);
                add(high, near.normal, height(high), tag + 2);
                return manifold;
            }
        }
    }
    add(near.t, near.normal, near.gap, tag);
    return manifold;
}

}  // namespace spook

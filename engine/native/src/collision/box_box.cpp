// Two boxes: separating axes, then the face of one clipped by the face of the other, or two crossing edges.
//
// The axis of largest separation wins; among near equals the first box's faces, then the second's, then edges,
// so that resting boxes keep their reference face from step to step.
#include <algorithm>

#include "collision/narrow_phase.hpp"
#include "collision/segment.hpp"

namespace spook {

namespace {

struct Oriented {
    Vec3 centre, half;
    Vec3 axis[3];
};

Oriented oriented(const Primitive& box, const Pose& at) noexcept {
    return {at.position, box.half, {column(at.rotation, 0), column(at.rotation, 1), column(at.rotation, 2)}};
}

double reach(const Oriented& box, Vec3 direction) noexcept {
    return box.half.x * std::abs(dot(direction, box.axis[0])) +
           box.half.y * std::abs(dot(direction, box.axis[1])) +
           box.half.z * std::abs(dot(direction, box.axis[2]));
}

struct Axis {
    double separation = -1e300;
    Vec3 normal;  // from second to first
    int first = 0, second = 0;
};

struct Vertex {
    double u, v, height;  // in the reference face's frame; height above it along its outward normal
    std::uint32_t feature;
};

struct Polygon {
    Vertex vertices[12];
    int count = 0;
};

/// Keeps what lies at or below `limit` along u (axis 0) or v (axis 1) times `sign`; `side` numbers the plane.
Polygon clipped(const Polygon& in, int axis, double sign, double limit, double slop,
                std::uint32_t side) noexcept {
    Polygon out;
    auto beyond = [&](const Vertex& p) noexcept { return sign * (axis == 0 ? p.u : p.v) - limit; };
    for (int k = 0; k < in.count; ++k) {
        const Vertex &from = in.vertices[k], &to = in.vertices[(k + 1) % in.count];
        const double d0 = beyond(from), d1 = beyond(to);
        const bool in0 = d0 <= slop, in1 = d1 <= slop;
        if (in0) out.vertices[out.count++] = from;
        if (in0 != in1) {
            const double s = clamped(d0 / (d0 - d1), 0.0, 1.0);
            out.vertices[out.count++] = {from.u + s * (to.u - from.u), from.v + s * (to.v - from.v),
                                         from.height + s * (to.height - from.height),
                                         8 + 2 * side + (in1 ? 1u : 0u)};
        }
    }
    return out;
}

/// The manifold of `reference`'s face (axis `face`, outward normal `outward`) against `incident`.
/// `flip` is −1 if the outward normal points from first to second.
void add_faces(Manifold& manifold, const Oriented& reference, int face, Vec3 outward,
               const Oriented& incident, double flip, double margin, double slop,
               std::uint32_t tag) noexcept {
    const int iu = (face + 1) % 3, iv = (face + 2) % 3;
    int opposite = 0;  // the incident face that looks most against `outward`
    for (int i = 1; i < 3; ++i)
        if (std::abs(dot(incident.axis[i], outward)) > std::abs(dot(incident.axis[opposite], outward)) + 1e-9)
            opposite = i;
    const double side = dot(incident.axis[opposite], outward) > 0.0 ? -1.0 : 1.0;
    const int ju = (opposite + 1) % 3, jv = (opposite + 2) % 3;
    const Vec3 middle =
        incident.centre + side * incident.half[opposite] * incident.axis[opposite] - reference.centre;
    Polygon polygon;
    const double signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (std::uint32_t k = 0; k < 4; ++k) {
        const Vec3 p = middle + signs[k][0] * incident.half[ju] * incident.axis[ju] +
                       signs[k][1] * incident.half[jv] * incident.axis[jv];
        polygon.vertices[polygon.count++] = {dot(p, reference.axis[iu]), dot(p, reference.axis[iv]),
                                             dot(p, outward) - reference.half[face], k};
    }
    for (std::uint32_t k = 0; k < 4; ++k)
        polygon = clipped(polygon, k / 2, k % 2 == 0 ? 1.0 : -1.0, reference.half[k < 2 ? iu : iv], slop, k);

    tag |= static_cast<std::uint32_t>(2 * face + (dot(outward, reference.axis[face]) > 0.0)) << 4;
    tag |= static_cast<std::uint32_t>(2 * opposite + (side > 0.0)) << 8;
    for (int k = 0; k < polygon.count; ++k) {
        const Vertex& p = polygon.vertices[k];
        if (p.height > margin) continue;
        bool repeated = false;
        for (int j = 0; j < k && !repeated; ++j)
            repeated = std::abs(p.u - polygon.vertices[j].u) <= slop &&
                       std::abs(p.v - polygon.vertices[j].v) <= slop;
        if (repeated) continue;
        const Vec3 position = reference.centre + p.u * reference.axis[iu] + p.v * reference.axis[iv] +
                              (reference.half[face] + 0.5 * p.height) * outward;
        manifold.add(position, flip * outward, p.height, tag | p.feature);
    }
}

void add_edges(Manifold& manifold, const Oriented& first, const Oriented& second, const Axis& edge,
               double margin) noexcept {
    Segment one{first.centre, first.axis[edge.first], first.half[edge.first]};
    Segment two{second.centre, second.axis[edge.second], second.half[edge.second]};
    for (int i = 0; i < 3; ++i) {
        if (i != edge.first)
            one.centre +=
                (dot(edge.normal, first.axis[i]) > 0.0 ? -first.half[i] : first.half[i]) * first.axis[i];
        if (i != edge.second)
            two.centre +=
                (dot(edge.normal, second.axis[i]) > 0.0 ? second.half[i] : -second.half[i]) * second.axis[i];
    }
    const SegmentPair closest = closest_parameters(one, two);
    const Vec3 p = one.at(closest.first), q = two.at(closest.second);
    const double gap = dot(edge.normal, p - q);
    const std::uint32_t feature = (1u << 13) | static_cast<std::uint32_t>(3 * edge.first + edge.second);
    if (edges_touch(p - q, gap, margin)) manifold.add(0.5 * (p + q), edge.normal, gap, feature);
}

}  // namespace

Manifold box_box(const Primitive& first, const Pose& at_first, const Primitive& second, const Pose& at_second,
                 double margin) noexcept {
    const Oriented a = oriented(first, at_first), b = oriented(second, at_second);
    const Vec3 between = a.centre - b.centre;
    Axis best_a, best_b, best_edge;
    auto improve = [&](Axis& best, Vec3 direction, int i, int j) noexcept {
        const double along = dot(direction, between);
        const double separation = std::abs(along) - reach(a, direction) - reach(b, direction);
        if (separation > best.separation) best = {separation, along < 0.0 ? -direction : direction, i, j};
    };
    for (int i = 0; i < 3; ++i) improve(best_a, a.axis[i], i, 0);
    for (int j = 0; j < 3; ++j) improve(best_b, b.axis[j], 0, j);
    if (std::max(best_a.separation, best_b.separation) > margin) return {};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const Vec3 axis = cross(a.axis[i], b.axis[j]);
            const double length = norm(axis);
            if (length > 1e-4)
                improve(best_edge, (1.0 / length) * axis, i, j);  // parallel edges are covered by faces
        }
    if (best_edge.separation > margin) return {};

    const double smallest = std::min({a.half.x, a.half.y, a.half.z, b.half.x, b.half.y, b.half.z});
    const double prefer = 1e-4 * smallest, slop = 1e-7 * smallest;
    const double face_separation = std::max(best_a.separation, best_b.separation);
    Manifold manifold;
    if (best_edge.separation > face_separation + prefer) {
        add_edges(manifold, a, b, best_edge, margin);
        return manifold;
    }
    if (best_b.separation > best_a.separation + prefer)
        add_faces(manifold, b, best_b.second, best_b.normal, a, 1.0, margin, slop, 1u << 12);
    else add_faces(manifold, a, best_a.first, -best_a.normal, b, -1.0, margin, slop, 0);
    // Overlapping, yet no vertex of a face inside the other: only near ties of the axes end here.
    if (manifold.count == 0 && face_separation <= 0.0 && best_edge.separation > -1e300)
        add_edges(manifold, a, b, best_edge, margin);
    return manifold;
}

}  // namespace spook

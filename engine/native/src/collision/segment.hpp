// Closest points of segments: the core of every pair with a capsule.
#pragma once

#include "collision/shape.hpp"

namespace spook {

/// The segment centre + t direction, t from −half to half; `direction` is unit.
struct Segment {
    Vec3 centre, direction;
    double half;
    Vec3 at(double t) const noexcept { return centre + t * direction; }
};

inline Segment capsule_core(const Primitive& capsule, const Pose& at) noexcept {
    return {at.position, column(at.rotation, 2), capsule.half_length};
}

inline double clamped(double t, double low, double high) noexcept {
    return t < low ? low : t > high ? high : t;
}

/// Parameter on `segment` of its point closest to `point`.
inline double closest_parameter(const Segment& segment, Vec3 point) noexcept {
    return clamped(dot(point - segment.centre, segment.direction), -segment.half, segment.half);
}

/// Parameters on both segments of their closest points (one of many if they are parallel).
struct SegmentPair {
    double first, second;
    bool parallel;  // directions agree to 1e-6 rad or less
};
SegmentPair closest_parameters(const Segment& first, const Segment& second) noexcept;

/// Whether two edges whose nearest points are `between` apart come within `margin` [m] of each other; `gap` is that along
/// the normal. Edges that do not cross, seen along it, are farther apart than the gap says: of solids that are apart it is
/// a lower bound only, and a point made by it would hold bodies that pass each other's corners.
inline bool edges_touch(Vec3 between, double gap, double margin) noexcept {
    return gap <= margin && (gap <= 0.0 || norm(between) <= margin);
}

/// Where a segment given in the axes of a box with half edges `half` comes closest to it: the range of
/// parameters at the least distance (low == high unless segment and box are parallel there; the range inside if
/// it cuts the box) and that distance [m], zero if it cuts.
struct SegmentBox {
    double low, high, distance;
};
SegmentBox closest_to_box(const Segment& segment, Vec3 half) noexcept;

}  // namespace spook

// Flat-sided solids, boxes and hulls, against each other: what contact points and casts both ask.
#pragma once

#include "collision/polytope.hpp"
#include "collision/shape.hpp"

namespace spook {

/// A polytope where it stands, its corners in world axes.
struct Solid {
    const Polytope& shape;
    Mat3 rotation;
    Vec3 corners[Polytope::most_corners];
    double thickness;

    Solid(const Primitive& primitive, const Pose& at) noexcept;

    int count() const noexcept { return static_cast<int>(shape.corners.size()); }
    const Polytope::Face& face(int k) const noexcept { return shape.faces[static_cast<std::size_t>(k)]; }
    Vec3 normal(int k) const noexcept { return rotation * face(k).normal; }
    Vec3 corner_of(const Polytope::Face& face, int k) const noexcept {
        const int place = face.begin + k % face.count;
        return corners[shape.loops[static_cast<std::size_t>(place)]];
    }
};

/// The axis along which two solids are farthest apart: a face of the first, one of the second, an edge of each.
struct SolidAxes {
    struct Best {
        double gap = -1e300;          // m
        Vec3 normal;                  // from second to first
        int first = -1, second = -1;  // face or edge
    };
    Best first_face, second_face, edges;
};
/// Stops where a face parts them by more than `margin` [m].
SolidAxes solid_axes(const Solid& first, const Solid& second, double margin) noexcept;

/// A segment against a polytope, both in the polytope's axes: apart, the shortest connection; cutting it, the axis of
/// least overlap.
struct SegmentSolid {
    double gap;   // of the core, m
    Vec3 normal;  // unit, from the polytope to the segment
    double t;     // on the segment
    int edge;     // of an edge met side by side or across, −1 if a face or an end decides
    bool cut;
};
struct Segment;
SegmentSolid segment_solid(const Segment& core, const Polytope& polytope) noexcept;

}  // namespace spook

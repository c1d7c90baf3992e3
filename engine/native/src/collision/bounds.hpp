// Axis-aligned boxes round primitives.
#pragma once

#include "collision/shape.hpp"

namespace spook {

struct Bounds {
    Vec3 low, high;  // m
};

/// The smallest box round a bounded shape, grown by `margin` [m] on every side.
/// A plane has no such box: its bounds are infinite.
Bounds bounds(const Primitive& shape, const Pose& at, double margin) noexcept;

/// Largest distance [m] of the shape's surface from its own origin; infinite for a plane.
double reach(const Primitive& shape) noexcept;

constexpr bool overlap(const Bounds& a, const Bounds& b) noexcept {
    return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
           a.low.z <= b.high.z && b.low.z <= a.high.z;
}

}  // namespace spook

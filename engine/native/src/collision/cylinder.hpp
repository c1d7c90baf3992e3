// What pairs and casts ask of a cylinder.
#pragma once

#include <cmath>
#include <cstdint>

#include "collision/shape.hpp"

namespace spook {

/// Largest n · p over a cylinder at the origin whose axis is the unit vector `axis`.
inline double cylinder_reach(const Primitive& cylinder, Vec3 axis, Vec3 n) noexcept {
    return cylinder.half_length * std::abs(dot(n, axis)) + cylinder.radius * norm(cross(n, axis));
}

/// What lies across an axis but for rounding, as a unit vector that does; `otherwise` where only rounding is left.
inline Vec3 unit_across(Vec3 v, Vec3 axis, Vec3 otherwise) noexcept {
    const double length = norm(v);
    if (!(length > 0.0)) return otherwise;
    const Vec3 unit = (1.0 / length) * v;
    if (std::abs(dot(unit, axis)) <= 1e-12) return unit;
    const Vec3 again =
        unit - dot(unit, axis) * axis;  // v is so short that rounding has a part along the axis
    const double left = norm(again);
    return left > 0.5 ? (1.0 / left) * again : otherwise;
}

/// The point of a cylinder nearest to `p`, both in its own axes; inside the height is negative.
Nearest nearest_on_cylinder(const Primitive& cylinder, Vec3 p) noexcept;

/// Whether a point of a rim on a plane, as the pairs here name them, is one between its lowest and its opposite.
inline bool is_between(const Primitive& rim, std::uint32_t feature) noexcept {
    return rim.has_rims() && feature % 2 == 1;
}

}  // namespace spook

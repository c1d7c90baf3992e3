// What pairs and sweeps ask of a cylinder.
#pragma once

#include <cmath>

#include "collision/shape.hpp"

namespace spook {

/// Largest n · p over a cylinder at the origin whose axis is the unit vector `axis`.
inline double cylinder_reach(const Primitive& cylinder, Vec3 axis, Vec3 n) noexcept {
    return cylinder.half_length * std::abs(dot(n, axis)) + cylinder.radius * norm(cross(n, axis));
}

/// The point of a cylinder nearest to `p`, both in its own axes; inside the height is negative.
Nearest nearest_on_cylinder(const Primitive& cylinder, Vec3 p) noexcept;

}  // namespace spook

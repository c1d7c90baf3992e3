// Small geometry shared by the parts of the contact stage.
#pragma once

#include <cmath>
#include <vector>

#include "collision/detection.hpp"
#include "contacts/pivot_system.hpp"
#include "contacts/tolerances.hpp"
#include "linear/vec.hpp"

namespace spook {

inline Vec3 linear(const Vec6& v) noexcept { return {v[0], v[1], v[2]}; }
inline Vec3 angular(const Vec6& v) noexcept { return {v[3], v[4], v[5]}; }

/// How much of a step's forces has acted on a free body when this part of the step has passed. v at the start of a step is
/// that of the middle of the step before: where bodies rebound, what they meet with has half a kick more.
inline double part_of_forces(double passed, bool rebounds) noexcept {
    return rebounds ? 0.5 + passed : passed;
}

/// The Jacobian of a body's velocity at `arm` from its centre, along `direction`.
inline Vec6 contact_row(Vec3 direction, Vec3 arm) noexcept {
    const Vec3 moment = cross(arm, direction);
    return {direction.x, direction.y, direction.z, moment.x, moment.y, moment.z};
}

/// The world axis x (or y, for surfaces that face along x) laid into the tangent plane.
inline Vec3 world_tangent(Vec3 normal) noexcept {
    const Vec3 axis = std::abs(normal.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 t = axis - dot(axis, normal) * normal;
    return (1.0 / norm(t)) * t;
}

/// Whether one of two shapes may come to the side of the other: a plane has none, nor have balls among themselves.
inline bool have_sides(const Primitive& one, const Primitive& two) noexcept {
    const bool balls = one.kind == ShapeKind::sphere && two.kind == ShapeKind::sphere;
    return !balls && one.kind != ShapeKind::plane && two.kind != ShapeKind::plane;
}

inline Vec6 sum(const Vec6& a, const Vec6& b, double s = 1.0) noexcept {
    Vec6 c;
    for (int i = 0; i < 6; ++i) c[i] = a[i] + s * b[i];
    return c;
}

/// Whether a rim's spin about its own axis alone closes an open point between its lowest and its opposite within a step: the rim
/// turns through it, and its row would hold the rim to a radian a step. The bodies stand at `first` and `second`.
bool is_turned_through(const Detection& detection, const Contact& contact, const Pose& first,
                       const Pose& second, const std::vector<Vec6>& velocity, const std::vector<Vec6>& dv_ext,
                       double h) noexcept;

}  // namespace spook

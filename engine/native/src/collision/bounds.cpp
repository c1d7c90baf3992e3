#include "collision/bounds.hpp"

#include <algorithm>
#include <limits>

#include "collision/cylinder.hpp"
#include "collision/frustum.hpp"

namespace spook {

Bounds bounds(const Primitive& shape, const Pose& at, double margin) noexcept {
    const Vec3 grown{margin, margin, margin};
    if (shape.kind == ShapeKind::hull) {
        Vec3 low, high;
        for (int i = 0; i < 3; ++i) {
            const Vec3 axis{at.rotation(i, 0), at.rotation(i, 1), at.rotation(i, 2)};
            high[i] = farthest(*shape.hull, axis);
            low[i] = -farthest(*shape.hull, -axis);
        }
        return {at.position + low - grown, at.position + high + grown};
    }
    if (shape.kind == ShapeKind::cone) {
        const Frustum frustum(shape, at);
        Vec3 low, high;
        for (int i = 0; i < 3; ++i) {
            Vec3 axis;
            axis[i] = 1.0;
            high[i] = frustum.reach(axis), low[i] = -frustum.reach(-axis);
        }
        return {low - grown, high + grown};
    }
    if (shape.kind == ShapeKind::triangle) {
        Vec3 low = apply(at, shape.mesh->corner(shape.triangle, 0)), high = low;
        for (int k = 1; k < 3; ++k) {
            const Vec3 p = apply(at, shape.mesh->corner(shape.triangle, k));
            for (int i = 0; i < 3; ++i) low[i] = std::min(low[i], p[i]), high[i] = std::max(high[i], p[i]);
        }
        return {low - grown, high + grown};
    }
    Vec3 half;
    for (int i = 0; i < 3; ++i) switch (shape.kind) {
            case ShapeKind::sphere: half[i] = shape.radius; break;
            case ShapeKind::capsule:
                half[i] = shape.half_length * std::abs(at.rotation(i, 2)) + shape.radius;
                break;
            case ShapeKind::box:
                half[i] = shape.half.x * std::abs(at.rotation(i, 0)) +
                          shape.half.y * std::abs(at.rotation(i, 1)) +
                          shape.half.z * std::abs(at.rotation(i, 2));
                break;
            case ShapeKind::hull:
            case ShapeKind::cone:
            case ShapeKind::triangle: break;
            case ShapeKind::cylinder: {
                Vec3 axis;
                axis[i] = 1.0;
                half[i] = cylinder_reach(shape, column(at.rotation, 2), axis);
                break;
            }
            case ShapeKind::plane: half[i] = std::numeric_limits<double>::infinity(); break;
        }
    half += grown;
    return {at.position - half, at.position + half};
}

double reach(const Primitive& shape) noexcept {
    switch (shape.kind) {
        case ShapeKind::sphere: return shape.radius;
        case ShapeKind::capsule: return shape.half_length + shape.radius;
        case ShapeKind::box: return norm(shape.half);
        case ShapeKind::hull: return shape.hull->reach;
        case ShapeKind::cylinder:
            return std::sqrt(shape.radius * shape.radius + shape.half_length * shape.half_length);
        case ShapeKind::cone: {
            const double rim = shape.radius * shape.radius + 0.25 * shape.half_length * shape.half_length;
            return std::max(1.5 * shape.half_length, std::sqrt(rim));
        }
        case ShapeKind::triangle: {
            double most = 0.0;
            for (int k = 0; k < 3; ++k) most = std::max(most, norm(shape.mesh->corner(shape.triangle, k)));
            return most;
        }
        case ShapeKind::plane: break;
    }
    return std::numeric_limits<double>::infinity();
}

}  // namespace spook

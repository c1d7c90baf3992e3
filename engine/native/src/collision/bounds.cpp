#include "collision/bounds.hpp"

#include <limits>

namespace spook {

Bounds bounds(const Primitive& shape, const Pose& at, double margin) noexcept {
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
            case ShapeKind::plane: half[i] = std::numeric_limits<double>::infinity(); break;
        }
    half += {margin, margin, margin};
    return {at.position - half, at.position + half};
}

double reach(const Primitive& shape) noexcept {
    switch (shape.kind) {
        case ShapeKind::sphere: return shape.radius;
        case ShapeKind::capsule: return shape.half_length + shape.radius;
        case ShapeKind::box: return norm(shape.half);
        case ShapeKind::plane: break;
    }
    return std::numeric_limits<double>::infinity();
}

}  // namespace spook

// One triangle of a mesh where it stands: the directions in which others part from it, and which of them are genuine.
#pragma once

#include "collision/frustum.hpp"
#include "collision/mesh.hpp"

namespace spook {

struct Triangle {
    const Mesh& mesh;
    int index;
    const Pose& at;
    Facets facets;  // both of its sides as faces, the outside first
    Vec3 normal;    // outwards, world axes

    Triangle(const Primitive& primitive, const Pose& at) noexcept;

    /// Whether a contact along `n` (from the triangle) on its farthest corner, edge or face meets no neighbour first.
    bool genuine(Vec3 n) const noexcept;
    /// Of the face, looked at along its normal: which corners, in bits 0 to 2, and which sides, in bits 3 to 5, are
    /// inside of a flat surface or in a valley, and hold nothing.
    unsigned hidden(Vec3 n) const noexcept;

private:
    bool below(int corner, int from, Vec3 n) const noexcept;
};

/// Axes from a triangle to the other. `all` holds the best of any kind, the others genuine ones only. Stops where one exceeds
/// `margin` [m].
struct TriangleAxes {
    SeparatingAxis all, flat, curved;
};
TriangleAxes separating_axes(const Triangle& triangle, const Facets& other, double margin) noexcept;
TriangleAxes separating_axes(const Triangle& triangle, const Frustum& other, double margin) noexcept;

}  // namespace spook

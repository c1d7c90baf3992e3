// Triangle meshes: fixed surfaces with an outside, and what of an edge or a corner another shape can meet.
#pragma once

#include <array>
#include <vector>

#include "linear/vec.hpp"

namespace spook {

/// Triangles with common corners, anticlockwise seen from outside. A contact on an edge or a corner is genuine only if
/// no neighbouring triangle rises beyond it along the contact's normal: along internal edges of flat faces, and in valleys, the
/// faces alone are met, so that what slides over an internal edge feels nothing.
struct Mesh {
    std::vector<Vec3> corners;  // m
    std::vector<std::array<int, 3>> triangles;
    std::vector<Vec3> normals;  // unit, outwards
    std::vector<std::array<int, 3>>
        across;  // the neighbour's far corner over side k, from corner k to k + 1; −1: a rim
    std::vector<std::vector<int>> round;  // the corners an edge away from each
    std::vector<char> on_rim;             // of each corner

    /// Throws std::invalid_argument where a triangle has no area, or a side is used twice in the same direction.
    Mesh(std::vector<Vec3> corners, std::vector<std::array<int, 3>> triangles);

    Vec3 corner(int triangle, int k) const noexcept {
        return corners[static_cast<std::size_t>(index(triangle, k))];
    }
    int index(int triangle, int k) const noexcept {
        return triangles[static_cast<std::size_t>(triangle)][static_cast<std::size_t>(k % 3)];
    }
};

}  // namespace spook

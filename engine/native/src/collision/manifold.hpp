// What the narrow phase says of two primitives: up to thirty-two contact points.
//
// Normals point from the second to the first: pushing along +normal moves the first away. The gap is signed,
// negative inside; the position lies midway between both surfaces. A feature names the pair of vertices, edges
// or faces a point comes from; it stays the same while the touching features do, so that a solver can start
// from the multipliers of the step before.
//
// Points are never thinned out. Two boxes face to face keep the whole clipped polygon, up to eight points, two hulls up
// to thirty-two, as a face has at most sixteen corners: a
// choice of four would cut corners off the area of support, so a box would tip too early, and would jump from
// step to step while the box turns. Four coplanar points are redundant already, so the solver must bear
// redundancy in any case.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "linear/vec.hpp"

namespace spook {

struct ContactPoint {
    Vec3 position;              // world, m
    Vec3 normal;                // world, unit, from second to first
    double gap = 0.0;           // m, negative inside
    std::uint32_t feature = 0;  // unique within one manifold
};

struct Manifold {
    static constexpr int capacity = 32;
    union {  // beyond `count` nothing is written, nor copied: most pairs have a point or none
        std::array<ContactPoint, capacity> points;
    };
    int count = 0;

    Manifold() noexcept {}
    Manifold(const Manifold& other) noexcept : count(other.count) {
        std::copy_n(other.points.begin(), count, points.begin());
    }
    Manifold& operator=(const Manifold& other) noexcept {
        count = other.count;
        std::copy_n(other.points.begin(), count, points.begin());
        return *this;
    }
    ~Manifold() = default;

    void add(Vec3 position, Vec3 normal, double gap, std::uint32_t feature) noexcept {
        if (count < capacity) points[count++] = {position, normal, gap, feature};
    }
};

}  // namespace spook

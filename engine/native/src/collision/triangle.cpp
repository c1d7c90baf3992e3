#include "collision/triangle.hpp"

#include <algorithm>

#include "collision/segment.hpp"
#include "collision/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::triangle;

}  // namespace

Triangle::Triangle(const Primitive& primitive, const Pose& pose) noexcept
    : mesh(*primitive.mesh),
      index(primitive.triangle),
      at(pose),
      facets(primitive, pose),
      normal(facets.normals[0]) {}

bool Triangle::below(int corner, int from, Vec3 n) const noexcept {
    const Vec3 way =
        mesh.corners[static_cast<std::size_t>(corner)] - mesh.corners[static_cast<std::size_t>(from)];
    return dot(n, at.rotation * way) <= level * norm(way);
}

bool Triangle::genuine(Vec3 n) const noexcept {
    if (dot(n, normal) < -level) return false;
    double heights[3], top = -1e300, size = 0.0;
    for (int k = 0; k < 3; ++k) {
        heights[k] = dot(n, facets.corners[k]);
        top = std::max(top, heights[k]);
        size = std::max(size, norm(facets.corners[k] - facets.corners[(k + 1) % 3]));
    }
    bool highest[3];
    for (int k = 0; k < 3; ++k) highest[k] = heights[k] >= top - level * size;
    if (highest[0] && highest[1] && highest[2]) return true;
    const auto& over = mesh.across[static_cast<std::size_t>(index)];
    for (int k = 0; k < 3; ++k) {
        if (!highest[k]) continue;
        const int here = mesh.index(index, k);
        if (highest[(k + 1) % 3]) {
            const int far = over[static_cast<std::size_t>(k)];
            return far < 0 || below(far, here, n);
        }
        if (highest[(k + 2) % 3]) continue;
        const auto& round = mesh.round[static_cast<std::size_t>(here)];
        return std::all_of(round.begin(), round.end(), [&](int other) { return below(other, here, n); });
    }
    return true;
}

unsigned Triangle::hidden(Vec3 n) const noexcept {
    unsigned found = 0;
    for (int k = 0; k < 3; ++k) {
        const int here = mesh.index(index, k),
                  far = mesh.across[static_cast<std::size_t>(index)][static_cast<std::size_t>(k)];
        const auto slope = [&](int other) {
            const Vec3 way = at.rotation * (mesh.corners[static_cast<std::size_t>(other)] -
                                            mesh.corners[static_cast<std::size_t>(here)]);
            return dot(n, way) / norm(way);
        };
        bool falls = mesh.on_rim[static_cast<std::size_t>(here)] != 0, rises = false;
        for (const int other : mesh.round[static_cast<std::size_t>(here)]) {
            falls = falls || slope(other) < -bent;
            rises = rises || slope(other) > bent;
        }
        if (rises || !falls) found |= 1u << k;
        if (far >= 0 && slope(far) >= -bent) found |= 8u << k;
    }
    return found;
}

TriangleAxes separating_axes(const Triangle& triangle, const Facets& other, double margin) noexcept {
    const Facets& own = triangle.facets;
    TriangleAxes axes;
    const auto consider = [&](Vec3 n, SeparatingAxis& best, int edge = -1) noexcept {
        const double gap = other.lowest(n) + own.lowest(-n) - other.radius;
        if (gap > axes.all.gap) axes.all = {gap, n, edge};
        if (gap > best.gap && triangle.genuine(n)) best = {gap, n, edge};
    };
    const auto towards = [&](Vec3 between, int edge) noexcept {
        const double length = norm(between);
        if (length > 0.0) consider((1.0 / length) * between, axes.curved, edge);
    };
    consider(triangle.normal, axes.flat);
    consider(-triangle.normal, axes.flat);
    for (int k = 0; k < other.face_count; ++k) consider(-other.normals[k], axes.flat);
    for (int i = 0; i < 3 && !(axes.all.gap > margin); ++i) {
        const Vec3 from = own.corners[i], way = own.corners[(i + 1) % 3] - from;
        for (int j = 0; j < other.edge_count; ++j) {
            const Vec3 start = other.corners[other.edges[j].from],
                       along = other.corners[other.edges[j].to] - start;
            const Vec3 axis = cross(way, along);
            const double length = norm(axis);
            if (length > 1e-4 * norm(way) * norm(along)) {
                consider((1.0 / length) * axis, axes.curved, j);
                consider((-1.0 / length) * axis, axes.curved, j);
            }
            if (other.radius > 0.0)
                towards(
                    start + clamped(dot(from - start, along) / dot(along, along), 0.0, 1.0) * along - from,
                    j);
        }
        for (int k = 0; other.radius > 0.0 && k < other.corner_count; ++k) {
            const Vec3 p = other.corners[k];
            towards(p - from - clamped(dot(p - from, way) / dot(way, way), 0.0, 1.0) * way, -1);
        }
    }
    return axes;
}

TriangleAxes separating_axes(const Triangle& triangle, const Frustum& other, double margin) noexcept {
    const SeparatingAxes found = separating_axes(other, triangle.facets, margin, &triangle);
    const auto turned = [](SeparatingAxis axis) noexcept {
        axis.normal = -axis.normal;
        return axis;
    };
    return {turned(found.all), turned(found.flat), turned(found.curved)};
}

}  // namespace spook

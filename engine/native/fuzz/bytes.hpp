// From the bytes of a fuzzer to the numbers of a scene: any bytes give something the engine has to take.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "collision/shape.hpp"

/// Ends the program where a promise is broken, so that the fuzzer keeps the bytes.
#define PROMISE(condition)                                                               \
    do {                                                                                 \
        if (!(condition)) {                                                              \
            std::fprintf(stderr, "%s:%d: broken: %s\n", __FILE__, __LINE__, #condition); \
            std::abort();                                                                \
        }                                                                                \
    } while (0)

namespace fuzz {

using namespace spook;

/// Reads on and on; behind the end there are zeros.
class Bytes {
public:
    Bytes(const std::uint8_t* data, std::size_t size) noexcept : at_(data), end_(data + size) {}

    int byte() noexcept { return at_ == end_ ? 0 : *at_++; }
    int below(int count) noexcept { return byte() % count; }
    bool flag() noexcept { return byte() & 1; }

    /// −4 … 4; three in four on a grid of 1/16, where faces, edges and centres coincide.
    double number() noexcept {
        const int first = byte();
        if (first < 192) return (first - 96) / 16.0 * (2.0 / 3.0);
        return (256 * byte() + byte() - 32768) / 8192.0;
    }
    /// Positive: most between 1/16 and 4, some down to 1/1000 and up to 1000.
    double size() noexcept {
        const int first = byte();
        return first < 192 ? (1 + first % 64) / 16.0 : std::pow(10.0, (first - 224) / 32.0 * 3.0);
    }
    /// 0 … 1, both included.
    double share() noexcept { return byte() / 255.0; }
    Vec3 place() noexcept {
        const double x = number(), y = number();
        return {x, y, number()};
    }
    /// A unit vector; along an axis where the numbers say nothing.
    Vec3 direction() noexcept {
        const Vec3 v = place();
        const double length = norm(v);
        return length > 1e-3 ? (1.0 / length) * v : Vec3{0, 0, 1};
    }
    Quat turn() noexcept {
        const double w = number(), x = number(), y = number(), z = number();
        const double length = std::sqrt(w * w + x * x + y * y + z * z);
        if (!(length > 1e-3)) return {1, 0, 0, 0};
        return {w / length, x / length, y / length, z / length};
    }

private:
    const std::uint8_t *at_, *end_;
};

using Point = std::array<int, 3>;

inline Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Point cross(const Point& a, const Point& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline int dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Corners round a flat set of points, anticlockwise about `normal`; exact, in whole numbers.
inline std::vector<int> round_face(const std::vector<Point>& points, const std::vector<int>& members,
                                   const Point& normal) {
    std::vector<int> ring;
    int here = members[0];
    for (const int k : members)
        if (points[k] < points[here]) here = k;
    const int start = here;
    do {
        ring.push_back(here);
        int next = -1;
        for (const int k : members) {
            if (k == here) continue;
            if (next < 0) {
                next = k;
                continue;
            }
            const Point to_next = minus(points[next], points[here]), to_k = minus(points[k], points[here]);
            const int side = dot(normal, cross(to_next, to_k));
            if (side < 0 || (side == 0 && dot(to_k, to_k) > dot(to_next, to_next))) next = k;
        }
        here = next;
    } while (here != start && ring.size() <= members.size());
    return ring;
}

/// The hull of up to ten points with whole coordinates, anisotropic; null where they enclose nothing.
inline std::shared_ptr<const Polytope> hull(Bytes& bytes) {
    const int count = 4 + bytes.below(7);
    std::vector<Point> points;
    Point sum{0, 0, 0};
    for (int k = 0; k < count; ++k) {
        const int x = bytes.below(9) - 4, y = bytes.below(9) - 4;
        const Point p{x, y, bytes.below(9) - 4};
        bool known = false;
        for (const Point& q : points) known = known || q == p;
        if (!known) points.push_back(p);
    }
    const Vec3 stretch{bytes.size(), bytes.size(), bytes.size()};
    const int n = static_cast<int>(points.size());
    std::map<std::vector<int>, Point> planes;
    for (int i = 0; i < n; ++i)
        for (int j = i + 1; j < n; ++j)
            for (int k = j + 1; k < n; ++k) {
                Point normal = cross(minus(points[j], points[i]), minus(points[k], points[i]));
                if (dot(normal, normal) == 0) continue;
                int low = 0, high = 0;
                std::vector<int> members;
                for (int m = 0; m < n; ++m) {
                    const int height = dot(normal, minus(points[m], points[i]));
                    low = std::min(low, height), high = std::max(high, height);
                    if (height == 0) members.push_back(m);
                }
                if (low < 0 && high > 0) continue;
                if (low == 0 && high == 0) return nullptr;  // all in one plane
                if (high > 0) normal = {-normal[0], -normal[1], -normal[2]};
                planes[members] = normal;
            }
    if (planes.size() < 4) return nullptr;
    std::map<int, int> place;
    std::vector<Vec3> corners;
    std::vector<int> loops, counts;
    for (const auto& [members, normal] : planes) {
        const std::vector<int> ring = round_face(points, members, normal);
        if (ring.size() > static_cast<std::size_t>(Polytope::most_round_a_face)) return nullptr;
        counts.push_back(static_cast<int>(ring.size()));
        for (const int corner : ring) {
            if (place.try_emplace(corner, static_cast<int>(corners.size())).second) corners.emplace_back();
            loops.push_back(place[corner]);
        }
    }
    for (const auto& [corner, k] : place)
        for (int i = 0; i < 3; ++i) sum[i] += points[corner][i];
    const double share = 1.0 / static_cast<double>(corners.size());
    for (const auto& [corner, k] : place)  // about the mean of its corners, which is inside
        corners[k] = {stretch.x * (points[corner][0] - share * sum[0]),
                      stretch.y * (points[corner][1] - share * sum[1]),
                      stretch.z * (points[corner][2] - share * sum[2])};
    return std::make_shared<const Polytope>(std::move(corners), std::move(loops), counts);
}

/// Two triangles over a common edge, folded up or down; null where one has no area.
inline std::shared_ptr<const Mesh> sheet(Bytes& bytes) {
    std::vector<Vec3> corners(4);
    for (Vec3& corner : corners) corner = bytes.place();
    try {
        return std::make_shared<const Mesh>(std::move(corners),
                                            std::vector<std::array<int, 3>>{{0, 1, 2}, {2, 1, 3}});
    } catch (const std::invalid_argument&) {
        return nullptr;
    }
}

/// Any bounded shape; a ball in place of one that encloses nothing.
inline Primitive solid(Bytes& bytes) {
    switch (bytes.below(6)) {
        case 0: return Primitive::sphere(bytes.size());
        case 1: {
            const double radius = bytes.size();
            return Primitive::capsule(radius, bytes.size());
        }
        case 2: {
            const double x = bytes.size(), y = bytes.size();
            return Primitive::box({x, y, bytes.size()});
        }
        case 3: {
            const double radius = bytes.size();
            return Primitive::cylinder(radius, bytes.size());
        }
        case 4: {
            const double radius = bytes.size();
            return Primitive::cone(radius, bytes.size());
        }
        default: {
            const auto made = hull(bytes);
            return made ? Primitive::convex(made) : Primitive::sphere(1.0);
        }
    }
}

inline Pose pose(Bytes& bytes) {
    const Vec3 position = bytes.place();
    return {position, rotation(bytes.turn())};
}

inline bool finite(Vec3 v) noexcept { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace fuzz

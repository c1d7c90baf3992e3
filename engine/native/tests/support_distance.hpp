// How far apart two convex shapes are, from their supports alone, and between two bounds that prove themselves: what any
// answer of the narrow phase is held to. It shares nothing with it but the shapes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/shape.hpp"

namespace support {

using namespace spook;

/// The point of a bounded shape that is farthest along n (any length but 0).
inline Vec3 farthest_point(const Primitive& shape, const Pose& at, Vec3 n) {
    const Vec3 l = local(at.rotation, n);
    const double across = std::sqrt(l.x * l.x + l.y * l.y),
                 share = across > 0.0 ? shape.radius / across : 0.0;
    const Vec3 rim{share * l.x, share * l.y, 0.0};
    Vec3 p;
    switch (shape.kind) {
        case ShapeKind::sphere: p = (shape.radius / norm(l)) * l; break;
        case ShapeKind::capsule:
            p = (shape.radius / norm(l)) * l + Vec3{0, 0, std::copysign(shape.half_length, l.z)};
            break;
        case ShapeKind::box:
            p = {std::copysign(shape.half.x, l.x), std::copysign(shape.half.y, l.y),
                 std::copysign(shape.half.z, l.z)};
            break;
        case ShapeKind::cylinder: p = rim + Vec3{0, 0, std::copysign(shape.half_length, l.z)}; break;
        case ShapeKind::cone: {
            const Vec3 base = rim - Vec3{0, 0, 0.5 * shape.half_length}, top{0, 0, 1.5 * shape.half_length};
            p = dot(base, l) > dot(top, l) ? base : top;
            break;
        }
        case ShapeKind::hull:
            p = shape.hull->corners[0];
            for (const Vec3 c : shape.hull->corners)
                if (dot(c, l) > dot(p, l)) p = c;
            break;
        case ShapeKind::triangle:
            p = shape.mesh->corner(shape.triangle, 0);
            for (int k = 1; k < 3; ++k)
                if (const Vec3 c = shape.mesh->corner(shape.triangle, k); dot(c, l) > dot(p, l)) p = c;
            break;
        case ShapeKind::plane: break;  // not bounded
    }
    return apply(at, p);
}

/// Of up to four points: the point of their hull nearest to the origin, and those that span it. Every subset is tried.
struct Spanned {
    std::array<Vec3, 4> points;
    int count = 0;
    Vec3 nearest;
};

inline Spanned spanning(const std::array<Vec3, 4>& points, int count) {
    Spanned best;
    double least = HUGE_VAL;
    for (int chosen = 1; chosen < (1 << count); ++chosen) {
        Spanned some;
        for (int k = 0; k < count; ++k)
            if (chosen >> k & 1)
                some.points[static_cast<std::size_t>(some.count++)] = points[static_cast<std::size_t>(k)];
        // p0 + Σ s_i e_i without a part along any edge e_i = p_i − p0, by Gram and Schmidt; outside if a share is below 0.
        const int edges = some.count - 1;
        double gram[3][4];
        for (int i = 0; i < edges; ++i) {
            const Vec3 e = some.points[static_cast<std::size_t>(i + 1)] - some.points[0];
            for (int j = 0; j < edges; ++j)
                gram[i][j] = dot(e, some.points[static_cast<std::size_t>(j + 1)] - some.points[0]);
            gram[i][3] = -dot(e, some.points[0]);
        }
        bool flat = false;
        for (int i = 0; i < edges && !flat; ++i) {
            const double pivot = gram[i][i];
            flat = !(pivot > 0.0);
            for (int row = 0; row < edges && !flat; ++row) {
                if (row == i) continue;
                const double times = gram[row][i] / pivot;
                for (int j = i; j < edges; ++j) gram[row][j] -= times * gram[i][j];
                gram[row][3] -= times * gram[i][3];
            }
        }
        if (flat) continue;
        double first = 1.0;
        bool inside = true;
        Vec3 p = some.points[0];
        for (int i = 0; i < edges; ++i) {
            const double share = gram[i][3] / gram[i][i];
            first -= share, inside = inside && share >= 0.0;
            p += share * (some.points[static_cast<std::size_t>(i + 1)] - some.points[0]);
        }
        if (!inside || !(first >= 0.0)) continue;
        if (const double far = norm(p); far < least) least = far, some.nearest = p, best = some;
    }
    return best;
}

/// Bounds of a distance [m]: the shapes are `least` apart along `normal` (unit, from second to first), and two of their
/// points are `most` apart. Where they overlap `least` is not positive, and `most` says nothing.
struct Distance {
    double least = -HUGE_VAL, most = HUGE_VAL;
    Vec3 normal{0, 0, 1};
};

/// Two bounded shapes. Both bounds hold whatever the search does: `least` is a gap along one direction, `most` the
/// length between two points of the shapes, each a mean of supports.
inline Distance distance(const Primitive& first, const Pose& at_first, const Primitive& second,
                         const Pose& at_second, Vec3 guess) {
    const auto difference = [&](Vec3 n) {
        return farthest_point(first, at_first, -n) - farthest_point(second, at_second, n);
    };
    Distance found;
    std::array<Vec3, 4> held{difference(guess)};
    int count = 1;
    Vec3 v = held[0];
    for (int round = 0; round < 100; ++round) {
        const double length = norm(v);
        found.most = std::min(found.most, length);
        if (!(length > 1e-12)) break;
        const Vec3 w = difference(v);
        if (const double along = dot(v, w) / length; along > found.least)
            found.least = along, found.normal = (1.0 / length) * v;
        if (length - found.least <= 1e-11 * length) break;
        held[static_cast<std::size_t>(count)] = w;
        const Spanned now = spanning(held, count + 1);
        if (now.count == 4 || !(norm(now.nearest) < length)) break;  // the origin is inside; or no nearer
        held = now.points, count = now.count, v = now.nearest;
    }
    return found;
}

}  // namespace support

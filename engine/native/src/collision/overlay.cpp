#include "collision/overlay.hpp"

#include <algorithm>

#include "collision/tolerances.hpp"

namespace spook {

Patch facing(const Frustum& frustum, Vec3 n, Vec3 other) noexcept {
    const Vec3 out = frustum.outward(n);
    const double along = dot(n, frustum.axis), side = frustum.cosine * dot(n, out) + frustum.sine * along;
    const int end = along > 0.0 ? 1 : 0;
    Patch patch;
    if (frustum.radius[end] == 0.0 || std::abs(along) < side) {
        patch.corners[0] = frustum.centre[0] + frustum.radius[0] * out;
        patch.corners[1] = frustum.centre[1] + frustum.radius[1] * out;
        patch.count = 2;
        return patch;
    }
    patch.kind = Patch::disc;
    patch.normal = end ? frustum.axis : -frustum.axis;
    patch.centre = frustum.centre[end];
    patch.radius = frustum.radius[end];
    // The rim's nearest point, its opposite and the two between: leaning in any direction it is held at its very edge.
    const Vec3 down = frustum.outward(is_zero(other) ? n : -other), aside = cross(frustum.axis, down);
    for (const Vec3 spoke : {down, aside, -down, -aside})
        patch.corners[static_cast<std::size_t>(patch.count++)] = patch.centre + patch.radius * spoke;
    return patch;
}

Patch facing(const Facets& facets, Vec3 n) noexcept {
    Patch patch;
    if (facets.face_count == 0) {
        for (int k = 0; k < facets.corner_count; ++k)
            patch.corners[static_cast<std::size_t>(k)] = facets.corners[k];
        patch.count = facets.corner_count;
        return patch;
    }
    int best = 0;
    for (int k = 1; k < facets.face_count; ++k)
        if (dot(n, facets.normals[k]) > dot(n, facets.normals[best]) + 1e-9) best = k;
    const Polytope::Face& face = facets.shape->faces[static_cast<std::size_t>(best)];
    patch.kind = Patch::polygon;
    patch.normal = facets.normals[best];
    patch.count = face.count;
    for (int k = 0; k < face.count; ++k) {
        const int place = face.begin + k;
        patch.corners[static_cast<std::size_t>(k)] =
            facets.corners[facets.shape->loops[static_cast<std::size_t>(place)]];
    }
    return patch;
}

namespace {

using namespace tolerances::overlay;

/// Numbers of a corner of the first (0) or second (1) patch, and of the first of two points on a side. Those beyond
/// eight stand behind all others.
constexpr std::uint32_t corner_feature(std::uint32_t whose, int k) noexcept {
    return (k < 8 ? 8 * whose : 64 + 16 * whose) + static_cast<std::uint32_t>(k);
}
constexpr std::uint32_t side_feature(int k) noexcept {
    return (k < 8 ? 16 : 96) + 2 * static_cast<std::uint32_t>(k);
}

class Overlay {
public:
    Overlay(const Patch& first, const Patch& second, const SeparatingAxis& axis, double radius, double margin,
            double slop) noexcept
        : first_(first),
          second_(second),
          n_(axis.normal),
          deepest_(axis.gap - slop),
          radius_(radius),
          margin_(margin),
          slop_(slop) {
        own_corners(first_, second_, 1.0, 0);
        own_corners(second_, first_, -1.0, 1);
        if (first_.kind == Patch::disc && second_.kind == Patch::disc) rims();
        else if (first_.kind == Patch::disc) crossings(second_, first_, -1.0);
        else if (second_.kind == Patch::disc) crossings(first_, second_, 1.0);
        else if (second_.kind == Patch::polygon) through(first_, second_, 1.0);
        else if (first_.kind == Patch::polygon) through(second_, first_, -1.0);
    }
    Manifold manifold;
    double least = 1e300;  // gap, m

private:
    const Patch &first_, &second_;
    Vec3 n_;
    double deepest_, radius_, margin_, slop_;

    /// A point of one patch and its gap to the plane of the other; `sign` is 1 for a point of the first.
    void add(Vec3 p, const Patch& other, double sign, std::uint32_t feature) noexcept {
        const double turned = dot(other.normal, n_);
        if (std::abs(turned) < 0.1) return;
        const double way = dot(other.normal, other.corners[0] - p) / turned, gap = sign * way - radius_;
        if (gap > margin_ || gap < deepest_) return;  // deeper than the shapes are: beside the other's patch
        // Midway between the surfaces: a round second's stands out of its core by its radius.
        const ContactPoint point{p + (0.5 * way - 0.5 * radius_) * n_, n_, gap, feature};
        for (int k = 0; k < manifold.count; ++k) {
            ContactPoint& known = manifold.points[static_cast<std::size_t>(k)];
            const Vec3 between = p + 0.5 * way * n_ - known.position;
            if (norm(between - dot(between, n_) * n_) > slop_) continue;
            if (gap < known.gap - slop_)
                known = point, least = std::min(least, gap);  // a line along n: its near end
            return;
        }
        least = std::min(least, gap);
        manifold.add(point.position, n_, gap, feature);
    }
    bool before(Vec3 p, const Patch& other) const noexcept {
        if (other.kind == Patch::disc) {
            const double turned = dot(other.normal, n_);
            const Vec3 on = p + (dot(other.normal, other.centre - p) / turned) * n_ - other.centre;
            return norm(on) <= other.radius + slop_;
        }
        for (int k = 0; k < other.count; ++k) {
            const Vec3 from = other.corners[static_cast<std::size_t>(k)],
                       along = other.corners[static_cast<std::size_t>((k + 1) % other.count)] - from,
                       out = cross(along, dot(other.normal, n_) > 0.0 ? n_ : -n_);
            if (dot(out, p - from) > slop_ * norm(out)) return false;
        }
        return true;
    }
    void own_corners(const Patch& own, const Patch& other, double sign, std::uint32_t whose) noexcept {
        if (other.kind == Patch::line || std::abs(dot(other.normal, n_)) < 0.1) return;
        for (int k = 0; k < own.count; ++k) {
            if (own.hidden_corners >> k & 1u) continue;
            const Vec3 p = own.corners[static_cast<std::size_t>(k)];
            if (before(p, other)) add(p, other, sign, corner_feature(whose, k));
        }
    }
    /// Where the sides of a polygon, or a line, cross the rim of a disc.
    void crossings(const Patch& straight, const Patch& disc, double sign) noexcept {
        const double turned = dot(disc.normal, n_);
        if (std::abs(turned) < 0.1) return;
        const auto onto = [&](Vec3 p) {
            return p + (dot(disc.normal, disc.centre - p) / turned) * n_ - disc.centre;
        };
        const int sides = straight.kind == Patch::line ? straight.count - 1 : straight.count;
        for (int k = 0; k < sides; ++k) {
            if (straight.hidden_sides >> k & 1u) continue;
            const std::uint32_t feature = side_feature(k);
            const Vec3 from = straight.corners[static_cast<std::size_t>(k)],
                       to = straight.corners[static_cast<std::size_t>((k + 1) % straight.count)];
            const Vec3 p = onto(from), along = onto(to) - p;
            const double square = dot(along, along), half = dot(p, along);
            const double root = half * half - square * (dot(p, p) - disc.radius * disc.radius);
            if (!(root > 0.0) || !(square > 0.0)) continue;
            for (const double side : {-1.0, 1.0}) {
                const double t = (side * std::sqrt(root) - half) / square;
                if (t > 0.0 && t < 1.0)
                    add(from + t * (to - from), disc, sign, feature + (side > 0.0 ? 1u : 0u));
            }
        }
    }
    /// Where two rims cross, both seen along n as circles.
    void rims() noexcept {
        Vec3 between = second_.centre - first_.centre;
        between -= dot(between, first_.normal) * first_.normal;
        const double distance = norm(between), r = first_.radius, other = second_.radius;
        if (!(distance > slop_) || distance >= r + other || distance <= std::abs(r - other)) return;
        const double along = 0.5 * (distance + (r - other) * (r + other) / distance);
        const double across = std::sqrt(std::max(0.0, r * r - along * along));
        const Vec3 unit = (1.0 / distance) * between, aside = cross(first_.normal, unit);
        for (const double side : {-1.0, 1.0})
            add(first_.centre + along * unit + side * across * aside, second_, 1.0, side > 0.0 ? 17 : 16);
    }
    /// Where a line, or the sides of a polygon, enter and leave another polygon.
    void through(const Patch& straight, const Patch& polygon, double sign) noexcept {
        const int sides = straight.kind == Patch::line ? straight.count - 1 : straight.count;
        for (int side = 0; side < sides; ++side) {
            if (straight.hidden_sides >> side & 1u) continue;
            double low = 0.0, high = 1.0;
            unsigned low_side = 0, high_side = 0;
            bool misses = false;
            const Vec3 from = straight.corners[static_cast<std::size_t>(side)],
                       way = straight.corners[static_cast<std::size_t>((side + 1) % straight.count)] - from;
            for (int k = 0; k < polygon.count; ++k) {
                const Vec3 on = polygon.corners[static_cast<std::size_t>(k)],
                           along = polygon.corners[static_cast<std::size_t>((k + 1) % polygon.count)] - on,
                           out = cross(along, dot(polygon.normal, n_) > 0.0 ? n_ : -n_);
                const double start = dot(out, from - on), speed = dot(out, way);
                if (std::abs(speed) <= 1e-14 * norm(out) * norm(way)) misses = misses || start > 0.0;
                else if (speed > 0.0 && -start / speed < high)
                    high = -start / speed, high_side = static_cast<unsigned>(k);
                else if (speed < 0.0 && -start / speed > low)
                    low = -start / speed, low_side = static_cast<unsigned>(k);
            }
            if (misses || !(low < high)) continue;
            const std::uint32_t feature = side_feature(side);
            if (low > 0.0 && !(polygon.hidden_sides >> low_side & 1u))
                add(from + low * way, polygon, sign, feature);
            if (high < 1.0 && !(polygon.hidden_sides >> high_side & 1u))
                add(from + high * way, polygon, sign, feature + 1);
        }
    }
};

}  // namespace

Manifold overlay(const Patch& first, const Patch& second, const SeparatingAxis& axis, double radius,
                 double margin, double slop, double& least) noexcept {
    const Overlay found(first, second, axis, radius, margin, slop);
    least = found.least;
    return found.manifold;
}

/// The line or the point of a frustum that is farthest along `n`.
Segment farthest_line(const Frustum& frustum, Vec3 n, double slop) noexcept {
    const Vec3 out = frustum.outward(n);
    const double across = norm(cross(n, frustum.axis));
    const double low = frustum.end(0, n, across), high = frustum.end(1, n, across);
    const Vec3 a = frustum.centre[0] + frustum.radius[0] * out,
               b = frustum.centre[1] + frustum.radius[1] * out;
    const double half = 0.5 * norm(b - a);
    if (std::abs(low - high) <= std::max(slop, level * half))
        return {0.5 * (a + b), (0.5 / half) * (b - a), half};
    return {low > high ? a : b, (0.5 / half) * (b - a), 0.0};
}

/// The edge or the corner that is lowest along `n`: parallel edges share an axis, and the named one may not be lowest.
Segment lowest_line(const Facets& facets, Vec3 n, int edge, double slop) noexcept {
    int lowest = 0;
    for (int k = 1; k < facets.corner_count; ++k)
        if (dot(n, facets.corners[k]) < dot(n, facets.corners[lowest])) lowest = k;
    const double lowest_of_all = dot(n, facets.corners[lowest]);
    for (const bool any : {false, true})
        for (int k = 0; k < facets.edge_count; ++k) {
            if (!any && k != edge) continue;
            const Vec3 a = facets.corners[facets.edges[k].from], b = facets.corners[facets.edges[k].to];
            const double half = 0.5 * norm(b - a);
            if (std::max(dot(n, a), dot(n, b)) - lowest_of_all > std::max(slop, level * half)) continue;
            return {0.5 * (a + b), (0.5 / half) * (b - a), half};
        }
    return {facets.corners[lowest], any_normal_to(n), 0.0};
}

Manifold lines(const Segment& first, const Segment& second, Vec3 n, double gap, double radius,
               double margin) noexcept {
    Manifold manifold;
    const auto add = [&](double t, double u, std::uint32_t feature) {
        const Vec3 p = first.at(t), q = second.at(u);
        const double here = feature == 24 ? gap : dot(n, q - p) - radius;
        // Edges that do not cross, seen along n, are farther apart than the gap says: see edges_touch.
        if (here > margin || (here > 0.0 && norm(q - p) - radius > margin)) return;
        manifold.add(0.5 * (p + q - radius * n), n, here, feature);
    };
    const SegmentPair closest = closest_parameters(first, second);
    if (closest.parallel && first.half > 0.0 && second.half > 0.0) {
        const double middle = dot(second.centre - first.centre, first.direction);
        const double low = clamped(middle - second.half, -first.half, first.half),
                     high = clamped(middle + second.half, -first.half, first.half);
        if (high - low > 1e-6 * (first.half + second.half)) {
            add(low, closest_parameter(second, first.at(low)), 25);
            add(high, closest_parameter(second, first.at(high)), 26);
            return manifold;
        }
    }
    add(closest.first, closest.second, 24);
    return manifold;
}

}  // namespace spook

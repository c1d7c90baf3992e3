#include "collision/advance.hpp"

#include <algorithm>
#include <cmath>

#include "collision/frustum.hpp"

namespace spook {

namespace {

/// A direction n that turns steadily about `spin` [rad/s] while `origin` [m] goes on with `velocity` [m/s].
struct Frame {
    Vec3 spin, origin, velocity;
};

/// Least height along n of a corner, or of the disc about it, against time: at least
/// height + rate t + (bend − jerk t / 3) t² / 2, in m and s.
struct Mark {
    double height, rate, bend, jerk;
    double radius = 0.0;               // of the disc, m
    double sine = 0.0, slope = 0.0;    // of the angle of n and its axis, and how fast that grows, 1/s
    double cosine = 0.0, curve = 0.0;  // and what bounds its second derivative, 1/s²
    double turn = 0.0;                 // fastest change of that angle, rad/s
};

struct Marks {
    int count = 0;
    Mark of[Polytope::most_corners];
};

/// The mark of a point at the arm `r` from its body's centre. The third derivative of n · z is bounded by those of both.
Mark follow(Vec3 r, const Pose& body, const Mover& mover, Vec3 n, const Frame& frame, double left) noexcept {
    const Vec3 w = mover.spin, turned = cross(w, r);
    const Vec3 z = body.position + r - frame.origin, dz = mover.velocity - frame.velocity + turned,
               ddz = cross(w, turned);
    const Vec3 dn = cross(frame.spin, n), ddn = cross(frame.spin, dn);
    const double omega = norm(frame.spin), p = norm(dn), rate = norm(w), round = norm(turned);
    const double fastest = norm(mover.velocity - frame.velocity) + round;
    return {dot(n, z), dot(dn, z) + dot(n, dz), dot(ddn, z) + 2.0 * dot(dn, dz) + dot(n, ddz),
            p * (omega * (omega * (norm(z) + left * fastest) + 3.0 * fastest) + 3.0 * rate * round) +
                rate * rate * round};
}

/// Every corner of a shape that the direction does not turn with.
Marks marks(const Mover& mover, double time, Vec3 n, const Frame& frame, double left) noexcept {
    const Pose body = mover.body_at(time), at = placed(body, mover.part);
    Marks found;
    if (mover.shape.has_rims()) {
        const Frustum frustum(mover.shape, at);
        const Vec3 other = mover.spin - frame.spin;
        const double sine = norm(cross(n, frustum.axis)), cosine = dot(n, frustum.axis);
        const double swing = norm(cross(frame.spin, n));
        const double change = dot(frustum.axis, cross(n, other));
        for (int i = 0; i < 2; ++i) {
            Mark& mark = found.of[found.count++] =
                follow(frustum.centre[i] - body.position, body, mover, n, frame, left);
            mark.radius = frustum.radius[i], mark.sine = sine, mark.cosine = std::abs(cosine);
            mark.slope = sine > 0.0 ? -cosine * change / sine : 0.0;
            mark.turn = norm(cross(n, other)) + swing * left * norm(other);
            mark.curve = swing * (norm(frame.spin) + 2.0 * norm(mover.spin)) +
                         norm(mover.spin) * norm(cross(mover.spin, frustum.axis));
        }
        return found;
    }
    const Facets facets(mover.shape, at);
    for (int k = 0; k < facets.corner_count; ++k) {
        Mark& mark = found.of[found.count++] =
            follow(facets.corners[k] - body.position, body, mover, n, frame, left);
        mark.height -= facets.radius;
    }
    return found;
}

/// What a shape that turns with the direction reaches, which stays.
Marks held(const Mover& mover, double time, Vec3 n, const Frame& frame) noexcept {
    const Pose body = mover.body_at(time), at = placed(body, mover.part);
    const double aside = dot(n, at.position - frame.origin);
    Marks found;
    found.count = 1;
    if (mover.shape.kind == ShapeKind::plane) found.of[0] = {aside, 0.0, 0.0, 0.0};
    else if (mover.shape.has_rims())
        found.of[0] = {-Frustum(mover.shape, at).reach(-n) - dot(n, frame.origin), 0.0, 0.0, 0.0};
    else {
        const Facets facets(mover.shape, at);
        found.of[0] = {facets.lowest(n) - facets.radius - dot(n, frame.origin), 0.0, 0.0, 0.0};
    }
    return found;
}

/// The mark with its disc as a corner that does no better until `until`.
Mark bounded(Mark mark, double until) noexcept {
    if (mark.radius == 0.0) return mark;
    mark.height -= mark.radius * mark.sine;
    const double least = mark.sine - until * mark.turn;
    if (least >
        0.5 * mark.sine) {  // the sine of an angle bends up by no more than its cosine over it makes it
        mark.rate -= mark.radius * mark.slope;
        mark.bend -= mark.radius * std::min(1.0, mark.cosine + until * mark.turn) * mark.curve / least;
    } else {
        mark.rate -= mark.radius * mark.turn;
    }
    return mark;
}

/// Least t > 0 with height + rate t + bend t² / 2 = 0, for a height above zero; infinite if there is none.
double falls(double height, double rate, double bend) noexcept {
    const double square = rate * rate - 2.0 * bend * height;
    if (!(square >= 0.0) || (rate >= 0.0 && bend >= 0.0)) return 1e300;
    const double root = std::sqrt(square);
    return rate > 0.0 ? (rate + root) / -bend : 2.0 * height / (root - rate);
}

/// How long, at most `until`, no corner of either has used the gap up.
double safe(const Marks& first, const Marks& second, double slop, double until) noexcept {
    double least = until;
    for (int i = 0; i < first.count; ++i) {
        const Mark one = bounded(first.of[i], until);
        for (int j = 0; j < second.count; ++j) {
            const Mark two = bounded(second.of[j], until);
            const double height = one.height + two.height + slop, rate = one.rate + two.rate,
                         bend = one.bend + two.bend - until * (one.jerk + two.jerk);
            if (!(height > 0.0)) return 0.0;
            if (height + least * (std::min(0.0, rate) + 0.5 * least * std::min(0.0, bend)) > 0.0) continue;
            least = std::min(least, falls(height, rate, bend));
        }
    }
    return least;
}

/// How long, at most `left`, what discs lean by does not halve.
double lean_lasts(const Marks& marks, double left) noexcept {
    for (int i = 0; i < marks.count; ++i)
        if (const Mark& mark = marks.of[i]; mark.turn * left > 0.499 * mark.sine && mark.radius > 0.0)
            left = 0.499 * mark.sine / mark.turn;
    return left;
}

/// The longest that is found by looking less far ahead, where less can change.
double longest(const Marks& first, const Marks& second, double slop, double left) noexcept {
    double best = 0.0, until = left;
    for (int look = 0; look < 4; ++look) {
        const double here = safe(first, second, slop, until);
        best = std::max(best, here);
        const double nearer = std::max(4.0 * here, 0.125 * until);
        if (!(here > 0.0) || here >= until || nearer >= 0.9 * until) break;
        until = nearer;
    }
    const double leans = lean_lasts(second, lean_lasts(first, left));
    if (best < leans && leans < left) best = std::max(best, safe(first, second, slop, leans));
    return best;
}

/// The direction of the edge, or of the line on its side, that a shape is met with along n: of its two lowest corners,
/// if they are equally low.
bool lowest_edge(const Mover& mover, double time, Vec3 n, Vec3& edge) noexcept {
    if (mover.shape.has_rims()) {
        const Frustum frustum(mover.shape, mover.at(time));
        const Vec3 out = frustum.outward(-n);
        const Vec3 way =
            frustum.centre[1] - frustum.centre[0] + (frustum.radius[1] - frustum.radius[0]) * out;
        edge = (1.0 / norm(way)) * way;
        return std::abs(dot(n, edge)) <= 1e-9;
    }
    const Facets facets(mover.shape, mover.at(time));
    if (facets.corner_count < 2) return false;
    int low = 0, next = -1;
    for (int k = 1; k < facets.corner_count; ++k) {
        if (dot(n, facets.corners[k] - facets.corners[low]) < 0.0) next = low, low = k;
        else if (next < 0 || dot(n, facets.corners[k] - facets.corners[next]) < 0.0) next = k;
    }
    const Vec3 way = facets.corners[next] - facets.corners[low];
    const double length = norm(way);
    if (!(dot(n, way) <= 1e-9 * length)) return false;
    edge = (1.0 / length) * way;
    return true;
}

}  // namespace

double separated_for(const Mover& first, const Mover& second, Vec3 normal, double time, double left,
                     double slop) noexcept {
    double best = 0.0;
    const Frame with_second{second.spin, second.body_at(time).position, second.velocity};
    if (first.shape.kind != ShapeKind::plane)
        best = longest(marks(first, time, normal, with_second, left),
                       held(second, time, -normal, with_second), slop, left);
    if (best >= left || second.shape.kind == ShapeKind::plane) return best;
    const Frame with_first{first.spin, first.body_at(time).position, first.velocity};
    best = std::max(best, longest(held(first, time, normal, with_first),
                                  marks(second, time, -normal, with_first, left), slop, left));
    Vec3 one, two;
    if (best >= left || first.shape.kind == ShapeKind::plane || !lowest_edge(first, time, normal, one) ||
        !lowest_edge(second, time, -normal, two))
        return best;
    const Vec3 across = cross(one, two);
    const double sine = norm(across);
    if (!(sine > 1e-3)) return best;
    const double side = dot(across, normal) < 0.0 ? -1.0 : 1.0;
    const Vec3 change =
        (side / sine) * (cross(cross(first.spin, one), two) + cross(one, cross(second.spin, two)));
    const Frame with_edges{cross(normal, change), with_first.origin, with_first.velocity};
    return std::max(best, longest(marks(first, time, normal, with_edges, left),
                                  marks(second, time, -normal, with_edges, left), slop, left));
}

}  // namespace spook

#include "collision/frustum.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "collision/cylinder.hpp"
#include "collision/segment.hpp"
#include "collision/solid_pairs.hpp"
#include "collision/tolerances.hpp"
#include "collision/triangle.hpp"
#include "linear/elementary.hpp"

namespace spook {

namespace {

constexpr Polytope::Edge only_edge{0, 1, 0, 0};
constexpr Polytope::Edge round_triangle[3] = {{0, 1, 0, 1}, {1, 2, 0, 1}, {2, 0, 0, 1}};

using namespace tolerances::frustum;

/// Parts of a turn, from −π to π.
struct Circle {
    static constexpr int count = 48;
    SineCosine turns[count + 1];
    Circle() noexcept {
        for (int k = 0; k <= count; ++k) turns[k] = sine_cosine(std::numbers::pi * (2.0 * k / count - 1.0));
    }
};
const Circle& circle() noexcept {
    static const Circle parts;
    return parts;
}
double circle_angle(int k, int parts) noexcept { return std::numbers::pi * (2.0 * k / parts - 1.0); }

/// a cos φ + b sin φ − r √(p² cos² φ + (p m sin φ − w)²): the gap of a disc of radius r and a feature whose normals are
/// a circle of directions. It peaks sharply, if at all, near φ = ±π/2, where the direction is nearest to the axis.
struct Around {
    double a, b, r, p, m, w;

    struct Look {
        double value, slope, bend, root;
    };
    Look at(SineCosine turn) const noexcept {
        const double s = turn.sine, c = turn.cosine, v = p * m * s - w;
        const double q = p * p * c * c + v * v, root = std::sqrt(q);
        double first = b * c - a * s, second = -a * c - b * s;
        if (root > 0.0) {
            const double half = p * c * (m * v - p * s);  // q′/2
            first -= r * half / root;
            const double turned = p * p * (s * s - c * c + m * m * c * c) - p * m * s * v;  // q″/2
            second -= r * (turned - half * half / q) / root;
        }
        return {a * c + b * s - r * root, first, second, root};
    }

    /// Calls visit(cos φ, sin φ) at every local maximum on the whole circle but those that `below` excludes: it is told what two
    /// looks see, where, and the turn from one to the other.
    template <class Below, class Visit> void peaks(Below below, Visit visit) const noexcept {
        if (r == 0.0) return apex(visit);
        constexpr int parts = 16;
        const SineCosine* turn = circle().turns;
        const SineCosine part = turn[Circle::count / 2 + Circle::count / parts];
        Look before = at(turn[0]);
        const Look first = before;  // and last: rounding may not part the circle from itself
        for (int k = 1; k <= parts; ++k) {
            const Look start = before;
            const SineCosine from = *turn;
            turn += Circle::count / parts;
            before = k < parts ? at(*turn) : first;
            if (start.slope > 0.0 && before.slope <= 0.0 && !below(start, from, before, *turn, part))
                peak(circle_angle(k - 1, parts), circle_angle(k, parts), visit);
        }
    }
    /// The same from one angle to another.
    template <class Below, class Visit>
    void peaks(double from, double to, Below below, Visit visit) const noexcept {
        if (r == 0.0) return apex(visit);
        const int parts = 1 + static_cast<int>(8.0 * (to - from) / std::numbers::pi);
        const double part = (to - from) / parts;
        SineCosine next = sine_cosine(from);
        const SineCosine width = sine_cosine(part);
        Look before = at(next);
        for (int k = 0; k < parts; ++k) {
            const Look start = before;
            const SineCosine turn = next;
            const double low = from + k * part;
            next = sine_cosine(low + part);
            before = at(next);
            if (start.slope > 0.0 && before.slope <= 0.0 && !below(start, turn, before, next, width))
                peak(low, low + part, visit);
        }
    }

private:
    template <class Visit> void apex(Visit visit) const noexcept {
        const double most = length(a, b);
        if (most > 0.0) visit(a / most, b / most);
    }
    template <class Visit> void peak(double low, double high, Visit visit) const noexcept {
        double angle = 0.5 * (low + high);
        for (int round = 0; round < 80; ++round) {
            const Look here = at(sine_cosine(angle));
            (here.slope > 0.0 ? low : high) = angle;
            double next = angle - here.slope / here.bend;
            // Steps round a kink can go to and fro for ever: after a few every second one halves.
            const bool halves = (round > 8 && round % 2 != 0) || !(next > low && next < high);
            if (halves) next = 0.5 * (low + high);
            const double way = std::abs(next - angle);
            angle = next;
            // What Newton's steps leave is of the order of their square over the width of the kink.
            if (way <= 4e-16 || (!halves && way * way <= 4e-16 * here.root)) break;
        }
        const SineCosine turn = sine_cosine(angle);
        visit(turn.cosine, turn.sine);
    }
};

/// The most of value cos Δ + slope sin Δ over a turn Δ of less than two right angles. The gap of convex shapes, a concave function of
/// the direction's length and turn, is nowhere more, if this is what it is and how it changes at Δ = 0.
double most_along(double value, double slope, SineCosine turn) noexcept {
    const double there = value * turn.cosine + slope * turn.sine;
    return slope > 0.0 && slope * turn.cosine < value * turn.sine ? length(value, slope)
                                                                  : std::max(value, there);
}

/// Collects axes; `gap` gives the gap along a direction.
template <class Gap> struct Search {
    Gap gap;
    const Triangle* sheet = nullptr;
    SeparatingAxes found{};

    void flat(Vec3 n) noexcept { improve(found.flat, n, -1); }
    void curved(Vec3 n, int edge = -1) noexcept { improve(found.curved, n, edge); }
    /// What is below it is neither the best axis of all nor, where a flat one is better, of its kind.
    double least() const noexcept { return std::max(found.flat.gap, found.curved.gap); }

private:
    void improve(SeparatingAxis& best, Vec3 n, int edge) noexcept {
        const double along = gap(n);
        if (along > found.all.gap) found.all = {along, n, edge};
        if (along > best.gap && (!sheet || sheet->genuine(-n))) best = {along, n, edge};
    }
};

/// The unit vector normal to `e` nearest to `v`, which is nearly so.
Vec3 normal_to(Vec3 e, Vec3 v) noexcept {
    const Vec3 unit = (1.0 / norm(v)) * v, across = unit - dot(unit, e) * e;
    return (1.0 / norm(across)) * across;
}

/// The corner `p` and the frustum's side and rims.
template <class Gap> void meet_corner(Search<Gap>& search, const Frustum& frustum, Vec3 p) noexcept {
    const Vec3 away = frustum.radial(p - frustum.centre[0]);
    const double distance = norm(away);
    const Vec3 out = frustum.unit_across(away);
    search.curved(frustum.cosine * out + frustum.sine * frustum.axis);
    for (int i = 0; i < 2; ++i) {
        if (distance <= frustum.radius[i]) continue;
        const Vec3 between = p - frustum.centre[i] - frustum.radius[i] * out;
        const double length = norm(between);
        if (length > 0.0) search.curved((1.0 / length) * between);
    }
}

/// `left` and `right` are the normals of the faces the edge parts: directions between them alone have it nearest. `beside`, a point
/// of the other as well, may be nearer than the edge.
template <class Gap>
void meet_edge(Search<Gap>& search, const Frustum& frustum, Vec3 from, Vec3 to, Vec3 beside, const Vec3* left,
               const Vec3* right, int edge) noexcept {
    const Vec3 along = to - from;
    const double length = norm(along);
    if (!(length > 0.0)) return;
    const Vec3 e = (1.0 / length) * along, across = cross(e, frustum.axis);
    const double m = dot(e, frustum.axis), k = norm(across);
    const Vec3 u = k > parallel ? normal_to(e, across) : any_normal_to(e), v = cross(u, e);
    if (k > parallel) {  // the side along one of its lines
        const double up = frustum.sine / k;
        if (std::abs(up) <= 1.0) {
            const double aside = std::sqrt(1.0 - up * up);
            search.curved(up * v + aside * u, edge);
            search.curved(up * v - aside * u, edge);
        }
    }
    const bool whole = left == nullptr;
    SineCosine ends[2], arc{0.0, 0.0};
    if (!whole) {
        const auto turned = [&](Vec3 n) {
            const double c = -dot(n, u), s = -dot(n, v), size = spook::length(c, s);
            return SineCosine{s / size, c / size};
        };
        const SineCosine one = ends[0] = turned(*left), two = ends[1] = turned(*right);
        arc = {one.cosine * two.sine - one.sine * two.cosine, one.cosine * two.cosine + one.sine * two.sine};
        if (arc.sine < 0.0) arc.sine = -arc.sine, std::swap(ends[0], ends[1]);
    }
    const double aside = dot(u, beside - from), above = dot(v, beside - from);
    for (int i = 0; i < 2; ++i) {
        const Vec3 between = from - frustum.centre[i];
        const Around around{dot(u, between), dot(v, between), frustum.radius[i], 1.0, m, 0.0};
        const double rounding = surely * (norm(from) + norm(between) + frustum.radius[i] + length);
        const auto below = [&](const Around::Look& one, SineCosine at_one, const Around::Look& two,
                               SineCosine at_two, SineCosine turn) {
            const double least = search.least() - rounding;
            if (most_along(one.value, one.slope, turn) < least ||
                most_along(two.value, -two.slope, turn) < least)
                return true;
            const double near = one.value + aside * at_one.cosine + above * at_one.sine,
                         far = two.value + aside * at_two.cosine + above * at_two.sine;
            const double near_slope = one.slope - aside * at_one.sine + above * at_one.cosine,
                         far_slope = two.slope - aside * at_two.sine + above * at_two.cosine;
            return most_along(near, near_slope, turn) < least || most_along(far, -far_slope, turn) < least;
        };
        const auto visit = [&](double c, double s) { search.curved(c * u + s * v, edge); };
        if (whole) {
            around.peaks(below, visit);
            continue;
        }
        if (around.r > 0.0 && below(around.at(ends[0]), ends[0], around.at(ends[1]), ends[1], arc)) continue;
        double low = arc_tangent(-dot(*left, v), -dot(*left, u)),
               high = arc_tangent(-dot(*right, v), -dot(*right, u));
        if (low > high) std::swap(low, high);
        if (high - low > std::numbers::pi) low += 2.0 * std::numbers::pi, std::swap(low, high);
        around.peaks(low, high, below, visit);
    }
}

/// The side of `one`, whose normals point to `other`, and the rims of `other`; `sign` turns them as the search wants.
template <class Gap>
void side_and_rims(Search<Gap>& search, const Frustum& one, const Frustum& other, double sign) noexcept {
    const Vec3 across = one.radial(other.axis);
    const double k = norm(across), m = dot(one.axis, other.axis);
    const Vec3 v = k > parallel ? normal_to(one.axis, across) : one.sideways, u = cross(v, one.axis);
    const double width = one.cosine;
    for (int i = 0; i < 2; ++i) {
        const Vec3 between = other.centre[i] - one.centre[0];
        const Around around{
            width * dot(u, between), width * dot(v, between), other.radius[i], width, m, one.sine * k};
        const auto never = [](auto&&...) { return false; };
        around.peaks(never, [&](double c, double s) {
            search.curved(sign * (width * (c * u + s * v) + one.sine * one.axis));
        });
    }
}

/// Two rims, and how far apart they are where the second's turn is looked at: its point, and the nearest of the first's.
class Rims {
public:
    Rims(const Frustum& one, int i, const Frustum& two, int j) noexcept
        : one_(one),
          u_(two.sideways),
          v_(cross(two.axis, two.sideways)),
          middle_(one.centre[i]),
          other_(two.centre[j]),
          r_(one.radius[i]),
          far_(two.radius[j]) {}

    /// Looks at a turn: half the slope of the squared distance over it, and unless null how that bends.
    double slope(SineCosine turn, double* bend = nullptr) noexcept {
        const Vec3 e = turn.cosine * u_ + turn.sine * v_, p = other_ + far_ * e;
        second_along_ = turn.cosine * v_ - turn.sine * u_;
        const Vec3 away = one_.radial(p - middle_);
        const Vec3 out = one_.unit_across(away);
        first_along_ = cross(one_.axis, out);
        apart_ = p - (middle_ + r_ * out);
        if (bend != nullptr) {
            const double side = dot(first_along_, second_along_), distance = norm(away);
            *bend = far_ - dot(apart_, e) - (distance > 0.0 ? r_ * far_ * side * side / distance : 0.0);
        }
        return dot(apart_, second_along_);
    }
    /// Looks at where the slope is zero between two turns at which its signs differ.
    void find_zero(double low, double at_low, double high, double at_high) noexcept {
        double angle = high, here = at_high, old = low, there = at_low;
        if (here == 0.0) slope(sine_cosine(angle));  // what was asked last may lie elsewhere
        for (int round = 0; round < 100 && here != 0.0;
             ++round) {  // secants, halving where one leaves the bracket
            double next = angle - here / (here - there) * (angle - old);
            if (!(next > low && next < high)) next = 0.5 * (low + high);
            if (std::abs(next - angle) <= 4e-16 || !(next > low && next < high)) break;
            old = angle, there = here;
            angle = next, here = slope(sine_cosine(angle));
            ((here > 0.0) == (at_low > 0.0) ? low : high) = angle;
        }
    }
    /// The directions that may part the rims where they were looked at last.
    template <class Gap> void visit(Search<Gap>& search, double sign) const noexcept {
        const double distance = norm(apart_);
        const Vec3 crossed = cross(first_along_, second_along_);
        const double sine = norm(crossed);
        // Crossing rims: the difference of two nearly equal points has no direction, their tangents have one.
        if (distance > 1e-3 * std::min(r_, far_)) search.curved((sign / distance) * apart_);
        if (sine > parallel) {
            search.curved((1.0 / sine) * crossed);
            search.curved((-1.0 / sine) * crossed);
        }
    }

private:
    const Frustum& one_;
    Vec3 u_, v_, middle_, other_;
    double r_, far_;
    Vec3 apart_, first_along_, second_along_;
};

/// Where the cubic that has these values and bends at both ends of a way turns beyond zero, or nearly so: a part of the
/// way; 0 if it does not.
double where_it_turns(double at_low, double bend_low, double at_high, double bend_high) noexcept {
    const double rise = at_high - at_low, a = 3.0 * (bend_low + bend_high - 2.0 * rise),
                 b = 3.0 * rise - 2.0 * bend_low - bend_high, root = b * b - a * bend_low;
    if (!(root > 0.0)) return 0.0;
    const double q = -(b + std::copysign(std::sqrt(root), b)), one = q / a, two = bend_low / q;
    const double early = std::min(one, two), late = std::max(one, two);
    const double near = 0.1 * std::max(std::abs(at_low), std::abs(at_high)), side = at_low > 0.0 ? 1.0 : -1.0;
    const auto above = [&](double t) { return side * (at_low + t * (bend_low + t * (b + t * a / 3.0))); };
    if ((at_low > 0.0) != (at_high > 0.0))  // once; or three times
        return early > 0.0 && late < 1.0 && above(early) < near && above(late) > -near ? early : 0.0;
    if (early > 0.0 && early < 1.0 && above(early) < near) return early;
    return late > 0.0 && late < 1.0 && above(late) < near ? late : 0.0;
}

struct RimPlace {
    double angle, slope, bend;
};

/// Visits the nearest points between two places. Where the slope may turn beyond zero in between it is asked: rims that
/// nearly touch have two nearest points close to each other.
template <class Gap>
void visit_between(Search<Gap>& search, Rims& rims, double sign, const RimPlace& low, const RimPlace& high,
                   int depth) noexcept {
    const double width = high.angle - low.angle;
    const double t = where_it_turns(low.slope, width * low.bend, high.slope, width * high.bend);
    if (t > 0.0 && depth > 0) {
        RimPlace middle{low.angle + t * width, 0.0, 0.0};
        middle.slope = rims.slope(sine_cosine(middle.angle), &middle.bend);
        visit_between(search, rims, sign, low, middle, depth - 1);
        visit_between(search, rims, sign, middle, high, depth - 1);
    } else if ((low.slope > 0.0) != (high.slope > 0.0)) {
        rims.find_zero(low.angle, low.slope, high.angle, high.slope);
        rims.visit(search, sign);
    }
}

/// Where the rims come nearest: each point of one, and the nearest of the other's. Round the smaller: about the larger's
/// circle the distance changes over less than a part of it.
template <class Gap>
void rim_and_rim(Search<Gap>& search, const Frustum& one, int i, const Frustum& two, int j,
                 double sign) noexcept {
    if (two.radius[j] > one.radius[i]) return rim_and_rim(search, two, j, one, i, -sign);
    Rims rims(one, i, two, j);
    constexpr int parts = 24;
    RimPlace low{circle_angle(0, parts), 0.0, 0.0};
    low.slope = rims.slope(circle().turns[0], &low.bend);
    const RimPlace first = low;  // and last: rounding may not part the circle from itself
    for (int k = 1; k <= parts; ++k) {
        RimPlace high{circle_angle(k, parts), first.slope, first.bend};
        if (k < parts) high.slope = rims.slope(circle().turns[k * Circle::count / parts], &high.bend);
        visit_between(search, rims, sign, low, high, 4);
        low = high;
    }
}

}  // namespace

Frustum::Frustum(const Primitive& primitive, const Pose& at) noexcept
    : axis(column(at.rotation, 2)), sideways(column(at.rotation, 0)) {
    const bool cone = primitive.kind == ShapeKind::cone;
    // A cone's centre of mass is a quarter of its height above its base.
    const double low = cone ? -0.5 * primitive.half_length : -primitive.half_length;
    const double high = cone ? 1.5 * primitive.half_length : primitive.half_length;
    centre[0] = at.position + low * axis, centre[1] = at.position + high * axis;
    radius[0] = primitive.radius, radius[1] = cone ? 0.0 : primitive.radius;
    const double fall = radius[0] - radius[1], rise = high - low, side = length(fall, rise);
    sine = fall / side, cosine = rise / side;
    thickness = std::min(rise, 2.0 * primitive.radius);
}

Vec3 Frustum::unit_across(Vec3 v) const noexcept { return spook::unit_across(v, axis, sideways); }

Vec3 Frustum::outward(Vec3 n) const noexcept {
    const Vec3 across = radial(n);
    return norm(across) > 1e-12 ? unit_across(across) : sideways;
}

Facets::Facets(const Primitive& primitive, const Pose& at) noexcept {
    if (primitive.faceted()) {
        const bool box = primitive.kind == ShapeKind::box;
        shape = box ? &cube() : primitive.hull.get();
        const Vec3 half = primitive.half;
        for (const Vec3 c : shape->corners)
            corners[corner_count++] = apply(at, box ? Vec3{half.x * c.x, half.y * c.y, half.z * c.z} : c);
        for (const Polytope::Face& face : shape->faces) normals[face_count++] = at.rotation * face.normal;
        edges = shape->edges.data(), edge_count = static_cast<int>(shape->edges.size());
        thickness = box ? 2.0 * std::min({half.x, half.y, half.z}) : shape->thickness;
        return;
    }
    if (primitive.kind == ShapeKind::triangle) {
        for (int k = 0; k < 3; ++k)
            corners[corner_count++] = apply(at, primitive.mesh->corner(primitive.triangle, k));
        normals[face_count++] =
            at.rotation * primitive.mesh->normals[static_cast<std::size_t>(primitive.triangle)];
        normals[face_count++] = -normals[0];
        edges = round_triangle, edge_count = 3;
        return;
    }
    radius = primitive.radius, thickness = 2.0 * primitive.radius;
    if (primitive.kind == ShapeKind::sphere) {
        corners[corner_count++] = at.position;
        return;
    }
    const Vec3 axis = primitive.half_length * column(at.rotation, 2);
    corners[corner_count++] = at.position - axis, corners[corner_count++] = at.position + axis;
    edges = &only_edge, edge_count = 1;
}

double Facets::lowest(Vec3 n) const noexcept {
    double least = 1e300;
    for (int k = 0; k < corner_count; ++k) least = std::min(least, dot(n, corners[k]));
    return least;
}

SeparatingAxes separating_axes(const Frustum& frustum, const Facets& other, double margin,
                               const Triangle* sheet) noexcept {
    Search search{[&](Vec3 n) noexcept { return other.lowest(n) - frustum.reach(n) - other.radius; }, sheet};
    search.flat(frustum.axis);
    search.flat(-frustum.axis);
    for (int k = 0; k < other.face_count; ++k) search.flat(-other.normals[k]);
    const auto parted = [&] { return search.found.all.gap > margin; };
    for (int k = 0; k < other.corner_count && !parted(); ++k) meet_corner(search, frustum, other.corners[k]);
    for (int k = 0; k < other.edge_count && !parted(); ++k) {
        const Polytope::Edge& edge = other.edges[k];
        const bool faces = other.shape != nullptr;
        meet_edge(search, frustum, other.corners[edge.from], other.corners[edge.to],
                  other.corners[(k + 2) % other.corner_count], faces ? &other.normals[edge.left] : nullptr,
                  faces ? &other.normals[edge.right] : nullptr, k);
    }
    return search.found;
}

SeparatingAxes separating_axes(const Frustum& one, const Frustum& two, double margin) noexcept {
    Search search{[&](Vec3 n) noexcept { return -two.reach(-n) - one.reach(n); }};
    for (const double side : {1.0, -1.0}) {
        search.flat(side * one.axis);
        search.flat(side * two.axis);
    }
    if (search.found.flat.gap > margin) return search.found;
    const double c = dot(one.axis, two.axis);
    const Vec3 crossed = cross(one.axis, two.axis);
    const double square = dot(crossed, crossed);
    if (square > 1e-14) {  // side on side: n · one = sine, n · two = −sine of the other
        const double a = (one.sine + c * two.sine) / square, b = -(two.sine + c * one.sine) / square;
        const double left = 1.0 - (a * one.sine - b * two.sine);
        if (left >= 0.0) {
            const Vec3 flat = a * one.axis + b * two.axis, aside = std::sqrt(left / square) * crossed;
            for (const Vec3 n : {flat + aside, flat - aside}) search.curved((1.0 / norm(n)) * n);
        }
    }
    for (int i = 0; i < 2; ++i) {  // ends as corners: apexes, and the sides of parallel axes
        meet_corner(search, one, two.centre[i]);
        const Vec3 out = two.radial(one.centre[i] - two.centre[0]);
        const double distance = norm(out);
        const Vec3 n = two.cosine * two.unit_across(out) + two.sine * two.axis;
        search.curved(-n);
        if (one.radius[i] == 0.0)
            for (int j = 0; j < 2; ++j) {
                if (distance <= two.radius[j]) continue;
                const Vec3 between = two.centre[j] + (two.radius[j] / distance) * out - one.centre[i];
                const double apart = norm(between);
                if (apart > 0.0) search.curved((1.0 / apart) * between);
            }
    }
    side_and_rims(search, one, two, 1.0);
    side_and_rims(search, two, one, -1.0);
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j)
            if (one.radius[i] > 0.0 && two.radius[j] > 0.0) rim_and_rim(search, one, i, two, j, 1.0);
    return search.found;
}

}  // namespace spook

// Boxes and convex hulls: separating axes, then the face of one clipped by the face of the other, or two edges.
//
// As for two boxes: the axis of largest separation wins; among near equals the first solid's faces, then the second's,
// then edges, so that resting solids keep their reference face from step to step. Pairs of edges count only where their
// arcs on the sphere of directions cross (Gregorius 2013), the others are no face of the Minkowski difference.
#include "collision/solid_pairs.hpp"

#include <algorithm>

#include "collision/narrow_phase.hpp"
#include "collision/segment.hpp"
#include "collision/tolerances.hpp"

namespace spook {

Solid::Solid(const Primitive& primitive, const Pose& at) noexcept
    : shape(primitive.kind == ShapeKind::hull ? *primitive.hull : cube()), rotation(at.rotation) {
    const bool box = primitive.kind == ShapeKind::box;
    const Vec3 half = primitive.half;
    for (int k = 0; k < count(); ++k) {
        const Vec3 c = shape.corners[static_cast<std::size_t>(k)];
        corners[k] = apply(at, box ? Vec3{half.x * c.x, half.y * c.y, half.z * c.z} : c);
    }
    thickness = box ? 2.0 * std::min({half.x, half.y, half.z}) : shape.thickness;
}

namespace {

using namespace tolerances::solid_pairs;

/// The face of `one` that the other lies farthest beyond; `sign` turns its normal from second to first.
SolidAxes::Best best_face(const Solid& one, const Solid& other, double sign) noexcept {
    SolidAxes::Best best{-1e300, sign * one.normal(0), 0, 0};  // also of what is no number
    for (int k = 0; k < static_cast<int>(one.shape.faces.size()); ++k) {
        const Vec3 n = one.normal(k);
        const double on = dot(n, one.corner_of(one.face(k), 0));
        double lowest = 1e300;
        for (int c = 0; c < other.count() && !(lowest - on <= best.gap); ++c)
            lowest = std::min(lowest, dot(n, other.corners[c]));
        if (lowest - on > best.gap) best = {lowest - on, sign * n, k, k};
    }
    return best;
}

/// The inward normals of a solid's faces in world axes, each coordinate by itself.
struct Inward {
    double x[Polytope::most_faces], y[Polytope::most_faces], z[Polytope::most_faces];
    int count;

    explicit Inward(const Solid& solid) noexcept : count(static_cast<int>(solid.shape.faces.size())) {
        for (int k = 0; k < count; ++k) {
            const Vec3 n = -solid.normal(k);
            x[k] = n.x, y[k] = n.y, z[k] = n.z;
        }
    }
    Vec3 operator[](int k) const noexcept { return {x[k], y[k], z[k]}; }
    void along(Vec3 v, double* found) const noexcept {
        for (int k = 0; k < count; ++k) found[k] = x[k] * v.x + y[k] * v.y + z[k] * v.z;
    }
};

Vec3 middle(const Solid& solid) noexcept {
    Vec3 sum;
    for (int k = 0; k < solid.count(); ++k) sum += solid.corners[k];
    return (1.0 / solid.count()) * sum;
}

/// Edges whose directions can part two solids by more than some gap: the ball in each, of radius rho about its middle, lies
/// inside, so that along n they are apart by n . way - rho - rho' at most, and the directions of an edge lie between the
/// normals beside it.
class Promising {
public:
    int edges[3 * Polytope::most_corners], count = 0;
    double inner = 1e300;  // rho, m

    /// `way`: from the other's middle to this one's, m; turned round for the second solid.
    Promising(const Solid& solid, Vec3 middle, Vec3 way) noexcept : solid_(solid) {
        for (int k = 0; k < static_cast<int>(solid.shape.faces.size()); ++k) {
            const Vec3 n = solid.normal(k);
            along_[k] = -dot(n, way);
            inner = std::min(inner, dot(n, solid.corner_of(solid.face(k), 0) - middle));
        }
    }
    /// `needed`: the gap and both radii, m.
    bool reaches(int edge, double needed) const noexcept {
        const auto [from, to, left, right] = solid_.shape.edges[static_cast<std::size_t>(edge)];
        const double most = std::max(along_[left], along_[right]);
        if (!(needed > 0.0) || !(most > 0.0)) return !(most < needed);
        const double cosine = dot(solid_.face(left).normal, solid_.face(right).normal);
        return !(most * most < 0.5 * (1.0 + cosine) * needed * needed);
    }
    void choose(double needed) noexcept {
        for (int k = 0; k < static_cast<int>(solid_.shape.edges.size()); ++k)
            if (reaches(k, needed)) edges[count++] = k;
    }

private:
    const Solid& solid_;
    double along_[Polytope::most_faces];  // of each face, how far its inward normal goes along the way, m
};

}  // namespace

SolidAxes solid_axes(const Solid& first, const Solid& second, double margin) noexcept {
    SolidAxes axes;
    axes.first_face = best_face(first, second, -1.0);
    axes.second_face = best_face(second, first, 1.0);
    const double face = std::max(axes.first_face.gap, axes.second_face.gap);
    if (face > margin) return axes;
    const Vec3 ours_middle = middle(first), their_middle = middle(second), way = ours_middle - their_middle;
    Promising mine(first, ours_middle, way), other(second, their_middle, -way);
    const double inner = mine.inner + other.inner, rounding = 1e-9 * (norm(way) + inner);
    const double least = face - near_tie * std::min(first.thickness, second.thickness);
    const auto needed = [&](double gap) { return gap + inner - rounding; };
    mine.choose(needed(least));
    other.choose(needed(least));
    const auto &ours = first.shape.edges, &theirs = second.shape.edges;
    const Inward inward(second);
    double beside[Polytope::most_faces];  // of each face of the second, its normal along `ba`
    for (int m = 0; m < mine.count; ++m) {
        const int i = mine.edges[m];
        if (axes.edges.gap > least && !mine.reaches(i, needed(axes.edges.gap))) continue;
        const Vec3 a = first.normal(ours[i].left), b = first.normal(ours[i].right);
        const Vec3 along = first.corners[ours[i].to] - first.corners[ours[i].from], ba = cross(b, a);
        inward.along(ba, beside);
        for (int o = 0; o < other.count; ++o) {
            const int j = other.edges[o];
            const double cba = beside[theirs[j].left], dba = beside[theirs[j].right];
            if (!(cba * dba < 0.0)) continue;
            const Vec3 c = inward[theirs[j].left], d = inward[theirs[j].right];
            const Vec3 dc = cross(d, c);
            const double adc = dot(a, dc), bdc = dot(b, dc);
            if (!(adc * bdc < 0.0 && cba * bdc > 0.0)) continue;
            const Vec3 edge = second.corners[theirs[j].to] - second.corners[theirs[j].from];
            const Vec3 axis = cross(along, edge);
            const double length = norm(axis);
            if (length <= 1e-4 * norm(along) * norm(edge)) continue;  // parallel edges are covered by faces
            Vec3 n = (1.0 / length) * axis;
            if (dot(n, a + b) > 0.0) n = -n;  // away from the first's outside: from second to first
            const double gap = dot(n, first.corners[ours[i].from] - second.corners[theirs[j].from]);
            if (gap > axes.edges.gap) axes.edges = {gap, n, i, j};
        }
    }
    return axes;
}

namespace {

struct Vertex {
    Vec3 place;
    std::uint32_t feature;
};

struct Polygon {
    static constexpr int most = 2 * Polytope::most_round_a_face + 2;
    Vertex vertices[most];
    int count = 0;
    void add(Vertex vertex) noexcept {
        if (count < most) vertices[count++] = vertex;
    }
};

/// Keeps what lies at or below the plane through `on` with the outward normal `out`; `side` numbers the plane, and new
/// points count from `corners`.
Polygon clipped(const Polygon& in, Vec3 on, Vec3 out, double slop, std::uint32_t side,
                std::uint32_t corners) noexcept {
    Polygon kept;
    for (int k = 0; k < in.count; ++k) {
        const Vertex &from = in.vertices[k], &to = in.vertices[(k + 1) % in.count];
        const double d0 = dot(out, from.place - on), d1 = dot(out, to.place - on);
        const bool in0 = d0 <= slop, in1 = d1 <= slop;
        if (in0) kept.add(from);
        if (in0 != in1)
            kept.add({from.place + clamped(d0 / (d0 - d1), 0.0, 1.0) * (to.place - from.place),
                      corners + 2 * side + (in1 ? 1u : 0u)});
    }
    return kept;
}

/// The face of a solid that looks most against a direction.
int most_against(Vec3 n, const Solid& solid) noexcept {
    int opposite = 0;
    double against = 1e300;
    for (int k = 0; k < static_cast<int>(solid.shape.faces.size()); ++k) {
        const double cosine = dot(n, solid.normal(k));
        if (cosine < against - 1e-9) against = cosine, opposite = k;
    }
    return opposite;
}

/// The manifold of `reference`'s face against the face `opposite` of `incident`; `flip` is −1 if the first's normal
/// points from first to second.
void add_faces(Manifold& manifold, const Solid& reference, int index, const Solid& incident, int opposite,
               double flip, double margin, double slop) noexcept {
    const Polytope::Face& face = reference.face(index);
    const Vec3 n = reference.normal(index);
    // Eight corners and as many sides take five bits, twice as many six.
    Polygon polygon;
    const Polytope::Face& other = incident.face(opposite);
    const bool many = std::max(face.count, other.count) > 8;
    const std::uint32_t corners = many ? 16 : 8;
    for (int k = 0; k < other.count; ++k)
        polygon.add({incident.corner_of(other, k), static_cast<std::uint32_t>(k)});
    for (int k = 0; k < face.count; ++k) {
        const Vec3 from = reference.corner_of(face, k), along = reference.corner_of(face, k + 1) - from;
        const Vec3 out = cross(along, n);
        polygon =
            clipped(polygon, from, (1.0 / norm(out)) * out, slop, static_cast<std::uint32_t>(k), corners);
    }
    const double plane = dot(n, reference.corner_of(face, 0));
    // Which faces: the same for all points of a manifold, so that it need not be unique.
    const std::uint32_t faces = static_cast<std::uint32_t>(37 * index + 5 * opposite + (flip > 0.0)) % 1024u;
    const std::uint32_t tag = many ? (faces % 512u) << 6 : faces << 5;
    for (int k = 0; k < polygon.count; ++k) {
        const Vec3 p = polygon.vertices[k].place;
        const double height = dot(n, p) - plane;
        if (height > margin) continue;
        bool repeated = false;
        for (int j = 0; j < k && !repeated; ++j) repeated = norm(p - polygon.vertices[j].place) <= slop;
        if (!repeated)
            manifold.add(p - 0.5 * height * n, flip * n, height, tag | polygon.vertices[k].feature);
    }
}

void add_edges(Manifold& manifold, const Solid& first, const Solid& second, const SolidAxes::Best& edges,
               double margin) noexcept {
    auto segment = [](const Solid& solid, int edge) noexcept {
        const Polytope::Edge& e = solid.shape.edges[static_cast<std::size_t>(edge)];
        const Vec3 along = 0.5 * (solid.corners[e.to] - solid.corners[e.from]);
        const double half = norm(along);
        return Segment{0.5 * (solid.corners[e.to] + solid.corners[e.from]), (1.0 / half) * along, half};
    };
    const Segment one = segment(first, edges.first), two = segment(second, edges.second);
    const SegmentPair closest = closest_parameters(one, two);
    const Vec3 p = one.at(closest.first), q = two.at(closest.second);
    const double gap = dot(edges.normal, p - q);
    const std::uint32_t feature =
        (1u << 15) | static_cast<std::uint32_t>(137 * edges.first + edges.second) % 32768u;
    if (edges_touch(p - q, gap, margin)) manifold.add(0.5 * (p + q), edges.normal, gap, feature);
}

double deepest_gap(const Manifold& manifold) noexcept {
    double least = 1e300;
    for (int k = 0; k < manifold.count; ++k) least = std::min(least, manifold.points[k].gap);
    return least;
}

/// Of all faces that look against the reference face, the one that reaches deepest below it: the face that looks most
/// against it may be cut off where a sharp solid is already through.
Manifold deepest_faces(const Solid& reference, int index, const Solid& incident, double flip, double margin,
                       double slop) noexcept {
    Manifold best;
    for (int k = 0; k < static_cast<int>(incident.shape.faces.size()); ++k) {
        if (!(dot(reference.normal(index), incident.normal(k)) < 0.0)) continue;
        Manifold tried;
        add_faces(tried, reference, index, incident, k, flip, margin, slop);
        if (deepest_gap(tried) < deepest_gap(best)) best = tried;
    }
    return best;
}

/// Where no polygon is left: the corner of `other` that is deepest below the face.
void add_deepest(Manifold& manifold, const Solid& reference, int index, const Solid& other,
                 double flip) noexcept {
    const Vec3 n = reference.normal(index);
    int deepest = 0;
    for (int k = 1; k < other.count(); ++k)
        if (dot(n, other.corners[k]) < dot(n, other.corners[deepest])) deepest = k;
    const double gap = dot(n, other.corners[deepest] - reference.corner_of(reference.face(index), 0));
    manifold.add(other.corners[deepest] - 0.5 * gap * n, flip * n, gap, static_cast<std::uint32_t>(deepest));
}

}  // namespace

Manifold solid_solid(const Primitive& one, const Pose& at_first, const Primitive& two, const Pose& at_second,
                     double margin) noexcept {
    const Solid first(one, at_first), second(two, at_second);
    const SolidAxes axes = solid_axes(first, second, margin);
    const double face = std::max(axes.first_face.gap, axes.second_face.gap);
    Manifold manifold;
    if (face > margin || axes.edges.gap > margin) return manifold;
    const double smallest = 0.5 * std::min(first.thickness, second.thickness);
    const double prefer = 1e-4 * smallest, slop = 1e-7 * smallest;
    if (axes.edges.gap > face + prefer) {
        add_edges(manifold, first, second, axes.edges, margin);
        return manifold;
    }
    const bool theirs = axes.second_face.gap > axes.first_face.gap + prefer;
    const Solid &reference = theirs ? second : first, &incident = theirs ? first : second;
    const int index = theirs ? axes.second_face.second : axes.first_face.first;
    const double flip = theirs ? 1.0 : -1.0;
    const int opposite = most_against(reference.normal(index), incident);
    add_faces(manifold, reference, index, incident, opposite, flip, margin, slop);
    if (face > 0.0 || (manifold.count > 0 && (face > -slop || deepest_gap(manifold) < 0.0))) return manifold;
    // Overlapping, yet nothing of that face inside the other.
    manifold = deepest_faces(reference, index, incident, flip, margin, slop);
    if (deepest_gap(manifold) < 0.0) return manifold;
    manifold = {};  // only near ties of the axes end here
    if (axes.edges.first >= 0) add_edges(manifold, first, second, axes.edges, margin);
    else add_deepest(manifold, reference, index, incident, flip);
    return manifold;
}

}  // namespace spook

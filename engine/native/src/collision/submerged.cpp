#include "collision/submerged.hpp"

#include <algorithm>
#include <numbers>

#include "collision/frustum.hpp"
#include "linear/elementary.hpp"

namespace spook {
namespace {

constexpr double kPi = std::numbers::pi;

Submerged sphere_below(double radius, Vec3 centre, Vec3 up, double height) noexcept {
    const double depth = std::min(2.0 * radius, radius - height);  // of its lowest point
    if (!(depth > 0.0)) return {0.0, centre};
    const double volume = kPi * depth * depth * (3.0 * radius - depth) / 3.0;
    const double left = 2.0 * radius - depth;
    return {volume, centre - 0.75 * left * left / (3.0 * radius - depth) * up};
}

/// The corners of a box's face, in turn round the normal that points out.
void face_corners(Vec3 half, int face, Vec3* corners) noexcept {
    const int a = face / 2, b = (a + 1) % 3, c = (a + 2) % 3;
    const double side = face % 2 == 0 ? 1.0 : -1.0;
    static constexpr double TURN[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
    for (int k = 0; k < 4; ++k) {
        const double* turn = TURN[side > 0.0 ? k : 3 - k];
        corners[k] = {};
        corners[k][a] = side * half[a];
        corners[k][b] = turn[0] * half[b];
        corners[k][c] = turn[1] * half[c];
    }
}

/// The part of a solid below n · p + height = 0, as cones over a point of the surface on its clipped faces.
class Below {
public:
    Below(Vec3 n, double height) noexcept : n_(n), height_(height), tip_(-height * n) {}
    void add_face(const Vec3* corners, int count) noexcept {
        Vec3 kept[Polytope::most_round_a_face + 1];
        int left = 0;
        for (int k = 0; k < count; ++k) {
            const Vec3 p = corners[k], q = corners[(k + 1) % count];
            const double above = dot(n_, p) + height_, next = dot(n_, q) + height_;
            if (above <= 0.0) kept[left++] = p;
            if ((above < 0.0 && next > 0.0) || (above > 0.0 && next < 0.0))
                kept[left++] = p + (above / (above - next)) * (q - p);
        }
        for (int k = 1; k + 1 < left; ++k) {
            const Vec3 a = kept[0] - tip_, b = kept[k] - tip_, c = kept[k + 1] - tip_;
            const double cone = dot(a, cross(b, c)) / 6.0;
            volume_ += cone;
            moment_ += 0.25 * cone * (a + b + c);
        }
    }
    Submerged found(const Pose& at) const noexcept {
        if (!(volume_ > 0.0)) return {0.0, at.position};
        return {volume_, apply(at, tip_ + (1.0 / volume_) * moment_)};
    }

private:
    Vec3 n_;
    double height_;
    Vec3 tip_;  // of the surface, below or above the centre
    double volume_ = 0.0;
    Vec3 moment_;
};

Submerged hull_below(const Polytope& polytope, const Pose& at, Vec3 up, double height) noexcept {
    const Vec3 n = local(at.rotation, up);
    if (height >= farthest(polytope, -n)) return {0.0, at.position};
    Below below(n, height);
    for (const Polytope::Face& face : polytope.faces) {
        Vec3 corners[Polytope::most_round_a_face];
        for (int k = 0; k < face.count; ++k) corners[k] = polytope.corner_of(face, k);
        below.add_face(corners, face.count);
    }
    return below.found(at);
}

Submerged box_below(Vec3 half, const Pose& at, Vec3 up, double height) noexcept {
    const Vec3 n = local(at.rotation, up);
    const double reach =
        std::abs(n.x) * half.x + std::abs(n.y) * half.y + std::abs(n.z) * half.z;  // of the highest corner
    if (height >= reach) return {0.0, at.position};
    if (height <= -reach) return {8.0 * half.x * half.y * half.z, at.position};
    Below below(n, height);
    for (int face = 0; face < 6; ++face) {
        Vec3 corners[4];
        face_corners(half, face, corners);
        below.add_face(corners, 4);
    }
    return below.found(at);
}

constexpr double NODE[] = {0.09501250983763744, 0.2816035507792589, 0.45801677765722737, 0.6178762444026438,
                           0.755404408355003,   0.8656312023878318, 0.9445750230732326,  0.9894009349916499};
constexpr double WEIGHT[] = {0.18945061045506864,  0.18260341504492364, 0.16915651939500265,
                             0.1495959888165767,   0.12462897125553407, 0.0951585116824926,
                             0.062253523938647456, 0.027152459411754176};

/// A capsule, a cylinder or a cone along a unit axis: slices at `s` from the centre, of radius ρ(s), under a surface that stands
/// height + slope s above the slice's centre and rises across it with `tilt`.
struct Slices {
    double radius, half_length, height, slope, tilt, apex;  // apex: of a cone, m up its axis, else zero
    bool caps;                                              // of a capsule
    double first, last;                                     // where it begins and ends along its axis

    double rho2(double s) const noexcept {  // of a cylinder no slice is beyond
        if (apex > 0.0) {
            const double rho = radius * (apex - s) / (2.0 * half_length);
            return rho * rho;
        }
        const double beyond = std::max(0.0, std::abs(s) - half_length);
        return std::max(0.0, radius * radius - beyond * beyond);
    }
    /// Area below the surface, and its moment across, towards up.
    void slice(double s, double& area, double& moment) const noexcept {
        const double r2 = rho2(s), r = std::sqrt(r2), over = height + slope * s;
        const double edge = over <= -tilt * r ? r : over >= tilt * r ? -r : -over / tilt;
        const double chord = std::sqrt(std::max(0.0, r2 - edge * edge));
        area = r2 * (0.5 * kPi + arc_tangent(edge, chord)) + edge * chord;
        moment = -2.0 / 3.0 * chord * chord * chord;
    }
    /// Where pieces end, in order: the caps, and where the surface meets the side |over| = tilt ρ. How many.
    int find_ends(double (&ends)[20]) const noexcept {
        ends[0] = first, ends[1] = last;
        int count = 2;
        const auto add = [&](double s) {
            if (s > first && s < last) ends[count++] = s;
        };
        if (apex > 0.0) {  // both sides linear
            for (const double side : {-0.5 * tilt * radius / half_length, 0.5 * tilt * radius / half_length})
                if (slope + side != 0.0) add((side * last - height) / (slope + side));
        } else if (slope != 0.0) {
            for (const double side : {-1.0, 1.0}) add((side * tilt * radius - height) / slope);
        }
        if (caps) {
            ends[count++] = -half_length, ends[count++] = half_length;
            add_caps(add);
        }
        std::sort(ends, ends + count);
        return count;
    }
    /// Where the surface meets the caps' sides: (over + slope x)² = tilt² (r² − x²), slope² + tilt² = 1.
    template <class Add> void add_caps(Add add) const noexcept {
        for (const double middle : {-half_length, half_length}) {
            const double over = height + slope * middle, root = radius * radius - over * over;
            if (root < 0.0) continue;
            for (const double side : {-1.0, 1.0}) add(middle - slope * over + side * tilt * std::sqrt(root));
        }
    }
    /// Volume of a piece and its moments along the axis and across, by sixteen nodes of Gauss.
    struct Moments {
        double volume = 0.0, along = 0.0, aside = 0.0;
    };
    void add_piece(double from, double to, Moments& sum) const noexcept {
        const double middle = 0.5 * (from + to), width = 0.5 * (to - from);
        if (!(width > 0.0)) return;
        for (int node = 0; node < 16; ++node) {
            // s = middle − width cos φ: roots at the ends become smooth.
            const double x = node < 8 ? -NODE[node] : NODE[node - 8];
            const SineCosine turn = sine_cosine(0.5 * kPi * (1.0 + x));
            const double s = middle - width * turn.cosine,
                         weight = WEIGHT[node % 8] * 0.5 * kPi * width * turn.sine;
            double area, moment;
            slice(s, area, moment);
            sum.volume += weight * area;
            sum.along += weight * area * s;
            sum.aside += weight * moment;
        }
    }
};

Submerged slices_below(const Primitive& shape, const Pose& at, Vec3 up, double height) noexcept {
    const Vec3 axis = column(at.rotation, 2);
    const double slope = dot(axis, up), r = shape.radius, half = shape.half_length;
    const bool caps = shape.kind == ShapeKind::capsule;
    const Vec3 across = up - slope * axis;
    const double tilt = norm(across);
    const bool cone = shape.kind == ShapeKind::cone;
    const double reach = (caps ? r : r * tilt) + half * std::abs(slope), end = caps ? half + r : half;
    const double first = cone ? -0.5 * half : -end, last = cone ? 1.5 * half : end;
    const double deep = cone ? std::max(r * tilt - slope * first, -slope * last) : reach,
                 tall = cone ? std::max(r * tilt + slope * first, slope * last) : reach;
    if (height >= deep) return {0.0, at.position};
    if (height <= -tall) return {volume(shape), at.position};
    const Slices slices{r, half, height, slope, tilt, cone ? last : 0.0, caps, first, last};
    double ends[20];
    const int count = slices.find_ends(ends);
    Slices::Moments below;
    for (int k = 0; k + 1 < count; ++k) slices.add_piece(ends[k], ends[k + 1], below);
    if (!(below.volume > 0.0)) return {0.0, at.position};
    const Vec3 up_across = tilt > 0.0 ? (1.0 / tilt) * across : Vec3{};
    return {below.volume,
            at.position + (below.along / below.volume) * axis + (below.aside / below.volume) * up_across};
}

}  // namespace

double volume(const Primitive& shape) noexcept {
    const double r = shape.radius;
    switch (shape.kind) {
        case ShapeKind::sphere: return 4.0 / 3.0 * kPi * r * r * r;
        case ShapeKind::capsule: return kPi * r * r * (2.0 * shape.half_length + 4.0 / 3.0 * r);
        case ShapeKind::box: return 8.0 * shape.half.x * shape.half.y * shape.half.z;
        case ShapeKind::hull: return shape.hull->volume;
        case ShapeKind::cone: return kPi * r * r * shape.half_length * 2.0 / 3.0;
        case ShapeKind::cylinder: return 2.0 * kPi * r * r * shape.half_length;
        case ShapeKind::plane:
        case ShapeKind::triangle: return 0.0;
    }
    return 0.0;
}

double shadow(const Primitive& shape, const Pose& at, Vec3 direction) noexcept {
    const double r = shape.radius;
    switch (shape.kind) {
        case ShapeKind::sphere: return kPi * r * r;
        case ShapeKind::capsule:
            return kPi * r * r + 4.0 * r * shape.half_length * norm(cross(column(at.rotation, 2), direction));
        case ShapeKind::box: {
            const Vec3 d = local(at.rotation, direction), half = shape.half;
            return 4.0 * (std::abs(d.x) * half.y * half.z + std::abs(d.y) * half.x * half.z +
                          std::abs(d.z) * half.x * half.y);
        }
        case ShapeKind::cylinder: {
            const Vec3 axis = column(at.rotation, 2);
            return kPi * r * r * std::abs(dot(axis, direction)) +
                   4.0 * r * shape.half_length * norm(cross(axis, direction));
        }
        case ShapeKind::cone: {  // its base's ellipse, and the tangents to it from the apex
            const Vec3 axis = column(at.rotation, 2);
            const double along = std::abs(dot(axis, direction)),
                         out = 2.0 * shape.half_length * norm(cross(axis, direction)), rim = r * along;
            if (out <= rim) return kPi * r * rim;
            const double tangent = std::sqrt(out * out - rim * rim);
            return r * (rim * (kPi - arc_tangent(tangent, rim)) + tangent);
        }
        case ShapeKind::hull: {
            const Vec3 d = local(at.rotation, direction);
            double area = 0.0;
            for (const Polytope::Face& face : shape.hull->faces)
                area += 0.5 * std::abs(dot(face.normal, d)) * face.area;
            return area;
        }
        case ShapeKind::plane:
        case ShapeKind::triangle: return 0.0;
    }
    return 0.0;
}

Submerged submerged(const Primitive& shape, const Pose& at, Vec3 up, double level) noexcept {
    const double height = dot(up, at.position) - level;  // of the centre above the surface
    switch (shape.kind) {
        case ShapeKind::sphere: return sphere_below(shape.radius, at.position, up, height);
        case ShapeKind::cylinder:
        case ShapeKind::cone:
        case ShapeKind::capsule: return slices_below(shape, at, up, height);
        case ShapeKind::box: return box_below(shape.half, at, up, height);
        case ShapeKind::hull: return hull_below(*shape.hull, at, up, height);
        case ShapeKind::plane:
        case ShapeKind::triangle: break;
    }
    return {0.0, at.position};
}

}  // namespace spook

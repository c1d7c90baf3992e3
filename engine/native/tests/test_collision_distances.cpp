// Every pair of bounded shapes against their distance, found from supports alone (Gilbert 1966), sizes from 1/1000 to
// 1000: nothing touches that is farther off than the margin, and what is apart is told apart.
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

#include "collision/narrow_phase.hpp"
#include "collision/sweep.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

class Draw {
public:
    explicit Draw(unsigned seed) : bits_(seed) {}
    double share() { return static_cast<double>(bits_() >> 8) / static_cast<double>(1u << 24); }
    Vec3 direction() {
        for (;;) {
            const double x = 2.0 * share() - 1.0, y = 2.0 * share() - 1.0;
            const Vec3 v{x, y, 2.0 * share() - 1.0};
            const double length = norm(v);
            if (length > 0.1 && length <= 1.0) return (1.0 / length) * v;
        }
    }
    Mat3 turn() {
        const Vec3 axis = direction();
        const double half = M_PI * share(), s = std::sin(half);
        return rotation(Quat{std::cos(half), s * axis.x, s * axis.y, s * axis.z});
    }
    /// Most between 1/16 and 4, one in four anywhere from 1/1000 to 1000.
    double size() {
        return share() < 0.25 ? std::pow(10.0, 6.0 * share() - 3.0)
                              : (1.0 + std::floor(64.0 * share())) / 16.0;
    }
    Primitive shape(int kind) {
        const double one = size(), two = size(), three = size();
        switch (kind) {
            case 0: return Primitive::sphere(one);
            case 1: return Primitive::capsule(one, two);
            case 2: return Primitive::box({one, two, three});
            case 3: return Primitive::cylinder(one, two);
            case 4: return Primitive::cone(one, two);
            default: return Primitive::convex(wedge({one, two, three}));
        }
    }

private:
    static std::shared_ptr<const Polytope> wedge(Vec3 s) {
        std::vector<Vec3> corners{{-1, -1, -1}, {1, -1, -1}, {0, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {0, 1, 1}};
        for (Vec3& c : corners) c = {s.x * c.x, s.y * (c.y + 1.0 / 3.0), s.z * c.z};
        return std::make_shared<const Polytope>(
            std::move(corners), std::vector<int>{0, 2, 1, 3, 4, 5, 0, 1, 4, 3, 1, 2, 5, 4, 2, 0, 3, 5},
            std::vector<int>{3, 3, 4, 4, 4});
    }
    std::mt19937 bits_;
};

/// The point of a shape that is farthest along n.
Vec3 farthest_point(const Primitive& shape, const Pose& at, Vec3 n) {
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
        case ShapeKind::plane:
        case ShapeKind::triangle: break;
    }
    return apply(at, p);
}

/// A lower bound of the distance, close to it: the shapes are as far apart along any direction.
double surely_apart(const Primitive& a, const Pose& at_a, const Primitive& b, const Pose& at_b, Vec3 first) {
    const auto difference = [&](Vec3 n) { return farthest_point(a, at_a, -n) - farthest_point(b, at_b, n); };
    Vec3 v = difference(first);
    double best = -1e300;
    for (int round = 0; round < 500; ++round) {
        const double length = norm(v);
        if (!(length > 1e-12)) return best;
        const Vec3 w = difference(v), way = w - v;
        best = std::max(best, dot(v, w) / length);
        if (length - best <= 1e-10 * length) break;
        v += std::min(1.0, -dot(v, way) / dot(way, way)) * way;
    }
    return best;
}

void nothing_touches_beyond_the_margin_and_what_is_apart_is_told_apart() {
    Draw draw(15);
    int apart = 0, near = 0;
    for (int pair = 0; pair < 36; ++pair)
        for (int round = 0; round < 1500; ++round) {
            const Primitive a = draw.shape(pair / 6), b = draw.shape(pair % 6);
            const Pose at_a{{}, draw.turn()};
            Pose at_b{{}, draw.turn()};
            const Vec3 n = draw.direction();
            const Vec3 p = farthest_point(a, at_a, n), q = farthest_point(b, at_b, -n);
            const double margin = draw.share();
            at_b.position = p - q + 1.5 * draw.share() * n;  // at least as far apart
            const double rounding = 1e-9 * (1.0 + norm(p) + norm(q));
            const double distance = surely_apart(a, at_a, b, at_b, -n);
            const Manifold found = collide(a, at_a, b, at_b, margin);
            const Separation told = separation(a, at_a, b, at_b);
            const bool touches_far = found.count > 0 && distance > margin + rounding;
            const bool seems_to_overlap = distance > rounding && !(told.gap > 0.0);
            // Flat sides facing each other at corners alone have a lower bound; all others the distance.
            const bool short_of_it = !(a.faceted() && b.faceted()) && told.gap < distance - rounding;
            if (touches_far || seems_to_overlap || short_of_it) {
                std::printf("kinds %d %d, round %d: distance %.9g, margin %.9g, %d points, told %.9g\n",
                            static_cast<int>(a.kind), static_cast<int>(b.kind), round, distance, margin,
                            found.count, told.gap);
                ++failures;
            }
            apart += distance > margin, near += found.count > 0;
        }
    EXPECT(apart > 10000 && near > 10000);
}

}  // namespace

int main() {
    nothing_touches_beyond_the_margin_and_what_is_apart_is_told_apart();
    return report();
}

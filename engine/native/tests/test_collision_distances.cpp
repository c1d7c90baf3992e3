// Every pair of bounded shapes against their distance, found from supports alone, sizes from 1/1000 to 1000: nothing
// touches that is farther off than the margin, and what is apart is told apart.
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

#include "collision/narrow_phase.hpp"
#include "collision/shape_cast.hpp"
#include "expect.hpp"
#include "support_distance.hpp"

using namespace spook;
using support::farthest_point;

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

/// Whether what was told of two shapes without a limit is told again where none is `far` apart, else that they are.
bool tells_the_same(const Separation& told, const Separation& again, double far) {
    if (told.gap > far) return again.gap > far && again.gap <= told.gap;
    return again.gap == told.gap && again.normal == told.normal;
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
            const double distance = support::distance(a, at_a, b, at_b, -n).least;
            const Manifold found = collide(a, at_a, b, at_b, margin);
            const Separation told = separation(a, at_a, b, at_b);
            const bool touches_far = found.count > 0 && distance > margin + rounding;
            const bool seems_to_overlap = distance > rounding && !(told.gap > 0.0);
            // Flat sides facing each other at corners alone have a lower bound; all others the distance.
            const bool short_of_it = !(a.faceted() && b.faceted()) && told.gap < distance - rounding;
            const bool tells = tells_the_same(told, separation(a, at_a, b, at_b, margin), margin);
            if (touches_far || seems_to_overlap || short_of_it || !tells) {
                std::printf("kinds %d %d, round %d: distance %.9g, margin %.9g, %d points, told %.9g\n",
                            static_cast<int>(a.kind), static_cast<int>(b.kind), round, distance, margin,
                            found.count, told.gap);
                ++failures;
            }
            apart += distance > margin, near += found.count > 0;
        }
    EXPECT(apart > 10000 && near > 10000);
}

/// A sheet with rims, and shapes beside, above and behind it: what is apart is not held deep below a face it passed, and told apart.
void nothing_that_is_apart_is_pushed_through_a_sheet() {
    Draw draw(16);
    int apart = 0, near = 0;
    for (int kind = 0; kind < 6; ++kind)
        for (int round = 0; round < 4000; ++round) {
            const auto corner = [&] { return (0.5 + 3.0 * draw.share()) * draw.direction(); };
            const auto mesh =
                std::make_shared<const Mesh>(std::vector<Vec3>{corner(), corner(), corner(), corner()},
                                             std::vector<std::array<int, 3>>{{0, 1, 2}, {2, 1, 3}});
            const Primitive face = Primitive::sheet(mesh, round % 2), a = draw.shape(kind);
            const Pose at_face{{}, draw.turn()};
            Pose at{{}, draw.turn()};
            // Nearest from any side; in two of three from behind or beside, with its centre before the face.
            Vec3 n = draw.direction(), p, q;
            const Vec3 out = at_face.rotation * mesh->normals[static_cast<std::size_t>(round % 2)];
            for (int again = 0; again < 20; ++again) {
                p = farthest_point(face, at_face, n), q = farthest_point(a, at, -n);
                at.position = p - q + 0.5 * draw.share() * n;
                if (round % 3 == 0 || (dot(n, out) < 0.0 && dot(out, at.position - p) > 0.0)) break;
                n = draw.direction(), at.rotation = draw.turn();
            }
            const double margin = draw.share(), rounding = 1e-9 * (1.0 + norm(p) + norm(q));
            const double distance = support::distance(a, at, face, at_face, n).least;
            const Manifold found = collide(a, at, face, at_face, margin);
            const bool far = found.count > 0 && distance > margin + rounding;
            bool deep = false;
            for (int k = 0; k < found.count; ++k)
                deep = deep ||
                       (distance > rounding && found.points[static_cast<std::size_t>(k)].gap < -rounding);
            const Separation told = separation(a, at, face, at_face);
            const bool short_of_it = distance > rounding && !a.faceted() && told.gap < distance - rounding;
            const bool tells = tells_the_same(told, separation(a, at, face, at_face, margin), margin);
            if (far || deep || short_of_it || !tells) {
                std::printf("kind %d, round %d: distance %.9g, margin %.9g, first gap %.9g, told %.9g\n",
                            static_cast<int>(a.kind), round, distance, margin, found.points[0].gap, told.gap);
                ++failures;
            }
            apart += distance > margin, near += found.count > 0;
        }
    EXPECT(apart > 1000 && near > 1000);
}

/// Caps that lie nearly flat before something: the face wins near ties, but the place that is nearest is held.
void the_nearest_place_of_nearly_flat_caps_is_held() {
    Draw draw(17);
    int asked = 0;
    for (int kind = 1; kind < 6; ++kind)
        for (int round = 0; round < 4000; ++round) {
            const Primitive a = Primitive::cylinder(0.5 + 3.0 * draw.share(), 0.2 + 3.0 * draw.share()),
                            b = draw.shape(kind);
            const Pose at_b{{}, draw.turn()};
            // Leaning by 10^-4 to 0.1, and up to its radius aside.
            const double lean = std::pow(10.0, -1.0 - 3.0 * draw.share());
            const Vec3 up = column(at_b.rotation, 2), side = column(at_b.rotation, 0);
            const Vec3 axis = (1.0 / std::sqrt(1.0 + lean * lean)) * (up + lean * side),
                       across = any_normal_to(axis);
            const Vec3 third = cross(axis, across);
            const Mat3 turn{
                {across.x, third.x, axis.x, across.y, third.y, axis.y, across.z, third.z, axis.z}};
            Pose at_a{{}, turn};
            const double margin = 0.2 + draw.share();
            const Vec3 p = farthest_point(b, at_b, up), q = farthest_point(a, at_a, -up);
            const Vec3 aside = draw.direction();
            at_a.position =
                p - q + 0.9 * margin * draw.share() * up + 2.0 * a.radius * (aside - dot(aside, up) * up);
            const support::Distance apart = support::distance(a, at_a, b, at_b, up);
            const double size = 1.0 + norm(p) + norm(q);
            if (!(apart.least > 1e-9 * size && apart.most < margin - 1e-9 * size)) continue;
            double deepest = HUGE_VAL;
            for (const bool swapped : {false, true}) {
                const Manifold found =
                    swapped ? collide(b, at_b, a, at_a, margin) : collide(a, at_a, b, at_b, margin);
                deepest = HUGE_VAL;
                for (int k = 0; k < found.count; ++k)
                    deepest = std::min(deepest, found.points[static_cast<std::size_t>(k)].gap);
                const double tie = 1e-5 * std::min(2.0 * a.half_length, 2.0 * a.radius) + 1e-9 * size;
                if (!(std::abs(deepest - apart.most) <= 2.0 * tie)) {
                    std::printf("kind %d, round %d: distance %.9g, margin %.9g, deepest %.9g\n",
                                static_cast<int>(b.kind), round, apart.most, margin, deepest);
                    ++failures;
                }
            }
            ++asked;
        }
    EXPECT(asked > 3000);
}

/// Rims whose nearest places lie where the search round them begins and ends.
void rims_are_nearest_in_any_quarter() {
    for (int quarter = 0; quarter < 4; ++quarter)
        for (const bool cones : {false, true}) {
            const double c = quarter % 2 ? 0.0 : 1.0 - quarter, s = quarter % 2 ? 2.0 - quarter : 0.0;
            const Pose at_a{{-1.0 / 12, -1.0 / 12, -1.0 / 12}, {{0, 0, 1, 1, 0, 0, 0, 1, 0}}};
            const Pose at_b{{-4.0, -1.0 / 12 - 4.0 * c, -1.0 / 12 - 4.0 * s}, at_a.rotation};
            const Primitive a = cones ? Primitive::cone(0.5, 0.5) : Primitive::cylinder(0.5, 0.5),
                            b = cones ? Primitive::cone(3.0625, 0.0625) : Primitive::cylinder(3.0625, 0.0625);
            const support::Distance apart = support::distance(a, at_a, b, at_b, {1, 0, 0});
            EXPECT_NEAR(separation(a, at_a, b, at_b).gap, apart.most, 1e-9);
            EXPECT_NEAR(separation(b, at_b, a, at_a).gap, apart.most, 1e-9);
        }
}

/// A wide disc, the base of a cylinder or a cone, that leans by 1e-2 to 1e-10 on a plane: its lowest place is in closed form.
void discs_that_hardly_lean_are_met_at_their_lowest_place() {
    Draw draw(5);
    for (int round = 0; round < 4000; ++round) {
        const Vec3 up = draw.direction(), side = any_normal_to(up);
        const double lean = std::pow(10.0, -2.0 - 8.0 * draw.share()), radius = 806.0;
        const Vec3 axis = (1.0 / std::sqrt(1.0 + lean * lean)) * (up + lean * side), x = any_normal_to(axis),
                   y = cross(axis, x);
        for (const bool cone : {false, true}) {
            const Primitive disc = cone ? Primitive::cone(radius, 1.0) : Primitive::cylinder(radius, 1.0);
            const Pose at{{}, {x.x, y.x, axis.x, x.y, y.y, axis.y, x.z, y.z, axis.z}};
            const double low = cone ? -0.5 * disc.half_length : -disc.half_length;
            const double lowest = low * dot(up, axis) - radius * norm(cross(up, axis));
            const Manifold found = collide(disc, at, Primitive::plane(up), Pose{}, 100.0);
            double deepest = HUGE_VAL;
            for (int k = 0; k < found.count; ++k)
                deepest = std::min(deepest, found.points[static_cast<std::size_t>(k)].gap);
            EXPECT_NEAR(deepest, lowest, 2e-12 * radius);
        }
    }
}

}  // namespace

int main() {
    discs_that_hardly_lean_are_met_at_their_lowest_place();
    rims_are_nearest_in_any_quarter();
    nothing_touches_beyond_the_margin_and_what_is_apart_is_told_apart();
    nothing_that_is_apart_is_pushed_through_a_sheet();
    the_nearest_place_of_nearly_flat_caps_is_held();
    return report();
}

// Places and shapes that are no numbers, or hardly: every question has an answer, and none is read out of bounds.
#include <cstdio>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <vector>

#include "collision/narrow_phase.hpp"
#include "collision/shape_cast.hpp"
#include "collision/submerged.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

constexpr double NONE = std::numeric_limits<double>::quiet_NaN(),
                 ENDLESS = std::numeric_limits<double>::infinity();

std::shared_ptr<const Polytope> wedge(double s) {
    return std::make_shared<const Polytope>(
        std::vector<Vec3>{{-s, -s, -s}, {s, -s, -s}, {0, s, -s}, {-s, -s, s}, {s, -s, s}, {0, s, s}},
        std::vector<int>{0, 2, 1, 3, 4, 5, 0, 1, 4, 3, 1, 2, 5, 4, 2, 0, 3, 5},
        std::vector<int>{3, 3, 4, 4, 4});
}

std::vector<Primitive> shapes(double s) {
    return {Primitive::sphere(s),        Primitive::capsule(s, s),  Primitive::box({s, 2 * s, 3 * s}),
            Primitive::convex(wedge(s)), Primitive::cylinder(s, s), Primitive::cone(s, s),
            Primitive::plane({0, 0, 1})};
}

/// Whatever is asked of two shapes there.
void ask(const Primitive& one, const Pose& here, const Primitive& two, const Pose& there, double margin) {
    for (const bool swapped : {false, true}) {
        const Manifold found =
            swapped ? collide(two, there, one, here, margin) : collide(one, here, two, there, margin);
        EXPECT(found.count >= 0 && found.count <= Manifold::capacity);
    }
    if (one.kind == ShapeKind::plane || two.kind == ShapeKind::plane) return;
    const Separation apart = separation(one, here, two, there);
    EXPECT(!(apart.gap > 0.0) || !std::isnan(apart.gap));
}

void move(const Primitive& one, const Pose& here, const Primitive& two, const Pose& there, Vec3 speed,
          Vec3 spin) {
    const double time =
        time_of_impact({one, here, Pose{}, speed, spin}, {two, there, Pose{}, {}, {}}, 0.02, 1e-9);
    EXPECT(!(time > 0.02));
}

void dip(const Primitive& one, const Pose& here, double level) {
    if (one.kind == ShapeKind::plane) return;
    const double dry = submerged(one, here, {0, 0, 1}, level).volume;
    EXPECT(!(dry < 0.0));
    EXPECT(!(shadow(one, here, {0, 0, 1}) < 0.0));
}

void every_pair_is_answered_where_numbers_end() {
    const double odd[] = {0.0, 1.0, -1e8, 1e20, 1e154, -1e200, 1e308, ENDLESS, NONE};
    for (const double size : {1.0, 1e-300, 1e-150, 1e150, 5e307}) {
        const std::vector<Primitive> all = shapes(size);
        for (const Primitive& one : all)
            for (const Primitive& two : all)
                for (const double x : odd)
                    for (const int part : {0, 1, 2}) {  // of the place, of the turn, of the motion
                        Pose there{{part == 0 ? x : 0.5 * size, 0.1 * size, 0.2 * size}, Mat3::identity()};
                        if (part == 1) there.rotation(0, 1) = there.rotation(1, 2) = x;
                        ask(one, Pose{}, two, there, 0.1 * size);
                        dip(two, there, x);
                        const double pace = part == 2 ? x : 1.0;
                        move(one, Pose{}, two, there, {pace, 0, -1}, {0, pace, 0.5 * pace});
                    }
    }
}

/// Far from the origin a place is known to no more than its rounding: clipped faces are no convex ones any more.
void far_away_clipping_stays_in_bounds() {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    for (int trial = 0; trial < 20000; ++trial) {
        const double far = std::pow(10.0, 6.0 + 10.0 * (trial % 101) / 100.0);
        const auto place = [&] {
            return Vec3{far + 0.3 * normal(random), far + 0.3 * normal(random), far + 0.3 * normal(random)};
        };
        const auto turn = [&] {
            const double small = trial % 2 ? 1.0 : 1e-7;
            const Vec3 e{small * normal(random), small * normal(random), small * normal(random)};
            const double length = std::sqrt(1.0 + dot(e, e));
            return rotation(Quat{1.0 / length, e.x / length, e.y / length, e.z / length});
        };
        const std::vector<Primitive> all = shapes(1.0);
        const Primitive &one = all[2 + static_cast<std::size_t>(trial / 2 % 2)],
                        &two = all[2 + static_cast<std::size_t>(trial / 4 % 2)];
        ask(one, Pose{place(), turn()}, two, Pose{place(), turn()}, 0.1);
    }
}

/// A ring of triangles: each edge parts two faces, and there are more of these than any hull of so many corners has.
void a_ring_is_no_hull() {
    constexpr int side = 8;  // 64 corners, 128 faces
    std::vector<Vec3> corners;
    std::vector<int> loops;
    for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j) {
            const double along = 6.283 * i / side, across = 6.283 * j / side, out = 2.0 + std::cos(across);
            corners.push_back({out * std::cos(along), out * std::sin(along), std::sin(across)});
            const int right = (i + 1) % side, up = (j + 1) % side;
            for (const int corner : {side * i + j, side * right + j, side * right + up, side * i + j,
                                     side * right + up, side * i + up})
                loops.push_back(corner);
        }
    bool refused = false;
    try {
        Polytope(corners, loops, std::vector<int>(loops.size() / 3, 3));
    } catch (const std::invalid_argument&) {
        refused = true;
    }
    EXPECT(refused);
}

}  // namespace

int main() {
    a_ring_is_no_hull();
    every_pair_is_answered_where_numbers_end();
    far_away_clipping_stays_in_bounds();
    return report();
}

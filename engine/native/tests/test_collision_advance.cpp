// How long a direction that turns keeps two moving shapes apart, and what time_of_impact() makes of it.
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

#include "collision/advance.hpp"
#include "collision/shape_cast.hpp"
#include "expect.hpp"
#include "linear/vec.hpp"

using namespace spook;

namespace {

constexpr double SLOP = 1e-9;  // m

std::shared_ptr<const Polytope> wedge(double s) {
    return std::make_shared<const Polytope>(
        std::vector<Vec3>{{-s, -s, -s}, {s, -s, -s}, {0, s, -s}, {-s, -s, s}, {s, -s, s}, {0, s, s}},
        std::vector<int>{0, 2, 1, 3, 4, 5, 0, 1, 4, 3, 1, 2, 5, 4, 2, 0, 3, 5},
        std::vector<int>{3, 3, 4, 4, 4});
}

std::vector<Primitive> shapes() {
    const auto tent = std::make_shared<const Mesh>(
        std::vector<Vec3>{{-0.5, -0.4, 0}, {0.5, -0.4, 0}, {0, 0.5, 0.1}, {0.6, 0.6, -0.2}},
        std::vector<std::array<int, 3>>{{0, 1, 2}, {1, 3, 2}});
    return {Primitive::sphere(0.3),         Primitive::capsule(0.2, 0.5),  Primitive::box({0.4, 0.5, 0.6}),
            Primitive::convex(wedge(0.25)), Primitive::cylinder(0.2, 0.5), Primitive::cone(0.3, 0.5),
            Primitive::sheet(tent, 0)};
}

struct Dice {
    std::mt19937_64 random;
    double unit() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random); }
    Vec3 vector(double size) { return size * Vec3{unit(), unit(), unit()}; }
    Mat3 turned() {
        const Vec3 v = vector(1.5);
        const double s = 1.0 / std::sqrt(1.0 + dot(v, v));
        return rotation(Quat{s, s * v.x, s * v.y, s * v.z});
    }
};

double gap(const Mover& one, const Mover& two, double time) {
    return separation(one.shape, one.at(time), two.shape, two.at(time)).gap;
}

/// Least gap over 0 … duration, of many samples.
double least_gap(const Mover& one, const Mover& two, double duration, int samples = 200) {
    double least = 1e300;
    for (int k = 0; k <= samples; ++k) least = std::min(least, gap(one, two, duration * k / samples));
    return least;
}

/// Every pair of shapes, on parts off their centres, turning by up to two turns: until the promised time many
/// samples see no overlap; and promises are long enough to be worth something.
void what_is_promised_holds() {
    Dice dice{std::mt19937_64(3)};
    const std::vector<Primitive> all = shapes();
    int asked = 0, whole = 0, none = 0;
    for (int trial = 0; trial < 2500; ++trial) {
        const std::size_t kinds = all.size();
        const Primitive &one = all[static_cast<std::size_t>(trial) % kinds],
                        &two = all[static_cast<std::size_t>(trial) / kinds % kinds];
        const Pose part{trial % 2 ? dice.vector(0.2) : Vec3{}, dice.turned()}, own{{}, dice.turned()};
        const double far = trial % 5 == 0 ? 1.3 : 0.8;
        const Pose here{dice.vector(0.1), dice.turned()},
            there{far * Vec3{1, 0, 0} + dice.vector(0.2), dice.turned()};
        const double quick = trial % 7 < 2 ? 8.0 : trial % 7 < 4 ? 4.0 : 1.0;
        const Vec3 spin = trial % 3 ? dice.vector(quick) : Vec3{};
        const Mover first{one, part, here, dice.vector(0.5), spin};
        const Mover second{two, own, there, dice.vector(0.5), dice.vector(quick)};
        const double time = trial % 4 ? 0.0 : 0.1;
        const Separation apart = separation(one, first.at(time), two, second.at(time));
        if (!(apart.gap > 1e-6)) continue;
        const double left = 1.0 - time, kept = separated_for(first, second, apart.normal, time, left, SLOP);
        ++asked;
        whole += kept >= left;
        none += !(kept > 0.0);
        EXPECT(kept >= 0.0 && kept <= left);
        for (int k = 0; k <= 60; ++k) EXPECT(gap(first, second, time + kept * k / 60) >= -2.0 * SLOP);
    }
    EXPECT(asked > 1200 && whole > 100 && none == 0);
}

/// Shapes that all but touch and part slowly there, while other corners of theirs turn nearer: they do not meet.
void what_parts_slowly_is_not_met() {
    Dice dice{std::mt19937_64(7)};
    const std::vector<Primitive> all = shapes();
    const std::size_t kinds = all.size();
    int asked = 0;
    constexpr double duration = 1.0 / 240.0;
    for (int trial = 0; trial < 2500; ++trial) {
        const Primitive &one = all[static_cast<std::size_t>(trial) % kinds],
                        &two = all[static_cast<std::size_t>(trial) / kinds % kinds];
        const Pose own, here{{}, dice.turned()};
        Pose there{Vec3{1.5, 0, 0} + dice.vector(0.3), dice.turned()};
        const Separation apart = separation(one, here, two, there);
        if (!(apart.gap > 0.01)) continue;
        const Mover still{one, own, here, {}, {}};
        const double when = time_of_impact(still, {two, own, there, apart.gap * apart.normal, {}}, 9.0, SLOP);
        if (when < 0.0) continue;
        there.position += (when * apart.gap - 1e-8) * apart.normal;
        const Mover first{one, own, here, {}, dice.vector(2.0)};
        const Mover second{two, own, there, dice.vector(0.5) - 0.3 * apart.normal, dice.vector(5.0)};
        if (least_gap(first, second, duration) < 1e-9) continue;
        ++asked;
        EXPECT(time_of_impact(first, second, duration, 1e-3 * SLOP) < 0.0);
    }
    EXPECT(asked > 200);
}

/// Coins that lie all but flat, two slops above a table, and turn on: their lowest place goes round the rim as their lean stops
/// falling. They are met when that comes down, in closed form, and not before.
void a_coin_that_lies_nearly_flat_is_met_where_its_rim_comes_down() {
    const Primitive coin = Primitive::cylinder(0.3, 0.01), box = Primitive::box({4, 4, 2});
    const auto mesh = std::make_shared<const Mesh>(std::vector<Vec3>{{-2, -2, 1}, {3, -2, 1}, {-2, 3, 1}},
                                                   std::vector<std::array<int, 3>>{{0, 1, 2}});
    const double slop = 1e-9 * 0.3, lasts = 1.0 / 60.0;
    for (const Primitive& table : {box, Primitive::sheet(mesh, 0)})
        for (const double lean : {3e-6, 1e-5, 3e-5, 1e-4}) {
            const Vec3 axis{lean, 0.0, std::sqrt(1.0 - lean * lean)}, y{0, 1, 0}, x = cross(y, axis);
            const double lowest = coin.half_length * axis.z + coin.radius * lean;
            Pose top{};
            top.position.z = 1.0;
            const Pose own{}, still{},
                at{{0.1, 0.2, 1.0 + lowest + 2.0 * slop},
                   {x.x, y.x, axis.x, x.y, y.y, axis.y, x.z, y.z, axis.z}};
            const Mover first{coin, own, at, {0, 0, -0.0424}, {-0.69, -0.1417, 0.0}},
                second{table, own, still, {}, {}};
            const auto height = [&](double time) {
                return separation(coin, first.at(time), Primitive::plane({0, 0, 1}), top).gap;
            };
            double touches = 0.0, overlaps = 1e-3;  // by then it has come down
            while (height(overlaps) > -slop && overlaps < lasts) overlaps *= 1.1;
            double low = 0.0;
            for (int k = 0; k < 200; ++k) {
                const double middle = 0.5 * (low + overlaps);
                (height(middle) > -slop ? low : overlaps) = middle;
            }
            for (double high = overlaps; high - touches > 1e-14;) {
                const double middle = 0.5 * (touches + high);
                (height(middle) > 0.0 ? touches : high) = middle;
            }
            const double met = time_of_impact(first, second, lasts, slop);
            EXPECT(met >= touches - 1e-9 * lasts && met <= overlaps + 1e-9 * lasts);
        }
}

}  // namespace

int main() {
    a_coin_that_lies_nearly_flat_is_met_where_its_rim_comes_down();
    what_is_promised_holds();
    what_parts_slowly_is_not_met();
    return report();
}

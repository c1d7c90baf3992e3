// Broad phase against brute force; detection's filters, order and keys.
#include <cmath>
#include <limits>
#include <random>

#include "collision/detection.hpp"
#include "collision/shape_cast.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

std::vector<IndexPair> by_brute_force(const std::vector<Bounds>& all) {
    std::vector<IndexPair> pairs;
    for (int i = 0; i < static_cast<int>(all.size()); ++i)
        for (int j = i + 1; j < static_cast<int>(all.size()); ++j)
            if (overlap(all[i], all[j])) pairs.emplace_back(i, j);
    return pairs;
}

void the_grid_finds_what_brute_force_finds() {
    std::mt19937_64 random(3);
    BroadPhase phase;
    for (const int count : {0, 1, 2, 32, 33, 400}) {
        std::uniform_real_distribution<double> unit(0.0, 1.0);
        std::vector<Bounds> all(count);
        for (Bounds& b : all) {
            b.low = {10 * unit(random), unit(random), unit(random)};
            b.high = b.low + Vec3{unit(random), 0.3 * unit(random), 0.3 * unit(random)};
        }
        if (count > 40) all[5] = all[17];  // ties
        std::vector<IndexPair> found;
        phase.overlapping_pairs(all, found);
        EXPECT(found == by_brute_force(all));
        EXPECT(count < 400 || found.size() > 100);
    }
}

/// Grains, boulders and ground: twelve orders of size, far from the origin on both sides, points, half-spaces.
void sizes_and_places_do_not_matter() {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    BroadPhase phase;
    for (const Vec3 origin : {Vec3{}, Vec3{-1e7, 3e5, 1e12}, Vec3{1e300, -1e300, 0}}) {
        std::vector<Bounds> all;
        for (int k = 0; k < 500; ++k) {
            const double size = std::pow(10.0, 6.0 * unit(random));
            const Vec3 centre =
                origin + (k % 2 ? 1.0 : 30.0) * Vec3{unit(random), unit(random), unit(random)};
            const Vec3 half = size * Vec3{0.5, 0.5 + 0.4 * unit(random), 0.01};
            all.push_back({centre - half, centre + half});
        }
        all[7].high = all[7].low;
        all[40] = {{-infinite, -infinite, -infinite}, {infinite, infinite, infinite}};
        all[41] = {{-infinite, -1, -1}, {infinite, 1, 1}};
        all[300] = all[40];
        std::vector<IndexPair> found;
        phase.overlapping_pairs(all, found);
        EXPECT(found == by_brute_force(all));
        EXPECT(found.size() > 1000);
    }
}

/// One search, asked again and again: of things that creep, fly, jump, grow, vanish, and rest.
void what_is_kept_does_not_show() {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    BroadPhase phase;
    std::vector<Bounds> all, shown;
    for (int k = 0; k < 700; ++k) {
        const double size = k % 97 == 1 ? 14.0 : k % 50 == 0 ? 4.0 : k % 11 == 0 ? 0.05 : 0.5;
        const Vec3 centre = 4.0 * Vec3{unit(random), unit(random), unit(random)};
        const Vec3 half = 0.5 * size * Vec3{1.0, 1.0 + 0.2 * unit(random), 1.0};
        all.push_back({centre - half, centre + half});
    }
    std::vector<IndexPair> found;
    for (int call = 0; call < 240; ++call) {
        const double pace = call < 60 ? 1e-3 : call < 120 ? 0.2 : call < 180 ? 0.0 : 0.01;
        for (std::size_t k = 0; k < all.size(); ++k) {
            const bool runs = (k + call) % 13 == 0;
            const Vec3 way = (runs ? 5.0 : 1.0) * pace * Vec3{unit(random), unit(random), unit(random)};
            all[k].low += way, all[k].high += way;
        }
        if (call % 7 == 3) all[call].high += Vec3{0.3, 0.0, 0.0};
        if (call % 7 == 5) all[call - 2].high -= Vec3{0.3, 0.0, 0.0};
        if (call % 20 == 9) all[3 * call] = all[call];
        shown = all;
        if (call % 30 > 24) shown[17].low.y = NAN;
        if (call % 40 > 35) shown[18] = {{-HUGE_VAL, -1, -1}, {HUGE_VAL, 1, 1}};
        phase.overlapping_pairs(shown, found);
        EXPECT(found == by_brute_force(shown));
    }
    EXPECT(found.size() > 200);
}

/// A rod over more cells of small ones than the table for them has places: each of its pairs is told once.
void a_long_one_among_few_meets_each_once() {
    for (const double length : {20.0, 60.0, 90.0, 97.0, 120.0, 400.0}) {
        BroadPhase phase;
        std::vector<Bounds> all;
        for (int k = 0; k < 39; ++k) all.push_back({{1.0 * k, 0.0, 0.0}, {1.0 * k + 0.5, 0.5, 0.5}});
        all.push_back({{-1.0, 0.2, 0.2}, {length, 0.3, 0.3}});
        std::vector<IndexPair> found;
        for (int call = 0; call < 20; ++call) {
            const Vec3 way{0.0, call % 2 ? 0.15 : -0.15, 0.0};
            all.back().low += way, all.back().high += way;
            phase.overlapping_pairs(all, found);
            EXPECT(found == by_brute_force(all));
        }
        EXPECT(found.size() >= 20);
    }
}

void not_a_number_touches_nothing() {
    std::vector<Bounds> all(40, {{0, 0, 0}, {1, 1, 1}});
    all[3].low.x = all[3].high.x = NAN;
    std::vector<IndexPair> found;
    BroadPhase().overlapping_pairs(all, found);
    EXPECT(found.size() == 39u * 38u / 2u);
}

void filters_and_order() {
    const Pose here;
    const Primitive ball = Primitive::sphere(1.0);
    // 0: static plane, 1 and 2: dynamic balls, 3: static ball, 4: dynamic dumb-bell
    std::vector<Collider> colliders{{0, Primitive::plane({0, 0, 1}), here},
                                    {4, ball, {{-2, 0, 0}, Mat3::identity()}},
                                    {1, ball, here},
                                    {2, ball, here},
                                    {3, ball, here},
                                    {4, ball, {{2, 0, 0}, Mat3::identity()}}};
    const std::vector<char> dynamic{0, 1, 1, 0, 1};
    const std::vector<double> margin(5, 0.0);
    std::vector<Pose> bodies(5);
    bodies[1].position = {0, 0, 0.9};
    bodies[2].position = {1.5, 0, 0.9};
    bodies[3].position = {0, 1.5, 0.5};
    bodies[4].position = {50, 0, 0.9};
    std::vector<Contact> contacts;
    Detection all(colliders, dynamic, {});
    all.detect(bodies, margin, contacts);
    // plane-1, plane-2, plane-4 twice, 1-2, 1-3; not plane-3; 2-3 are too far apart
    EXPECT(contacts.size() == 6);
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        EXPECT(contacts[k].first < contacts[k].second);
        EXPECT(k == 0 || contacts[k - 1].key < contacts[k].key);
        if (contacts[k].first == 0) EXPECT(contacts[k].point.normal.z == -1.0);  // from second to first: down
    }
    Detection fewer(colliders, dynamic, {{2, 1}, {0, 4}});
    fewer.detect(bodies, margin, contacts);
    EXPECT(contacts.size() == 3);
    EXPECT_NEAR(all.radius()[4], 3.0, 0.0);
    EXPECT(!Detection({{0, ball, here}, {1, ball, here}}, {0, 0}, {}).possible());
    EXPECT(!Detection({{0, ball, here}, {1, ball, here}}, {1, 1}, {{0, 1}}).possible());
    EXPECT(all.possible());
}

/// Margins that grow for a few bodies: their pairs are those that a search from scratch would find.
void what_goes_further_is_looked_for_again() {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (const int count : {5, 60}) {
        const double side = std::cbrt(static_cast<double>(count));
        std::vector<Collider> colliders{{0, Primitive::plane({0, 0, 1}), {}},
                                        {1, Primitive::box({side, 1, 1}), {}}};
        std::vector<char> dynamic{0, 0};
        std::vector<Pose> bodies(2);
        for (int b = 2; b < count; ++b) {
            colliders.push_back({b, Primitive::sphere(0.2 + 0.2 * unit(random)), {}});
            if (b % 3 == 0)
                colliders.push_back({b, Primitive::box({0.2, 0.3, 0.4}), {{0.5, 0, 0}, Mat3::identity()}});
            dynamic.push_back(1);
            const Vec3 place{side * unit(random), side * unit(random), side * unit(random)};
            bodies.push_back({place, Mat3::identity()});
        }
        std::vector<double> margin(bodies.size(), 0.01);
        const std::vector<IndexPair> excluded{{2, 3}};
        Detection one(colliders, dynamic, excluded), other(colliders, dynamic, excluded);
        one.near(bodies, margin);
        std::vector<IndexPair> found;
        for (const std::vector<int>& grown : {std::vector<int>{2}, {2, 3}, {2, 3, 4}}) {
            for (const int body : grown) margin[body] += 0.7 * side * unit(random);
            EXPECT(one.near_again(grown, margin, found));
            std::vector<IndexPair> theirs;
            for (const IndexPair& pair : other.near(bodies, margin))
                for (const int body : grown)
                    if (one.collider(pair.first).body == body || one.collider(pair.second).body == body) {
                        theirs.push_back(pair);
                        break;
                    }
            EXPECT(found == theirs);
            EXPECT(found.size() >= grown.size());
        }
        EXPECT(!one.near_again({0}, margin, found));  // a plane's margin is that of every body
    }
}

void keys_last_while_the_touching_features_do() {
    const Primitive box = Primitive::box({1, 1, 1});
    Detection stack({{0, box, {}}, {1, box, {}}}, {0, 1}, {});
    std::vector<Pose> bodies(2);
    std::vector<Contact> before, after;
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(-1e-9, 1e-9);
    for (int trial = 0; trial < 1000; ++trial) {
        bodies[1] = {{unit(random), unit(random), 1.0 + unit(random)},
                     rotation(Quat{1.0, unit(random), unit(random), unit(random)})};
        stack.detect(bodies, {1e-6, 1e-6}, after);
        EXPECT(after.size() == 4);
        for (std::size_t k = 0; k < after.size() && trial > 0; ++k) EXPECT(after[k].key == before[k].key);
        before = after;
    }
}

/// Boxes and capsules that fly and turn past each other, on parts off their centres or not: nothing is missed that
/// many small steps see, and nothing is found where they see nothing.
void casts_find_what_small_steps_find() {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto vector = [&](double size) { return size * Vec3{unit(random), unit(random), unit(random)}; };
    const auto turned = [&] {
        const Vec3 v = vector(1.0);
        const double s = 1.0 / std::sqrt(1.0 + dot(v, v));
        return rotation(Quat{s, s * v.x, s * v.y, s * v.z});
    };
    constexpr double slop = 1e-6;
    constexpr int samples = 2000;
    int hits = 0, misses = 0;
    for (int trial = 0; trial < 600; ++trial) {
        const Primitive shapes[] = {Primitive::box({0.4, 0.6, 0.8}), Primitive::capsule(0.2, 0.7),
                                    Primitive::sphere(0.3)};
        const Primitive &one = shapes[trial % 3], &two = shapes[trial / 3 % 3];
        const Pose part{trial % 2 ? vector(0.3) : Vec3{}, turned()}, own{{}, turned()};
        const Pose here{vector(0.1), turned()}, there{Vec3{1.6, 0, 0} + vector(0.3), turned()};
        // Every third spins about its own axis only, every fourth about the line between both.
        const Vec3 spin = trial % 3 == 1   ? 6.0 * (here.rotation * column(part.rotation, 2))
                          : trial % 4 == 1 ? Vec3{6.0, 0, 0}
                                           : vector(4.0);
        const Mover first{one, part, here, Vec3{1.0, 0, 0} + vector(1.0), spin};
        const Mover second{two, own, there, vector(0.5), vector(3.0)};
        if (separation(one, first.at(0.0), two, second.at(0.0)).gap <= 0.0) continue;
        double deepest = 0.0, seen = -1.0;
        for (int k = 0; k <= samples; ++k) {
            const double time = static_cast<double>(k) / samples;
            const double gap = separation(one, first.at(time), two, second.at(time)).gap;
            if (gap < -slop && seen < 0.0) seen = time;
            deepest = std::min(deepest, gap);
        }
        const double found = time_of_impact(first, second, 1.0, slop);
        if (seen >= 0.0) {
            ++hits;
            EXPECT(found >= 0.0 && found <= seen);
        } else if (found < 0.0) {
            ++misses;
        }
        if (found >= 0.0) EXPECT(separation(one, first.at(found), two, second.at(found)).gap < 1e-3);
    }
    EXPECT(hits > 100 && misses > 50);
}

/// A face on a level with its neighbour: what turns about the normal, or rolls, slides on and meets nothing.
void what_turns_in_a_plane_meets_no_side_of_it() {
    const Primitive tile = Primitive::box({1, 1, 1}), box = Primitive::box({0.1, 0.2, 0.1}),
                    roller = Primitive::capsule(0.05, 0.1);
    const Pose own, next{{1, 0, -0.5}, Mat3::identity()};
    const Mover still{tile, own, next, {}, {}};
    const Pose flat{{0.3, 0.1, 0.05}, Mat3::identity()};
    const double half = std::sqrt(0.5);
    const Pose lying{{0.3, 0.1, 0.05}, rotation(Quat{half, half, 0, 0})};  // axis along y
    for (const double h : {1.0 / 60.0, 0.1}) {
        EXPECT(time_of_impact({box, own, flat, {5, 0, 0}, {0, 0, 4}}, still, h, 1e-10) < 0.0);
        EXPECT(time_of_impact({roller, own, lying, {5, 0, 0}, {0, 100, 0}}, still, h, 1e-10) < 0.0);
        EXPECT(time_of_impact({roller, own, lying, {5, 0, 0}, {0, 0, 4}}, still, h, 1e-10) < 0.0);
        // Nor what lifts its rear by turning about its front edge.
        EXPECT(time_of_impact({box, own, flat, {5, 0, 0.05e-3}, {0, 1e-3, 0}}, still, h, 1e-10) < 0.0);
    }
    // One that tips is met, and so is one that stands a little lower.
    EXPECT(time_of_impact({box, own, flat, {5, 0, 0}, {0, 4, 0}}, still, 0.1, 1e-10) >= 0.0);
    const Pose lower{{0.3, 0.1, 0.0499}, Mat3::identity()};
    EXPECT(time_of_impact({box, own, lower, {5, 0, 0}, {0, 0, 4}}, still, 0.1, 1e-10) >= 0.0);
}

}  // namespace

int main() {
    the_grid_finds_what_brute_force_finds();
    sizes_and_places_do_not_matter();
    what_is_kept_does_not_show();
    a_long_one_among_few_meets_each_once();
    not_a_number_touches_nothing();
    filters_and_order();
    what_goes_further_is_looked_for_again();
    keys_last_while_the_touching_features_do();
    casts_find_what_small_steps_find();
    what_turns_in_a_plane_meets_no_side_of_it();
    return report();
}

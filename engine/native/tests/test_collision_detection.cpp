// Broad phase against brute force; detection's filters, order and keys.
#include <cmath>
#include <limits>
#include <random>

#include "collision/detection.hpp"
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

}  // namespace

int main() {
    the_grid_finds_what_brute_force_finds();
    sizes_and_places_do_not_matter();
    not_a_number_touches_nothing();
    filters_and_order();
    keys_last_while_the_touching_features_do();
    return report();
}

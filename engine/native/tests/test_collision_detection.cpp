// Broad phase against brute force; detection's filters, order and keys.
#include <random>

#include "collision/detection.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

void sweep_finds_what_brute_force_finds() {
    std::mt19937_64 random(3);
    for (const int count : {0, 1, 2, 32, 33, 400}) {
        std::uniform_real_distribution<double> unit(0.0, 1.0);
        std::vector<Bounds> all(count);
        for (Bounds& b : all) {
            b.low = {10 * unit(random), unit(random), unit(random)};
            b.high = b.low + Vec3{unit(random), 0.3 * unit(random), 0.3 * unit(random)};
        }
        if (count > 40) all[5] = all[17];  // ties
        std::vector<IndexPair> reference, found;
        for (int i = 0; i < count; ++i)
            for (int j = i + 1; j < count; ++j)
                if (overlap(all[i], all[j])) reference.emplace_back(i, j);
        overlapping_pairs(all, found);
        EXPECT(found == reference);
        EXPECT(count < 400 || found.size() > 100);
    }
}

void not_a_number_touches_nothing() {
    std::vector<Bounds> all(40, {{0, 0, 0}, {1, 1, 1}});
    all[3].low.x = all[3].high.x = NAN;
    std::vector<IndexPair> found;
    overlapping_pairs(all, found);
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
    sweep_finds_what_brute_force_finds();
    not_a_number_touches_nothing();
    filters_and_order();
    keys_last_while_the_touching_features_do();
    return report();
}

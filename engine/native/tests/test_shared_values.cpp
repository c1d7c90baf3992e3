// Equal values are kept once, and every index still finds its own.
#include <random>
#include <vector>

#include "contacts/contact_material.hpp"
#include "expect.hpp"
#include "linear/shared_values.hpp"

using namespace spook;

namespace {

SurfaceMaterial with_friction(double mu) {
    SurfaceMaterial material;
    material.friction = mu;
    return material;
}

/// So many distinct values in a random order, and in turns.
void every_index_finds_its_own(int distinct, std::mt19937& random) {
    for (const bool in_turns : {false, true}) {
        std::vector<SurfaceMaterial> given;
        for (int k = 0; k < 1000; ++k)
            given.push_back(with_friction(in_turns ? k % distinct : static_cast<int>(random() % distinct)));
        const SharedValues<SurfaceMaterial> kept(given);
        for (std::size_t k = 0; k < given.size(); ++k) EXPECT(kept[k] == given[k]);
        if (distinct <= 16) EXPECT(static_cast<int>(kept.distinct().size()) == distinct);
    }
}

}  // namespace

int main() {
    std::mt19937 random(3);
    for (const int distinct : {1, 2, 16, 17, 40, 900}) every_index_finds_its_own(distinct, random);
    SurfaceMaterial turned = with_friction(0.5);
    turned.direction = {1.0, 0.0, 0.0};
    const SharedValues<SurfaceMaterial> two({with_friction(0.5), turned});
    EXPECT(two.distinct().size() == 2);
    EXPECT(two[1].is_oriented() && !two[0].is_oriented());
    return report();
}

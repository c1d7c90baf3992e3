// Islands: who hangs together, and that solving apart gives what solving together gives.
#include <cstring>

#include "contact_world.hpp"
#include "contacts/contact_islands.hpp"
#include "expect.hpp"

using namespace spook;

namespace {

RowBlock tie(int first, int second) {
    RowBlock block;
    block.first = first;
    block.second = second;
    return block;
}

void static_bodies_join_nothing() {
    MixedSystem system;
    system.mass.resize(6);
    system.rows = {tie(0, -1), tie(4, 1), tie(-1, 1), tie(3, -1)};
    const Islands islands = find_islands(system);
    EXPECT(islands.count == 3);
    EXPECT((islands.of_body == std::vector<int>{0, 1, -1, 2, 1, -1}));
}

ContactWorld two_stacks(double distance) {
    const SurfaceMaterial m{0.4, 0.3, 0.0, 0.075, 0.0};
    std::vector<ContactBody> bodies{{Primitive::plane({0, 0, 1}), 0.0, {}, {}, {}, {}, {}, m}};
    for (int k = 0; k < 6; ++k) {
        const Vec3 where{distance * (k % 2) + 0.03 * k, 0.0, 0.6 + 1.1 * (k / 2)};
        bodies.push_back({Primitive::box({1, 1, 1}), 1.0, box_inertia(1.0, {1, 1, 1}), where, {}, {}, {}, m});
    }
    ContactOptions o;
    o.time_step = 1.0 / 60.0;
    return ContactWorld(bodies, {0, 0, -9.81}, o);
}

void far_stacks_do_not_know_each_other() {
    ContactWorld near = two_stacks(50.0), far = two_stacks(500.0), again = two_stacks(50.0);
    for (int step = 0; step < 120; ++step) near.step(), far.step(), again.step();
    for (std::size_t k = 1; k < near.bodies.size(); ++k) {
        const Vec3 a = near.bodies[k].position, b = far.bodies[k].position, c = again.bodies[k].position;
        EXPECT_NEAR(a.z, b.z, 1e-9);  // rounding of a far position only
        EXPECT(std::memcmp(&a, &c, sizeof a) == 0);
    }
    EXPECT(near.bodies[5].position.z > 2.3);  // still stacked
}

}  // namespace

int main() {
    static_bodies_join_nothing();
    far_stacks_do_not_know_each_other();
    return report();
}

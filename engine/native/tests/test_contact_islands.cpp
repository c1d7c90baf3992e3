// Islands: which bodies are connected, and that solving apart gives what solving together gives.
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
    IslandFinder finder;
    const Islands& islands = finder.find(system);
    EXPECT(islands.count == 3);
    EXPECT((islands.of_body == std::vector<int>{0, 1, -1, 2, 1, -1}));
}

/// Ties come, go and stay: the islands are those that a search from nothing finds, and more ties are no reason to search.
void islands_follow_their_ties() {
    constexpr int bodies = 60;
    IslandFinder kept;
    std::vector<Islands::Tie> ties;
    unsigned state = 1;
    const auto random = [&](int count) {
        state = 1664525u * state + 1013904223u;
        return static_cast<int>((state >> 8) % static_cast<unsigned>(count));
    };
    const auto find = [&](IslandFinder& finder) -> const Islands& {
        finder.begin(bodies);
        for (const auto [first, second] : ties) finder.tie(first, second);
        return finder.find();
    };
    for (int turn = 0; turn < 400; ++turn) {
        const bool goes = turn % 5 == 4 && !ties.empty();
        if (goes) ties.erase(ties.begin() + random(static_cast<int>(ties.size())));
        else if (turn % 5 != 0)
            ties.insert(ties.begin() + random(static_cast<int>(ties.size()) + 1),
                        {random(bodies + 1) - 1, random(bodies)});
        IslandFinder fresh;
        const long before = kept.searches();
        const Islands &known = find(kept), &anew = find(fresh);
        EXPECT(known.count == anew.count && known.of_body == anew.of_body);
        EXPECT(goes || turn % 60 == 0 || kept.searches() == before);
        if (turn % 60 == 59) ties.clear();
    }
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

/// Two balls on the ground; the second one's row asks for another speed in a second round.
void answered_islands_are_left_as_they_are() {
    MixedSystem system;
    Mat6 unit{};
    for (int i = 0; i < 6; ++i) unit[7 * i] = 1.0;
    system.mass = {unit, unit};
    system.momentum = {{0, 0, -1, 0, 0, 0}, {0, 0, -1, 0, 0, 0}};
    system.rows = {tie(0, -1), tie(1, -1)};
    for (RowBlock& row : system.rows) {
        row.first_jacobian[0] = {0, 0, 1, 0, 0, 0};
        row.lower[0] = 0.0;
    }
    std::vector<FrictionPoint> none;
    IslandSolver solver;
    int asked = 0;
    const IslandSolver::Solve solve = [&asked](MixedSystem& island, std::vector<FrictionPoint>& points,
                                               DirectSolver& direct) {
        ++asked;
        return solve_friction_direct(island, points, FrictionModel::cone, direct);
    };
    solver.run(system, none, solve);
    EXPECT(asked == 2);
    const Vec6 kept = system.velocity[0];
    const double push = system.rows[0].multiplier[0];
    EXPECT_NEAR(push, 1.0, 1e-12);

    system.rows[1].right[0] = 0.5;
    system.momentum[0][2] = -7.0;  // seen only if the first island is asked again
    const std::vector<char> answered{1, 0};
    solver.run(system, none, solve, &answered);
    EXPECT(asked == 3);
    EXPECT(system.velocity[0] == kept && system.rows[0].multiplier[0] == push);
    EXPECT_NEAR(system.velocity[1][2], 0.5, 1e-12);
    EXPECT_NEAR(system.rows[1].multiplier[0], 1.5, 1e-12);

    solver.run(system, none, solve);
    EXPECT(asked == 5);
    EXPECT_NEAR(system.rows[0].multiplier[0], 7.0, 1e-12);
}

}  // namespace

int main() {
    static_bodies_join_nothing();
    islands_follow_their_ties();
    answered_islands_are_left_as_they_are();
    far_stacks_do_not_know_each_other();
    return report();
}

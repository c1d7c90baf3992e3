// Newton's method on the cone gives the same bits with vectors of four and with single numbers: points with and without
// friction, soft ones, and rows with every kind of bounds; a pattern with pivots that move, and a heap.
#include <random>

#include "contacts/cone_newton.hpp"
#include "expect.hpp"
#include "linear/block_lu_kernels.hpp"
#include "rigid/rigid_program.hpp"

using namespace spook;

namespace {

constexpr double STEP = 1.0 / 60.0;  // s

struct Problem {
    MixedSystem system;
    std::vector<FrictionPoint> points;
};

/// Bodies that touch each other and what does not move, and a few rows of something else.
Problem random_problem(unsigned seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto any = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
    Problem problem;
    const int bodies = 2 + any(9), blocks = 1 + any(30);
    for (int b = 0; b < bodies; ++b) {
        Mat6 mass{};
        const double size = std::exp(2.0 * unit(random));
        for (int i = 0; i < 6; ++i) mass[7 * i] = size * (i < 3 ? 1.0 : 0.1 + 0.05 * unit(random));
        mass[22] = mass[27] = 0.01 * size * unit(random);
        problem.system.mass.push_back(mass);
        Vec6 momentum;
        for (double& p : momentum) p = size * unit(random);
        problem.system.momentum.push_back(momentum);
    }
    for (int k = 0; k < blocks; ++k) {
        RowBlock block;
        block.first = any(bodies + 1) - 1;
        block.second = any(bodies + 1) - 1;
        if (block.first == block.second) block.second = block.first > 0 ? 0 : block.first + 1;
        if (any(2) == 0) std::swap(block.first, block.second);
        const bool point = any(4) != 0;
        block.size = point ? 3 : 1 + any(2);
        for (int i = 0; i < block.size; ++i) {
            for (int a = 0; a < 6; ++a) {
                block.first_jacobian[i][a] = block.first >= 0 ? unit(random) : 0.0;
                block.second_jacobian[i][a] = block.second >= 0 ? -unit(random) : 0.0;
            }
            block.right[i] = any(2) ? 0.1 * unit(random) : 0.0;
            block.softness[i] = any(3) ? 0.0 : 0.1 + 0.1 * unit(random);
            const int kind = point ? 1 : any(5);  // unbounded, from below, from above, both, fixed
            if (kind == 1 || kind == 3) block.lower[i] = kind == 1 ? 0.0 : -0.2;
            if (kind == 2 || kind == 3) block.upper[i] = 0.3;
            if (kind == 4) block.lower[i] = block.upper[i] = 0.1;
            block.multiplier[i] = i == 0 ? 0.1 : 0.0;
        }
        if (point) {
            block.lower[1] = block.lower[2] = -unbounded;
            const double slip = any(3) ? 0.0 : 0.05;
            block.softness[1] = block.softness[2] = slip;
            problem.points.push_back({static_cast<int>(problem.system.rows.size()),
                                      any(5) ? 0.5 + 0.4 * unit(random) : 0.0, slip, -1.0});
        }
        problem.system.rows.push_back(block);
    }
    return problem;
}

void portable(bool only) {
    use_portable_cone_laws(only);
    use_portable_lu(only);
}

void systems_give_the_same_bits() {
    int finite = 0;
    for (unsigned seed = 1; seed <= 400; ++seed) {
        Problem one = random_problem(seed), two = one;
        ConeNewton wide, single;
        portable(false);
        const ConeReport a = wide.solve(one.system, one.points);
        portable(true);
        const ConeReport b = single.solve(two.system, two.points);
        portable(false);
        EXPECT(a.iterations == b.iterations);
        EXPECT(a.converged == b.converged);
        EXPECT(a.residual == b.residual || (a.residual != a.residual && b.residual != b.residual));
        if (!(a.residual < unbounded)) continue;
        ++finite;
        EXPECT(one.system.velocity == two.system.velocity);
        for (std::size_t k = 0; k < one.system.rows.size(); ++k)
            EXPECT(one.system.rows[k].multiplier == two.system.rows[k].multiplier);
    }
    EXPECT(finite > 350);
}

/// Boxes and balls that fall into each other, too many for pivoting alone.
RigidScene heap() {
    RigidScene scene;
    scene.gravity = {0, 0, -10};
    scene.method.time_step = STEP;
    RigidBodySpec ground;
    ground.motion = Motion::fixed;
    ground.material.friction = 0.5;
    ground.material.damping = 4.5 * STEP;
    scene.bodies.push_back(ground);
    scene.colliders.push_back({0, Primitive::plane({0, 0, 1}), {}});
    for (int i = 0; i < 27; ++i) {
        RigidBodySpec body = ground;
        body.motion = Motion::dynamic;
        body.mass = 1.0;
        body.inertia = {0.1, 0.12, 0.15};
        body.position = {0.9 * (i % 3) + 0.02 * (i % 5), 0.9 * (i / 3 % 3) - 0.03 * (i % 4),
                         0.6 + 1.0 * (i / 9)};
        scene.bodies.push_back(body);
        scene.colliders.push_back(
            {i + 1, i % 2 ? Primitive::sphere(0.45) : Primitive::box({0.4, 0.4, 0.4}), {}});
    }
    return scene;
}

void a_heap_gives_the_same_bits() {
    std::vector<double> ends[2];
    for (const bool only : {false, true}) {
        portable(only);
        const RigidScene scene = heap();
        RigidSystem system(scene, StageList(choose_stages(scene, false)));
        system.reset(nullptr);
        for (int i = 0; i < 90; ++i) system.advance(1);
        EXPECT(system.health().status == Status::completed);
        ends[only] = system.final_state();
    }
    portable(false);
    EXPECT(ends[0] == ends[1]);
}

}  // namespace

int main() {
    systems_give_the_same_bits();
    a_heap_gives_the_same_bits();
    return report();
}

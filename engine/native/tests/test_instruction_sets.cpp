// Whole runs give the same bits with the vector kernels and with the portable ones; and all of them ask kernels.
#include "linear/block_kernels.hpp"
#include "particles/particle_program.hpp"
#include "rigid/rigid_program.hpp"

#include <cstdio>
#include <vector>

#include "expect.hpp"

using namespace spook;

namespace {

constexpr double STEP = 1.0 / 60.0;  // s
constexpr int STEPS = 120;

const kernel::Kernels* asked = nullptr;
std::int64_t factors = 0;

/// The kernels of `asked`, counted.
std::int64_t counted_factor(const kernel::Factor& f, int uniform_size, double floor, double* x) {
    ++factors;
    return asked->factor(f, uniform_size, floor, x);
}
void forward(const kernel::Factor& f, int uniform_size, double* x) { asked->forward(f, uniform_size, x); }
void backward(const kernel::Factor& f, int uniform_size, double* x) { asked->backward(f, uniform_size, x); }
void product(int rows, int columns, const double* b, const double* x2, double* y) {
    asked->subtract_product(rows, columns, b, x2, y);
}
void coupling(int rows, int columns, const double* b, const double* x1, const double* x2, double* y,
              double* z) {
    asked->subtract_coupling(rows, columns, b, x1, x2, y, z);
}
constexpr kernel::Kernels COUNTED{counted_factor, forward, backward, product, coupling};

JointSpec joint(JointKind kind, int first, int second, Vec3 at, double compliance) {
    JointSpec spec;
    spec.kind = kind;
    spec.first = first;
    spec.second = second;
    spec.first_point = spec.second_point = at;
    spec.axes = {Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{1, 0, 0}};
    spec.compliance.fill(compliance);
    spec.damping.fill(2.0 * STEP);
    return spec;
}

/// Boxes in a row from the world on, a joint between each and the next.
RigidScene row(int count, JointKind kind, double compliance) {
    RigidScene scene;
    scene.gravity = {0.3, -0.4, -10.0};
    scene.method.time_step = STEP;
    for (int i = 0; i < count; ++i) {
        RigidBodySpec box;
        box.mass = 2.5 + 0.1 * i;
        box.inertia = {0.010, 0.012, 0.015};
        box.position = {(i + 0.5) * 0.125, 0, 0};
        scene.bodies.push_back(box);
        scene.joints.push_back(joint(kind, i - 1, i, {i * 0.125, 0, 0}, compliance));
    }
    return scene;
}

/// World – lock – box – lock – box … along x.
RigidScene cantilever(int count, double compliance) {
    RigidScene scene;
    scene.gravity = {0, 0, -10};
    scene.method.time_step = STEP;
    for (int i = 0; i < count; ++i) {
        RigidBodySpec box;
        box.mass = 2.5;
        box.inertia = {2.5 * 0.02 / 12, 2.5 * 0.025625 / 12, 2.5 * 0.025625 / 12};
        box.position = {(i + 0.5) * 0.125, 0, 0};
        scene.bodies.push_back(box);
        JointSpec lock = joint(JointKind::lock, i - 1, i, {i * 0.125, 0, 0}, compliance);
        lock.axes = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
        scene.joints.push_back(lock);
    }
    return scene;
}

RigidScene ring(int count, JointKind kind, double compliance) {
    RigidScene scene = row(count, kind, compliance);
    scene.joints.push_back(joint(kind, -1, count - 1, {count * 0.125, 0, 0}, compliance));
    return scene;
}

/// Boxes that fall on rough ground and on each other, two of them tied.
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
    for (int i = 0; i < 4; ++i) {
        RigidBodySpec box = ground;
        box.motion = Motion::dynamic;
        box.mass = 1.0 + i;
        box.inertia = {0.1, 0.12, 0.15};
        box.position = {0.2 * i, 0.1 * i, 0.6 + 1.1 * i};
        box.angular_velocity = {0.1, 0.2, 0.3};
        scene.bodies.push_back(box);
        scene.colliders.push_back({i + 1, Primitive::box({1, 1, 1}), {}});
    }
    scene.joints.push_back(joint(JointKind::ball, 3, 4, {0.5, 0.25, 3.4}, 1e-9));
    scene.no_contact.push_back({3, 4});
    return scene;
}

ParticleScene net(bool strings) {
    ParticleScene scene;
    scene.gravity = {0.0, 0.0, -9.81};
    scene.method.time_step = STEP;
    scene.method.string_stiffness = strings;
    for (int i = 0; i < 6; ++i) {
        scene.bodies.push_back({1.0 + 50.0 * (i == 5), {0.001 * (i % 2), 0.0, -1.0 - i}, {}, {}});
        scene.rows.push_back({{{i - 1, {}}, {i, {}}}, 1.0, 1e-9, STEP});
    }
    if (!strings) scene.rows.push_back({{{0, {}}, {3, {}}}, 3.0, 1e-6, STEP});  // a loop
    return scene;
}

/// `asks`: whether these kernels solve it; a tree goes link by link, and a composition of one in coordinates of its joints.
template <class Scene, class System> void same_bits(const char* name, const Scene& scene, bool asks = true) {
    std::vector<double> ends[2];
    for (const bool portable : {false, true}) {
        kernel::use_portable_kernels(portable);
        asked = &kernel::kernels();
        factors = 0;
        kernel::use_kernels(COUNTED);
        System system(scene, StageList(choose_stages(scene, false)));
        system.reset(nullptr);
        for (int i = 0; i < STEPS; ++i) system.advance(1);
        const bool asked_often = factors >= STEPS / 2;
        if (system.health().status != Status::completed || asked_often != asks)
            std::printf("%s: %lld factorisations, %s\n", name, static_cast<long long>(factors),
                        system.health().reason);
        EXPECT(system.health().status == Status::completed);
        EXPECT(asked_often == asks);
        ends[portable] = system.final_state();
    }
    kernel::use_portable_kernels(false);
    EXPECT(ends[0] == ends[1]);
}

}  // namespace

int main() {
    const auto rigid = [](const char* name, const RigidScene& scene, bool asks = true) {
        same_bits<RigidScene, RigidSystem>(name, scene, asks);
    };
    rigid("a cantilever, locked link by link", cantilever(40, 1e-9), false);
    RigidScene held = cantilever(40, 1e-9);  // by two locks to the world: not a tree
    held.joints.push_back(held.joints[0]);
    held.joints.back().second = 39;
    held.joints.back().first_point = held.joints.back().second_point = {5, 0, 0};
    rigid("a beam held at both ends", held);
    RigidScene door = cantilever(6, 0.0);
    for (JointSpec& each : door.joints) each.kind = JointKind::hinge;
    for (int i = 0; i < 6; ++i) {
        door.joints.push_back(door.joints[i]);
        door.joints.back().first_point.x += 0.01, door.joints.back().second_point.x += 0.01;
    }
    rigid("a door on doubled hinges", door);
    door.method.composition = 6;
    rigid("a composition of it, in the coordinates of its joints", door, false);
    rigid("a ring of locks", ring(40, JointKind::lock, 1e-9));
    rigid("a rope of balls", ring(12, JointKind::ball, 1e-9));
    RigidScene halves = row(6, JointKind::hinge, 0.0);
    halves.method.half_step_velocities = true;
    rigid("half steps", halves);
    halves.method.corrections = 2;
    rigid("half steps with corrections", halves);
    RigidScene loaded = row(8, JointKind::ball, 1e-10);
    loaded.method.string_stiffness = true;
    loaded.gravity = {10.0, 0.1, 0.0};  // along the chain
    loaded.bodies.back().mass = 1e4, loaded.bodies.back().inertia = {100, 100, 100};
    rigid("a loaded chain", loaded);
    RigidScene composed = ring(12, JointKind::lock, 0.0);
    composed.method.composition = 6;
    rigid("a composition of rows", composed);
    RigidScene twice = row(6, JointKind::hinge, 0.0);
    for (int i = 0; i < 6; ++i) {
        twice.joints.push_back(twice.joints[i]);
        twice.joints.back().first_point.y += 0.01, twice.joints.back().second_point.y += 0.01;
    }
    rigid("redundant hinges", twice);
    rigid("a heap", heap());
    same_bits<ParticleScene, ParticleSystem>("a loop of particles", net(false));
    same_bits<ParticleScene, ParticleSystem>("stiff strings", net(true));
    return report();
}

// Runs at the same time in several threads, as Python does them without its lock: each gives the bits it gives alone.
#include <string>
#include <thread>
#include <vector>

#include "expect.hpp"
#include "rigid/rigid_program.hpp"

using namespace spook;

namespace {

/// Boxes, balls and coins that fall on each other and on a hanging chain; solved in another way for each `kind`.
RigidScene scene(int kind) {
    RigidScene s;
    s.gravity = {0, 0, -10};
    s.method.time_step = 1.0 / 60.0;
    s.method.solver = static_cast<SolverKind>(kind % 2);
    const SurfaceMaterial rough{0.5, 0.1 * (kind % 2), 0.0, 0.075, 0.0};
    RigidBodySpec floor;
    floor.motion = Motion::fixed;
    floor.material = rough;
    s.bodies.push_back(floor);
    s.colliders.push_back({0, Primitive::plane({0, 0, 1}), {}});
    for (int k = 1; k < 13; ++k) {
        RigidBodySpec body;
        body.mass = 1.0;
        body.inertia = {0.1, 0.1, 0.1};
        body.position = {0.1 * (k % 3), 0.07 * (k % 4), 0.6 * k};
        body.material = rough;
        s.bodies.push_back(body);
        const Primitive shapes[] = {Primitive::box({0.5, 0.5, 0.5}), Primitive::sphere(0.3),
                                    Primitive::cylinder(0.3, 0.2)};
        s.colliders.push_back({k, shapes[k % 3], {}});
    }
    for (int k = 10; k < 12; ++k) {
        JointSpec joint;
        joint.kind = JointKind::ball;
        joint.first = k, joint.second = k + 1;
        joint.first_point = joint.second_point = 0.5 * (s.bodies[k].position + s.bodies[k + 1].position);
        joint.axes = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
        joint.damping.fill(2.0 / 60.0);
        s.joints.push_back(joint);
        s.no_contact.emplace_back(k, k + 1);
    }
    return s;
}

std::string hash_of(int kind) {
    RigidProgram program(scene(kind), {}, {});
    return program.run(40, 1e6, kind % 2 == 0).state_hash;
}

void runs_at_the_same_time_do_not_know_each_other() {
    constexpr int kinds = 3;
    std::vector<std::string> together(kinds);
    std::vector<std::thread> threads;
    for (int kind = 0; kind < kinds; ++kind)
        threads.emplace_back([&together, kind] { together[kind] = hash_of(kind); });
    for (std::thread& thread : threads) thread.join();
    for (int kind = 0; kind < kinds; ++kind) EXPECT(together[kind] == hash_of(kind));
}

}  // namespace

int main() {
    runs_at_the_same_time_do_not_know_each_other();
    return report();
}

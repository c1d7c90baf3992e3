// Whole steps of rigid bodies against closed forms: sagging chains, overdetermined doors, closed systems.
#include "rigid/rigid_program.hpp"

#include "expect.hpp"

using namespace spook;

namespace {

constexpr double kStep = 1.0 / 60.0;

RigidBodySpec box(Vec3 position) {
    RigidBodySpec spec;
    spec.mass = 2.5;
    spec.inertia = {2.5 * 0.02 / 12, 2.5 * 0.025625 / 12, 2.5 * 0.025625 / 12};
    spec.position = position;
    return spec;
}

JointSpec joint(JointKind kind, int first, int second, Vec3 at, double compliance) {
    JointSpec spec;
    spec.kind = kind;
    spec.first = first;
    spec.second = second;
    spec.first_point = spec.second_point = at;
    spec.axes = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    spec.compliance.fill(compliance);
    spec.damping.fill(2.0 * kStep);
    return spec;
}

RigidScene scene() {
    RigidScene s;
    s.gravity = {0, 0, -10};
    s.method.time_step = kStep;
    return s;
}

struct Started : RigidSystem {
    explicit Started(const RigidScene& scene) : RigidSystem(scene, StageList(choose_stages(scene, false))) {
        reset(nullptr);
    }
};

/// World – lock – box – lock – box … along x.
RigidScene cantilever(int n, double compliance) {
    RigidScene s = scene();
    for (int i = 0; i < n; ++i) {
        s.bodies.push_back(box({(i + 0.5) * 0.125, 0, 0}));
        s.joints.push_back(joint(JointKind::lock, i - 1, i, {i * 0.125, 0, 0}, compliance));
    }
    return s;
}

template <class Build> bool is_refused(Build build) {
    try {
        build();
    } catch (const std::invalid_argument&) {
        return true;
    }
    return false;
}

void only_the_listed_stages_run() {
    RigidScene s = scene();
    s.bodies = {box({0, 0, 0})};
    s.bodies[0].torque = {0.1, 0, 0};
    const auto after = [&](StageList stages) {
        RigidSystem system(s, stages);
        system.reset(nullptr);
        system.advance(10);
        return system.read().state(0);
    };
    const Stage fall = Stage::apply_gravity, load = Stage::apply_loads;
    const Stage move = Stage::integrate_positions, turn = Stage::integrate_rotations;
    EXPECT(is_zero(after({move, turn}).velocity));
    EXPECT(after({fall, move, turn}).velocity.z < -1.0 &&
           is_zero(after({fall, move, turn}).angular_velocity));
    EXPECT(is_zero(after({load, move, turn}).velocity) && after({load, move, turn}).angular_velocity.x > 0.1);
    EXPECT(is_refused([&] { after({fall, move}); }));
    EXPECT(is_refused([&] { after({move, turn, Stage::friction}); }));
    const RigidScene held = cantilever(2, 1e-9);
    EXPECT(is_refused([&] { RigidSystem(held, {move, turn, Stage::assemble_rows}); }));
    EXPECT(is_refused([&] { RigidSystem(held, {move, turn, Stage::solve_block}); }));
}

void a_compliant_chain_sags_by_the_unit_load_theorem() {
    const int n = 20;
    const double eps = 1e-10, weight = 25.0, a = 0.125;
    Started system(cantilever(n, eps));
    system.advance(2000);
    double sag = 0.0;  // of the last centre
    for (int lock = 0; lock < n; ++lock) {
        double moment = 0.0;
        for (int i = lock; i < n; ++i) moment += weight * (i + 0.5 - lock) * a;
        sag += eps * (moment * (n - 0.5 - lock) * a + weight * (n - lock));
    }
    EXPECT_NEAR(-system.read().state(n - 1).displacement.z / sag, 1.0, 1e-9);
    double wrench[6];
    system.read().wrench(0, wrench);
    EXPECT_NEAR(wrench[2] / (n * weight), 1.0, 1e-12);
    EXPECT_NEAR(wrench[4] / (-weight * n * n * a / 2), 1.0, 1e-10);
}

void every_joint_of_an_overdetermined_body_carries_its_share() {
    for (const double compliance : {1e-13, 0.0}) {
        RigidScene s = scene();
        s.bodies.push_back(box({0, 0, 0}));
        const int n = 40;
        for (int i = 0; i < n; ++i) s.joints.push_back(joint(JointKind::ball, -1, 0, {0, 0, 0}, compliance));
        Started system(s);
        system.advance(200);
        for (int i = 0; i < n; ++i) {
            double wrench[6];
            system.read().wrench(i, wrench);
            EXPECT_NEAR(wrench[2], 25.0 / n, 1e-9);
        }
    }
}

void contradictory_rows_are_named() {
    RigidScene s = scene();
    s.gravity = {};
    s.bodies = {box({5, 0, 0}), box({0, 0, 0})};
    for (double speed : {1.0, 2.0}) {
        JointSpec hinge = joint(JointKind::hinge, -1, 1, {0, 0, 0}, 0.0);
        hinge.motor.emplace();
        hinge.motor->speed = speed;
        hinge.motor->force = std::numeric_limits<double>::infinity();
        s.joints.push_back(hinge);
    }
    Started contradictory(s);
    contradictory.advance(1);
    EXPECT(contradictory.health().status == Status::diverged);
    EXPECT(contradictory.health().body == 1);
    s.joints[1].motor->speed = 1.0;
    Started redundant(s);
    redundant.advance(10);
    EXPECT(redundant.health().status == Status::completed);
    EXPECT_NEAR(redundant.read().state(1).angular_velocity.x, 1.0, 1e-12);
}

void a_free_pair_keeps_its_momenta() {
    RigidScene s = scene();
    s.gravity = {};
    s.bodies = {box({0, 0, 0}), box({0.3, 0, 0})};
    s.bodies[0].velocity = {0.2, 0.4, -0.1};
    s.bodies[1].angular_velocity = {1, -2, 3};
    s.joints.push_back(joint(JointKind::universal, 0, 1, {0.15, 0, 0}, 0.0));
    Started system(s);
    const auto momenta = [&](Vec3& p, Vec3& l) {
        p = l = {};
        for (int i = 0; i < 2; ++i) {
            const Vec3 mv = 2.5 * system.read().state(i).velocity;
            p += mv;
            l += cross(system.read().position_of(i), mv) + system.read().state(i).angular_momentum;
        }
    };
    Vec3 p0, l0, p, l;
    momenta(p0, l0);
    system.advance(1000);
    momenta(p, l);
    EXPECT_NEAR(norm(p - p0), 0.0, 1e-13);
    // Reactions share a point at the frozen positions, and x moves along v: nothing is lost to either.
    EXPECT_NEAR(norm(l - l0), 0.0, 1e-13);
    EXPECT(system.health().status == Status::completed);
}

void a_kinematic_body_drives_what_is_locked_to_it() {
    RigidScene s = scene();
    s.bodies = {box({0, 0, 0}), box({0.3, 0, 0})};
    s.bodies[0].motion = Motion::kinematic;
    s.bodies[0].velocity = {0, 0, 2};
    s.joints.push_back(joint(JointKind::lock, 0, 1, {0.15, 0, 0}, 0.0));
    Started system(s);
    system.advance(300);
    EXPECT_NEAR(system.read().state(1).velocity.z, 2.0, 1e-12);
    EXPECT_NEAR(system.read().position_of(1).z - system.read().position_of(0).z, 0.0, 1e-12);
}

void a_particle_hangs_on_a_distance() {
    RigidScene s = scene();
    RigidBodySpec bob;
    bob.particle = true;
    bob.mass = 3.0;
    bob.position = {0, 0, -1};
    s.bodies = {bob, box({5, 0, 0})};
    JointSpec rod = joint(JointKind::distance, -1, 0, {0, 0, 0}, 1e-9);
    rod.second_point = {0, 0, -1};
    rod.rest_length = 1.0;
    s.joints.push_back(rod);
    Started system(s);
    system.advance(600);
    EXPECT_NEAR(system.read().tension(0), 30.0, 1e-9);
    EXPECT_NEAR(system.read().position_of(0).z, -1.0 - 3e-8, 1e-15);
}

void a_bounded_motor_gives_its_force_and_no_more() {
    RigidScene s = scene();
    s.gravity = {};
    s.bodies = {box({0, 0, 0})};
    s.joints.push_back(joint(JointKind::prismatic, -1, 0, {0, 0, 0}, 0.0));
    s.joints[0].motor.emplace();
    s.joints[0].motor->speed = 1.0;
    s.joints[0].motor->force = 5.0;
    Started system(s);
    system.advance(15);
    EXPECT_NEAR(system.read().state(0).velocity.x, 5.0 / 2.5 * 15 * kStep, 1e-13);
    system.advance(100);
    EXPECT_NEAR(system.read().state(0).velocity.x, 1.0, 1e-13);
}

void a_limit_holds_and_lets_go() {
    RigidScene s = scene();
    s.bodies = {box({0, 0, 0})};
    s.joints.push_back(joint(JointKind::prismatic, -1, 0, {0, 0, 0}, 0.0));
    s.joints[0].axes = {Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, 1, 0}};
    s.joints[0].limit.emplace();
    s.joints[0].limit->lower = -0.5;
    s.joints[0].limit->upper = 0.5;
    s.joints[0].limit->damping = 2.0 * kStep;
    Started system(s);
    system.advance(600);
    EXPECT_NEAR(system.read().coordinate(0), -0.5, 1e-12);
    double wrench[6];
    system.read().wrench(0, wrench);
    EXPECT_NEAR(wrench[2], 25.0, 1e-10);
}

void a_replayed_block_of_steps_is_the_same() {
    Started system(cantilever(5, 1e-6));
    system.advance(50);
    system.save();
    system.advance(64);
    const std::vector<double> once = system.final_state();
    system.restore();
    for (int i = 0; i < 64; ++i) system.advance(1);
    EXPECT(system.final_state() == once);
}

void the_work_grows_with_the_chain_and_no_faster() {
    Started small(cantilever(10, 0.0)), large(cantilever(1000, 0.0));
    RunReport a, b;
    small.advance(1), large.advance(1);
    small.count(a, 1), large.count(b, 1);
    EXPECT(a.counters["block_operations"] == 30);
    EXPECT(b.counters["block_operations"] == 3000);
}

}  // namespace

int main() {
    only_the_listed_stages_run();
    a_compliant_chain_sags_by_the_unit_load_theorem();
    every_joint_of_an_overdetermined_body_carries_its_share();
    contradictory_rows_are_named();
    a_free_pair_keeps_its_momenta();
    a_kinematic_body_drives_what_is_locked_to_it();
    a_particle_hangs_on_a_distance();
    a_bounded_motor_gives_its_force_and_no_more();
    a_limit_holds_and_lets_go();
    a_replayed_block_of_steps_is_the_same();
    the_work_grows_with_the_chain_and_no_faster();
    return report();
}

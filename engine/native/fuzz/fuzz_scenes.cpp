// A small scene from bytes: bodies, joints and surfaces, stepped a little. It ends, with finite numbers or a failure
// that says so, and a second run gives the same bits.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "bytes.hpp"
#include "rigid/rigid_program.hpp"
#include "run/watch.hpp"

namespace {

using namespace fuzz;

constexpr int kSteps = 12;
// A direct solve of shapes that lie deep in each other may take seconds a step, and thirty times as long where every
// access is watched. The engine ends it itself, and is held to that; what went further is not asked.
constexpr double kPatience = 0.5;  // s of a run, so that ten minutes are thousands of scenes
constexpr double kUnlooked =
    0.2;  // s of the processor: a tenth between two questions, and a tenth until one is put

/// How long a run works without asking whether it is to end. Processor time: a busy machine takes nothing from it.
class Looks {
public:
    Looks() {
        interrupted = asked;
        last_ = processor_seconds(), longest_ = 0.0;
    }
    ~Looks() { interrupted = nullptr; }
    double longest() const {
        asked();
        return longest_;
    }

private:
    static bool asked() {
        const double now = processor_seconds();
        longest_ = std::max(longest_, now - std::exchange(last_, now));
        return false;
    }
    static inline double last_ = 0.0, longest_ = 0.0;  // s
};

template <class Run> RunReport held(Run run) {
    const Looks looks;
    RunReport report = run();
    PROMISE(looks.longest() <= kUnlooked);
    return report;
}

RigidBodySpec body(Bytes& bytes, double step) {
    RigidBodySpec spec;
    const int motion = bytes.below(8);
    spec.motion = motion == 0 ? Motion::fixed : motion == 1 ? Motion::kinematic : Motion::dynamic;
    spec.position = bytes.place();
    spec.orientation = bytes.turn();
    if (bytes.flag()) spec.velocity = bytes.place(), spec.angular_velocity = bytes.place();
    if (spec.motion == Motion::fixed) spec.velocity = spec.angular_velocity = {};
    if (spec.motion == Motion::dynamic) {
        const Vec3 size{bytes.size(), bytes.size(), bytes.size()};
        spec.mass = bytes.size();
        spec.inertia = spec.mass / 12.0 *
                       Vec3{size.y * size.y + size.z * size.z, size.x * size.x + size.z * size.z,
                            size.x * size.x + size.y * size.y};
    }
    spec.material.damping = 4.5 * step;
    const int said = bytes.byte();
    if (said & 1) spec.material.friction = 2.0 * bytes.share();
    if (said & 2) spec.material.restitution = bytes.share();
    if ((said & 2) && spec.material.restitution > 0.5)
        spec.material.tangential_restitution = spec.material.restitution;
    if (said & 4) spec.material.compliance = 1e-3 * bytes.share();
    if (said & 8) spec.material.rolling = bytes.share();
    if (said & 16) spec.material.torsional = bytes.share();
    if (said & 32) spec.material.slip_compliance = bytes.share();
    if (said & 64) spec.material.surface_velocity = bytes.place();
    return spec;
}

/// As engine/rigid_program.py packs one; false where a scene would refuse it.
bool joint(Bytes& bytes, RigidScene& scene, double step) {
    const int count = static_cast<int>(scene.bodies.size());
    JointSpec spec;
    spec.kind = static_cast<JointKind>(bytes.below(9));
    spec.second = bytes.below(count);
    spec.first = bytes.below(count + 1) - 1;
    const auto moves = [&](int k) {
        return k >= 0 && scene.bodies[static_cast<std::size_t>(k)].motion == Motion::dynamic;
    };
    if (spec.first == spec.second || (!moves(spec.first) && !moves(spec.second))) return false;
    spec.first_point = spec.second_point = bytes.place();
    spec.axes = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    if (spec.kind == JointKind::distance) {
        spec.second_point = bytes.place();
        spec.rest_length = bytes.flag() ? bytes.size() : norm(spec.first_point - spec.second_point);
        if (!(norm(spec.first_point - spec.second_point) > 0.0) || !(spec.rest_length > 0.0)) return false;
    } else if (spec.kind != JointKind::lock && spec.kind != JointKind::ball) {
        const Vec3 along = bytes.direction(), across = any_normal_to(along);
        spec.axes = {along, across, cross(along, across)};
    }
    spec.compliance.fill(bytes.flag() ? 1e-3 * bytes.share() : 0.0);
    spec.damping.fill(2.0 * step);
    if (bytes.below(8) == 0) spec.strength = 100.0 * bytes.share();
    if (bytes.below(8) == 0) spec.torque_strength = 100.0 * bytes.share();
    if (spec.kind == JointKind::hinge || spec.kind == JointKind::prismatic) {
        const int said = bytes.byte();
        if (said & 1) {
            spec.motor.emplace();
            spec.motor->speed = bytes.number();
            spec.motor->force = said & 2 ? std::numeric_limits<double>::infinity() : 10.0 * bytes.share();
        }
        if (said & 4) {
            const double one = bytes.number(), two = bytes.number();
            spec.limit.emplace();
            spec.limit->lower = std::min(one, two), spec.limit->upper = std::max(one, two);
            spec.limit->damping = 2.0 * step;
            spec.limit->restitution = bytes.share();
        }
        if (said & 8) {
            spec.spring.emplace();
            spec.spring->stiffness = bytes.size();
            spec.spring->rest = bytes.number();
            spec.spring->damping = bytes.share();
            if (said & 16) spec.spring->force = 10.0 * bytes.share();
        }
    }
    scene.joints.push_back(std::move(spec));
    const JointSpec& made = scene.joints.back();
    if (made.first >= 0) scene.no_contact.emplace_back(made.first, made.second);
    return true;
}

RigidMethod method(Bytes& bytes, bool smooth) {
    constexpr double steps[] = {1.0 / 60.0, 1.0 / 240.0, 1e-3, 0.1};
    RigidMethod chosen;
    chosen.time_step = steps[bytes.below(4)];
    chosen.substeps = 1 + bytes.below(2);
    chosen.solver = static_cast<SolverKind>(bytes.below(2));
    chosen.friction = static_cast<FrictionModel>(bytes.below(2));
    chosen.impacts = static_cast<ImpactOrder>(bytes.below(2));
    chosen.iterations = 1 + bytes.below(50);
    chosen.refinements = bytes.below(3);
    if (smooth) {
        chosen.solver = SolverKind::direct;
        chosen.corrections = bytes.below(3);
        chosen.half_step_velocities = bytes.flag();
        if (bytes.flag()) chosen.composition = 2 * (1 + bytes.below(4));
    }
    return chosen;
}

/// What compositions and half steps ask of a scene: see engine/smooth.py.
bool is_smooth(const RigidScene& scene) {
    for (const JointSpec& made : scene.joints)
        if (can_let_go(made) || made.motor || made.limit || made.spring || made.compliance[0] > 1e-7 ||
            (made.kind == JointKind::distance &&
             std::abs(made.rest_length - norm(made.first_point - made.second_point)) >
                 1e-9 * made.rest_length))
            return false;
    return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace fuzz;
    Bytes bytes(data, size);
    RigidScene scene;
    const int shape = bytes.byte();
    scene.contacts = (shape & 3) != 0;
    if (shape & 4) scene.gravity = {0, 0, -10};
    const bool smooth = !scene.contacts && (shape & 8);
    const double step = 1.0 / 60.0;
    const int count = 1 + bytes.below(4);
    for (int k = 0; k < count; ++k) {
        scene.bodies.push_back(body(bytes, step));
        const Primitive made = solid(bytes);
        const Pose part{bytes.below(4) == 0 ? bytes.place() : Vec3{}, Mat3::identity()};
        if (scene.contacts) scene.colliders.push_back({k, made, part});
        if (scene.bodies[static_cast<std::size_t>(k)].motion == Motion::dynamic)
            scene.floaters.push_back({k, made, part});
    }
    const int joints = bytes.below(4);
    for (int k = 0; k < joints; ++k) joint(bytes, scene, step);
    if (shape & 16) {  // a floor
        RigidBodySpec floor;
        floor.motion = Motion::fixed;
        floor.material.friction = bytes.share();
        floor.material.damping = 4.5 * step;
        scene.bodies.push_back(floor);
        if (scene.contacts) scene.colliders.push_back({count, Primitive::plane({0, 0, 1}), {}});
    }
    if ((shape & 32) && scene.contacts)
        if (const auto ground = sheet(bytes)) {
            RigidBodySpec fixed;
            fixed.motion = Motion::fixed;
            fixed.material.damping = 4.5 * step;
            const int at = static_cast<int>(scene.bodies.size());
            scene.bodies.push_back(fixed);
            for (int k = 0; k < 2; ++k) scene.colliders.push_back({at, Primitive::sheet(ground, k), {}});
        }
    if ((shape & 64) && (shape & 4) && !smooth)
        scene.fluids.push_back(
            {10.0 * bytes.size(), bytes.number(), {0, 0, 1}, bytes.place(), bytes.share()});
    else scene.floaters.clear();
    if (shape & 128) {
        SpringForce spring;
        spring.ends[0].body = bytes.below(count);
        spring.ends[0].point = bytes.place();
        spring.ends[1].point = bytes.place();
        spring.stiffness = bytes.size();
        scene.springs.push_back(spring);
    }
    scene.method = method(bytes, smooth && is_smooth(scene));
    if (scene.contacts && (shape & 8)) {  // bodies sleep, soon
        scene.method.sleep_speed = 0.3;
        scene.method.sleep_after = 2.0 * scene.method.time_step;
    }

    RigidProgram program(scene, {{"energy", -1, {}, -1}}, {{0, Reduction::trace, 0, -1, false, 1}});
    const auto run = [&] { return program.run(kSteps, kPatience, false); };
    const RunReport report = held(run);
    if (report.status == Status::timed_out) return 0;
    if (report.status == Status::completed || report.status == Status::unsettled) {
        PROMISE(report.steps == kSteps);
        for (const double value : report.final_state) PROMISE(std::isfinite(value));
        for (const double value : report.recordings.at(0).values) PROMISE(std::isfinite(value));
    } else {
        PROMISE(report.failed_step >= 0 && report.failed_step <= kSteps);
    }
    const RunReport again = held(run);
    if (again.status == Status::timed_out) return 0;  // the machine has become busier
    PROMISE(again.status == report.status && again.state_hash == report.state_hash);
    PROMISE(again.recordings.at(0).values == report.recordings.at(0).values ||
            report.status != Status::completed);

    // Taken step by step and back, as a run one holds.
    const auto half = [&] { return held([&] { return program.advance(kSteps / 2, kPatience); }); };
    program.start({});
    if (half().status == Status::timed_out) return 0;
    const auto here = program.keep();
    RunReport first = half();
    program.read(first, 0.0);
    program.go_back(here);
    RunReport second = half();
    program.read(second, 0.0);
    if (first.status == Status::timed_out || second.status == Status::timed_out) return 0;
    PROMISE(first.status == second.status && first.state_hash == second.state_hash);
    if (report.status == Status::completed) PROMISE(first.state_hash == report.state_hash);
    return 0;
}

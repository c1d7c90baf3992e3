#include "rigid/rigid_program.hpp"

#include <stdexcept>

#include "run/state_hash.hpp"

namespace spook {
namespace {

void put(double* out, Vec3 v) noexcept { out[0] = v.x, out[1] = v.y, out[2] = v.z; }

/// `read(i, out)` for one index, or for all `count` of them in turn.
template <class Read> Sampler one_or_all(int index, int count, int width, Read read) {
    if (index >= 0) return {width, [=](double* out) { read(index, out); }};
    return {width * count, [=](double* out) {
                for (int i = 0; i < count; ++i) read(i, out + i * width);
            }};
}

std::vector<int> distances(const RigidSystem& system) {
    std::vector<int> found;
    for (int joint = 0; joint < system.joints().count(); ++joint)
        if (system.joints().is_distance(joint)) found.push_back(joint);
    return found;
}

Sampler joint_sampler(const RigidSystem* s, const QuantityRequest& request) {
    const bool force = request.kind == "constraint_force";
    const int joint = request.index;
    const auto read_distance = [s, force](int distance, double* out) {
        if (force) *out = s->tension(distance);
        else s->violation(distance, out);
    };
    if (joint < 0) {
        const std::vector<int> all = distances(*s);
        return {static_cast<int>(all.size()), [=](double* out) {
                    for (int distance : all) read_distance(distance, out++);
                }};
    }
    if (s->joints().is_distance(joint)) return {1, [=](double* out) { read_distance(joint, out); }};
    if (force) return {6, [=](double* out) { s->wrench(joint, out); }};
    return {s->joints().rows(joint), [=](double* out) { s->violation(joint, out); }};
}

Sampler momentum_sampler(const RigidSystem* s, bool angular, Vec3 about) {
    return {3, [=](double* out) {
                Vec3 sum;
                for (int i = 0; i < s->bodies(); ++i) {
                    if (!s->constants(i).moves()) continue;
                    const Vec3 p = s->constants(i).mass * s->state(i).velocity;
                    sum += angular ? cross(s->position_of(i) - about, p) + s->state(i).angular_momentum : p;
                }
                put(out, sum);
            }};
}

Sampler sampler_of(RigidSystem& system, const QuantityRequest& request) {
    const RigidSystem* s = &system;
    const std::string& kind = request.kind;
    if (kind != "position" && kind != "orientation" && kind != "violation" && kind != "joint_coordinate" &&
        kind != "potential_energy")
        system.see_velocities();
    const int index = request.index, count = system.bodies();
    if (kind == "position")
        return one_or_all(index, count, 3, [s](int i, double* out) { put(out, s->position_of(i)); });
    if (kind == "velocity")
        return one_or_all(index, count, 3, [s](int i, double* out) { put(out, s->state(i).velocity); });
    if (kind == "angular_velocity")
        return one_or_all(index, count, 3,
                          [s](int i, double* out) { put(out, s->state(i).angular_velocity); });
    if (kind == "orientation")
        return one_or_all(index, count, 4, [s](int i, double* out) {
            const Quat q = s->orientation_of(i);
            out[0] = q.w, out[1] = q.x, out[2] = q.y, out[3] = q.z;
        });
    if (kind == "kinetic_energy") return {1, [s](double* out) { *out = s->kinetic_energy(); }};
    if (kind == "potential_energy") return {1, [s](double* out) { *out = s->potential_energy(); }};
    if (kind == "energy")
        return {1, [s](double* out) { *out = s->kinetic_energy() + s->potential_energy(); }};
    if (kind == "momentum" || kind == "angular_momentum")
        return momentum_sampler(s, kind == "angular_momentum", request.point);
    if (kind == "violation" || kind == "constraint_force") return joint_sampler(s, request);
    if (kind == "joint_coordinate") {
        system.joints().track(index);
        return {1, [s, index](double* out) { *out = s->coordinate(index); }};
    }
    if (kind == "contact_force") {
        const int other = static_cast<int>(request.point.x);
        return {3, [s, index, other](double* out) { put(out, s->contact_force(index, other)); }};
    }
    if (kind == "contact_count") return {1, [s](double* out) { *out = s->contact_count(); }};
    if (kind == "penetration") return {1, [s](double* out) { *out = s->penetration(); }};
    throw std::invalid_argument("rigid bodies have no quantity " + kind);
}

std::vector<Sampler> samplers_of(RigidSystem& system, const std::vector<QuantityRequest>& quantities) {
    std::vector<Sampler> samplers;
    for (const QuantityRequest& request : quantities) samplers.push_back(sampler_of(system, request));
    return samplers;
}

}  // namespace

RigidProgram::RigidProgram(const RigidScene& scene, const std::vector<QuantityRequest>& quantities,
                           std::vector<Observation> observations)
    : system_(scene), recorder_(samplers_of(system_, quantities), std::move(observations)) {}

RunReport RigidProgram::run(std::int64_t steps, double time_limit, bool timed) {
    RunReport report;
    StageClock clock;
    system_.reset(timed ? &clock : nullptr);
    recorder_.prepare(steps);
    run_loop(system_, recorder_, steps, time_limit, report);
    system_.count(report, report.steps);
    report.final_state = system_.final_state();
    report.state_hash = state_hash(report.final_state);
    if (timed)
        for (std::size_t stage = 0; stage < STAGE_NAMES.size(); ++stage)
            if (clock.seconds(static_cast<Stage>(stage)) > 0.0)
                report.stage_seconds[STAGE_NAMES[stage]] = clock.seconds(static_cast<Stage>(stage));
    return report;
}

const char* RigidProgram::solver() const noexcept {
    switch (system_.solver()) {
        case RigidSolver::block: return "block";
        case RigidSolver::pivot: return "pivot";
        case RigidSolver::iterative: return "iterative";
        default: return "none";
    }
}

}  // namespace spook

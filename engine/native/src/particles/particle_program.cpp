#include "particles/particle_program.hpp"

#include <stdexcept>

#include "run/state_hash.hpp"

namespace spook {

namespace {

void put(double* out, Vec3 v) noexcept {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

/// `read(i, out)` for one index, or for all `count` of them in turn.
template <class Read> Sampler one_or_all(int index, int count, int width, Read read) {
    if (index >= 0) return {width, [=](double* out) { read(index, out); }};
    return {width * count, [=](double* out) {
                for (int i = 0; i < count; ++i) read(i, out + i * width);
            }};
}

}  // namespace

Sampler particle_sampler(const ParticleSystem& system, const QuantityRequest& request) {
    const ParticleSystem* s = &system;
    const std::string& kind = request.kind;
    const int index = request.index, bodies = system.bodies(), rows = system.rows();
    const Vec3 about = request.point;
    if (kind == "position")
        return one_or_all(index, bodies, 3, [s](int body, double* out) { put(out, s->position(body)); });
    if (kind == "velocity")
        return one_or_all(index, bodies, 3, [s](int body, double* out) { put(out, s->velocity(body)); });
    if (kind == "orientation")
        return one_or_all(index, bodies, 4, [](int, double* out) {
            put(out + 1, {});
            out[0] = 1.0;
        });
    if (kind == "angular_velocity" || kind == "contact_force")
        return one_or_all(index, kind == "contact_force" ? 1 : bodies, 3,
                          [](int, double* out) { put(out, {}); });
    if (kind == "contact_count" || kind == "penetration") return {1, [](double* out) { *out = 0.0; }};
    if (kind == "violation")
        return one_or_all(index, rows, 1, [s](int row, double* out) { *out = s->violation(row); });
    if (kind == "constraint_force")
        return one_or_all(index, rows, 1, [s](int row, double* out) { *out = s->tension(row); });
    if (kind == "kinetic_energy") return {1, [s](double* out) { *out = s->kinetic_energy(); }};
    if (kind == "potential_energy") return {1, [s](double* out) { *out = s->potential_energy(); }};
    if (kind == "energy")
        return {1, [s](double* out) { *out = s->kinetic_energy() + s->potential_energy(); }};
    if (kind == "momentum")
        return {3, [s](double* out) {
                    Vec3 sum;
                    for (int body = 0; body < s->bodies(); ++body) sum += s->mass(body) * s->velocity(body);
                    put(out, sum);
                }};
    if (kind == "angular_momentum")
        return {3, [s, about](double* out) {
                    Vec3 sum;
                    for (int body = 0; body < s->bodies(); ++body)
                        sum += s->mass(body) * cross(s->position(body) - about, s->velocity(body));
                    put(out, sum);
                }};
    throw std::invalid_argument("particles have no quantity " + kind);
}

namespace {

std::vector<Sampler> samplers_of(const ParticleSystem& system,
                                 const std::vector<QuantityRequest>& quantities) {
    std::vector<Sampler> samplers;
    for (const QuantityRequest& request : quantities) samplers.push_back(particle_sampler(system, request));
    return samplers;
}

}  // namespace

ParticleProgram::ParticleProgram(const ParticleScene& scene, const std::vector<QuantityRequest>& quantities,
                                 std::vector<Observation> observations)
    : system_(scene), recorder_(samplers_of(system_, quantities), std::move(observations)) {}

RunReport ParticleProgram::run(std::int64_t steps, double time_limit, bool timed) {
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

const char* ParticleProgram::solver() const noexcept {
    switch (system_.solver()) {
        case ParticleSolver::path: return "path";
        case ParticleSolver::block: return "block";
        case ParticleSolver::iterative: return "iterative";
        default: return "none";
    }
}

}  // namespace spook

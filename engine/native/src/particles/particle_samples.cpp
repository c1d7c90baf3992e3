// What a run asks of the state between steps: samples, health, going back, and the report.
#include "particles/particle_system.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "run/energy_made.hpp"

namespace spook {

void ParticleSystem::observe(Recorder& recorder, std::int64_t sample) {
    if (clock_) clock_->start();
    for (std::size_t k = 0; k < rows_.link.size(); ++k)
        seen_.lambda[k] = sample > 0 ? rows_.link[k].lambda : 0.0;
    seen_.v = nodes_.v;
    if (composition_) {
        if (sample > 0) read_composition();
    } else if (half_step_) {
        look_ahead();
        if (sample == 0)
            for (int body = 0; body < readings_.bodies(); ++body)
                seen_.v[nodes_.of_body[body]] = scene_.bodies[body].velocity;
    }
    recorder.sample(sample);
    if (clock_) clock_->mark(Stage::observe);
}

/// Velocities at mid-step are seen in the mean with those of the coming step.
void ParticleSystem::look_ahead() {
    seen_.v = nodes_.v;
    if (clock_) velocity_stage<true>();
    else velocity_stage<false>();
    velocity_ready_ = true;
    for (std::size_t node = 0; node < nodes_.v.size(); ++node)
        seen_.v[node] = 0.5 * (seen_.v[node] + nodes_.v[node]);
}

/// Rows that cannot be told apart may leave the velocities at the sample no numbers, where the steps go on.
void ParticleSystem::read_composition() {
    composition_->read(seen_);
    for (int body = readings_.bodies() - 1; body >= 0; --body)
        if (!finite(seen_.v[nodes_.of_body[body]])) unread_ = body;
}

Health ParticleSystem::health() const noexcept {
    if (unread_ >= 0) return {Status::not_finite, unread_};
    if (parts_.saddle.contradicted() >= 0)
        return {Status::diverged, parts_.saddle.contradicted(),
                "is held by rows that contradict each other; give one of them a compliance"};
    Health health;
    for (int body = 0; body < readings_.bodies(); ++body) {
        const Vec3 x = nodes_.x[nodes_.of_body[body]], v = nodes_.v[nodes_.of_body[body]];
        if (!finite(x) || !finite(v)) return {Status::not_finite, body};
        const double largest = std::max(
            {std::fabs(x.x), std::fabs(x.y), std::fabs(x.z), std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
        if (largest > RUNAWAY && health.status == Status::completed) health = {Status::diverged, body};
    }
    return health;
}

void ParticleSystem::keep(Memory& memory) const {
    memory.x = nodes_.x;
    memory.v = nodes_.v;
    memory.lambda.resize(rows_.size());
    for (std::size_t k = 0; k < rows_.size(); ++k) memory.lambda[k] = rows_.link[k].lambda;
    memory.velocity_ready = velocity_ready_;
    memory.pgs = parts_.pgs.work;
    memory.redundancy = parts_.saddle.memory();
    if (composition_) memory.composition = composition_->state();
}

void ParticleSystem::go_back(const Memory& memory) {
    nodes_.x = memory.x;
    nodes_.v = memory.v;
    for (std::size_t k = 0; k < rows_.size(); ++k) rows_.link[k].lambda = memory.lambda[k];
    velocity_ready_ = memory.velocity_ready;
    parts_.pgs.work = memory.pgs;
    parts_.saddle.restore(memory.redundancy);
    if (composition_) composition_->go_back(memory.composition);
    unread_ = -1;
}

void ParticleSystem::place(std::span<const double> state) {
    for (std::size_t body = 0; body < scene_.bodies.size(); ++body) {
        const double* s = state.data() + 13 * body;
        scene_.bodies[body].position = {s[0], s[1], s[2]};
        scene_.bodies[body].velocity = {s[7], s[8], s[9]};
    }
}

void ParticleSystem::set_load(int body, Vec3 force) {
    if (!stages_.runs(Stage::apply_loads)) throw std::invalid_argument("loads need the stage apply_loads");
    if (composition_) composition_->catch_up();
    const int node = nodes_.of_body[body];
    const Vec3 gravity = stages_.runs(Stage::apply_gravity) ? scene_.gravity : Vec3{};
    nodes_.steady_kick[node] = parts_.h * (gravity + nodes_.w[node] * force);
    if (!parts_.forces.any()) nodes_.kick = nodes_.steady_kick;
}

void ParticleSystem::count(RunReport& report, std::int64_t steps) const {
    const std::int64_t inner = steps * scene_.method.substeps;
    const auto rows = static_cast<std::int64_t>(rows_.row.size());
    const std::int64_t passes = 1 + corrections_;
    report.counters["steps"] = steps;
    report.counters["substeps"] = inner;
    report.counters["force_evaluations"] =
        inner * static_cast<std::int64_t>(parts_.forces.springs() +
                                          parts_.forces.fields().size() * scene_.bodies.size());
    report.counters["rows_assembled"] = inner * rows;
    report.counters["contacts"] = 0;
    report.counters["sweeps"] = parts_.pgs.work.pgs_iterations;
    report.counters["back_substitutions"] =
        parts_.solver == ParticleSolver::path || parts_.solver == ParticleSolver::block ? inner * passes : 0;
    std::int64_t blocks = 0;
    if (parts_.solver == ParticleSolver::path)
        blocks = 2 * rows - static_cast<std::int64_t>(parts_.paths.first().size()) + 1;
    report.counters["block_operations"] = inner * blocks;
    if (parts_.solver == ParticleSolver::block)
        report.counters["block_operations"] = parts_.saddle.operations();
    if (composition_) {
        const std::int64_t stages = composition_->stages();
        report.counters["composition_stages"] = inner * stages;
        report.counters["halved_steps"] = composition_->halved_steps();
        report.counters["newton_iterations"] = composition_->newton_iterations();
        report.counters["force_evaluations"] *= stages;
        report.counters["rows_assembled"] *= stages;
        report.counters["back_substitutions"] = rows > 0 ? composition_->newton_iterations() : 0;
        report.counters["block_operations"] = composition_->newton_iterations() * blocks;
    }
    report.residual = parts_.pgs.work.residual;
}

/// What the judge at the end of a run is to know, at places x between two blocks of steps.
void ParticleSystem::note() {
    if (!noted_.asked) return;
    if (composition_) {
        double kinetic = 0.0;
        for (int body = 0; body < readings_.bodies(); ++body) {
            const Vec3 v = nodes_.v[nodes_.of_body[body]];
            kinetic += 0.5 * readings_.mass(body) * dot(v, v);
        }
        noted_.most_kinetic = std::max(noted_.most_kinetic, kinetic);
    }
    for (int k = 0; k < readings_.rows(); ++k) {
        const DistanceRow& row = scene_.rows[k];
        const double open = readings_.violation(k), load = rows_.link[rows_.slot[k]].lambda / parts_.h;
        if (row.compliance > rigid_compliance || !(open > noted_.open * row.rest_length)) continue;
        noted_.open = open / row.rest_length, noted_.row = k;
        noted_.gives_way = 2.0 * row.compliance * std::fabs(load) > open;
    }
}

/// Asked once the final state was read: what moves with energy out of nothing, or was found off rows that are rigid. With
/// string_stiffness tension lets nothing fall, and neither is asked.
void ParticleSystem::judge_end(RunReport& report) {
    if (!noted_.asked || report.status != Status::completed) return;
    note();
    const char* cure =
        composition_ ? taut_cure
        : scene_.method.iterative
            ? "light bodies carry more tension than they can take in a step, T h²/(m l) above 0.3: "
              "take smaller steps"
            : "light bodies carry more tension than they can take in a step, T h²/(m l) above 0.3: "
              "use string_stiffness=True, or smaller steps";
    if (noted_.open > 1.0) {
        const DistanceRow& row = scene_.rows[noted_.row];
        char said[300];
        std::snprintf(said, sizeof said, "was found %.3g m off a distance of %.3g m; %s",
                      noted_.open * row.rest_length, row.rest_length,
                      noted_.gives_way ? "give it less compliance" : cure);
        return report.leave_unsettled(std::max(row.ends[0].body, row.ends[1].body), said);
    }
    // In single steps the energy of a stiff row comes and goes by (h ω/2)² of itself, and none is lost.
    if (!composition_ || noted_.is_powered) return;
    const double reached = readings_.kinetic_energy() + readings_.potential_energy();
    const auto lightest = std::ranges::min_element(scene_.bodies, {}, &ParticleBody::mass);
    judge_energy({noted_.begun, reached, noted_.most_kinetic},
                 static_cast<int>(lightest - scene_.bodies.begin()), cure, report);
}

std::vector<double> ParticleSystem::places() const {
    constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> state;
    for (int body = 0; body < readings_.bodies(); ++body) {
        const Vec3 x = readings_.position(body);
        state.insert(state.end(),
                     {x.x, x.y, x.z, 1.0, 0.0, 0.0, 0.0, UNKNOWN, UNKNOWN, UNKNOWN, 0.0, 0.0, 0.0});
    }
    return state;
}

std::vector<double> ParticleSystem::final_state() {
    std::vector<double> state;
    if (composition_) composition_->read(seen_);
    else if (half_step_ && !velocity_ready_) look_ahead();
    else if (!half_step_) seen_.v = nodes_.v;
    for (int body = 0; body < readings_.bodies(); ++body) {
        const Vec3 x = readings_.position(body), v = readings_.velocity(body);
        state.insert(state.end(), {x.x, x.y, x.z, 1.0, 0.0, 0.0, 0.0, v.x, v.y, v.z, 0.0, 0.0, 0.0});
    }
    return state;
}

double ParticleReadings::violation(int row) const noexcept {
    const Row& r = parts_.rows.row[parts_.rows.slot[row]];
    return norm(parts_.nodes.x[r.b] - parts_.nodes.x[r.a]) - r.rest;
}

double ParticleReadings::kinetic_energy() const noexcept {
    double energy = 0.0;
    for (int body = 0; body < bodies(); ++body)
        energy += 0.5 * mass(body) * dot(velocity(body), velocity(body));
    return energy;
}

double ParticleReadings::potential_energy() const noexcept {
    double energy = 0.0;
    for (int body = 0; body < bodies(); ++body) {
        energy -= mass(body) * dot(scene_.gravity, position(body));
        for (const CentralField& field : parts_.forces.fields())
            energy -= mass(body) * field.strength / norm(position(body) - field.centre);
    }
    return parts_.forces.spring_energy(parts_.nodes, energy);
}

}  // namespace spook

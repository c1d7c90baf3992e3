// What a run asks of the state between steps: samples, health, going back, and the report.
#include "particles/particle_system.hpp"

#include <algorithm>
#include <cmath>

#include "run/composition.hpp"

namespace spook {

void ParticleSystem::observe(Recorder& recorder, std::int64_t sample) {
    if (clock_) clock_->start();
    for (std::size_t k = 0; k < link_.size(); ++k) seen_lambda_[k] = sample > 0 ? link_[k].lambda : 0.0;
    seen_v_ = v_;
    if (composed_) {
        if (sample > 0) read_composition();
    } else if (half_step_) {
        velocity_stage<false>();
        velocity_ready_ = true;
        for (std::size_t node = 0; node < v_.size(); ++node) seen_v_[node] = 0.5 * (seen_v_[node] + v_[node]);
        if (sample == 0)
            for (int body = 0; body < bodies(); ++body)
                seen_v_[node_of_body_[body]] = scene_.bodies[body].velocity;
    }
    recorder.sample(sample);
    if (clock_) clock_->mark(Stage::observe);
}

Health ParticleSystem::health() const noexcept {
    if (contradicted_ >= 0)
        return {Status::diverged, contradicted_,
                "is held by rows that contradict each other; give one of them a compliance"};
    Health health;
    for (int body = 0; body < bodies(); ++body) {
        const Vec3 x = x_[node_of_body_[body]], v = v_[node_of_body_[body]];
        if (!finite(x) || !finite(v)) return {Status::not_finite, body};
        const double largest = std::max(
            {std::fabs(x.x), std::fabs(x.y), std::fabs(x.z), std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
        if (largest > RUNAWAY && health.status == Status::completed) health = {Status::diverged, body};
    }
    return health;
}

void ParticleSystem::save() {
    saved_.x = x_;
    saved_.v = v_;
    saved_.lambda.resize(link_.size());
    for (std::size_t k = 0; k < link_.size(); ++k) saved_.lambda[k] = link_[k].lambda;
    saved_.velocity_ready = velocity_ready_;
    saved_.sweeps = sweeps_;
    saved_.pending = pending_;
    saved_.stage_steps = stage_steps_;
    saved_.newton_iterations = newton_iterations_;
    saved_.halved_steps = halved_steps_;
    saved_.history = history_;
    saved_.residual = residual_;
    saved_.share = redundant_.share();
}

void ParticleSystem::restore() {
    x_ = saved_.x;
    v_ = saved_.v;
    for (std::size_t k = 0; k < link_.size(); ++k) link_[k].lambda = saved_.lambda[k];
    velocity_ready_ = saved_.velocity_ready;
    sweeps_ = saved_.sweeps;
    pending_ = saved_.pending;
    stage_steps_ = saved_.stage_steps;
    newton_iterations_ = saved_.newton_iterations;
    halved_steps_ = saved_.halved_steps;
    lost_ = false;
    history_ = saved_.history;
    residual_ = saved_.residual;
    contradicted_ = -1;
    redundant_.restore(ldlt_, saved_.share);
}

void ParticleSystem::count(RunReport& report, std::int64_t steps) const {
    const std::int64_t inner = steps * scene_.method.substeps;
    const auto rows = static_cast<std::int64_t>(row_.size());
    const std::int64_t passes = 1 + corrections_;
    report.counters["steps"] = steps;
    report.counters["substeps"] = inner;
    report.counters["force_evaluations"] =
        inner * static_cast<std::int64_t>(springs_.size() + fields_.size() * scene_.bodies.size());
    report.counters["rows_assembled"] = inner * rows;
    report.counters["contacts"] = 0;
    report.counters["sweeps"] = sweeps_;
    report.counters["back_substitutions"] =
        solver_ == ParticleSolver::path || solver_ == ParticleSolver::block ? inner * passes : 0;
    std::int64_t blocks = 0;
    if (solver_ == ParticleSolver::path)
        blocks = 2 * rows - static_cast<std::int64_t>(path_first_.size()) + 1;
    report.counters["block_operations"] = inner * blocks;
    if (solver_ == ParticleSolver::block)
        report.counters["block_operations"] =
            static_cast<std::int64_t>(ldlt_.counters().block_operations) - operations_at_start_;
    if (composed_) {
        const auto stages = static_cast<std::int64_t>(composition_stages(scene_.method.composition).size());
        report.counters["composition_stages"] = inner * stages;
        report.counters["halved_steps"] = halved_steps_;
        report.counters["newton_iterations"] = newton_iterations_;
        report.counters["force_evaluations"] *= stages;
        report.counters["rows_assembled"] *= stages;
        report.counters["back_substitutions"] = rows > 0 ? newton_iterations_ : 0;
        report.counters["block_operations"] = newton_iterations_ * blocks;
    }
    report.residual = residual_;
}

std::vector<double> ParticleSystem::final_state() {
    std::vector<double> state;
    std::vector<Vec3> reported = v_;
    if (composed_) {
        read_composition();
        reported = seen_v_;
    } else if (half_step_) {
        if (velocity_ready_) reported = seen_v_;
        else {
            velocity_stage<false>();
            for (std::size_t node = 0; node < v_.size(); ++node)
                reported[node] = 0.5 * (reported[node] + v_[node]);
        }
    }
    for (int body = 0; body < bodies(); ++body) {
        const Vec3 x = position(body), v = reported[node_of_body_[body]];
        state.insert(state.end(), {x.x, x.y, x.z, 1.0, 0.0, 0.0, 0.0, v.x, v.y, v.z, 0.0, 0.0, 0.0});
    }
    return state;
}

double ParticleSystem::violation(int row) const noexcept {
    const Row& r = row_[slot_of_row_[row]];
    return norm(x_[r.b] - x_[r.a]) - r.rest;
}

double ParticleSystem::kinetic_energy() const noexcept {
    double energy = 0.0;
    for (int body = 0; body < bodies(); ++body)
        energy += 0.5 * mass(body) * dot(velocity(body), velocity(body));
    return energy;
}

double ParticleSystem::potential_energy() const noexcept {
    double energy = 0.0;
    for (int body = 0; body < bodies(); ++body) {
        energy -= mass(body) * dot(scene_.gravity, position(body));
        for (const CentralField& field : fields_)
            energy -= mass(body) * field.strength / norm(position(body) - field.centre);
    }
    for (const SpringNodes& s : springs_) energy += spook::energy(s.spring, x_[s.b] - x_[s.a]);
    return energy;
}

}  // namespace spook

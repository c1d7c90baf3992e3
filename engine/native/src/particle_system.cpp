#include "particle_system.hpp"

#include <algorithm>
#include <cmath>

#include "composition.hpp"
#include "path_order.hpp"

namespace spook {

ParticleSystem::ParticleSystem(const ParticleScene& scene)
    : scene_(scene), h_(scene.method.time_step / scene.method.substeps) {
    const std::vector<Path> paths = find_paths(scene);
    if (!scene.rows.empty()) {
        solver_ = paths.empty() || scene.method.force_block || scene.method.string_stiffness
                      ? ParticleSolver::block : ParticleSolver::path;
        if (scene.method.iterative) solver_ = ParticleSolver::iterative;
    }
    node_of_body_.assign(scene.bodies.size(), -1);
    slot_of_row_.assign(scene.rows.size(), 0);
    if (solver_ == ParticleSolver::path) lay_out_paths(paths);
    else lay_out_plain();
    for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
        if (node_of_body_[body] >= 0) continue;
        node_of_body_[body] = static_cast<int>(x_.size());
        anchor(scene.bodies[body].position);
    }
    for (const SpringForce& spring : scene.springs) {
        int node[2];
        for (int side = 0; side < 2; ++side) {
            const End& end = spring.ends[side];
            node[side] = end.body >= 0 ? node_of_body_[end.body] : anchor(end.point);
        }
        springs_.push_back({node[0], node[1], spring});
    }
    body_of_node_.assign(x_.size(), -1);
    for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
        const int node = node_of_body_[body];
        body_of_node_[node] = static_cast<int>(body);
        w_[node] = 1.0 / scene.bodies[body].mass;
        steady_kick_[node] = h_ * (scene.gravity + w_[node] * scene.bodies[body].load);
    }
    for (Row& row : row_) {
        row.stiff = w_[row.a] + w_[row.b];
        row.diagonal = row.stiff + row.softness;
    }
    composed_ = scene.method.composition > 2;
    if (composed_) {
        history_.resize(3 * row_.size() * composition_stages(scene.method.composition).size());
        for (int depth = 0; depth < MOST_HALVINGS; ++depth) {
            step_x_[depth].reserve(x_.size());
            step_v_[depth].reserve(x_.size());
        }
    }
    moving_forces_ = !scene.fields.empty() || !springs_.empty();
    v_.resize(x_.size());
    kick_ = steady_kick_;
    trial_.resize(x_.size());
    seen_v_.resize(x_.size());
    link_.resize(row_.size());
    seen_lambda_.resize(row_.size());
    first_rhs_.resize(row_.size());
    if (solver_ == ParticleSolver::block) analyse_blocks();
    block_ = std::clamp<std::int64_t>(65536 / static_cast<std::int64_t>(x_.size() * scene.method.substeps), 1, 4096);
}

int ParticleSystem::anchor(Vec3 point) {
    x_.push_back(point);
    w_.push_back(0.0);
    steady_kick_.push_back({});
    return static_cast<int>(x_.size()) - 1;
}

void ParticleSystem::lay_out_paths(const std::vector<Path>& paths) {
    for (const Path& path : paths) {
        path_first_.push_back(static_cast<int>(row_.size()));
        for (int node : path.nodes) {
            const int end = -1 - node;
            if (node >= 0) node_of_body_[node] = anchor(scene_.bodies[node].position);
            else anchor(scene_.rows[end / 2].ends[end % 2].point);
        }
        const int first = static_cast<int>(x_.size() - path.nodes.size());
        for (std::size_t k = 0; k < path.rows.size(); ++k) {
            const DistanceRow& row = scene_.rows[path.rows[k]];
            const Regularisation r = regularise(row.compliance, row.damping, h_);
            slot_of_row_[path.rows[k]] = static_cast<int>(row_.size());
            const int a = first + static_cast<int>(k);
            row_.push_back({a, a + 1, row.rest_length, 0.0, 0.0, r.violation_gain, r.velocity_gain,
                            r.relaxation, r.softness, 1.0 / (row.rest_length * row.rest_length)});
        }
    }
    path_first_.push_back(static_cast<int>(row_.size()));
}

void ParticleSystem::lay_out_plain() {
    for (std::size_t body = 0; body < scene_.bodies.size(); ++body)
        node_of_body_[body] = anchor(scene_.bodies[body].position);
    for (std::size_t k = 0; k < scene_.rows.size(); ++k) {
        const DistanceRow& row = scene_.rows[k];
        const Regularisation r = regularise(row.compliance, row.damping, h_);
        int node[2];
        for (int side = 0; side < 2; ++side) {
            const End& end = row.ends[side];
            node[side] = end.body >= 0 ? node_of_body_[end.body] : anchor(end.point);
        }
        slot_of_row_[k] = static_cast<int>(k);
        row_.push_back({node[0], node[1], row.rest_length, 0.0, 0.0, r.violation_gain, r.velocity_gain,
                        r.relaxation, r.softness, 1.0 / (row.rest_length * row.rest_length)});
    }
}

void ParticleSystem::reset(StageClock* clock) {
    clock_ = clock;
    velocity_ready_ = false;
    sweeps_ = 0;
    newton_iterations_ = 0;
    residual_ = 0.0;
    operations_at_start_ = static_cast<std::int64_t>(ldlt_.counters().block_operations);
    for (int body = 0; body < bodies(); ++body) {
        x_[node_of_body_[body]] = scene_.bodies[body].position;
        v_[node_of_body_[body]] = scene_.bodies[body].velocity;
    }
    for (Link& link : link_) link = {};
    std::fill(seen_lambda_.begin(), seen_lambda_.end(), 0.0);
    seen_v_ = v_;
    if (composed_) start_composition();
    else if (scene_.method.half_step_velocities) half_kick_back();
    save();
}

// --- the step -----------------------------------------------------------------------------------------

void ParticleSystem::advance(std::int64_t steps) {
    steps *= scene_.method.substeps;
    if (composed_) return compose(steps);
    if (clock_) return advance_by<true>(steps);
    if (velocity_ready_ && steps > 0) {
        position_stage();
        velocity_ready_ = false;
        --steps;
    }
    if (solver_ == ParticleSolver::none && springs_.empty() && scene_.fields.size() <= 1) fly(steps);
    else if (solver_ == ParticleSolver::path && !moving_forces_) swing(steps);
    else advance_by<false>(steps);
}

template <bool Timed>
void ParticleSystem::advance_by(std::int64_t steps) {
    if constexpr (Timed) clock_->start();
    for (; steps > 0; --steps) {
        if (!velocity_ready_) velocity_stage<Timed>();
        velocity_ready_ = false;
        position_stage();
        mark<Timed>(Stage::integrate_positions);
    }
}

template <bool Timed>
void ParticleSystem::velocity_stage() {
    if (moving_forces_) {
        kick_ = steady_kick_;
        mark<Timed>(Stage::apply_gravity);
        if (!scene_.fields.empty()) {
            apply_central_gravity();
            mark<Timed>(Stage::apply_central_gravity);
        }
        if (!springs_.empty()) {
            apply_springs();
            mark<Timed>(Stage::apply_springs);
        }
    }
    if (solver_ == ParticleSolver::none) {
        for (std::size_t node = 0; node < v_.size(); ++node) v_[node] += kick_[node];
        mark<Timed>(Stage::apply_gravity);
        return;
    }
    assemble_rows();
    if (scene_.method.corrections > 0) bend_rows_back();
    mark<Timed>(Stage::assemble_rows);
    solve_rows();
    mark<Timed>(solver_ == ParticleSolver::path    ? Stage::solve_path
                : solver_ == ParticleSolver::block ? Stage::solve_block
                                                   : Stage::solve_iterative);
    if (scene_.method.corrections > 0) {
        correct_curvature();
        mark<Timed>(Stage::correct_curvature);
    }
    kick_nodes(v_);
    mark<Timed>(Stage::apply_gravity);
}

void ParticleSystem::position_stage() noexcept {
    for (std::size_t node = 0; node < x_.size(); ++node) x_[node] += h_ * v_[node];
}

void ParticleSystem::apply_central_gravity() noexcept {
    for (const CentralField& field : scene_.fields)
        for (std::size_t node = 0; node < x_.size(); ++node) {
            if (w_[node] == 0.0) continue;
            const Vec3 d = x_[node] - field.centre;
            const double r2 = dot(d, d), r = std::sqrt(r2);
            kick_[node] = kick_[node] - (h_ * field.strength / (r2 * r)) * d;
        }
}

void ParticleSystem::apply_springs() noexcept {
    for (const SpringNodes& s : springs_) {
        const Vec3 d = x_[s.b] - x_[s.a];
        Vec3 pull = s.spring.stiffness * d;  // on a, towards b
        if (s.spring.rest_length > 0.0 || s.spring.viscosity > 0.0) {
            const double length = norm(d);
            const Vec3 u = length > 0.0 ? (1.0 / length) * d : Vec3{};
            const double rate = s.spring.viscosity * dot(u, v_[s.b] - v_[s.a]);
            pull += (rate - s.spring.stiffness * s.spring.rest_length) * u;
        }
        kick_[s.a] += (h_ * w_[s.a]) * pull;
        kick_[s.b] -= (h_ * w_[s.b]) * pull;
    }
}

void ParticleSystem::assemble_rows() noexcept {
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Row& row = row_[k];
        Link& link = link_[k];
        const Vec3 d = x_[row.b] - x_[row.a];
        const double length = norm(d);
        const Vec3 u = (1.0 / length) * d;
        link.u = u;
        link.length = length;
        link.g = length - row.rest;
        link.rhs = -row.violation_gain * link.g - row.velocity_gain * dot(u, v_[row.b] - v_[row.a]) -
                   dot(u, kick_[row.b] - kick_[row.a]);
    }
}

void ParticleSystem::solve_rows() {
    if (solver_ == ParticleSolver::iterative) return solve_iterative();
    if (solver_ == ParticleSolver::path) {
        factor_paths();
        substitute_paths();
    } else {
        factor_blocks();
        substitute_blocks();
    }
}

void ParticleSystem::solve_rows_again() {
    if (solver_ == ParticleSolver::iterative) solve_iterative();
    else if (solver_ == ParticleSolver::path) substitute_paths();
    else substitute_blocks();
}

/// Projected Gauss–Seidel on the Schur form, warm started with the last step's impulses.
void ParticleSystem::solve_iterative() noexcept {
    std::fill(trial_.begin(), trial_.end(), Vec3{});  // M⁻¹ Gᵀ λ
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Vec3 impulse = link_[k].lambda * link_[k].u;
        trial_[row_[k].a] -= w_[row_[k].a] * impulse;
        trial_[row_[k].b] += w_[row_[k].b] * impulse;
    }
    for (int sweep = 0; sweep < scene_.method.iterations; ++sweep) {
        double worst = 0.0;
        ++sweeps_;
        for (std::size_t k = 0; k < row_.size(); ++k) {
            const Row& row = row_[k];
            Link& link = link_[k];
            const double residual = link.rhs - dot(link.u, trial_[row.b] - trial_[row.a]) - row.softness * link.lambda;
            worst = std::max(worst, std::fabs(residual));
            const double change = residual / row.diagonal;
            link.lambda += change;
            trial_[row.a] -= (w_[row.a] * change) * link.u;
            trial_[row.b] += (w_[row.b] * change) * link.u;
        }
        residual_ = worst;
        if (worst <= scene_.method.residual_tolerance) break;
    }
}

/// Keep the curvature of |d| in the right side: rhs −= (4/h) Ups [(c₊ + c₋)/4 + θ c₊]. c₋, from where the row
/// came, is known before the first solve; c₊ is where that solve, then the corrected one, would take it. Each is
/// capped at a fraction of the rest length.
void ParticleSystem::bend_rows_back() noexcept {
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Row& row = row_[k];
        Link& link = link_[k];
        const double cap = scene_.method.correction_cap * row.rest;
        const double back = std::min(cap, curvature(link.u, link.length, -h_ * (v_[row.b] - v_[row.a])));
        link.rhs -= row.violation_gain * 0.25 * back;
        first_rhs_[k] = link.rhs;
    }
}

void ParticleSystem::correct_curvature() {
    for (int round = 0; round < scene_.method.corrections; ++round) {
        trial_ = v_;
        kick_nodes(trial_);
        for (std::size_t k = 0; k < row_.size(); ++k) {
            const Row& row = row_[k];
            Link& link = link_[k];
            const double cap = scene_.method.correction_cap * row.rest;
            const double ahead = std::min(cap, curvature(link.u, link.length, h_ * (trial_[row.b] - trial_[row.a])));
            link.rhs = first_rhs_[k] - row.violation_gain * (0.25 + row.relaxation) * ahead;
        }
        solve_rows_again();
    }
}

/// v += kick + M⁻¹ Gᵀ λ
void ParticleSystem::kick_nodes(std::vector<Vec3>& v) const noexcept {
    if (solver_ == ParticleSolver::path) return kick_paths(v);
    for (std::size_t node = 0; node < v.size(); ++node) v[node] += kick_[node];
    if (scene_.method.string_stiffness && solver_ == ParticleSolver::block) {
        for (std::size_t node = 0; node < v.size(); ++node)
            if (block_of_node_[node] >= 0) v[node] += vec_at(saddle_.data() + ldlt_.offset(block_of_node_[node]));
        return;
    }
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Row& row = row_[k];
        const Vec3 impulse = link_[k].lambda * link_[k].u;
        v[row.a] -= w_[row.a] * impulse;
        v[row.b] += w_[row.b] * impulse;
    }
}

/// v −= (h/2) a with the constrained acceleration. The row's right side gets −(2/h) c₋, c₋ the curvature on the
/// way back; with v constant that is −h Ġ v, found first, and with curved constraints it is iterated.
void ParticleSystem::half_kick_back() {
    kick_ = steady_kick_;
    if (!scene_.fields.empty()) apply_central_gravity();
    if (!springs_.empty()) apply_springs();
    const std::vector<Vec3> start = v_;
    if (solver_ != ParticleSolver::none) {
        assemble_rows();
        for (std::size_t k = 0; k < row_.size(); ++k) first_rhs_[k] = link_[k].rhs;
        for (int round = 0; round <= 3 * scene_.method.corrections; ++round) {
            for (std::size_t k = 0; k < row_.size(); ++k) {
                const Row& row = row_[k];
                const double back = curvature(link_[k].u, link_[k].length, -h_ * (v_[row.b] - v_[row.a]));
                link_[k].rhs = first_rhs_[k] - (2.0 / h_) * back;
            }
            if (round == 0) solve_rows();
            else solve_rows_again();
            v_ = start;
            kick_nodes(v_);
            for (std::size_t node = 0; node < v_.size(); ++node)
                v_[node] = start[node] - 0.5 * (v_[node] - start[node]);
        }
    } else {
        for (std::size_t node = 0; node < v_.size(); ++node) v_[node] -= 0.5 * kick_[node];
    }
    for (Link& link : link_) link.lambda = 0.0;
    sweeps_ = 0;
    operations_at_start_ = static_cast<std::int64_t>(ldlt_.counters().block_operations);
}

// --- sampling, checking, going back ---------------------------------------------------------------------

void ParticleSystem::observe(Recorder& recorder, std::int64_t sample) {
    if (clock_) clock_->start();
    for (std::size_t k = 0; k < link_.size(); ++k) seen_lambda_[k] = link_[k].lambda;
    seen_v_ = v_;
    if (composed_) {
        if (sample > 0) read_composition();
    } else if (scene_.method.half_step_velocities) {
        velocity_stage<false>();
        velocity_ready_ = true;
        for (std::size_t node = 0; node < v_.size(); ++node) seen_v_[node] = 0.5 * (seen_v_[node] + v_[node]);
        if (sample == 0)
            for (int body = 0; body < bodies(); ++body) seen_v_[node_of_body_[body]] = scene_.bodies[body].velocity;
    }
    recorder.sample(sample);
    if (clock_) clock_->mark(Stage::observe);
}

Health ParticleSystem::health() const noexcept {
    Health health;
    for (int body = 0; body < bodies(); ++body) {
        const Vec3 x = x_[node_of_body_[body]], v = v_[node_of_body_[body]];
        if (!finite(x) || !finite(v)) return {Status::not_finite, body};
        const double largest = std::max({std::fabs(x.x), std::fabs(x.y), std::fabs(x.z), std::fabs(v.x),
                                         std::fabs(v.y), std::fabs(v.z)});
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
    history_ = saved_.history;
    residual_ = saved_.residual;
}

void ParticleSystem::count(RunReport& report, std::int64_t steps) const {
    const std::int64_t inner = steps * scene_.method.substeps;
    const auto rows = static_cast<std::int64_t>(row_.size());
    const std::int64_t passes = 1 + scene_.method.corrections;
    report.counters["steps"] = steps;
    report.counters["substeps"] = inner;
    report.counters["force_evaluations"] =
        inner * static_cast<std::int64_t>(springs_.size() + scene_.fields.size() * scene_.bodies.size());
    report.counters["rows_assembled"] = inner * rows;
    report.counters["contacts"] = 0;
    report.counters["sweeps"] = sweeps_;
    report.counters["back_substitutions"] =
        solver_ == ParticleSolver::path || solver_ == ParticleSolver::block ? inner * passes : 0;
    std::int64_t blocks = 0;
    if (solver_ == ParticleSolver::path) blocks = 2 * rows - static_cast<std::int64_t>(path_first_.size()) + 1;
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
    } else if (scene_.method.half_step_velocities) {
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

// --- what is read ---------------------------------------------------------------------------------------

double ParticleSystem::violation(int row) const noexcept {
    const Row& r = row_[slot_of_row_[row]];
    return norm(x_[r.b] - x_[r.a]) - r.rest;
}

double ParticleSystem::kinetic_energy() const noexcept {
    double energy = 0.0;
    for (int body = 0; body < bodies(); ++body) energy += 0.5 * mass(body) * dot(velocity(body), velocity(body));
    return energy;
}

double ParticleSystem::potential_energy() const noexcept {
    double energy = 0.0;
    for (int body = 0; body < bodies(); ++body) {
        energy -= mass(body) * dot(scene_.gravity, position(body));
        for (const CentralField& field : scene_.fields)
            energy -= mass(body) * field.strength / norm(position(body) - field.centre);
    }
    for (const SpringNodes& s : springs_) {
        const Vec3 d = x_[s.b] - x_[s.a];
        const double stretch = s.spring.rest_length > 0.0 ? norm(d) - s.spring.rest_length : norm(d);
        energy += 0.5 * s.spring.stiffness * stretch * stretch;
    }
    return energy;
}

}  // namespace spook

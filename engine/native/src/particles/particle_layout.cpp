// From a scene to nodes and rows: which solver the rows need, and where everything stands in memory.
#include "particles/particle_system.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "particles/path_order.hpp"
#include "run/composition.hpp"

namespace spook {

ParticleSystem::ParticleSystem(const ParticleScene& scene, StageList stages)
    : scene_(scene), h_(scene.method.time_step / scene.method.substeps), stages_(std::move(stages)) {
    std::vector<Path> paths;
    if (stages_.take(Stage::assemble_rows)) {
        if (stages_.take(Stage::solve_path)) {
            solver_ = ParticleSolver::path;
            paths = find_paths(scene);
            if (paths.empty()) throw std::invalid_argument("the stage solve_path needs rows in open paths");
        } else if (stages_.take(Stage::solve_block)) {
            solver_ = ParticleSolver::block;
            stiff_strings_ = stages_.take(Stage::string_stiffness);
        } else if (stages_.take(Stage::solve_iterative)) {
            solver_ = ParticleSolver::iterative;
        }
        if (stages_.take(Stage::correct_curvature)) corrections_ = scene.method.corrections;
    }
    if (solver_ == ParticleSolver::none && !scene.rows.empty())
        throw std::invalid_argument("rows need the stage assemble_rows and one that solves them");
    half_step_ = stages_.take(Stage::half_step);
    composed_ = half_step_ && scene.method.composition > 2;
    const bool weighs = stages_.take(Stage::apply_gravity), loaded = stages_.take(Stage::apply_loads);
    if (stages_.take(Stage::apply_central_gravity)) fields_ = scene.fields;
    const bool sprung = stages_.take(Stage::apply_springs);
    stages_.take(Stage::observe);
    if (!stages_.take(Stage::integrate_positions))
        throw std::invalid_argument("particles need the stage integrate_positions");
    stages_.expect_all_taken("particles");
    node_of_body_.assign(scene.bodies.size(), -1);
    slot_of_row_.assign(scene.rows.size(), 0);
    if (solver_ == ParticleSolver::path) lay_out_paths(paths);
    else lay_out_plain();
    for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
        if (node_of_body_[body] >= 0) continue;
        node_of_body_[body] = static_cast<int>(x_.size());
        anchor(scene.bodies[body].position);
    }
    for (const SpringForce& spring : sprung ? scene.springs : std::vector<SpringForce>{}) {
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
        const Vec3 load = loaded ? scene.bodies[body].load : Vec3{};
        steady_kick_[node] = h_ * ((weighs ? scene.gravity : Vec3{}) + w_[node] * load);
    }
    for (Row& row : row_) {
        row.stiff = w_[row.a] + w_[row.b];
        row.diagonal = row.stiff + row.softness;
    }
    if (composed_) {
        upper_.resize(row_.size());
        impulse_.resize(row_.size());
        history_.resize(3 * row_.size() * composition_stages(scene.method.composition).size());
        for (int depth = 0; depth < MOST_HALVINGS; ++depth) {
            step_x_[depth].reserve(x_.size());
            step_v_[depth].reserve(x_.size());
        }
    }
    moving_forces_ = !fields_.empty() || !springs_.empty();
    v_.resize(x_.size());
    kick_ = steady_kick_;
    trial_.resize(x_.size());
    seen_v_.resize(x_.size());
    link_.resize(row_.size());
    seen_lambda_.resize(row_.size());
    first_rhs_.resize(row_.size());
    if (solver_ == ParticleSolver::block) analyse_blocks();
    block_ = std::clamp<std::int64_t>(65536 / static_cast<std::int64_t>(x_.size() * scene.method.substeps),
                                      16, 4096);
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
                            r.relaxation, r.softness, 1.0 / row.rest_length,
                            1.0 / (row.rest_length * row.rest_length)});
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
                        r.relaxation, r.softness, 1.0 / row.rest_length,
                        1.0 / (row.rest_length * row.rest_length)});
    }
}

void ParticleSystem::reset(StageClock* clock) {
    clock_ = clock;
    velocity_ready_ = false;
    sweeps_ = 0;
    newton_iterations_ = 0;
    residual_ = 0.0;
    contradicted_ = -1;
    redundant_.reset(ldlt_);
    operations_at_start_ = static_cast<std::int64_t>(ldlt_.counters().block_operations);
    for (int body = 0; body < bodies(); ++body) {
        x_[node_of_body_[body]] = scene_.bodies[body].position;
        v_[node_of_body_[body]] = scene_.bodies[body].velocity;
    }
    for (Link& link : link_) link = {};
    std::fill(seen_lambda_.begin(), seen_lambda_.end(), 0.0);
    seen_v_ = v_;
    if (stiff_strings_ && solver_ == ParticleSolver::block) find_tensions();
    if (composed_) start_composition();
    else if (half_step_) half_kick_back();
    save();
}

}  // namespace spook

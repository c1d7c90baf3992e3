// From a scene to nodes and rows: which solver the rows need, and where everything stands in memory.
#include "particles/particle_system.hpp"

#include <algorithm>

#include "particles/path_order.hpp"
#include "run/composition.hpp"

namespace spook {

namespace {

/// A path between two points of the world without any compliance: stretched out straight, each of its rows says
/// what the others say. An open end, a bend or a compliance anywhere keeps the rows independent.
bool rigid_between_anchors(const ParticleScene& scene, const Path& path) {
    return path.nodes.front() < 0 && path.nodes.back() < 0 &&
           std::all_of(
               path.rows.begin(), path.rows.end(),
               [&](int row) { return scene.rows[row].compliance == 0.0; });
}

}  // namespace

ParticleSystem::ParticleSystem(const ParticleScene& scene)
    : scene_(scene), h_(scene.method.time_step / scene.method.substeps) {
    const std::vector<Path> paths = find_paths(scene);
    if (!scene.rows.empty()) {
        held_twice_ = std::any_of(paths.begin(), paths.end(),
                                  [&](const Path& path) { return rigid_between_anchors(scene, path); });
        solver_ = paths.empty() || held_twice_ || scene.method.force_block || scene.method.string_stiffness
                      ? ParticleSolver::block
                      : ParticleSolver::path;
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
    share_ = 0.0;
    ldlt_.shift_constraints(0.0);
    operations_at_start_ = static_cast<std::int64_t>(ldlt_.counters().block_operations);
    for (int body = 0; body < bodies(); ++body) {
        x_[node_of_body_[body]] = scene_.bodies[body].position;
        v_[node_of_body_[body]] = scene_.bodies[body].velocity;
    }
    for (Link& link : link_) link = {};
    std::fill(seen_lambda_.begin(), seen_lambda_.end(), 0.0);
    seen_v_ = v_;
    if (scene_.method.string_stiffness && solver_ == ParticleSolver::block) find_tensions();
    if (composed_) start_composition();
    else if (scene_.method.half_step_velocities) half_kick_back();
    save();
}

}  // namespace spook

// From a scene to nodes and rows: which solver the rows need, and where everything stands in memory.
#include "particles/particle_system.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "particles/path_order.hpp"
#include "run/energy_made.hpp"

namespace spook {

ParticleSystem::ParticleSystem(const ParticleScene& scene, StageList stages)
    : scene_(scene), stages_(std::move(stages)) {
    parts_.h = scene.method.time_step / scene.method.substeps;
    std::vector<Path> paths;
    if (stages_.take(Stage::assemble_rows)) {
        if (stages_.take(Stage::solve_path)) {
            parts_.solver = ParticleSolver::path;
            paths = find_paths(scene);
            if (paths.empty()) throw std::invalid_argument("the stage solve_path needs rows in open paths");
        } else if (stages_.take(Stage::solve_block)) {
            parts_.solver = ParticleSolver::block;
            stiff_strings_ = stages_.take(Stage::string_stiffness);
        } else if (stages_.take(Stage::solve_iterative)) {
            parts_.solver = ParticleSolver::iterative;
        }
        if (stages_.take(Stage::correct_curvature)) corrections_ = scene.method.corrections;
    }
    if (parts_.solver == ParticleSolver::none && !scene.rows.empty())
        throw std::invalid_argument("rows need the stage assemble_rows and one that solves them");
    half_step_ = stages_.take(Stage::half_step);
    const bool weighs = stages_.take(Stage::apply_gravity), loaded = stages_.take(Stage::apply_loads);
    if (stages_.take(Stage::apply_central_gravity)) parts_.forces.take_fields(scene.fields);
    const bool sprung = stages_.take(Stage::apply_springs);
    stages_.take(Stage::observe);
    if (!stages_.take(Stage::integrate_positions))
        throw std::invalid_argument("particles need the stage integrate_positions");
    stages_.expect_all_taken("particles");
    nodes_.of_body.assign(scene.bodies.size(), -1);
    rows_.slot.assign(scene.rows.size(), 0);
    if (parts_.solver == ParticleSolver::path) lay_out_paths(paths);
    else lay_out_plain();
    for (std::size_t body = 0; body < scene.bodies.size(); ++body)
        if (nodes_.of_body[body] < 0) nodes_.of_body[body] = nodes_.add(scene.bodies[body].position);
    if (sprung) parts_.forces.take_springs(scene.springs, nodes_);
    nodes_.body.assign(nodes_.size(), -1);
    for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
        const int node = nodes_.of_body[body];
        nodes_.body[node] = static_cast<int>(body);
        nodes_.w[node] = 1.0 / scene.bodies[body].mass;
        const Vec3 load = loaded ? scene.bodies[body].load : Vec3{};
        nodes_.steady_kick[node] = parts_.h * ((weighs ? scene.gravity : Vec3{}) + nodes_.w[node] * load);
    }
    rows_.finish(nodes_);
    nodes_.v.resize(nodes_.size());
    nodes_.kick = nodes_.steady_kick;
    trial_.resize(nodes_.size());
    seen_.v.resize(nodes_.size());
    seen_.lambda.resize(rows_.size());
    first_rhs_.resize(rows_.size());
    const ParticleMethod& method = scene.method;
    const bool composed = half_step_ && method.composition > 2;
    parts_.pgs.iterations = method.iterations;
    parts_.pgs.tolerance = method.residual_tolerance;
    parts_.pgs.prepare(nodes_);
    if (parts_.solver == ParticleSolver::block)
        parts_.saddle.analyse(nodes_, rows_,
                              {parts_.h, method.floor, method.refinements, stiff_strings_, !composed});
    if (composed) composition_.emplace(parts_, method.composition);
    block_ = std::clamp<std::int64_t>(65536 / static_cast<std::int64_t>(nodes_.size() * method.substeps), 16,
                                      4096);
}

void ParticleSystem::lay_out_paths(const std::vector<Path>& paths) {
    for (const Path& path : paths) {
        parts_.paths.begin(rows_);
        for (int node : path.nodes) {
            const int end = -1 - node;
            if (node >= 0) nodes_.of_body[node] = nodes_.add(scene_.bodies[node].position);
            else nodes_.add(scene_.rows[end / 2].ends[end % 2].point);
        }
        const int first = static_cast<int>(nodes_.size() - path.nodes.size());
        for (std::size_t k = 0; k < path.rows.size(); ++k) {
            rows_.slot[path.rows[k]] = static_cast<int>(rows_.size());
            const int a = first + static_cast<int>(k);
            rows_.add(scene_.rows[path.rows[k]], a, a + 1, parts_.h);
        }
    }
    parts_.paths.end(rows_);
}

void ParticleSystem::lay_out_plain() {
    for (std::size_t body = 0; body < scene_.bodies.size(); ++body)
        nodes_.of_body[body] = nodes_.add(scene_.bodies[body].position);
    for (std::size_t k = 0; k < scene_.rows.size(); ++k) {
        int node[2];
        for (int side = 0; side < 2; ++side) {
            const End& end = scene_.rows[k].ends[side];
            node[side] = end.body >= 0 ? nodes_.of_body[end.body] : nodes_.add(end.point);
        }
        rows_.slot[k] = static_cast<int>(k);
        rows_.add(scene_.rows[k], node[0], node[1], parts_.h);
    }
}

void ParticleSystem::reset(StageClock* clock) {
    clock_ = clock;
    velocity_ready_ = false;
    parts_.pgs.work = {};
    parts_.saddle.reset();
    for (int body = 0; body < readings_.bodies(); ++body) {
        nodes_.x[nodes_.of_body[body]] = scene_.bodies[body].position;
        nodes_.v[nodes_.of_body[body]] = scene_.bodies[body].velocity;
    }
    for (Link& link : rows_.link) link = {};
    std::fill(seen_.lambda.begin(), seen_.lambda.end(), 0.0);
    seen_.v = nodes_.v;
    if (stiff_strings_) find_tensions();
    unread_ = -1;
    if (composition_) composition_->start(clock);
    else if (half_step_) half_kick_back();
    noted_ = {};
    bool begun_violated = false, rigid = false;
    for (int row = 0; row < readings_.rows(); ++row) {
        begun_violated |= std::fabs(readings_.violation(row)) > initial_overstep;
        rigid |= scene_.rows[row].compliance <= rigid_compliance;
    }
    noted_.asked = !stiff_strings_ && (composition_ ? rows_.size() > 0 : rigid && !begun_violated);
    save();
    noted_.begun = readings_.kinetic_energy() + readings_.potential_energy();
    for (const ParticleBody& body : scene_.bodies) noted_.is_powered |= norm(body.load) > 0.0;
}

}  // namespace spook

// One SPOOK step, stage by stage: forces, rows, solve, motion.
#include "particles/particle_system.hpp"

#include <algorithm>
#include <cmath>

namespace spook {

void ParticleSystem::advance(std::int64_t steps) {
    steps *= scene_.method.substeps;
    if (composition_) return composition_->advance(steps);
    if (clock_) return advance_by<true>(steps);
    if (velocity_ready_ && steps > 0) {
        position_stage();
        velocity_ready_ = false;
        --steps;
    }
    if (parts_.solver == ParticleSolver::none && parts_.forces.springs() == 0 &&
        parts_.forces.fields().size() <= 1)
        fly(steps);
    else if (parts_.solver == ParticleSolver::path && !parts_.forces.any()) swing(steps);
    else advance_by<false>(steps);
}

template <bool Timed> void ParticleSystem::advance_by(std::int64_t steps) {
    if constexpr (Timed) clock_->start();
    for (; steps > 0; --steps) {
        if (!velocity_ready_) velocity_stage<Timed>();
        velocity_ready_ = false;
        position_stage();
        mark<Timed>(Stage::integrate_positions);
    }
}

template <bool Timed> void ParticleSystem::velocity_stage() {
    if (parts_.forces.any()) {
        nodes_.kick = nodes_.steady_kick;
        if constexpr (Timed) clock_->mark({Stage::apply_gravity, Stage::apply_loads});
        if (!parts_.forces.fields().empty()) {
            parts_.forces.add_attraction(nodes_, parts_.h);
            mark<Timed>(Stage::apply_central_gravity);
        }
        if (parts_.forces.springs() > 0) {
            parts_.forces.add_springs(nodes_, parts_.h);
            mark<Timed>(Stage::apply_springs);
        }
    }
    if (parts_.solver == ParticleSolver::none) {
        for (std::size_t node = 0; node < nodes_.v.size(); ++node) nodes_.v[node] += nodes_.kick[node];
        if constexpr (Timed)
            clock_->mark({Stage::apply_gravity, Stage::apply_springs, Stage::apply_central_gravity,
                          Stage::apply_loads});
        return;
    }
    rows_.assemble(nodes_);
    if (corrections_ > 0) bend_rows_back();
    mark<Timed>(Stage::assemble_rows);
    const Stage solver = parts_.solver == ParticleSolver::path    ? Stage::solve_path
                         : parts_.solver == ParticleSolver::block ? Stage::solve_block
                                                                  : Stage::solve_iterative;
    solve_rows();
    mark<Timed>(solver);
    if (corrections_ > 0) {
        correct_curvature();
        mark<Timed>(Stage::correct_curvature);
    }
    kick_nodes(nodes_.v);
    mark<Timed>(solver);
}

void ParticleSystem::position_stage() noexcept {
    for (std::size_t node = 0; node < nodes_.x.size(); ++node) nodes_.x[node] += parts_.h * nodes_.v[node];
}

void ParticleSystem::solve_rows() {
    switch (parts_.solver) {
        case ParticleSolver::path: parts_.paths.factor(nodes_, rows_); break;
        case ParticleSolver::block: parts_.saddle.factor(nodes_, rows_); break;
        case ParticleSolver::iterative:
        case ParticleSolver::none: break;
    }
    solve_rows_again();
}

void ParticleSystem::solve_rows_again() {
    switch (parts_.solver) {
        case ParticleSolver::path: parts_.paths.substitute(rows_); break;
        case ParticleSolver::block: parts_.saddle.substitute(nodes_, rows_); break;
        case ParticleSolver::iterative: parts_.pgs.solve(nodes_, rows_); break;
        case ParticleSolver::none: break;
    }
}

/// v += kick + M⁻¹ Gᵀ λ
void ParticleSystem::kick_nodes(std::vector<Vec3>& v) const noexcept {
    if (parts_.solver == ParticleSolver::path) return parts_.paths.kick(nodes_, rows_, v);
    for (std::size_t node = 0; node < v.size(); ++node) v[node] += nodes_.kick[node];
    if (stiff_strings_) parts_.saddle.add_moves(v);
    else rows_.push(nodes_, v);
}

template void ParticleSystem::velocity_stage<false>();
template void ParticleSystem::velocity_stage<true>();

}  // namespace spook

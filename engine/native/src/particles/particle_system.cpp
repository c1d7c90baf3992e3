// One SPOOK step, stage by stage: forces, rows, solve, motion.
#include "particles/particle_system.hpp"

#include <algorithm>
#include <cmath>

namespace spook {

void ParticleSystem::advance(std::int64_t steps) {
    steps *= scene_.method.substeps;
    if (composed_) return compose(steps);
    if (clock_) return advance_by<true>(steps);
    if (velocity_ready_ && steps > 0) {
        position_stage();
        velocity_ready_ = false;
        --steps;
    }
    if (solver_ == ParticleSolver::none && springs_.empty() && fields_.size() <= 1) fly(steps);
    else if (solver_ == ParticleSolver::path && !moving_forces_) swing(steps);
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
    if (moving_forces_) {
        kick_ = steady_kick_;
        mark<Timed>(Stage::apply_gravity);
        if (!fields_.empty()) {
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
    if (corrections_ > 0) bend_rows_back();
    mark<Timed>(Stage::assemble_rows);
    solve_rows();
    mark<Timed>(solver_ == ParticleSolver::path    ? Stage::solve_path
                : solver_ == ParticleSolver::block ? Stage::solve_block
                                                   : Stage::solve_iterative);
    if (corrections_ > 0) {
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
    for (const CentralField& field : fields_)
        for (std::size_t node = 0; node < x_.size(); ++node) {
            if (w_[node] == 0.0) continue;
            const Vec3 d = x_[node] - field.centre;
            const double r2 = dot(d, d), r = std::sqrt(r2);
            kick_[node] = kick_[node] - (h_ * field.strength / (r2 * r)) * d;
        }
}

void ParticleSystem::apply_springs() noexcept {
    for (const SpringNodes& s : springs_) {
        const Vec3 pull = spook::pull(s.spring, x_[s.b] - x_[s.a], v_[s.b] - v_[s.a]);
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
            const double residual =
                link.rhs - dot(link.u, trial_[row.b] - trial_[row.a]) - row.softness * link.lambda;
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

/// v += kick + M⁻¹ Gᵀ λ
void ParticleSystem::kick_nodes(std::vector<Vec3>& v) const noexcept {
    if (solver_ == ParticleSolver::path) return kick_paths(v);
    for (std::size_t node = 0; node < v.size(); ++node) v[node] += kick_[node];
    if (stiff_strings_ && solver_ == ParticleSolver::block) {
        for (std::size_t node = 0; node < v.size(); ++node)
            if (block_of_node_[node] >= 0)
                v[node] += vec_at(saddle_.data() + ldlt_.offset(block_of_node_[node]));
        return;
    }
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Row& row = row_[k];
        const Vec3 impulse = link_[k].lambda * link_[k].u;
        v[row.a] -= w_[row.a] * impulse;
        v[row.b] += w_[row.b] * impulse;
    }
}

template void ParticleSystem::velocity_stage<false>();

}  // namespace spook

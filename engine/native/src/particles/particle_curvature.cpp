// Beyond the linearised, whole-step scheme: the curvature of the rows, and velocities at mid-step.
#include "particles/particle_system.hpp"

#include <algorithm>

namespace spook {

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
    for (int round = 0; round < corrections_; ++round) {
        trial_ = v_;
        kick_nodes(trial_);
        for (std::size_t k = 0; k < row_.size(); ++k) {
            const Row& row = row_[k];
            Link& link = link_[k];
            const double cap = scene_.method.correction_cap * row.rest;
            const double ahead =
                std::min(cap, curvature(link.u, link.length, h_ * (trial_[row.b] - trial_[row.a])));
            link.rhs = first_rhs_[k] - row.violation_gain * (0.25 + row.relaxation) * ahead;
        }
        solve_rows_again();
    }
}

/// The tensions at the start, which the stiffness of strings in the first step is made of. The first round knows
/// none and moves light bodies under a heavy load far too fast; its tensions are right all the same.
void ParticleSystem::find_tensions() {
    kick_ = steady_kick_;
    if (!fields_.empty()) apply_central_gravity();
    if (!springs_.empty()) apply_springs();
    for (int round = 0; round < 3; ++round) {
        assemble_rows();
        if (corrections_ > 0) bend_rows_back();
        solve_rows();
    }
    operations_at_start_ = static_cast<std::int64_t>(ldlt_.counters().block_operations);
}

/// v −= (h/2) a with the constrained acceleration. The row's right side gets −(2/h) c₋, c₋ the curvature on the
/// way back; with v constant that is −h Ġ v, found first, and with curved constraints it is iterated.
void ParticleSystem::half_kick_back() {
    kick_ = steady_kick_;
    if (!fields_.empty()) apply_central_gravity();
    if (!springs_.empty()) apply_springs();
    const std::vector<Vec3> start = v_;
    if (solver_ != ParticleSolver::none) {
        assemble_rows();
        for (std::size_t k = 0; k < row_.size(); ++k) first_rhs_[k] = link_[k].rhs;
        for (int round = 0; round <= 3 * corrections_; ++round) {
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
    if (!stiff_strings_)
        for (Link& link : link_) link.lambda = 0.0;
    sweeps_ = 0;
    operations_at_start_ = static_cast<std::int64_t>(ldlt_.counters().block_operations);
}

}  // namespace spook

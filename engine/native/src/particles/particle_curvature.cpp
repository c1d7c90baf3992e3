// Beyond the linearised, whole-step scheme: the curvature of the rows, and velocities at mid-step.
#include "particles/particle_system.hpp"

#include <algorithm>

namespace spook {

/// Keep the curvature of |d| in the right side: rhs −= (4/h) Ups [(c₊ + c₋)/4 + θ c₊]. c₋, from where the row
/// came, is known before the first solve; c₊ is where that solve, then the corrected one, would take it. Each is
/// capped at a fraction of the rest length.
void ParticleSystem::bend_rows_back() noexcept {
    for (std::size_t k = 0; k < rows_.row.size(); ++k) {
        const Row& row = rows_.row[k];
        Link& link = rows_.link[k];
        const double cap = scene_.method.correction_cap * row.rest;
        const double back =
            std::min(cap, curvature(link.u, link.length, -parts_.h * (nodes_.v[row.b] - nodes_.v[row.a])));
        link.rhs -= row.violation_gain * 0.25 * back;
        first_rhs_[k] = link.rhs;
    }
}

void ParticleSystem::correct_curvature() {
    for (int round = 0; round < corrections_; ++round) {
        trial_ = nodes_.v;
        kick_nodes(trial_);
        for (std::size_t k = 0; k < rows_.row.size(); ++k) {
            const Row& row = rows_.row[k];
            Link& link = rows_.link[k];
            const double cap = scene_.method.correction_cap * row.rest;
            const double ahead =
                std::min(cap, curvature(link.u, link.length, parts_.h * (trial_[row.b] - trial_[row.a])));
            link.rhs = first_rhs_[k] - row.violation_gain * (0.25 + row.relaxation) * ahead;
        }
        solve_rows_again();
    }
}

/// The tensions at the start, which the stiffness of strings in the first step is made of. The first round knows
/// none and moves light bodies under a heavy load far too fast; its tensions are right all the same.
void ParticleSystem::find_tensions() {
    parts_.forces.find_kicks(nodes_, parts_.h);
    for (int round = 0; round < 3; ++round) {
        rows_.assemble(nodes_);
        if (corrections_ > 0) bend_rows_back();
        solve_rows();
    }
    parts_.saddle.count_from_here();
}

/// v −= (h/2) a with the constrained acceleration. The row's right side gets −(2/h) c₋, c₋ the curvature on the
/// way back; with v constant that is −h Ġ v, found first, and with curved constraints it is iterated.
void ParticleSystem::half_kick_back() {
    parts_.forces.find_kicks(nodes_, parts_.h);
    const std::vector<Vec3> start = nodes_.v;
    if (parts_.solver != ParticleSolver::none) {
        rows_.assemble(nodes_);
        for (std::size_t k = 0; k < rows_.row.size(); ++k) first_rhs_[k] = rows_.link[k].rhs;
        for (int round = 0; round <= 3 * corrections_; ++round) {
            for (std::size_t k = 0; k < rows_.row.size(); ++k) {
                const Row& row = rows_.row[k];
                const double back = curvature(rows_.link[k].u, rows_.link[k].length,
                                              -parts_.h * (nodes_.v[row.b] - nodes_.v[row.a]));
                rows_.link[k].rhs = first_rhs_[k] - (2.0 / parts_.h) * back;
            }
            if (round == 0) solve_rows();
            else solve_rows_again();
            nodes_.v = start;
            kick_nodes(nodes_.v);
            for (std::size_t node = 0; node < nodes_.v.size(); ++node)
                nodes_.v[node] = start[node] - 0.5 * (nodes_.v[node] - start[node]);
        }
    } else {
        for (std::size_t node = 0; node < nodes_.v.size(); ++node) nodes_.v[node] -= 0.5 * nodes_.kick[node];
    }
    if (!stiff_strings_)
        for (Link& link : rows_.link) link.lambda = 0.0;
    parts_.pgs.work = {};
    parts_.saddle.count_from_here();
}

}  // namespace spook

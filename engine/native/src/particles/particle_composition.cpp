// Symmetric compositions of a symmetric constrained step, for smooth scenes.
//
// The base step over τ is RATTLE (Andersen 1983): half a kick, a drift that ends on the constraints, half a kick.
// With |d| = L for every row the impulses act along d/L, and those Λ are sought for which the drift ends at
// |d + τ dv|² = L². Rows are held rigidly: their compliance would only add the static stretch eps F.
// RATTLE also projects the velocity at the end of the step. Between two stages that projection acts along the same
// directions as the next impulses, so it drops out and only the sum of both is solved for: one nonlinear solve per
// stage. Velocities are projected where they are read. The kicks at the end of a stage and the beginning of
// the next are one kick, too: v_ lives at mid-stage and `pending_` is the half stage it still has to be kicked.
//
// Newton's method: the matrix at the predicted end, then the same factor again until the square of the residual is
// below rounding; refactored when that converges slowly. The prediction extrapolates each stage's forces from the
// same stage of the steps before.
#include <algorithm>
#include <cmath>
#include <limits>

#include "particles/particle_system.hpp"
#include "run/composition.hpp"

namespace spook {

namespace {

constexpr double SETTLED = 2e-15;  // of |d|²/L² − 1: rounding level
constexpr double SLOW = 0.05;      // residual ratio above which the matrix is factored again
constexpr int MOST_ITERATIONS = 20;
// |d + τ dv| = L has a second, wrong solution across the circle: a step that comes near it is halved instead.
constexpr double LEAST_ALONG = 0.5;  // of the length, along the direction before: less than 60° in a stage
constexpr double FARTHEST = 0.3;     // of |d|²/L² − 1 at the prediction

}  // namespace

void ParticleSystem::start_composition() {
    pending_ = 0.0;
    stage_steps_ = 0;
    halved_steps_ = 0;
    lost_ = false;
    std::fill(history_.begin(), history_.end(), 0.0);
}

void ParticleSystem::compose(std::int64_t steps) {
    const std::span<const double> stages = composition_stages(scene_.method.composition);
    if (clock_) clock_->start();
    if (solver_ == ParticleSolver::none) {
        for (; steps > 0; --steps) {
            for (const double gamma : stages) drift_kick(gamma * h_);
            for (std::size_t node = 0; node < x_.size(); ++node) x_[node] += pending_ * v_[node];
            pending_ = 0.0;  // so that reading a sample changes no bit of what follows
        }
        return;
    }
    for (; steps > 0; --steps) constrained_step(h_, 0);
}

/// One step of length h. Where the equations have no solution near (a whip cracks within the step), the step is
/// taken back and done in two halves, and so on; the order stays, `halved_steps_` counts it. When the smallest part
/// has none either, the state is lost: not a number from here on.
void ParticleSystem::constrained_step(double h, int depth) {
    const std::span<const double> stages = composition_stages(scene_.method.composition);
    const std::size_t rows = row_.size();
    if (lost_) return;
    std::vector<Vec3>&x = step_x_[static_cast<std::size_t>(depth)],
    &v = step_v_[static_cast<std::size_t>(depth)];
    x = x_;
    v = v_;
    const double pending = pending_;
    bool solved = true;
    for (std::size_t stage = 0; stage < stages.size() && solved; ++stage)
        solved = constrained_stage(stages[stage] * h, history_.data() + 3 * rows * stage);
    ++stage_steps_;
    if (solved) return;
    if (depth + 1 == MOST_HALVINGS) {
        lost_ = true;
        for (Vec3& speed : v_) speed.x = std::numeric_limits<double>::quiet_NaN();
        return;
    }
    x_ = x;
    v_ = v;
    pending_ = pending;
    ++halved_steps_;
    for (int half = 0; half < 2; ++half) {
        stage_steps_ = half == 0 ? 0 : stage_steps_;
        if (half == 0) std::fill(history_.begin(), history_.end(), 0.0);
        constrained_step(0.5 * h, depth + 1);
    }
    stage_steps_ = 0;
    std::fill(history_.begin(), history_.end(), 0.0);
}

/// Without rows: drift, kick, drift; the drifts of neighbouring stages are one.
void ParticleSystem::drift_kick(double tau) noexcept {
    const double drift = pending_ + 0.5 * tau, part = tau / h_;
    for (std::size_t node = 0; node < x_.size(); ++node) x_[node] += drift * v_[node];
    if (clock_) clock_->mark(Stage::integrate_positions);
    find_kicks();
    for (std::size_t node = 0; node < x_.size(); ++node) v_[node] += part * kick_[node];
    pending_ = 0.5 * tau;
    if (clock_) clock_->mark(fields_.empty() ? Stage::apply_gravity : Stage::apply_central_gravity);
}

void ParticleSystem::find_kicks() noexcept {
    if (!moving_forces_) return;
    kick_ = steady_kick_;
    if (!fields_.empty()) apply_central_gravity();
    if (!springs_.empty()) apply_springs();
}

/// `history` holds this stage's forces one, two and three steps ago. False if no solution was found.
bool ParticleSystem::constrained_stage(double tau, double* history) {
    const std::size_t rows = row_.size();
    const double span = pending_ + 0.5 * tau, part = span / h_;
    double *one = history, *two = history + rows, *three = history + 2 * rows;
    find_kicks();
    const double a1 = stage_steps_ >= 3 ? 3.0 : stage_steps_ == 2 ? 2.0 : 1.0;
    const double a2 = stage_steps_ >= 3   ? -3.0
                      : stage_steps_ == 2 ? -1.0
                                          : 0.0,
                 a3 = stage_steps_ >= 3 ? 1.0 : 0.0;
    for (std::size_t k = 0; k < rows; ++k)
        link_[k].lambda = span * (a1 * one[k] + a2 * two[k] + a3 * three[k]);
    if (solver_ == ParticleSolver::path) {
        predict_paths(part);
    } else {
        for (std::size_t k = 0; k < rows; ++k)
            link_[k].u = row_[k].rest_inverse * (x_[row_[k].b] - x_[row_[k].a]);
        for (std::size_t node = 0; node < v_.size(); ++node) v_[node] += part * kick_[node];
        push(v_);
    }
    if (clock_) clock_->mark(Stage::assemble_rows);
    double before = std::numeric_limits<double>::infinity();
    bool fresh = true;
    for (int iteration = 0;; ++iteration) {
        const double off =
            solver_ == ParticleSolver::path ? lengthen_paths(tau, fresh) : lengthen_blocks(tau, fresh);
        const double ratio = off / before;
        ++newton_iterations_;
        if (off <= SETTLED || (off < 1e-12 && ratio > 0.5)) break;  // settled, or down in the rounding
        if (!(off < FARTHEST) || iteration == MOST_ITERATIONS) return false;
        fresh = iteration > 0 && ratio > SLOW;
        if (solver_ == ParticleSolver::path) shorten_paths();
        else shorten_blocks();
        // What is left is below rounding already: by Newton's rate, or by that of the kept factor.
        if (off * (iteration == 0 ? 100.0 * off : ratio) <= 0.1 * SETTLED) break;
        before = off;
    }
    if (clock_) clock_->mark(solver_ == ParticleSolver::path ? Stage::solve_path : Stage::solve_block);
    const double per_span = 1.0 / span;
    for (std::size_t k = 0; k < rows; ++k) {
        three[k] = two[k];
        two[k] = one[k];
        one[k] = link_[k].lambda * per_span;
    }
    for (std::size_t node = 0; node < x_.size(); ++node) x_[node] += tau * v_[node];
    pending_ = 0.5 * tau;
    if (clock_) clock_->mark(Stage::integrate_positions);
    return true;
}

/// v += M⁻¹ Gᵀ λ with the directions d/L.
void ParticleSystem::push(std::vector<Vec3>& v) const noexcept {
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Vec3 impulse = link_[k].lambda * link_[k].u;
        v[row_[k].a] -= w_[row_[k].a] * impulse;
        v[row_[k].b] += w_[row_[k].b] * impulse;
    }
}

/// Residual of every row and the way down: L U of the Jacobian if `fresh`, else forward substitution only.
/// Returns the largest |d₊²/L² − 1|. rhs: y; lambda keeps the impulse so far.
double ParticleSystem::lengthen_paths(double tau, bool fresh) noexcept {
    double worst = 0.0;
    for (std::size_t path = 0; path + 1 < path_first_.size(); ++path) {
        const int first = path_first_[path], end = path_first_[path + 1];
        double y = 0.0, inverse = 0.0, upper = 0.0;
        for (int k = first; k < end; ++k) {
            const Row& row = row_[k];
            Link& link = link_[k];
            const Vec3 ahead = row.rest * link.u + tau * (v_[row.b] - v_[row.a]);
            const double residual = dot(ahead, ahead) - row.rest * row.rest;
            worst = std::max(worst, std::fabs(residual) * row.rest_inverse_square);
            if (residual != residual) return residual;
            if (fresh) {
                const Vec3 scaled = tau * ahead;
                const double along = dot(ahead, link.u);
                if (along < LEAST_ALONG * row.rest) return std::numeric_limits<double>::infinity();
                const double diagonal = row.stiff * tau * along;
                const double left = k > first ? -w_[row.a] * dot(scaled, link_[k - 1].u) : 0.0;
                link.lower = left * inverse;
                inverse = 1.0 / (diagonal - link.lower * upper);
                upper = k + 1 < end ? -w_[row.b] * dot(scaled, link_[k + 1].u) : 0.0;
                link.pivot_inverse = inverse;
                upper_[k] = upper;
            }
            link.rhs = y = -0.5 * residual - link.lower * y;
        }
    }
    return worst;
}

/// The way up: the changes of the impulses, into λ and the velocities.
void ParticleSystem::shorten_paths() noexcept {
    for (std::size_t path = 0; path + 1 < path_first_.size(); ++path) {
        double change = 0.0;
        Vec3 out;
        const int first = path_first_[path], end = path_first_[path + 1];
        for (int k = end - 1; k >= first; --k) {
            Link& link = link_[k];
            change = (link.rhs - upper_[k] * change) * link.pivot_inverse;
            link.lambda += change;
            const Vec3 in = change * link.u;
            v_[row_[k].b] += w_[row_[k].b] * (in - out);
            out = in;
        }
        v_[row_[first].a] -= w_[row_[first].a] * out;
    }
}

/// Kicks and predicted impulses, node by node.
void ParticleSystem::predict_paths(double part) noexcept {
    int node = 0;
    for (std::size_t path = 0; path + 1 < path_first_.size(); ++path) {
        Vec3 in, here = x_[node];
        for (int k = path_first_[path]; k < path_first_[path + 1]; ++k, ++node) {
            Link& link = link_[k];
            const Vec3 next = x_[node + 1];
            link.u = row_[k].rest_inverse * (next - here);
            const Vec3 out = link.lambda * link.u;
            v_[node] += part * kick_[node] + w_[node] * (in - out);
            in = out;
            here = next;
        }
        v_[node] += part * kick_[node] + w_[node] * in;
        ++node;
    }
    for (; node < static_cast<int>(v_.size()); ++node) v_[node] += part * kick_[node];
}

/// The same for rows that branch or close loops: the symmetric matrix at the start of the stage, so the iteration
/// converges by a factor of about the angle turned in a stage.
double ParticleSystem::lengthen_blocks(double tau, bool fresh) {
    double worst = 0.0;
    if (fresh) {
        factor_rigid_blocks();
        std::fill(saddle_rhs_.begin(), saddle_rhs_.end(), 0.0);
    }
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Row& row = row_[k];
        const Vec3 ahead = row.rest * link_[k].u + tau * (v_[row.b] - v_[row.a]);
        const double residual = dot(ahead, ahead) - row.rest * row.rest;
        if (residual != residual) return residual;
        worst = std::max(worst, std::fabs(residual) * row.rest_inverse_square);
        link_[k].rhs = -0.5 * residual / (tau * row.rest);
    }
    return worst;
}

void ParticleSystem::shorten_blocks() {
    for (std::size_t k = 0; k < row_.size(); ++k) impulse_[k] = link_[k].lambda;
    substitute_blocks();
    push(v_);
    for (std::size_t k = 0; k < row_.size(); ++k) link_[k].lambda += impulse_[k];
}

/// The matrix with Sig = 0 at the directions link_.u.
void ParticleSystem::factor_rigid_blocks() {
    factor_blocks();
    for (std::size_t k = 0; k < row_.size(); ++k) *ldlt_.diagonal(row_blocks_[k].row) = -0.0;
    redundant_.factor(ldlt_, scene_.method.floor);
}

/// λ such that G M⁻¹ Gᵀ λ = rhs, rigidly.
void ParticleSystem::solve_rigidly() {
    if (solver_ == ParticleSolver::block) {
        factor_rigid_blocks();
        std::fill(saddle_rhs_.begin(), saddle_rhs_.end(), 0.0);
        return substitute_blocks();
    }
    factor_paths(true);
    substitute_paths();
}

/// What is seen at the end of a step, without changing what goes on: velocities kicked and projected to the sample,
/// forces from the accelerations there.
void ParticleSystem::read_composition() {
    if (solver_ == ParticleSolver::none) {
        seen_v_ = v_;
        return;
    }
    find_kicks();
    const double part = pending_ / h_;
    seen_v_ = v_;
    for (std::size_t node = 0; node < x_.size(); ++node) seen_v_[node] += part * kick_[node];
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Row& row = row_[k];
        link_[k].u = (1.0 / row.rest) * (x_[row.b] - x_[row.a]);
        link_[k].rhs = -dot(link_[k].u, seen_v_[row.b] - seen_v_[row.a]);
    }
    solve_rigidly();
    push(seen_v_);
    for (std::size_t k = 0; k < row_.size(); ++k) {
        const Row& row = row_[k];
        const Vec3 dv = seen_v_[row.b] - seen_v_[row.a];
        link_[k].rhs = -dot(link_[k].u, kick_[row.b] - kick_[row.a]) - h_ * dot(dv, dv) / row.rest;
    }
    if (solver_ == ParticleSolver::block) substitute_blocks();
    else substitute_paths();
    for (std::size_t k = 0; k < row_.size(); ++k) seen_lambda_[k] = link_[k].lambda;
}

}  // namespace spook

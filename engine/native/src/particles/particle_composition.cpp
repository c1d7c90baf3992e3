// Symmetric compositions of a symmetric constrained step, for smooth scenes.
//
// The base step over τ is RATTLE (Andersen 1983): half a kick, a drift that ends on the constraints, half a kick.
// With |d| = L for every row the impulses act along d/L, and those Λ are sought for which the drift ends at
// |d + τ dv|² = L². Rows are held rigidly: their compliance would only add the static stretch eps F.
// RATTLE also projects the velocity at the end of the step. Between two stages that projection acts along the same
// directions as the next impulses, so it drops out and only the sum of both is solved for: one nonlinear solve per
// stage. Velocities are projected where they are read. The kicks at the end of a stage and the beginning of
// the next are one kick, too: v_ lives at mid-stage and `state_.pending` is the half stage it still has to be kicked.
//
// Newton's method: the matrix at the predicted end, then the same factor again until the square of the residual is
// below rounding; refactored when that converges slowly. The prediction extrapolates each stage's forces from the
// same stage of the steps before.
#include "particles/particle_composition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "run/composition.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

constexpr double SETTLED = 2e-15;  // of |d|²/L² − 1: rounding level
constexpr double SLOW = 0.05;      // residual ratio above which the matrix is factored again
constexpr int MOST_ITERATIONS = 20;
// |d + τ dv| = L has a second, wrong solution across the circle: a step that comes near it is halved instead.
constexpr double LEAST_ALONG = 0.5;  // of the length, along the direction before: less than 60° in a stage
constexpr double FARTHEST = 0.3;     // of |d|²/L² − 1 at the prediction

}  // namespace

ParticleComposition::ParticleComposition(ParticleParts& parts, int order)
    : nodes_(parts.nodes),
      rows_(parts.rows),
      forces_(parts.forces),
      paths_(parts.paths),
      saddle_(parts.saddle),
      solver_(parts.solver),
      h_(parts.h),
      gammas_(composition_stages(order)),
      longest_(h_ * longest_stage(order)) {
    pull_.resize(nodes_.x.size());
    upper_.resize(rows_.size());
    impulse_.resize(rows_.size());
    state_.history.resize(3 * rows_.size() * gammas_.size());
    for (int depth = 0; depth < MOST_HALVINGS; ++depth) {
        step_x_[depth].reserve(nodes_.size());
        step_v_[depth].reserve(nodes_.size());
    }
}

void ParticleComposition::start(StageClock* clock) {
    clock_ = clock;
    std::vector<double> history = std::move(state_.history);
    std::fill(history.begin(), history.end(), 0.0);
    state_ = {};
    state_.history = std::move(history);
}

void ParticleComposition::advance(std::int64_t steps) {
    if (clock_) clock_->start();
    if (solver_ == ParticleSolver::none) {
        for (; steps > 0; --steps) {
            for (const double gamma : gammas_) drift_kick(gamma * h_);
            for (std::size_t node = 0; node < nodes_.x.size(); ++node)
                nodes_.x[node] += state_.pending * nodes_.v[node];
            state_.pending = 0.0;  // so that reading a sample changes no bit of what follows
        }
        return;
    }
    for (; steps > 0; --steps) {
        const int parts = state_.parts;
        for (int part = 0; part < parts; ++part) constrained_step(h_ / parts, 0);
        state_.halved_steps += parts - 1;
    }
}

/// Whether a step of that length was too long for the tension that its stages found; then those to come are parted.
/// Of K = Σ (T/l)(I − u uᵀ), pulling rows alone, M⁻¹ K has no eigenvalue above 2/m Σ T/l of some node: |b − a|² <= 2 |a|² + 2 |b|².
bool ParticleComposition::is_too_taut(double length) noexcept {
    const std::size_t count = rows_.size();
    std::fill(pull_.begin(), pull_.end(), 0.0);
    for (std::size_t k = 0; k < count; ++k) {
        double force = 0.0;
        for (std::size_t stage = 0; stage < gammas_.size(); ++stage)
            force = std::min(force, state_.history[3 * count * stage + k]);
        const double stiffness = -force * rows_.row[k].rest_inverse;
        pull_[static_cast<std::size_t>(rows_.row[k].a)] += stiffness;
        pull_[static_cast<std::size_t>(rows_.row[k].b)] += stiffness;
    }
    double rate = 0.0;
    for (std::size_t node = 0; node < pull_.size(); ++node)
        rate = std::max(rate, 2.0 * nodes_.w[node] * pull_[node]);
    const int parts = static_cast<int>(std::lround(h_ / length)),
              needed = parts_for_tension(longest_ * longest_ * rate, parts);
    state_.parts = std::max(state_.parts, needed);
    return needed > parts;
}

/// One step of length h. Where the equations have no solution near (a whip cracks within the step), or tension is too much for its
/// length, the step is taken back and done in two halves, and so on; the order stays, `halved_steps` counts it. When the smallest
/// part has none either, the state is lost: not a number from here on.
void ParticleComposition::constrained_step(double length, int depth) {
    const std::size_t count = rows_.size();
    if (state_.lost) return;
    if (depth > 0) Watch::look();  // halves of halves are thousands
    std::vector<Vec3>&x = step_x_[static_cast<std::size_t>(depth)],
    &v = step_v_[static_cast<std::size_t>(depth)];
    x = nodes_.x;
    v = nodes_.v;
    const double pending = state_.pending;
    bool solved = true;
    for (std::size_t stage = 0; stage < gammas_.size() && solved; ++stage)
        solved = constrained_stage(gammas_[stage] * length, state_.history.data() + 3 * count * stage);
    ++state_.stage_steps;
    const bool last = depth + 1 == MOST_HALVINGS;
    if (solved && (!is_too_taut(length) || last)) return;
    if (last) {
        state_.lost = true;
        for (Vec3& speed : nodes_.v) speed.x = std::numeric_limits<double>::quiet_NaN();
        return;
    }
    nodes_.x = x;
    nodes_.v = v;
    state_.pending = pending;
    ++state_.halved_steps;
    for (int half = 0; half < 2; ++half) {
        state_.stage_steps = half == 0 ? 0 : state_.stage_steps;
        if (half == 0) std::fill(state_.history.begin(), state_.history.end(), 0.0);
        constrained_step(0.5 * length, depth + 1);
    }
    state_.stage_steps = 0;
    std::fill(state_.history.begin(), state_.history.end(), 0.0);
}

/// Without rows: drift, kick, drift; the drifts of neighbouring stages are one.
void ParticleComposition::drift_kick(double tau) noexcept {
    const double drift = state_.pending + 0.5 * tau, part = tau / h_;
    for (std::size_t node = 0; node < nodes_.x.size(); ++node) nodes_.x[node] += drift * nodes_.v[node];
    if (clock_) clock_->mark(Stage::integrate_positions);
    find_kicks();
    for (std::size_t node = 0; node < nodes_.x.size(); ++node) nodes_.v[node] += part * nodes_.kick[node];
    state_.pending = 0.5 * tau;
    if (clock_)
        clock_->mark(
            {Stage::apply_central_gravity, Stage::apply_springs, Stage::apply_gravity, Stage::apply_loads});
}

void ParticleComposition::find_kicks() noexcept {
    if (forces_.any()) forces_.find_kicks(nodes_, h_);
}

/// `history` holds this stage's forces one, two and three steps ago. False if no solution was found.
bool ParticleComposition::constrained_stage(double tau, double* history) {
    const double span = state_.pending + 0.5 * tau, part = span / h_;
    find_kicks();
    if (clock_ && forces_.any()) clock_->mark({Stage::apply_central_gravity, Stage::apply_springs});
    extrapolate(span, history);
    if (solver_ == ParticleSolver::path) predict_paths(part);
    else predict_blocks(part);
    if (clock_) clock_->mark(Stage::assemble_rows);
    if (!find_impulses(tau)) return false;
    if (clock_) clock_->mark(solver_ == ParticleSolver::path ? Stage::solve_path : Stage::solve_block);
    const std::size_t count = rows_.size();
    double *one = history, *two = history + count, *three = history + 2 * count;
    const double per_span = 1.0 / span;
    for (std::size_t k = 0; k < count; ++k) {
        three[k] = two[k];
        two[k] = one[k];
        one[k] = rows_.link[k].lambda * per_span;
    }
    for (std::size_t node = 0; node < nodes_.x.size(); ++node) nodes_.x[node] += tau * nodes_.v[node];
    state_.pending = 0.5 * tau;
    if (clock_) clock_->mark(Stage::integrate_positions);
    return true;
}

/// Where to look for impulses over `span`: by the forces of as many steps as there were, up to three.
void ParticleComposition::extrapolate(double span, const double* history) noexcept {
    const std::size_t count = rows_.size();
    const double *one = history, *two = history + count, *three = history + 2 * count;
    const std::int64_t steps = state_.stage_steps;
    const double a1 = steps >= 3 ? 3.0 : steps == 2 ? 2.0 : 1.0;
    const double a2 = steps >= 3 ? -3.0 : steps == 2 ? -1.0 : 0.0, a3 = steps >= 3 ? 1.0 : 0.0;
    for (std::size_t k = 0; k < count; ++k)
        rows_.link[k].lambda = span * (a1 * one[k] + a2 * two[k] + a3 * three[k]);
}

void ParticleComposition::predict_blocks(double part) noexcept {
    for (std::size_t k = 0; k < rows_.size(); ++k)
        rows_.link[k].u = rows_.row[k].rest_inverse * (nodes_.x[rows_.row[k].b] - nodes_.x[rows_.row[k].a]);
    for (std::size_t node = 0; node < nodes_.v.size(); ++node) nodes_.v[node] += part * nodes_.kick[node];
    rows_.push(nodes_, nodes_.v);
}

/// Impulses with which the rows hold after τ, by Newton's method. False if they are not near.
bool ParticleComposition::find_impulses(double tau) {
    double before = std::numeric_limits<double>::infinity();
    bool fresh = true;
    for (int iteration = 0;; ++iteration) {
        const double off =
            solver_ == ParticleSolver::path ? lengthen_paths(tau, fresh) : lengthen_blocks(tau, fresh);
        const double ratio = off / before;
        ++state_.newton_iterations;
        if (off <= SETTLED || (off < 1e-12 && ratio > 0.5)) return true;  // settled, or down in the rounding
        if (!(off < FARTHEST) || iteration == MOST_ITERATIONS) return false;
        fresh = iteration > 0 && ratio > SLOW;
        if (solver_ == ParticleSolver::path) shorten_paths();
        else shorten_blocks();
        // What is left is below rounding already: by Newton's rate, or by that of the kept factor.
        if (off * (iteration == 0 ? 100.0 * off : ratio) <= 0.1 * SETTLED) return true;
        before = off;
    }
}

/// Residual of every row and the way down: L U of the Jacobian if `fresh`, else forward substitution only.
/// Returns the largest |d₊²/L² − 1|; lambda keeps the impulse so far.
double ParticleComposition::lengthen_paths(double tau, bool fresh) noexcept {
    double worst = 0.0;
    for (std::size_t path = 0; path + 1 < paths_.first().size(); ++path) {
        const int first = paths_.first()[path], end = paths_.first()[path + 1];
        double y = 0.0, inverse = 0.0, upper = 0.0;
        for (int k = first; k < end; ++k) {
            const Row& row = rows_.row[k];
            Link& link = rows_.link[k];
            const Vec3 ahead = row.rest * link.u + tau * (nodes_.v[row.b] - nodes_.v[row.a]);
            const double residual = dot(ahead, ahead) - row.rest * row.rest;
            worst = std::max(worst, std::fabs(residual) * row.rest_inverse_square);
            if (residual != residual) return residual;
            if (fresh) {
                const Vec3 scaled = tau * ahead;
                const double along = dot(ahead, link.u);
                if (along < LEAST_ALONG * row.rest) return std::numeric_limits<double>::infinity();
                const double diagonal = row.stiff * tau * along;
                const double left = k > first ? -nodes_.w[row.a] * dot(scaled, rows_.link[k - 1].u) : 0.0;
                link.lower = left * inverse;
                inverse = 1.0 / (diagonal - link.lower * upper);
                upper = k + 1 < end ? -nodes_.w[row.b] * dot(scaled, rows_.link[k + 1].u) : 0.0;
                link.pivot_inverse = inverse;
                upper_[k] = upper;
            }
            link.y = y = -0.5 * residual - link.lower * y;
        }
    }
    return worst;
}

/// The way up: the changes of the impulses, into λ and the velocities.
void ParticleComposition::shorten_paths() noexcept {
    for (std::size_t path = 0; path + 1 < paths_.first().size(); ++path) {
        double change = 0.0;
        Vec3 out;
        const int first = paths_.first()[path], end = paths_.first()[path + 1];
        for (int k = end - 1; k >= first; --k) {
            Link& link = rows_.link[k];
            change = (link.y - upper_[k] * change) * link.pivot_inverse;
            link.lambda += change;
            const Vec3 in = change * link.u;
            nodes_.v[rows_.row[k].b] += nodes_.w[rows_.row[k].b] * (in - out);
            out = in;
        }
        nodes_.v[rows_.row[first].a] -= nodes_.w[rows_.row[first].a] * out;
    }
}

/// Kicks and predicted impulses, node by node.
void ParticleComposition::predict_paths(double part) noexcept {
    int node = 0;
    for (std::size_t path = 0; path + 1 < paths_.first().size(); ++path) {
        Vec3 in, here = nodes_.x[node];
        for (int k = paths_.first()[path]; k < paths_.first()[path + 1]; ++k, ++node) {
            Link& link = rows_.link[k];
            const Vec3 next = nodes_.x[node + 1];
            link.u = rows_.row[k].rest_inverse * (next - here);
            const Vec3 out = link.lambda * link.u;
            nodes_.v[node] += part * nodes_.kick[node] + nodes_.w[node] * (in - out);
            in = out;
            here = next;
        }
        nodes_.v[node] += part * nodes_.kick[node] + nodes_.w[node] * in;
        ++node;
    }
    for (; node < static_cast<int>(nodes_.v.size()); ++node) nodes_.v[node] += part * nodes_.kick[node];
}

/// The same for rows that branch or close loops: the symmetric matrix at the start of the stage, so the iteration
/// converges by a factor of about the angle turned in a stage.
double ParticleComposition::lengthen_blocks(double tau, bool fresh) {
    double worst = 0.0;
    if (fresh) {
        saddle_.factor_rigidly(nodes_, rows_);
    }
    for (std::size_t k = 0; k < rows_.row.size(); ++k) {
        const Row& row = rows_.row[k];
        const Vec3 ahead = row.rest * rows_.link[k].u + tau * (nodes_.v[row.b] - nodes_.v[row.a]);
        const double residual = dot(ahead, ahead) - row.rest * row.rest;
        if (residual != residual) return residual;
        worst = std::max(worst, std::fabs(residual) * row.rest_inverse_square);
        rows_.link[k].rhs = -0.5 * residual / (tau * row.rest);
    }
    return worst;
}

void ParticleComposition::shorten_blocks() {
    for (std::size_t k = 0; k < rows_.row.size(); ++k) impulse_[k] = rows_.link[k].lambda;
    saddle_.substitute(nodes_, rows_);
    rows_.push(nodes_, nodes_.v);
    for (std::size_t k = 0; k < rows_.row.size(); ++k) rows_.link[k].lambda += impulse_[k];
}

/// λ such that G M⁻¹ Gᵀ λ = rhs, rigidly.
void ParticleComposition::solve_rigidly() {
    if (solver_ == ParticleSolver::block) {
        saddle_.factor_rigidly(nodes_, rows_);
        return saddle_.substitute(nodes_, rows_);
    }
    paths_.factor(nodes_, rows_, true);
    paths_.substitute(rows_);
}

/// Kicks up to where the step ended, by forces as they were: what is set from outside acts from there on.
void ParticleComposition::catch_up() {
    if (state_.pending == 0.0) return;
    find_kicks();
    const double part = state_.pending / h_;
    for (std::size_t node = 0; node < nodes_.v.size(); ++node) nodes_.v[node] += part * nodes_.kick[node];
    state_.pending = 0.0;
}

/// What is seen at the end of a step, without changing what goes on: velocities kicked and projected to the sample,
/// forces from the accelerations there.
void ParticleComposition::read(Seen& seen) {
    if (solver_ == ParticleSolver::none) {
        seen.v = nodes_.v;
        return;
    }
    find_kicks();
    const double part = state_.pending / h_;
    seen.v = nodes_.v;
    for (std::size_t node = 0; node < nodes_.x.size(); ++node) seen.v[node] += part * nodes_.kick[node];
    for (std::size_t k = 0; k < rows_.row.size(); ++k) {
        const Row& row = rows_.row[k];
        rows_.link[k].u = (1.0 / row.rest) * (nodes_.x[row.b] - nodes_.x[row.a]);
        rows_.link[k].rhs = -dot(rows_.link[k].u, seen.v[row.b] - seen.v[row.a]);
    }
    solve_rigidly();
    rows_.push(nodes_, seen.v);
    for (std::size_t k = 0; k < rows_.row.size(); ++k) {
        const Row& row = rows_.row[k];
        const Vec3 dv = seen.v[row.b] - seen.v[row.a];
        rows_.link[k].rhs =
            -dot(rows_.link[k].u, nodes_.kick[row.b] - nodes_.kick[row.a]) - h_ * dot(dv, dv) / row.rest;
    }
    if (solver_ == ParticleSolver::block) saddle_.substitute(nodes_, rows_);
    else paths_.substitute(rows_);
    for (std::size_t k = 0; k < rows_.row.size(); ++k) seen.lambda[k] = rows_.link[k].lambda;
}

}  // namespace spook

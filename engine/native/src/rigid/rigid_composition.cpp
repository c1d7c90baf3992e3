// Symmetric compositions of a symmetric constrained step of rigid bodies, for smooth scenes.
//
// The base step over τ is RATTLE (Andersen 1983) with the variational turn of rotation.hpp: half a kick, the free
// motion of all momenta, which ends on the constraints, half a kick. The impulses Gᵀ Λ act at its start; those Λ
// are sought for which it ends at g = 0. RATTLE also projects the momenta at the end; that acts along the same
// directions as the next impulses, so one solve per stage finds both, and momenta are projected where they are
// read. So are the kicks at the end of a stage and the beginning of the next one kick: momenta live at mid-stage,
// and `pending` is the half stage they still have to be kicked. Rows are held rigidly: their compliance would only
// add the static stretch eps F.
//
// Λ is found by iteration with the matrix at the start of the stage, which contracts by about the angle turned in
// it, accelerated, from forces extrapolated from the same stage of the steps before.
#include <algorithm>
#include <cmath>
#include <limits>

#include "rigid/rigid_system.hpp"
#include "run/composition.hpp"

namespace spook {

namespace {

constexpr double SETTLED = 2e-15;  // of the joint's size: rounding level
constexpr int MOST_ITERATIONS = 30;
constexpr int MIXED = 6;           // rounds that are remembered
constexpr double SINGULAR = 1e-4;  // of its scale: pivots below it belong to rows that become redundant
constexpr double NEAR =
    1e-11;  // of the joint's size: what rounds show below it is the rounding of redundant rows
constexpr double FARTHEST = 0.3;  // of the joint's size, at the prediction: beyond it lie other solutions

}  // namespace

void RigidSystem::start_composition() {
    const std::size_t rows = static_cast<std::size_t>(rows_);
    live_.history.assign(3 * rows * composition_stages(method_.composition).size(), 0.0);
    trial_ = live_.bodies;
    violation_.assign(rows, 0.0);
    bias_.assign(rows, 0.0);
    multiplier_.assign(rows, 0.0);
    change_ = last_plain_ = last_step_ = multiplier_;
    mixing_.assign(2 * rows * MIXED, 0.0);
    if (solver_ != RigidSolver::block) return;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int i = 0; i < joints_.blocks()[k].size; ++i) matrix_.diagonal(k)[i] = -0.0;
}

void RigidSystem::compose(std::int64_t steps) {
    if (clock_) clock_->start();
    for (; steps > 0; --steps) {
        composed_step(h_, 0);
        joints_.follow(live_.bodies);
    }
}

/// One step of length h. Where the equations have no solution near, the step is taken back and done in two halves,
/// and so on; the order stays, `halved_steps` counts it. When the smallest part has none either, the state is lost.
void RigidSystem::composed_step(double h, int depth) {
    if (live_.lost >= 0) return;
    const std::span<const double> stages = composition_stages(method_.composition);
    const std::size_t rows = static_cast<std::size_t>(rows_);
    LargeArray<BodyState>& start = step_start_[depth];
    start = live_.bodies;
    const double pending = live_.pending;
    bool solved = true;
    for (std::size_t stage = 0; stage < stages.size() && solved; ++stage)
        solved = composed_stage(stages[stage] * h, live_.history.data() + 3 * rows * stage);
    ++live_.stage_steps;
    if (solved) return;
    if (depth + 1 == MOST_HALVINGS) {
        live_.lost = tied_.empty() ? free_.front() : tied_.front();
        return;
    }
    live_.bodies = start;
    live_.pending = pending;
    ++live_.halved_steps;
    for (int half = 0; half < 2; ++half) {
        live_.stage_steps = half == 0 ? 0 : live_.stage_steps;
        if (half == 0) std::fill(live_.history.begin(), live_.history.end(), 0.0);
        composed_step(0.5 * h, depth + 1);
    }
    live_.stage_steps = 0;
    std::fill(live_.history.begin(), live_.history.end(), 0.0);
}

void RigidSystem::kick_all(double span) {
    if (!force_.empty()) apply_forces();
    for (int i = 0; i < bodies(); ++i) {
        const BodyConstants& body = constants_[i];
        if (!body.moves()) continue;
        BodyState& s = live_.bodies[i];
        s.velocity += (span / h_) * kick(i);
        s.angular_momentum += span * body.torque;
    }
}

/// Momenta += Gᵀ Λ with the Jacobians as assembled.
void RigidSystem::push(const double* multipliers) {
    const auto blocks = joints_.blocks();
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        for (const bool second : {false, true}) {
            const int body = second ? blocks[k].second : blocks[k].first;
            if (body < 0 || !constants_[body].moves()) continue;
            const double* j = jacobian(static_cast<int>(k), second);
            Vec3 force, torque;
            for (int i = 0; i < blocks[k].size; ++i, j += 6) {
                force += multipliers[i] * Vec3{j[0], j[1], j[2]};
                torque += multipliers[i] * Vec3{j[3], j[4], j[5]};
            }
            live_.bodies[body].velocity += (1.0 / constants_[body].mass) * force;
            if (!constants_[body].particle) live_.bodies[body].angular_momentum += torque;
        }
        multipliers += blocks[k].size;
    }
}

/// Violations where the momenta lead in τ; the largest, in sizes of its joint; infinite when a body turns too fast.
double RigidSystem::violations_ahead(double tau) {
    for (const std::vector<int>* some : {&tied_, &driven_})
        for (int i : *some) {
            trial_[i] = live_.bodies[i];
            if (!move(constants_[i], tau, trial_[i])) return std::numeric_limits<double>::infinity();
        }
    violations_at(trial_, violation_.data());
    double worst = 0.0;
    std::size_t row = 0;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int i = 0; i < joints_.blocks()[k].size; ++i, ++row) {
            const double off = std::fabs(violation_[row]) / joints_.gain(k, i).extent;
            if (!(off <= worst)) worst = off;
        }
    return worst;
}

/// Anderson's mixing (J. ACM 12 (1965) 547): takes out of the step bias_ what the rounds before this one have shown of
/// the difference between the matrix at the start of the stage and the true derivative. `kept` pairs are remembered.
void RigidSystem::mix(int iteration, int& kept) {
    const std::size_t rows = static_cast<std::size_t>(rows_);
    if (iteration > 0 && kept < MIXED) {
        // One more pair: how the plain step changed (made orthonormal) when Λ went on by so much.
        double* turned = mixing_.data() + 2 * rows * static_cast<std::size_t>(kept);
        double* moved = turned + rows;
        for (std::size_t row = 0; row < rows; ++row) {
            turned[row] = bias_[row] - last_plain_[row];
            moved[row] = last_step_[row] + turned[row];
        }
        double all = 0.0, left = 0.0;
        for (std::size_t row = 0; row < rows; ++row) all += turned[row] * turned[row];
        for (int k = 0; k < kept; ++k) {
            const double* q = mixing_.data() + 2 * rows * static_cast<std::size_t>(k);
            double share = 0.0;
            for (std::size_t row = 0; row < rows; ++row) share += q[row] * turned[row];
            for (std::size_t row = 0; row < 2 * rows; ++row) turned[row] -= share * q[row];
        }
        for (std::size_t row = 0; row < rows; ++row) left += turned[row] * turned[row];
        if (left > 1e-8 * all) {
            const double scale = 1.0 / std::sqrt(left);
            for (std::size_t row = 0; row < 2 * rows; ++row) turned[row] *= scale;
            ++kept;
        }
    }
    std::copy(bias_.begin(), bias_.end(), last_plain_.begin());
    for (int k = 0; k < kept; ++k) {
        const double* q = mixing_.data() + 2 * rows * static_cast<std::size_t>(k);
        double share = 0.0;
        for (std::size_t row = 0; row < rows; ++row) share += q[row] * last_plain_[row];
        for (std::size_t row = 0; row < rows; ++row) bias_[row] -= share * q[rows + row];
    }
}

/// Iterates Λ until the rows hold where the momenta lead in τ, each round with the matrix at the start of the stage.
/// change_: what Λ has gained. False if it does not come near.
bool RigidSystem::hold_rows(double tau, double floor) {
    const std::size_t rows = static_cast<std::size_t>(rows_);
    change_.assign(rows, 0.0);
    if (!matrix_.factor(floor)) return false;
    double before = std::numeric_limits<double>::infinity();
    int kept = 0;
    bool plain = false;
    for (int iteration = 0;; ++iteration) {
        const double off = violations_ahead(tau), ratio = off / before;
        ++live_.newton_iterations;
        if (off <= SETTLED) return true;
        if (off < 1e-12 &&
            ratio > 0.5) {  // down in the rounding, which mixing of redundant rows makes larger
            if (plain) return true;
            plain = true;
        }
        if (!(off < FARTHEST) || iteration == MOST_ITERATIONS) return false;
        std::fill(solution_.begin(), solution_.end(), 0.0);
        for (std::size_t row = 0; row < rows; ++row) solution_[row] = -violation_[row] / tau;
        matrix_.solve(solution_.data());
        for (std::size_t row = 0; row < rows; ++row) bias_[row] = -solution_[row];
        if (!plain) mix(iteration, kept);
        std::copy(bias_.begin(), bias_.end(), last_step_.begin());
        for (std::size_t row = 0; row < rows; ++row) {
            multiplier_[row] += bias_[row];
            change_[row] += bias_[row];
        }
        push(bias_.data());
        before = off;
    }
}

/// `history` holds this stage's forces one, two and three steps ago. False if no solution was found.
bool RigidSystem::composed_stage(double tau, double* history) {
    const std::size_t rows = static_cast<std::size_t>(rows_);
    const double span = live_.pending + 0.5 * tau;
    kick_all(span);
    if (clock_) clock_->mark(Stage::apply_gravity);
    if (solver_ == RigidSolver::block) {
        assemble_blocks();
        fill_inertias();
        double *one = history, *two = history + rows, *three = history + 2 * rows;
        const std::int64_t seen = live_.stage_steps;
        const double a1 = seen >= 3 ? 3.0 : seen == 2 ? 2.0 : 1.0;
        const double a2 = seen >= 3 ? -3.0 : seen == 2 ? -1.0 : 0.0, a3 = seen >= 3 ? 1.0 : 0.0;
        for (std::size_t row = 0; row < rows; ++row)
            multiplier_[row] = span * (a1 * one[row] + a2 * two[row] + a3 * three[row]);
        push(multiplier_.data());
        if (clock_) clock_->mark(Stage::assemble_rows);
        if (!hold_rows(tau, method_.floor)) {
            // Near a singular position the chord along the rows that become redundant points the wrong way:
            // again from the same momenta, with little trust in those rows.
            for (std::size_t row = 0; row < rows; ++row) bias_[row] = -change_[row];
            push(bias_.data());
            for (std::size_t row = 0; row < rows; ++row) multiplier_[row] += bias_[row];
            if (!hold_rows(tau, SINGULAR)) return false;
        }
        for (std::size_t row = 0; row < rows; ++row) {
            three[row] = two[row];
            two[row] = one[row];
            one[row] = multiplier_[row] / span;
        }
        for (int i : tied_) {
            live_.bodies[i] = trial_[i];
            if (!constants_[i].particle) refresh(constants_[i], live_.bodies[i]);
        }
        if (clock_) clock_->mark(Stage::solve_block);
    } else {
        for (int i : tied_) integrate_body(i);
    }
    for (const std::vector<int>* some : {&free_, &driven_})
        for (int i : *some)
            if (!integrate(constants_[i], tau, live_.bodies[i])) return false;
    live_.pending = 0.5 * tau;
    if (clock_) clock_->mark(Stage::integrate_positions);
    return true;
}

/// What is seen at the end of a step: momenta kicked and projected to the sample, forces from the accelerations
/// there.
void RigidSystem::read_composition() {
    kick_all(live_.pending);
    for (int i = 0; i < bodies(); ++i)
        if (constants_[i].moves() && !constants_[i].particle) refresh(constants_[i], live_.bodies[i]);
    if (solver_ != RigidSolver::block || live_.lost >= 0) return;
    const std::size_t rows = static_cast<std::size_t>(rows_);
    const auto blocks = joints_.blocks();
    const auto solve = [&] {  // multiplier_ from the rows' right sides
        if (!factor_and_solve()) live_.not_solved = tied_.front();
        for (std::size_t row = 0; row < rows; ++row) multiplier_[row] = -solution_[row];
    };
    assemble_blocks();
    fill_inertias();
    std::fill(right_.begin(), right_.end(), 0.0);
    std::size_t row = 0;
    for (int k = 0; k < static_cast<int>(blocks.size()); ++k)
        for (int i = 0; i < blocks[k].size; ++i, ++row) right_[row] = -row_speed(k, i, false);
    solve();
    push(multiplier_.data());
    for (int i : tied_)
        if (!constants_[i].particle) refresh(constants_[i], live_.bodies[i]);
    find_bias(bias_.data());
    double* right = right_.data() + rows;
    for (row = 0; row < rows; ++row) right_[row] = -h_ * bias_[row];
    for (int i : tied_) {
        const Vec3 p = constants_[i].mass * kick(i), l = h_ * constants_[i].torque;
        for (int k = 0; k < 3; ++k) *right++ = p[k];
        for (int k = 0; k < 3 && !constants_[i].particle; ++k) *right++ = l[k];
    }
    solve();
    const double* multiplier = multiplier_.data();
    for (const JointBlock& block : blocks) {
        std::copy_n(multiplier, block.size, joints_.states[block.joint].multiplier.data());
        multiplier += block.size;
    }
}

}  // namespace spook

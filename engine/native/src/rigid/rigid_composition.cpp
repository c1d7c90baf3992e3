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
// Λ is sought (rigid_hold.cpp) from forces extrapolated from the same stage of the steps before. Small trees of
// joints are solved in joint coordinates instead (joint_tree.hpp), extrapolated likewise; where that finds nothing,
// Λ is sought after all.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "rigid/joint_pulls.hpp"
#include "rigid/joint_spring_kicks.hpp"
#include "rigid/readings.hpp"
#include "rigid/rigid_composition.hpp"
#include "rigid/rotors.hpp"
#include "rigid/tolerances.hpp"
#include "run/composition.hpp"
#include "run/watch.hpp"

namespace spook {

using namespace tolerances::rigid_composition;

Refusal RigidComposition::take() {
    const bool tilted =  // joint coordinates see inertias along the bodies' own axes
        std::any_of(model_.constants.begin(), model_.constants.end(),
                    [](const BodyConstants& body) { return body.tilted; });
    if (tilted) return "axes of some body are not those of its inertia";
    const Refusal refusal = tree_.analyse(model_.constants, joints_, model_.constrained, model_.start);
    return refusal || tree_.holds(model_.start) ? refusal : "joints do not hold where the scene begins";
}

void RigidComposition::begin() {
    const std::size_t rows = rows_.rows();
    const std::size_t stages = composition_stages(model_.method.composition).size();
    in_tree_ = tree_.coordinates() > 0 && tree_.holds(live_.bodies);
    unknowns_ = in_tree_ ? static_cast<std::size_t>(tree_.coordinates()) : rows;
    live_.history.assign(static_cast<std::size_t>(max_differences) * unknowns_ * stages, 0.0);
    live_.guess_order.assign(stages, 0);
    pace_.assign(std::max(rows, unknowns_), 0.0);
    multiplier_.assign(std::max(rows, unknowns_), 0.0);
    hold_.begin();
    if (!model_.bilateral) return;
    for (int k = 0; k < static_cast<int>(joints_.blocks().size()); ++k)
        for (int i = 0; i < joints_.blocks()[k].size; ++i)
            if (i != joints_.blocks()[k].rotor) rows_.matrix.diagonal(k)[i] = -0.0;
    turn_rotors();
}

/// As their joints go.
void RigidComposition::turn_rotors() noexcept {
    for (const int k : joints_.rotors())
        joints_.states[joints_.blocks()[k].joint].rotor = rotor_speed(joints_, k, live_.bodies);
}

void RigidComposition::project() {
    read();
    turn_rotors();
}

void RigidComposition::compose(std::int64_t steps) {
    clock_.start();
    for (; steps > 0; --steps) {
        if (model_.bilateral && live_.tension_look-- <= 0) look_at_tension();
        for (int part = 0; part < live_.parts; ++part) step(model_.h / live_.parts, 0);
        live_.halved_steps += live_.parts - 1;
        joints_.follow(live_.bodies);
        live_.energy.most_kinetic =
            std::max(live_.energy.most_kinetic, kinetic_energy(model_, live_, joints_));
    }
}

/// The square of the rate at which tension turns a body back, of the fastest one, 1/s²: a force F that pulls at its arm r does so with
/// F r/I, and shakes it sideways with F/(m r). A light link under a heavy load does so at many times the rate of its swing.
double RigidComposition::tension_rate(double allowed) {
    LargeArray<BodyState>& going = step_start_[0];
    going = live_.bodies;
    read();
    live_.bodies.swap(going);
    const auto rows = [this](int k) { return rows_.jacobian(k, true); };
    std::vector<double>& rates = rates_;
    rates.assign(model_.constants.size(), 0.0);
    each_pull(joints_, model_.solver_index, model_.constants, rows, [&](int b, Vec3 arm, Vec3 impulse) {
        const double pull = dot(arm, impulse) / model_.h, length2 = dot(arm, arm);
        if (!(pull > 0.0) || length2 == 0.0) return;
        const Vec3 inertia = model_.constants[b].inertia;
        // Of the two axes across the arm the easier one; the third, along a slender body, turns freely.
        const double across = inertia.x + inertia.y + inertia.z -
                              std::max({inertia.x, inertia.y, inertia.z}) -
                              std::min({inertia.x, inertia.y, inertia.z});
        // A body goes sideways by turning about its joint: near its centre that is a turn, however light it is.
        rates[b] += pull * (1.0 / across + 1.0 / std::max(model_.constants[b].mass * length2, across));
    });
    const double most = *std::max_element(rates.begin(), rates.end());
    if (!(most > allowed)) return most;

    // Each body by itself would shake so; joints may tie light ones to heavy ones. The fastest turning that joints allow, by power
    // iteration of M⁻¹ K, with K of the forces on its arms, from a start in which light bodies turn most.
    std::vector<Mat3> stiffness(model_.constrained.size());
    each_pull(joints_, model_.solver_index, model_.constants, rows, [&](int b, Vec3 arm, Vec3 impulse) {
        const Vec3 force = (1.0 / model_.h) * impulse;
        Mat3& held = stiffness[model_.solver_index[b]];
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                held(i, j) +=
                    (i == j ? dot(force, arm) : 0.0) - 0.5 * (force[i] * arm[j] + arm[i] * force[j]);
    });
    std::vector<Vec3> turn;
    for (const int i : model_.constrained) {
        const Vec3 own = model_.constants[i].inertia;
        const double light = model_.constants[i].particle ? 0.0 : 1.0 / (own.x + own.y + own.z);
        turn.push_back(light * Vec3{1.0 - 0.3 * (i % 4), 0.4 * (i % 3) - 0.5, 0.7 - 0.25 * (i % 5)});
    }
    double fastest = most;
    for (int round = 0; round < power_iterations; ++round) {
        std::fill(rows_.right.begin(), rows_.right.end(), 0.0);
        for (std::size_t k = 0; k < model_.constrained.size(); ++k) {
            if (model_.constants[model_.constrained[k]].particle) continue;
            const Vec3 torque = stiffness[k] * turn[k];
            std::copy_n(&torque.x, 3, rows_.right.data() + rows_.body_at(k) + 3);
        }
        rows_.solve_again();
        double size = 0.0;
        for (std::size_t k = 0; k < model_.constrained.size(); ++k) {
            const int i = model_.constrained[k];
            const double* x = rows_.solution.data() + rows_.body_at(k);
            size += model_.constants[i].mass * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
            if (model_.constants[i].particle) continue;
            turn[k] = {x[3], x[4], x[5]};
            size += dot(turn[k], live_.bodies[i].inertia * turn[k]);
        }
        size = std::sqrt(size);
        if (!(size > 0.0) || !std::isfinite(size)) break;
        if (round > 0) fastest = size;  // the first is of the start
        for (Vec3& each : turn) each = (1.0 / size) * each;
    }
    return std::min(most, rate_safety * fastest);
}

/// Steps whose longest stage is too long for the tension are taken in parts, in halves of halves; once parted they remain so.
void RigidComposition::look_at_tension() {
    const double longest = model_.h * longest_stage(model_.method.composition);
    const double near = near_limit * max_tension_turn;
    const double turned =
        longest * longest * tension_rate(near * live_.parts * live_.parts / (longest * longest));
    const int parts = parts_for_tension(turned, live_.parts);
    live_.tension_look = turned > near * parts * parts ? often : seldom;
    if (parts == live_.parts) return;
    live_.parts = parts;
    live_.stage_steps = 0;
    forget();
    std::fill(live_.guess_order.begin(), live_.guess_order.end(), 0);
}

/// One step of length h. Where the equations have no solution near, the step is taken back and done in two halves,
/// and so on; the order stays, `halved_steps` counts it. When the smallest part has none either, the state is lost.
void RigidComposition::step(double h, int depth) {
    if (live_.lost >= 0) return;
    if (depth > 0) Watch::look();  // halves of halves are thousands
    const std::span<const double> stages = composition_stages(model_.method.composition);
    LargeArray<BodyState>& start = step_start_[depth];
    start = live_.bodies;
    const double pending = live_.pending;
    std::vector<double> rotors;
    for (const int k : joints_.rotors()) rotors.push_back(joints_.states[joints_.blocks()[k].joint].rotor);
    bool solved = true;
    for (std::size_t stage = 0; stage < stages.size() && solved; ++stage)
        solved = this->stage(stages[stage] * h, stage);
    ++live_.stage_steps;
    if (solved) return;
    if (depth + 1 == MOST_HALVINGS) {
        live_.lost = model_.constrained.empty() ? model_.free.front() : model_.constrained.front();
        return;
    }
    live_.bodies = start;
    for (std::size_t i = 0; i < rotors.size(); ++i)
        joints_.states[joints_.blocks()[joints_.rotors()[i]].joint].rotor = rotors[i];
    live_.pending = pending;
    ++live_.halved_steps;
    for (int half = 0; half < 2; ++half) {
        live_.stage_steps = half == 0 ? 0 : live_.stage_steps;
        if (half == 0) forget();
        step(0.5 * h, depth + 1);
    }
    live_.stage_steps = 0;
    forget();
}

void RigidComposition::kick_all(double span) {
    if (forces_.loads_change())
        forces_.find_loads(static_cast<double>(live_.moved) *
                           model_.h);  // a composition itself: springs alone
    forces_.find();
    for (int i = 0; i < model_.bodies(); ++i) {
        const BodyConstants& body = model_.constants[i];
        if (!body.moves()) continue;
        BodyState& s = live_.bodies[i];
        s.velocity += (span / model_.h) * forces_.kick(i);
        s.angular_momentum += span * body.torque;
    }
    pull_by_springs(joints_, model_.constants, live_.bodies, [&](const JointSpringPull& pull) {
        BodyState& s = live_.bodies[pull.body];
        s.velocity += (span / model_.constants[pull.body].mass) * pull.force;
        if (!model_.constants[pull.body].particle) s.angular_momentum += span * pull.torque;
    });
}

/// What is set from outside acts from here on: up to here momenta are kicked as it was before.
void RigidComposition::catch_up() {
    if (live_.pending == 0.0) return;
    kick_all(live_.pending);
    live_.pending = 0.0;
}

/// What a stage will need, impulses or moves of joints, from their paces in the steps before: their differences from
/// step to step, as many as would have told the last one best.
void RigidComposition::guess(std::size_t stage, double span) {
    const double* difference =
        live_.history.data() + static_cast<std::size_t>(max_differences) * unknowns_ * stage;
    std::fill(multiplier_.begin(), multiplier_.end(), 0.0);
    for (int k = 0; k < live_.guess_order[stage]; ++k)
        for (std::size_t i = 0; i < unknowns_; ++i) multiplier_[i] += span * *difference++;
}

/// The k-th difference of a new pace is what k differences before it failed to tell.
void RigidComposition::remember(std::size_t stage, double span) {
    double* difference = live_.history.data() + static_cast<std::size_t>(max_differences) * unknowns_ * stage;
    // A loop can come to a singular position, where long extrapolation leads into another of its branches.
    const bool loops = !in_tree_ && joints_.count() > static_cast<int>(model_.constrained.size());
    const auto known =
        static_cast<int>(std::min<std::int64_t>(live_.stage_steps, loops ? 3 : max_differences - 1));
    for (std::size_t i = 0; i < unknowns_; ++i) pace_[i] = multiplier_[i] / span;
    double least = std::numeric_limits<double>::infinity();
    bool falling = true;  // beyond the first that grows they tell of noise, or of a sudden change
    live_.guess_order[stage] = 1;
    for (int k = 0;; ++k) {
        double size = 0.0;
        for (std::size_t i = 0; i < unknowns_; ++i, ++difference) {
            size += std::fabs(pace_[i]);
            const double before = *difference;
            *difference = pace_[i];
            pace_[i] -= before;
        }
        if (k > 0 && falling && size < least) least = size, live_.guess_order[stage] = k;
        else falling = k == 0;
        if (k == known) return;
    }
}

void RigidComposition::forget() { std::fill(live_.history.begin(), live_.history.end(), 0.0); }

void RigidComposition::forget(std::size_t stage) {
    const std::size_t numbers = static_cast<std::size_t>(max_differences) * unknowns_;
    std::fill_n(live_.history.begin() + static_cast<std::ptrdiff_t>(numbers * stage), numbers, 0.0);
    live_.guess_order[stage] = 0;
}

/// Tied bodies to the end of a stage, on their rows. False if no solution was found.
bool RigidComposition::hold_stage(double tau, double span, std::size_t stage) {
    if (in_tree_) {
        guess(stage, tau);
        if (tree_.stage(tau, live_.bodies, joints_, multiplier_.data(), live_.newton_iterations)) {
            remember(stage, tau);
            return true;
        }
        forget(stage);
        std::fill(multiplier_.begin(), multiplier_.end(), 0.0);
    }
    rows_.assemble();
    if (!in_tree_) guess(stage, span);
    rows_.push(multiplier_.data());
    clock_.mark(Stage::assemble_rows);
    if (!hold_.hold(tau, multiplier_)) return false;
    for (const int k : joints_.rotors()) {
        const JointBlock& block = joints_.blocks()[k];
        joints_.states[block.joint].rotor -=
            block.softness[block.rotor] * multiplier_[rows_.matrix.offset(k) + block.rotor];
    }
    if (!in_tree_) remember(stage, span);
    return true;
}

/// False if no solution was found.
bool RigidComposition::stage(double tau, std::size_t stage) {
    const double span = live_.pending + 0.5 * tau;
    kick_all(span);
    clock_.mark({Stage::apply_gravity, Stage::apply_loads});
    if (model_.bilateral) {
        if (!hold_stage(tau, span, stage)) return false;
        clock_.mark(Stage::solve_block);
    } else {
        for (int i : model_.constrained) spook::integrate(model_.constants[i], model_.h, live_.bodies[i]);
    }
    for (const std::vector<int>* some : {&model_.free, &model_.driven})
        for (int i : *some) spook::integrate(model_.constants[i], tau, live_.bodies[i]);
    live_.pending = 0.5 * tau;
    clock_.mark(Stage::integrate_positions);
    return true;
}

/// What is seen at the end of a step: momenta kicked and projected to the sample, forces from the accelerations
/// there.
void RigidComposition::read() {
    kick_all(live_.pending);
    for (int i = 0; i < model_.bodies(); ++i)
        if (model_.constants[i].moves() && !model_.constants[i].particle)
            refresh(model_.constants[i], live_.bodies[i]);
    if (!model_.bilateral || live_.lost >= 0) return;
    const std::size_t rows = rows_.rows();
    const auto blocks = joints_.blocks();
    const auto take = [&] {
        for (std::size_t row = 0; row < rows; ++row) multiplier_[row] = -rows_.solution[row];
    };
    rows_.assemble();
    rows_.fill_inertias();
    std::fill(rows_.right.begin(), rows_.right.end(), 0.0);
    std::size_t row = 0;
    for (int k = 0; k < static_cast<int>(blocks.size()); ++k)
        for (int i = 0; i < blocks[k].size; ++i, ++row)
            rows_.right[row] = (i == blocks[k].rotor ? joints_.states[blocks[k].joint].rotor : 0.0) -
                               rows_.row_speed(k, i, false);
    if (!rows_.factor_and_solve()) live_.not_solved = model_.constrained.front();
    take();
    rows_.push(multiplier_.data());
    for (int i : model_.constrained)
        if (!model_.constants[i].particle) refresh(model_.constants[i], live_.bodies[i]);
    rows_.find_bias(pace_.data());
    double* right = rows_.right.data() + rows;
    for (row = 0; row < rows; ++row) rows_.right[row] = -model_.h * pace_[row];
    for (int i : model_.constrained) {
        const Vec3 p = model_.constants[i].mass * forces_.kick(i), l = model_.h * model_.constants[i].torque;
        for (int k = 0; k < 3; ++k) *right++ = p[k];
        for (int k = 0; k < 3 && !model_.constants[i].particle; ++k) *right++ = l[k];
    }
    pull_by_springs(joints_, model_.constants, live_.bodies, [&](const JointSpringPull& pull) {
        double* to = rows_.right.data() +
                     rows_.matrix.offset(static_cast<int>(blocks.size()) + model_.solver_index[pull.body]);
        for (int k = 0; k < 3; ++k) to[k] += model_.h * pull.force[k];
        for (int k = 0; k < 3 && !model_.constants[pull.body].particle; ++k)
            to[3 + k] += model_.h * pull.torque[k];
    });
    rows_.solve_again();
    take();
    const double* multiplier = multiplier_.data();
    for (const JointBlock& block : blocks) {
        JointSet::State& state = joints_.states[block.joint];
        std::copy_n(multiplier, block.size,
                    block.axial ? state.axial_multiplier.data() : state.multiplier.data());
        multiplier += block.size;
    }
}

}  // namespace spook

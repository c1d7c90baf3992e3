// An explicit Runge–Kutta method of order 8 in joint coordinates, twelve accelerations a step.
//
// What a step goes on from are the poses and momenta of the bodies: each step has a chart of its own (articulated_tree.hpp), and
// joints hold by construction. With a tolerance a step of h is taken in parts, each as long as the method's estimate of its error
// allows; a part whose error is larger is taken again. Nothing is symplectic here: energy drifts with the error, h⁸.
//
// reads: bodies, loads, springs. writes: bodies, rotors, the length of the parts.
#include "rigid/tree_runge_kutta.hpp"

#include <algorithm>
#include <cmath>

#include "rigid/readings.hpp"
#include "rigid/tolerances.hpp"
#include "run/runge_kutta.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

using namespace tolerances::tree_runge_kutta;

double root_of_order(double x) noexcept {
    static_assert(RungeKutta8::ORDER == 8);
    return std::sqrt(std::sqrt(std::sqrt(x)));
}

}  // namespace

bool TreeRungeKutta::take() {
    std::vector<int> bodies = model_.constrained;
    bodies.insert(bodies.end(), model_.free.begin(), model_.free.end());
    JointTree tree;
    if (!tree.hang(model_.constants, joints_, bodies)) return false;
    tree_.take(tree, model_.constants, joints_);
    start_.assign(2 * tree_.coordinates(), 0.0);
    there_ = start_;
    changes_.assign((RungeKutta8::STAGES + 1) * start_.size(), 0.0);
    return true;
}

void TreeRungeKutta::advance(std::int64_t steps) {
    clock_.start();
    tree_.count(joints_.followed());
    for (; steps > 0 && live_.lost < 0; --steps) {
        step(static_cast<double>(live_.moved) * model_.h);
        ++live_.moved;
        live_.energy.most_kinetic =
            std::max(live_.energy.most_kinetic, kinetic_energy(model_, live_, joints_));
    }
    clock_.mark(Stage::integrate_positions);
}

void TreeRungeKutta::lose() noexcept { live_.lost = tree_.body_of(worst_); }

/// How state `there_` changes, as that of a stage.
void TreeRungeKutta::find_stage(int stage, double time) {
    const std::size_t n = tree_.coordinates();
    const double *moved = there_.data(), *rates = moved + n;
    if (forces_.change_within_steps()) {
        tree_.place(moved, rates, live_.bodies, model_.constants, joints_);
        forces_.find_at(time);
        load();
    }
    double* changes = changes_.data() + 2 * n * static_cast<std::size_t>(stage);
    tree_.accelerate(moved, rates, changes, changes + n);
}

/// From the first stage, which is known: all others, and in there_ the state after h.
void TreeRungeKutta::stages(double time, double h) {
    const std::size_t size = start_.size();
    for (int stage = 1;; ++stage) {
        double* there = there_.data();
        std::fill_n(there, size, 0.0);
        for (const RungeKuttaTerm& term : RungeKutta8::before(stage)) {
            const double* changes = changes_.data() + size * static_cast<std::size_t>(term.stage);
            for (std::size_t i = 0; i < size; ++i) there[i] += term.weight * changes[i];
        }
        if (stage == RungeKutta8::STAGES)  // for the estimates
            std::copy_n(there, size, changes_.data() + size * RungeKutta8::STAGES);
        for (std::size_t i = 0; i < size; ++i) there[i] = start_[i] + h * there[i];
        if (stage == RungeKutta8::STAGES) return;
        find_stage(stage, time + RungeKutta8::NODES[static_cast<std::size_t>(stage)] * h);
    }
}

/// By which rates are measured, sizes in a second.
double TreeRungeKutta::fastest() const noexcept {
    const std::size_t n = tree_.coordinates();
    double found = resting_rate / model_.h;
    for (std::size_t i = 0; i < n; ++i)
        found = std::max(
            {found, std::fabs(start_[n + i]) / tree_.extent(i), std::fabs(there_[n + i]) / tree_.extent(i)});
    return found;
}

/// What the step from start_ to there_ may be off by, in tolerances.
double TreeRungeKutta::error(double h) noexcept {
    const std::size_t n = tree_.coordinates();
    const double over_tolerance = 1.0 / model_.method.tolerance, over_rate = over_tolerance / fastest();
    double worst = -1.0;
    const double *changes = changes_.data(), *whole = changes + 2 * n * RungeKutta8::STAGES;
    double fifth2 = 0.0, third2 = 0.0;
    for (std::size_t i = 0; i < 2 * n; ++i) {
        double fifth = 0.0, third = whole[i];
        for (const RungeKuttaTerm& term : RungeKutta8::FIFTH)
            fifth += term.weight * changes[2 * n * static_cast<std::size_t>(term.stage) + i];
        for (const RungeKuttaTerm& term : RungeKutta8::THIRD)
            third -= term.weight * changes[2 * n * static_cast<std::size_t>(term.stage) + i];
        const double scale = (i < n ? over_tolerance : over_rate) / tree_.extent(i < n ? i : i - n);
        fifth2 += scale * scale * fifth * fifth;
        if (!(std::fabs(scale * fifth) <= worst))
            worst = std::fabs(scale * fifth), worst_ = i < n ? i : i - n;
        third2 += scale * scale * third * third;
    }
    if (fifth2 == 0.0) return 0.0;
    return std::fabs(h) * fifth2 / std::sqrt(fifth2 + 0.01 * third2);
}

/// A part in which the coordinates change by about the tolerance's eighth root.
double TreeRungeKutta::first_guess() noexcept {
    const std::size_t n = tree_.coordinates();
    double rate = 0.0, gain = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        rate = std::max(rate, std::fabs(start_[n + i]) / tree_.extent(i));
        gain = std::max(gain, std::fabs(changes_[n + i]) / tree_.extent(i));
    }
    const double most = std::max(rate, std::sqrt(gain));
    return most > 0.0 ? root_of_order(model_.method.tolerance) / most : model_.h;
}

void TreeRungeKutta::load() noexcept {
    tree_.load([this](int body, Vec3& force, Vec3& torque) {
        force = forces_.force(body);
        torque = model_.constants[body].torque;
    });
}

/// Within a tolerance parts end where a load bends: no length is short enough for what jumps inside it, and none would see a pulse
/// between its accelerations.
void TreeRungeKutta::step(double time) {
    const double end = time + model_.h;
    double knot = model_.method.tolerance > 0.0 ? forces_.next_knot(time) : end;
    if (!(knot < end)) return go_on(time, model_.h);
    while (knot < end && live_.lost < 0) {
        go_on(time, knot - time);
        time = knot;
        knot = forces_.next_knot(time);
    }
    if (live_.lost < 0 && time < end) go_on(time, end - time);
}

/// From a time on by `left`, over which loads do not bend.
void TreeRungeKutta::go_on(double time, double left) {
    const std::size_t n = tree_.coordinates();
    const bool controlled = model_.method.tolerance > 0.0;
    while (left > 0.0) {
        tree_.begin(live_.bodies, joints_, start_.data() + n);
        load();
        there_ = start_;
        find_stage(0, time);
        if (controlled && !(live_.part > 0.0)) live_.part = first_guess();
        for (bool again = false;;) {
            ++live_.newton_iterations;
            const bool last = !controlled || live_.part * last_part >= left;
            const double before = live_.part;
            const double h = last ? left : std::min(before, 0.5 * left);
            stages(time, h);
            if (controlled) {
                const double off = error(h);
                // No NaN does. Between knots that are nearer than that, times are rounded.
                const bool fits = off <= 1.0 || (h <= min_part * model_.h && std::isfinite(off));
                const double stretch =
                    off > 0.0 ? std::clamp(safety / root_of_order(off), min_growth, again ? 1.0 : max_growth)
                              : (off == 0.0 ? max_growth : min_growth);
                live_.part = h * stretch;
                if (fits && h < before) live_.part = std::max(live_.part, before);
                if (!fits) {
                    again = true;
                    ++live_.halved_steps;
                    if (live_.part < min_part * model_.h) return lose();
                    Watch::look();
                    continue;
                }
            }
            left = last ? 0.0 : left - h;
            time += h;
            break;
        }
        tree_.place(there_.data(), there_.data() + n, live_.bodies, model_.constants, joints_);
        if (left > 0.0) Watch::look();
    }
}

}  // namespace spook

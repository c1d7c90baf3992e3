// The rows of a step in which all are bilateral, solved: link by link (locked_tree.hpp), or in one factorisation (block_rows.hpp).
//
// reads: rows of joints, masses, momenta, dv_ext. writes: velocities and angular momenta of bodies; multipliers once they are asked for.
#include <algorithm>

#include "rigid/bilateral_solve.hpp"

namespace spook {

void BilateralSolve::take() {
    if (!model_.bilateral || by_links()) return;
    rows_.analyse();
    loops.take();
}

void BilateralSolve::begin() {
    moved_ = undelivered_ = false;
    loops.begin();
    locked_.clear_counters();
}

/// A body moves while its numbers are at hand; a timed run keeps the stages apart.
void BilateralSolve::take(int body, const Twist& v) noexcept {
    BodyState& s = live_.bodies[body];
    s.velocity = v.linear;
    s.angular_momentum = s.inertia * v.angular;
    if (moves_at_once()) integrate(model_.constants[body], model_.h, s);
}

bool BilateralSolve::find_by_links(bool ahead) {
    live_.last_rows = LastRows::block;
    LockedLoads loads{model_.h,
                      model_.stages.runs(Stage::apply_gravity) ? model_.gravity : Vec3{},
                      model_.constants,
                      {},
                      forces_.of_springs_and_fields(),
                      !joints_.turning.empty()};
    if (model_.stages.runs(Stage::apply_loads) || forces_.loads_change())
        loads.acceleration = forces_.accelerations();
    const auto solve = [&](const auto& take) {
        return locked_.solve(live_.bodies, loads, model_.method.refinements, take);
    };
    if (!ahead) return solve([this](int body, const Twist& v) { take(body, v); });
    scratch_.next = scratch_.free_velocities;
    return solve([this](int body, const Twist& v) {
        scratch_.next[body] = {v.linear.x, v.linear.y, v.linear.z, v.angular.x, v.angular.y, v.angular.z};
    });
}

bool BilateralSolve::find(bool ahead) {
    bool finite = false;
    if (by_links()) {
        finite = find_by_links(ahead);
    } else {
        if (model_.stiff) stiffness.add();
        rows_.assemble();
        rows_.fill_inertias();
        rows_.fill_momenta();
        if (model_.curved) curvature_.predict_curvature();
        else if (model_.method.corrections > 0) curvature_.take_past_curvature();
        clock_.mark(Stage::assemble_rows);
        finite = rows_.factor_and_solve();
        if (rows_.parted() && model_.method.corrections == 0) loops.note_projected();
    }
    clock_.mark(Stage::solve_block);
    if (!finite) live_.not_solved = model_.constrained.front();
    if (!finite || !ahead || by_links()) return finite;
    scratch_.next = scratch_.free_velocities;
    const double* x = rows_.solution.data() + rows_.rows();
    for (int i : model_.constrained) {
        const int size = model_.constants[i].particle ? 3 : 6;
        std::copy_n(x, size, scratch_.next[i].data());
        x += size;
    }
    return true;
}

void BilateralSolve::take_velocities(bool ahead) {
    moved_ = moves_at_once();
    undelivered_ = by_links();
    if (by_links()) {
        for (std::size_t k = 0; ahead && k < model_.constrained.size(); ++k) {
            const Vec6& v = scratch_.next[model_.constrained[k]];
            take(model_.constrained[k], {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}});
        }
        return clock_.mark(Stage::solve_block);
    }
    if (model_.method.corrections > 0) {
        model_.curved ? curvature_.refine_curvature() : curvature_.correct();
        clock_.mark(Stage::correct_curvature);
    }
    if (model_.stiff) stiffness.keep_angular_momentum();
    loops.look();
    rows_.deliver();
    const double* x = rows_.solution.data() + rows_.rows();
    for (int i : model_.constrained) {
        const Vec3 v{x[0], x[1], x[2]};
        x += 3;
        if (model_.constants[i].particle) {
            live_.bodies[i].velocity = v;
            if (moved_) integrate(model_.constants[i], model_.h, live_.bodies[i]);
            continue;
        }
        take(i, {v, {x[0], x[1], x[2]}});
        x += 3;
    }
    clock_.mark(Stage::solve_block);
}

void BilateralSolve::deliver() {
    if (std::exchange(undelivered_, false)) locked_.deliver(joints_.states);
}

}  // namespace spook

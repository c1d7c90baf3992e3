#include "contacts/jointed_friction.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/tolerances.hpp"

namespace spook {

using namespace tolerances::friction_direct;
using namespace tolerances::jointed_friction;

void JointedFriction::take(double residual) {
    if (!(residual < report.residual)) {
        if (!(report.residual <= fair)) system = best;
        return;
    }
    report.residual = residual;
    if (!(residual <= fair)) best = system;
}

void JointedFriction::ask_newton(bool turning) {
    ConeNewton& newton = direct.newton;
    newton.near_enough = turning ? turning_near : fair;
    newton.max_losses = turning ? ConeNewton{}.max_losses : 1;
    newton.max_frozen = points.size() < many_points ? max_frozen : 0;
    const ConeReport found = newton.solve(system, points);
    newton.max_losses = ConeNewton{}.max_losses, newton.max_frozen = 0;
    report.rounds += found.iterations;
    take(found.residual);
}

/// An answer that leaves more than `most` is none.
void JointedFriction::ask_reduced(int turn, double most) {
    const ReducedContacts::Report found =
        direct.reduced.solve(system, points, first_iterations << (2 * turn));
    report.rounds += found.newton_steps, report.pgs_iterations += found.iterations;
    take(found.residual <= most ? found.residual : unbounded);
}

bool JointedFriction::asks_more(int turn, bool turning, double at_once) const {
    const double enough = points.size() < few_points ? fair : near;
    if (report.residual <= (turn > 0 ? enough : at_once)) return false;
    return turn < joint_turns || (turning && turn == joint_turns && !(report.residual <= poor));
}

void JointedFriction::solve(bool newton, bool redundant) {
    best = system;
    report.residual = unbounded;
    const bool turning = std::any_of(points.begin(), points.end(), turns);
    const bool first =
        redundant && points.size() >= many_points && points.size() * bodies_a_point > system.mass.size();
    if (first) ask_newton(turning);
    const double at_once = turning && first ? turning_near : fair;
    for (int turn = 0; asks_more(turn, turning, at_once); ++turn) {
        ask_reduced(turn, unbounded);
        if (turn == 0) {
            if (!(report.residual <= near)) ReducedContacts::leave_open(system), ask_reduced(0, near);
            if (!newton || first || report.residual <= (redundant ? fair : near)) continue;
            system = start;
        } else if (!turning || !newton || !asks_more(turn, turning, at_once)) {
            continue;
        }
        ask_newton(turning);
    }
    report.converged = report.residual <= fair;
    report.finite = std::isfinite(report.residual);
    for (FrictionPoint& point : points) point.normal = system.rows[point.block].multiplier[0];
}

}  // namespace spook

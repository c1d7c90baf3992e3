#include "contacts/friction_direct.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/friction_acceleration.hpp"
#include "contacts/friction_pgs.hpp"
#include "contacts/jointed_friction.hpp"
#include "contacts/tolerances.hpp"
#include "linear/elementary.hpp"
#include "linear/vec.hpp"

namespace spook {

namespace {

using namespace tolerances::friction_direct;

/// How much is spent on rounds of pivoting.
struct IterationBudget {
    int rounds;
    int pivots = 60;  // of a round: the cone's need not be exact while its bounds still move
    int cycling =
        8;  // rounds in a row without an end of the pivoting: it goes in circles; 1: nor the first guess
    bool near = false;  // an answer is near: directions start from its slip, not from the predicted one
};
constexpr IterationBudget quick{4, 4, 1};  // what rests or moves on as it did is found within these, exactly
constexpr IterationBudget small{12, 20, 1};  // nine systems in ten of few blocks settle
constexpr IterationBudget brief{
    6, 8, 1};  // the same where points are redundant: the others are Newton's, at less cost
constexpr IterationBudget polish{6, 8, 1, true};  // after Newton's method

/// What rounds change of a system.
struct Answer {
    std::vector<RowBlock> rows;
    std::vector<Vec6> velocity;
    std::vector<FrictionPoint> points;
    FrictionReport report;

    void keep(const MixedSystem& system, const std::vector<FrictionPoint>& now, const FrictionReport& told) {
        rows = system.rows, velocity = system.velocity;
        points = now, report = told;
    }
    /// `told` keeps the work that was done.
    void give_back(MixedSystem& system, std::vector<FrictionPoint>& now, FrictionReport& told) const {
        const int rounds = told.rounds, pivots = told.pivots;
        system.rows = rows, system.velocity = velocity;
        now = points, told = report;
        told.rounds = rounds, told.pivots = pivots;
    }
};

/// What a solve needs besides what it gives. One per thread: its memory outlives a solve, its values do not.
struct Work {
    MixedSystem start, best;  // as it was, and the best end of Newton's method
    std::vector<FrictionPoint> start_points, pgs_points;
    Answer answer;
    Acceleration acceleration;
    MassFactors mass;
    std::vector<Vec6> free_velocity;
    std::vector<double> scale, used, given;
    std::vector<std::pair<int, int>> pairs;  // see is_redundant()
};

Work& work() {
    static thread_local Work own;
    return own;
}

void bound_rows(RowBlock& block, const FrictionPoint& point, double bound) noexcept {
    for (int i = point.row; i < point.row + point.size; ++i) {
        block.lower[i] = -bound;
        block.upper[i] = bound;
    }
}

void bound_by_normals(MixedSystem& system, const std::vector<FrictionPoint>& points) noexcept {
    for (const FrictionPoint& point : points)
        bound_rows(system.rows[point.block], point, point.coefficient * std::max(0.0, point.normal));
}

/// Contradicting rigid contacts leave residuals that no round removes: less is asked after 25 rounds.
double accepted_in(int round, double before) noexcept {
    return round >= 25 && round % 5 == 0 ? std::min(10.0 * before, loosest) : before;
}

/// Turns first tangents along the slip that would be without any constraint force. work() has the masses' factors.
void turn_along_predicted_slip(MixedSystem& system, const std::vector<FrictionPoint>& points) {
    std::vector<Vec6>& free_velocity = work().free_velocity;
    free_velocity = system.momentum;
    for (std::size_t b = 0; b < system.mass.size(); ++b) solve_six(work().mass[b], free_velocity[b]);
    for (const FrictionPoint& point : points) {
        if (point.size != 2) continue;
        RowBlock& block = system.rows[point.block];
        const int one = point.row, two = point.row + 1;
        const double s1 = row_velocity(block, one, free_velocity) - block.right[one];
        const double s2 = row_velocity(block, two, free_velocity) - block.right[two];
        const double speed = length(s1, s2);
        if (speed > 0.0) turn_tangents(block, point, s1 / speed, s2 / speed);
    }
}

/// Σ over the two rows of (G M⁻¹ Gᵀ)ᵢᵢ + gamma/h: an upper bound of the block's largest eigenvalue.
double tangent_scale(const RowBlock& block, const FrictionPoint& point, const MassFactors& mass) {
    double sum = 0.0, first[2], second[2];
    if (block.first >= 0)
        own_inertias(mass[block.first], &block.first_jacobian[point.row], point.size, first);
    if (block.second >= 0)
        own_inertias(mass[block.second], &block.second_jacobian[point.row], point.size, second);
    for (int i = 0; i < point.size; ++i) {
        sum += point.slip_softness;
        if (block.first >= 0) sum += first[i];
        if (block.second >= 0) sum += second[i];
    }
    return sum;
}

struct Law {
    double residual = 0.0;  // how far beta is from its projection, as an impulse
    bool moved = false;     // frames or softness changed: the matrix is another one
};

/// Measures the disc law at one point; if it does not hold, prepares the point's next Newton step.
Law step_cone(RowBlock& block, const FrictionPoint& point, double scale, double bound, double accepted,
              double hysteresis, const std::vector<Vec6>& velocity) {
    const int one = point.row, two = point.row + 1;
    const double s1 = slip(block, point, one, velocity), s2 = slip(block, point, two, velocity);
    const double b1 = block.multiplier[one], b2 = block.multiplier[two];
    const double d1 = b1 - s1 / scale, d2 = b2 - s2 / scale, reach = length(d1, d2);
    const double shrink = reach > bound ? bound / reach : 1.0;
    Law law;
    law.residual = length(b1 - shrink * d1, b2 - shrink * d2);
    if (law.residual <= accepted) return law;
    const double old_softness = block.softness[two];
    block.softness[one] = block.softness[two] = point.slip_softness;
    if (reach > bound) {
        turn_tangents(block, point, -d1 / reach, -d2 / reach);
        if (bound > 0.0) block.softness[two] += std::max(length(s1, s2) / bound, hysteresis * scale);
        block.state[one] = RowState::at_lower;  // beta_1 = −mu nu: against the slip
        block.state[two] = RowState::free;
        law.moved = true;
    } else {
        block.state[one] = block.state[two] = RowState::free;
        law.moved = block.softness[two] != old_softness;
    }
    return law;
}

/// Few systems have no fixed point the rounds can find (wedged bodies); iterations may. A poor end of the rounds is
/// replaced in any case: what iterations leave obeys every bound, so it cannot throw bodies about.
void finish_by_pgs(MixedSystem& system, MixedSystem& start, std::vector<FrictionPoint>& points,
                   FrictionModel model, FrictionReport& report) {
    if (start.rows.empty()) return;
    double speed = 0.0;
    for (std::size_t b = 0; b < start.mass.size(); ++b) {
        Vec6 v = start.momentum[b];
        solve_six(factor_six(start.mass[b]), v);
        speed = std::max(speed, norm(Vec3{v[0], v[1], v[2]}));
    }
    std::vector<FrictionPoint>& pgs_points = work().pgs_points;
    pgs_points = points;
    const FrictionReport pgs = solve_iterative(start, pgs_points, model, 1000, 1e-10 * speed);
    report.pgs_iterations += pgs.pgs_iterations;
    report.finite = report.finite || pgs.finite;
    if (!pgs.converged && report.residual <= poor) return;
    report.converged = pgs.converged;
    report.residual = pgs.residual;
    system = start;
    points = pgs_points;
}

/// Whether the system is one for Newton's method on the cone.
bool is_for_newton(const MixedSystem& system, const std::vector<FrictionPoint>& points, FrictionModel model) {
    if (model != FrictionModel::cone && !points.empty()) return false;
    if (points.empty() && system.rows.size() <= few_blocks) return false;
    // Its units tie two bodies; bilateral rows may tie more.
    return std::all_of(system.rows.begin(), system.rows.end(), [&](const RowBlock& block) {
        if (points.empty()) return block.lower[0] == 0.0 && block.further.empty();
        return block.further.empty() || BilateralRows::is_bilateral(block, 0);
    });
}

/// Whether some pair of bodies has several points, which may share a load in many ways.
bool is_redundant(const MixedSystem& system) {
    std::vector<std::pair<int, int>>& pairs = work().pairs;
    pairs.clear();
    for (const RowBlock& block : system.rows)
        if (block.lower[0] == 0.0) pairs.emplace_back(std::minmax(block.first, block.second));
    std::sort(pairs.begin(), pairs.end());
    return std::adjacent_find(pairs.begin(), pairs.end()) != pairs.end();
}

/// Takes over what multipliers and velocities say: which contacts push, which stick, and which way the others slide.
void start_near(MixedSystem& system, const std::vector<FrictionPoint>& points,
                const std::vector<double>& scale) {
    for (RowBlock& block : system.rows)
        block.state[0] = block.multiplier[0] > 0.0 ? RowState::free : RowState::at_lower;
    for (std::size_t k = 0; k < points.size(); ++k) {
        if (points[k].size != 2) continue;
        RowBlock& block = system.rows[points[k].block];
        step_cone(block, points[k], scale[k], points[k].coefficient * block.multiplier[0], -1.0,
                  direction_hysteresis, system.velocity);
    }
}

/// The normal forces without friction are the first guess where no step before knows them. `solve`: false where that is none.
template <class Solve>
bool guess_normals(MixedSystem& system, std::vector<FrictionPoint>& points, const Solve& solve) {
    if (std::none_of(points.begin(), points.end(), [](const FrictionPoint& p) { return p.normal < 0.0; }))
        return true;
    for (const FrictionPoint& point : points) bound_rows(system.rows[point.block], point, 0.0);
    if (!solve()) return false;
    for (FrictionPoint& point : points)
        if (point.normal < 0.0) point.normal = system.rows[point.block].multiplier[0];
    for (const FrictionPoint& point : points)
        for (int i = point.row; i < point.row + point.size; ++i)
            system.rows[point.block].state[i] = RowState::free;
    return true;
}

struct LawsLeft {
    double residual = 0.0;  // of the largest normal impulse
    bool moved = false;     // frames or softness changed: the matrix is another one
};

/// How far a solution is from the law at all points, and what the next round begins with. work() keeps which normal forces were used,
/// and which were found.
LawsLeft renew_bounds(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                      int round) {
    const std::vector<double>& scale = work().scale;
    std::vector<double>&used = work().used, &given = work().given;
    used.resize(points.size()), given.resize(points.size());
    // The bounds in use count, too: without them a round in which every normal force vanishes would settle at
    // once, with the friction of the step before.
    double largest = 0.0, change = 0.0, residual = 0.0;
    for (const FrictionPoint& point : points)
        largest = std::max({largest, system.rows[point.block].multiplier[0], point.normal});
    LawsLeft left;
    for (std::size_t k = 0; k < points.size(); ++k) {
        FrictionPoint& point = points[k];
        RowBlock& block = system.rows[point.block];
        const double now = std::max(0.0, block.multiplier[0]);
        if (model != FrictionModel::box)
            change = std::max(change, point.coefficient * std::abs(now - point.normal));
        if (model == FrictionModel::cone && point.size == 2) {
            const double hysteresis = direction_hysteresis * std::ldexp(1.0, -std::max(0, round - 5));
            const Law law = step_cone(block, point, scale[k], point.coefficient * point.normal,
                                      exact * point.coefficient * largest, hysteresis, system.velocity);
            residual = std::max(residual, law.residual);
            left.moved = left.moved || law.moved;
        }
        used[k] = point.normal;
        given[k] = now;
        if (model != FrictionModel::box) point.normal = now;
    }
    left.residual = largest > 0.0 ? std::max(change, residual) / largest : 0.0;
    return left;
}

/// The scale of each point's friction, and where its directions start.
void start_directions(MixedSystem& system, const std::vector<FrictionPoint>& points, FrictionModel model,
                      bool near) {
    std::vector<double>& scale = work().scale;
    scale.assign(points.size(), 1.0);
    if (model == FrictionModel::cone) {
        work().mass.find(system.mass);
        if (!near) turn_along_predicted_slip(system, points);
        for (std::size_t k = 0; k < points.size(); ++k)
            scale[k] = tangent_scale(system.rows[points[k].block], points[k], work().mass);
    }
    if (near) start_near(system, points, scale);
}

/// Pivoting with bounds and directions renewed until the law holds. True when it does; a system that is not finite is
/// reported.
bool settle_by_rounds(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                      PivotSolver& solver, const IterationBudget& effort, FrictionReport& report) {
    auto solve = [&](bool same_matrix) {
        const PivotReport pivots = solver.solve(system, same_matrix);
        ++report.rounds;
        report.pivots += pivots.flips;
        report.converged = pivots.converged;
        report.finite = pivots.finite;
        return pivots.finite;
    };
    const RoundLimitKept kept(solver);
    if (effort.cycling == 1) solver.round_limit = effort.pivots;  // the first guess, too
    const bool guessed = guess_normals(
        system, points, [&] { return solve(false) && (effort.cycling != 1 || report.converged); });
    if (!guessed) return false;
    start_directions(system, points, model, effort.near);

    bool same_matrix = false;
    Acceleration& acceleration = work().acceleration;
    acceleration.begin();
    double accepted = settled;
    int cycling = 0;
    Answer& answer = work().answer;
    bool answered = false;  // accepted; the next round may find it to rounding
    if (model == FrictionModel::cone) solver.round_limit = effort.pivots;
    for (int round = 0; round < effort.rounds; ++round) {
        bound_by_normals(system, points);
        if (!solve(same_matrix) && !answered) return false;
        accepted = accepted_in(round, accepted);
        const LawsLeft left = renew_bounds(system, points, model, round);
        report.residual = left.residual;
        same_matrix = !left.moved;
        const bool is_answer = report.residual <= accepted && report.converged;
        if (is_answer && report.residual <= exact) return true;
        if (answered && !(is_answer && report.residual <= falling * answer.report.residual)) {
            if (!is_answer || report.residual > answer.report.residual)
                answer.give_back(system, points, report);
            return true;
        }
        if (is_answer) answered = true, answer.keep(system, points, report);
        cycling = report.converged ? 0 : cycling + 1;
        if (cycling >= effort.cycling) break;
        if (points.empty() || model == FrictionModel::box) {
            report.residual = unbounded;  // the pivoting itself gave up
            break;
        }
        if (round < plain_rounds) continue;
        const std::vector<double>& next = acceleration.next(work().used, work().given);
        for (std::size_t k = 0; k < points.size(); ++k) points[k].normal = next[k];
    }
    if (answered) {  // the last round's
        points = answer.points;
        report = answer.report;
        return true;
    }
    report.converged = false;
    return false;
}

/// Rounds that start from the answer of the step before find what rests or moves on at once, and exactly; they are
/// asked first unless they failed lately. True when they settled; else the system is as it was; `kept`: and work() has
/// a copy of it.
bool settle_quickly(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                    DirectSolver& direct, bool joints, bool redundant, bool& kept, FrictionReport& report) {
    if (direct.backoff.waits()) return false;
    kept = true;
    MixedSystem& start = work().start;
    std::vector<FrictionPoint>& start_points = work().start_points;
    start = system, start_points = points;
    const FrictionReport before = report;
    const IterationBudget& effort = joints || system.rows.size() > few_blocks ? quick
                                    : redundant                               ? brief
                                                                              : small;
    if (settle_by_rounds(system, points, model, direct.pivot, effort, report)) {
        direct.backoff.succeeded();
        return true;
    }
    direct.backoff.failed();
    system = start;
    points = start_points;
    const int rounds = report.rounds, pivots = report.pivots;
    report = before;
    report.rounds = rounds;
    report.pivots = pivots;
    return false;
}

/// Newton's method; where its path ends without an answer, a few iterations choose anew which contacts push and which slide, and it
/// goes on from there. Few blocks are handed to pivoting in the end, which shares loads evenly. False if all that is
/// poor, and the system as it was. `kept`: work() has a copy of it already.
bool solve_by_newton(MixedSystem& system, std::vector<FrictionPoint>& points, FrictionModel model,
                     DirectSolver& direct, bool kept, FrictionReport& report) {
    MixedSystem &start = work().start, &best = work().best;
    std::vector<FrictionPoint>& start_points = work().start_points;
    if (!kept) start = system, start_points = points;
    report.residual = unbounded;
    const bool few = start.rows.size() <= few_blocks;
    bool is_best = true;  // the system, of what was met so far: a copy is taken when it is to be changed
    for (int turn = 0; turn <= pgs_turns && !(report.residual <= (few ? fair : direct.newton.near_enough));
         ++turn) {
        if (turn > 0) {
            if (is_best) best = system;
            report.pgs_iterations +=
                solve_iterative(system, points, model, iterations_per_turn, 0.0).pgs_iterations;
        }
        const ConeReport found = direct.newton.solve(system, points);
        report.rounds += found.iterations;
        is_best = turn == 0 || found.residual < report.residual;
        if (is_best) report.residual = found.residual;
    }
    if (!is_best) system = best;
    for (FrictionPoint& point : points) point.normal = system.rows[point.block].multiplier[0];
    report.converged = report.residual <= fair;
    if (!points.empty() && few) {
        FrictionReport polished;
        if (is_best) best = system;
        const bool settled = settle_by_rounds(system, points, model, direct.pivot, polish, polished);
        report.rounds += polished.rounds;
        report.pivots += polished.pivots;
        if (settled) {
            report.residual = polished.residual;
            report.converged = true;
            return true;
        }
        system = best;
        points = start_points;
        for (FrictionPoint& point : points) point.normal = system.rows[point.block].multiplier[0];
    }
    if (report.residual <= poor) return true;
    system = start;
    points = start_points;
    return false;
}

}  // namespace

FrictionReport solve_friction_direct(MixedSystem& system, std::vector<FrictionPoint>& points,
                                     FrictionModel model, DirectSolver& direct, int max_rounds) {
    FrictionReport report;
    if (system.velocity.size() == system.mass.size() && still_right(system, points, model)) return report;
    MixedSystem& start = work().start;
    const IterationBudget full_budget{max_rounds};
    if ((model == FrictionModel::cone || points.empty()) && ReducedContacts::takes(system, points)) {
        bool kept = false;
        if (settle_quickly(system, points, model, direct, true, false, kept, report)) return report;
        const bool newton = is_for_newton(system, points, FrictionModel::cone);
        if (newton && !kept) start = system;
        JointedFriction beside{system, points, direct, report, start, work().best};
        beside.solve(newton, newton && is_redundant(system));
        return report;
    }
    if (is_for_newton(system, points, model)) {
        const bool redundant = is_redundant(system);
        const bool near_none =
            (direct.warm_started || (redundant && points.empty())) && system.rows.size() > few_blocks;
        direct.newton.near_enough = redundant ? redundant_near : near;
        bool kept = false;
        if (!near_none && settle_quickly(system, points, model, direct, false, redundant, kept, report))
            return report;
        if (solve_by_newton(system, points, model, direct, kept, report)) return report;
        report.residual = unbounded;  // the system is as it was, which work() has a copy of
    } else {
        start.rows.clear();
        if (!points.empty() || std::any_of(system.rows.begin(), system.rows.end(),
                                           [](const RowBlock& block) { return block.lower[0] == 0.0; }))
            start = system;
        if (settle_by_rounds(system, points, model, direct.pivot, full_budget, report) || !report.finite)
            return report;
    }
    finish_by_pgs(system, start, points, model, report);
    return report;
}

}  // namespace spook

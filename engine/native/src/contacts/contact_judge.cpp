// How far an answer is from the law it was asked for.
#include <algorithm>
#include <cmath>

#include "contacts/contact_geometry.hpp"
#include "contacts/solve_quality.hpp"
#include "contacts/tolerances.hpp"
#include "linear/elementary.hpp"

namespace spook {

namespace {

template <class FactorOf> double inertia(const FactorOf& factor, const RowBlock& block, int i) {
    double own = block.softness[i];
    const auto add = [&](int body, const Vec6& jacobian) {
        if (body < 0) return;
        Vec6 x = jacobian;
        solve_six(factor(body), x);
        own += dot(jacobian, x);
    };
    add(block.first, block.first_jacobian[i]);
    add(block.second, block.second_jacobian[i]);
    for (const auto& [body, jacobian] : block.further) add(body, jacobian);
    return own;
}

}  // namespace

double own_inertia(const MixedSystem& system, const RowBlock& block, int i) {
    return inertia([&](int body) { return factor_six(system.mass[body]); }, block, i);
}

double own_inertia(const MassFactors& mass, const RowBlock& block, int i) {
    return inertia([&](int body) -> const Mat6& { return mass[static_cast<std::size_t>(body)]; }, block, i);
}

namespace {

using namespace tolerances::contact_judge;

/// About G M⁻¹ Gᵀ of one row: off-diagonal inertia left out, since every step asks.
double nearly_own(const MixedSystem& system, const RowBlock& block, int i) {
    double own = 0.0;
    for (const bool first : {true, false}) {
        const int body = first ? block.first : block.second;
        if (body < 0) continue;
        const Vec6& jacobian = first ? block.first_jacobian[i] : block.second_jacobian[i];
        for (int a = 0; a < 6; ++a) own += jacobian[a] * jacobian[a] / system.mass[body][7 * a];
    }
    for (const auto& [body, jacobian] : block.further)
        for (int a = 0; a < 6; ++a) own += jacobian[a] * jacobian[a] / system.mass[body][7 * a];
    return own;
}

/// How far z is from where one step of projection would put it, as a velocity: 0 exactly where the law holds. Within its
/// bounds at most |w|, so no more is asked where that is `enough`.
double bounded_residual(const MixedSystem& system, const RowBlock& block, int i, double enough) {
    const double w = row_residual(block, i, system.velocity), z = block.multiplier[i];
    if (std::abs(w) <= enough && z >= block.lower[i] && z <= block.upper[i]) return 0.0;
    const double own = nearly_own(system, block, i) + block.softness[i];
    if (!(own > 0.0)) return 0.0;
    const double below = own * (block.lower[i] - z), above = own * (z - block.upper[i]);
    if (below > 0.0) return w < 0.0 ? std::max(below, std::min(-w, -above)) : below;
    if (above > 0.0) return w > 0.0 ? std::max(above, std::min(w, -below)) : above;
    return w > 0.0 ? std::min(w, -below) : std::min(-w, -above);  // z − w/own would round w away
}

/// The same of a point's friction: at most its slip.
double friction_residual(const MixedSystem& system, const RowBlock& block, const FrictionPoint& point,
                         FrictionModel model, double enough) {
    const int one = point.row, two = one + point.size - 1;  // of an interval both are its one row
    const double nu = std::max(0.0, model == FrictionModel::box ? point.normal : block.multiplier[0]);
    const double bound = point.coefficient * nu;
    const double b1 = block.multiplier[one], b2 = one == two ? 0.0 : block.multiplier[two];
    const double s1 = slip(block, point, one, system.velocity),
                 s2 = one == two ? 0.0 : slip(block, point, two, system.velocity);
    const bool disc = model == FrictionModel::cone;
    const bool within = disc ? length(b1, b2) <= bound : std::abs(b1) <= bound && std::abs(b2) <= bound;
    if (within && length(s1, s2) <= enough) return 0.0;
    // Without the rows' softness: that is the solver's own, which turns a slip's direction by it.
    const double own =
        nearly_own(system, block, one) + nearly_own(system, block, two) + 2.0 * point.slip_softness;
    double d1 = b1 - s1 / own, d2 = b2 - s2 / own;
    bool sticks = true;
    if (disc) {
        const double reach = length(d1, d2);
        sticks = reach <= bound;
        if (!sticks) d1 *= bound / reach, d2 *= bound / reach;
    } else {
        sticks = std::abs(d1) <= bound && std::abs(d2) <= bound;
        d1 = std::clamp(d1, -bound, bound), d2 = std::clamp(d2, -bound, bound);
    }
    return sticks ? length(s1, s2) : own * length(b1 - d1, b2 - d2);
}

}  // namespace

RowsResidual rows_residual(const MixedSystem& system, const std::vector<FrictionPoint>& points,
                           FrictionModel model, double enough) {
    RowsResidual worst{enough, 0};
    std::size_t next = 0;
    for (std::size_t k = 0; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        double residual = 0.0;
        const bool rubs = next < points.size() && points[next].block == static_cast<int>(k);
        for (int i = 0; i < (rubs ? 1 : block.size); ++i)
            residual = std::max(residual, bounded_residual(system, block, i, worst.residual));
        for (; next < points.size() && points[next].block == static_cast<int>(k); ++next)
            residual =
                std::max(residual, friction_residual(system, block, points[next], model, worst.residual));
        if (!(residual <= worst.residual)) worst = {residual, static_cast<int>(k)};
    }
    return worst;
}

bool still_right(const MixedSystem& system, const std::vector<FrictionPoint>& points, FrictionModel model) {
    constexpr double moves = 1e-14, pushes = 1e-13;  // of the largest speed, and of the largest impulse
    for (const FrictionPoint& point : points)
        if (point.normal < 0.0) return false;
    double largest = 0.0;
    for (const RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i) {
            if (block.multiplier[i] < block.lower[i] || block.multiplier[i] > block.upper[i]) return false;
            largest = std::max(largest, std::abs(block.multiplier[i]));
        }
    if (largest == 0.0) return false;
    static thread_local std::vector<Vec6> missing;  // p + Gᵀ z − M v; its memory outlives a call
    missing = system.momentum;
    double speed = 0.0;
    for (std::size_t b = 0; b < missing.size(); ++b)
        for (int a = 0; a < 6; ++a) {
            for (int c = 0; c < 6; ++c) missing[b][a] -= system.mass[b][6 * a + c] * system.velocity[b][c];
            if (a < 3) speed = std::max(speed, std::abs(missing[b][a]) / system.mass[b][7 * a]);
        }
    for (const RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i)
            for (int a = 0; a < 6; ++a) {
                if (block.first >= 0)
                    missing[block.first][a] += block.first_jacobian[i][a] * block.multiplier[i];
                if (block.second >= 0)
                    missing[block.second][a] += block.second_jacobian[i][a] * block.multiplier[i];
                for (const FurtherBody& other : block.further)
                    missing[other.body][a] += other.jacobian[a] * block.multiplier[i];
            }
    for (const Vec6& part : missing)
        for (const double impulse : part)
            if (!(std::abs(impulse) <= pushes * largest)) return false;
    return rows_residual(system, points, model, moves * speed).residual <= moves * speed;
}

SolveQuality judge(const JudgedStep& step, const MixedSystem& system,
                   const std::vector<FrictionPoint>& points, const FrictionReport& report) {
    SolveQuality quality;
    if (!report.finite || report.rounds + report.pgs_iterations == 0) return quality;
    const RowsResidual worst = rows_residual(system, points, step.motion.options().friction);
    quality.residual = worst.residual;
    if (report.converged && step.motion.options().solver == SolverKind::direct) return quality;
    const RowBlock& block = system.rows[worst.row];
    blame(quality, step.motion, worst.residual, std::max(block.first, block.second));
    if (quality.body < 0 && !report.converged) blame_sunk(quality, step);
    return quality;
}

void judge_impact(SolveQuality& quality, const StepMotion& motion, const MixedSystem& hit,
                  const std::vector<FrictionPoint>& points, FrictionModel friction) {
    const RowsResidual worst = rows_residual(hit, points, friction);
    if (!(worst.residual > quality.residual)) return;
    quality.residual = worst.residual;
    const RowBlock& block = hit.rows[worst.row];
    blame(quality, motion, worst.residual, std::max(block.first, block.second));
}

void blame_sunk(SolveQuality& quality, const JudgedStep& step) {
    const ContactBodies& bodies = step.motion.bodies();
    double worst = sunk;
    for (const StepContact& point : step.points.all) {
        if (point.toi >= 0.0 || point.before < 0.0) continue;
        const auto given = step.initial_penetration.find(pair_of(point.contact));
        const double known =
            elastic_depth(bodies, point) + (given == step.initial_penetration.end() ? 0.0 : given->depth);
        const double share = (-point.contact.point.gap - known) / bodies.moving_size(point.contact);
        if (!(share > worst)) continue;
        worst = share;
        quality.by = quality.residual;
        quality.sunk = true;
        quality.body = bodies.moves(point.contact.first) ? point.contact.first : point.contact.second;
    }
}

void blame(SolveQuality& quality, const StepMotion& motion, double residual, int solver_index) {
    double speed = 0.0;
    for (const Vec6& v : motion.velocity) speed = std::max(speed, norm(linear(v)));
    // A billionth of the fastest body's speed, or so, is rounding wherever it stands.
    if (!(residual > motion.options().unsettled_residual + 1e-6 * speed)) return;
    quality.by = residual;
    quality.body = motion.bodies().body_of[solver_index];
}

const std::vector<double>& EnergyLimit::shorten(MixedSystem& system, std::size_t joints,
                                                const StepMotion& motion, const ContactPoints& points,
                                                const std::function<bool(std::size_t)>& pushes) {
    const ContactModel& model = motion.model();
    const std::size_t bodies = system.mass.size();
    share_.assign(bodies, 1.0);
    pushes_.clear();
    connected_.begin(system, joints);
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        const Contact& contact = points.all[k].contact;
        pushes_.push_back(pushes(k));
        if (pushes_[k]) connected_.tie(model.bodies.solver_pair(contact));
    }
    const Islands& islands = connected_.find();
    std::vector<Sums>& sums = sums_;
    sums.assign(islands.count, {});
    const auto driven = [&](int first, int second) {
        sums[islands.of_body[std::max(first, second)]].driven = true;
    };
    for (std::size_t k = 0; k < joints; ++k) driven(system.rows[k].first, system.rows[k].second);
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        const StepContact& point = points.all[k];
        if (pushes_[k] && (motion.drive.acts_at(point.contact, model.surfaces) ||
                           model.surfaces.pair(point.contact).compliance > 0.0))
            driven(model.bodies.solver_index[point.contact.first],
                   model.bodies.solver_index[point.contact.second]);
    }
    std::vector<Vec6>& free = free_velocity_;
    free = system.momentum;
    for (std::size_t u = 0; u < bodies; ++u)
        if (islands.of_body[u] >= 0) solve_six(factor_six(system.mass[u]), free[u]);
    for (std::size_t b = 0; b < model.bodies.count(); ++b) {
        const int u = model.bodies.solver_index[b];
        if (u < 0 || islands.of_body[u] < 0) continue;
        const Vec6 by_contacts = sum(system.velocity[u], free[u], -1.0),
                   kick = sum(free[u], motion.velocity[b], -1.0);
        Sums& own = sums[islands.of_body[u]];
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) {
                const double m = system.mass[u][6 * i + j];
                if (m == 0.0) continue;
                own.square += 0.5 * m * by_contacts[i] * by_contacts[j];
                own.linear += m * by_contacts[i] * motion.velocity[b][j];
                own.fall += 0.5 * m * kick[i] * kick[j];
            }
    }
    for (std::size_t u = 0; u < bodies; ++u) {
        if (islands.of_body[u] < 0) continue;
        const auto& [square, linear, fall, is_driven] = sums[islands.of_body[u]];
        if (is_driven || !(square + linear > fall)) continue;
        const double root = std::sqrt(linear * linear + 4.0 * square * fall);
        share_[u] = linear > 0.0 ? 2.0 * fall / (linear + root) : (root - linear) / (2.0 * square);
        for (int i = 0; i < 6; ++i)
            system.velocity[u][i] = free[u][i] + share_[u] * (system.velocity[u][i] - free[u][i]);
    }
    return share_;
}

}  // namespace spook

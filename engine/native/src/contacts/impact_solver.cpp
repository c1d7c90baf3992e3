#include "contacts/impact_solver.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_rows.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::impact_solver;

/// Of successive impacts in one step.
int most_rounds(std::size_t points) noexcept { return 100 + 20 * static_cast<int>(points); }

/// Of each island's bodies and rotors, J.
void find_kinetic_energy(const MixedSystem& system, const std::vector<Vec6>& velocity, const Islands& islands,
                         std::vector<double>& energy) {
    energy.assign(islands.count, 0.0);
    for (std::size_t b = 0; b < velocity.size(); ++b) {
        if (islands.of_body[b] < 0) continue;
        for (int i = 0; i < 6; ++i) {
            double momentum = 0.0;
            for (int j = 0; j < 6; ++j) momentum += system.mass[b][6 * i + j] * velocity[b][j];
            energy[islands.of_body[b]] += 0.5 * momentum * velocity[b][i];
        }
    }
    for (const RowBlock& block : system.rows) {
        if (block.rotor < 0) continue;
        const double speed = row_velocity(block, block.rotor, velocity);
        energy[islands.of(block)] += 0.5 * speed * speed / block.softness[block.rotor];
    }
}

/// In islands whose energy rises, velocities between the plastic ones and those of Newton's law that keep it; `share` is
/// how much of the latter.
template <class Work> void blend(Work& work, const Islands& islands) {
    MixedSystem& newton = work.hit;
    const MixedSystem& plastic = work.plastic;
    const std::vector<char>& rises = work.rises;
    std::vector<double>&low = work.low, &high = work.high, &energy = work.energy;
    low.assign(islands.count, 0.0), high.assign(islands.count, 1.0);
    std::vector<Vec6>& mixed = work.mixed = newton.velocity;
    const auto mix = [&](const auto& of_island) {
        for (std::size_t b = 0; b < mixed.size(); ++b) {
            const int island = islands.of_body[b];
            if (island < 0 || !rises[island]) continue;
            const double s = of_island(island);
            for (int i = 0; i < 6; ++i)
                mixed[b][i] = plastic.velocity[b][i] + s * (newton.velocity[b][i] - plastic.velocity[b][i]);
        }
    };
    for (int halving = 0; halving < 50; ++halving) {
        mix([&](int k) { return 0.5 * (low[k] + high[k]); });
        find_kinetic_energy(newton, mixed, islands, energy);
        for (int k = 0; k < islands.count; ++k)
            (energy[k] <= work.limit[k] ? low[k] : high[k]) = 0.5 * (low[k] + high[k]);
    }
    mix([&](int k) { return low[k]; });
    newton.velocity = mixed;
    for (int k = 0; k < islands.count; ++k)
        if (rises[k]) work.share[k] = low[k];
}

/// Whether some contact is approached after a solve: where many rows of a few bodies say the same, elimination may find
/// pivots that are rounding, and impulses with it.
bool is_broken(const MixedSystem& system, std::size_t joints) {
    double short_of = 0.0, fastest = 0.0;
    for (std::size_t k = joints; k < system.rows.size(); ++k) {
        const RowBlock& block = system.rows[k];
        const double speed = row_velocity(block, 0, system.velocity);
        fastest = std::max({fastest, std::abs(speed), std::abs(block.right[0])});
        if (block.softness[0] == 0.0) short_of = std::max(short_of, block.right[0] - speed);
    }
    return short_of > broken * fastest;
}

Vec3 impulse_of(const RowBlock& block) {
    Vec3 impulse;  // the solver may have turned the tangents: read them from the rows
    for (int i = 0; i < block.size; ++i)
        impulse += block.multiplier[i] *
                   (block.first >= 0 ? linear(block.first_jacobian[i]) : -linear(block.second_jacobian[i]));
    return impulse;
}

}  // namespace

void ImpactSolver::begin_step(const ContactModel& model) {
    solver_.floor = model.options.floor;
    solver_.refinements = model.options.refinements;
    needed_ = slow_too_ = false;
    plastic_too_ = model.surfaces.rebounds || model.options.stops_rebound;
    rounds_ = 0;
    queue_.begin(model);
}

/// A pair that meets at more points than its motion can tell apart may share an impact among them in many ways, and
/// friction turns the bodies otherwise with each. Points that give way alike share it in one: their rows get a
/// softness, which solve_rows() takes back.
void ImpactSolver::share_impact(MixedSystem& hit, std::size_t joints, const ContactPoints& points) {
    std::vector<std::pair<int, int>>& pairs = work_.pairs;  // points of compounds do not come together
    const std::vector<std::size_t>& hit_points = work_.hit_points;
    const auto pair = [&](std::size_t k) {
        const Contact& contact = points.all[k].contact;
        return std::pair{contact.first, contact.second};
    };
    pairs.clear();
    for (const std::size_t k : hit_points) pairs.push_back(pair(k));
    std::sort(pairs.begin(), pairs.end());
    for (std::size_t j = 0; j < hit_points.size(); ++j) {
        const auto [first, last] = std::equal_range(pairs.begin(), pairs.end(), pair(hit_points[j]));
        if (last - first <= determined) continue;
        RowBlock& block = hit.rows[joints + j];
        block.softness[0] = impact_compliance * own_inertia(hit, block, 0);
    }
}

/// Solves an impact; where its rows are soft, again and again with their give added to what they ask, until none is left
/// (the proximal point algorithm, Rockafellar 1976). Rows that contradict each other keep some: the solve is unsettled.
void ImpactSolver::solve_rows(MixedSystem& hit, std::size_t joints, std::vector<FrictionPoint>& friction,
                              const IslandRules& rules, const StepMotion& motion, ContactCounters& counters,
                              SolveQuality& quality) {
    const ContactOptions& options = motion.options();
    const std::vector<FrictionPoint>& fresh = work_.first_friction = friction;
    FrictionReport report = solve_islands(hit, friction, solver_, options, rules, counters);
    if (report.converged && is_broken(hit, joints)) {
        for (std::size_t k = joints; k < hit.rows.size(); ++k) {
            RowBlock& block = hit.rows[k];
            block.multiplier.fill(0.0);
            block.state[0] = block.right[0] > 0.0 ? RowState::free : RowState::at_lower;
            block.softness[0] = impact_compliance * own_inertia(hit, block, 0);
        }
        friction = fresh;
        report = solve_islands(hit, friction, solver_, options, rules, counters);
    }
    bool settled = report.converged;
    std::vector<double>& asked = filled(work_.asked, 0);
    std::vector<char>& answered = filled<char>(work_.answered, hit.rows.size(), 1);
    double fastest = 0.0;
    bool soft = false;
    for (std::size_t k = joints; k < hit.rows.size(); ++k) {
        const RowBlock& block = hit.rows[k];
        asked.push_back(block.right[0]);
        fastest = std::max(fastest, std::abs(row_velocity(block, 0, hit.velocity)));
        soft = soft || block.softness[0] > 0.0;
    }
    double change = 0.0;
    for (int again = 0; soft && report.finite && again <= most_again; ++again) {
        change = 0.0;
        for (std::size_t k = 0; k < asked.size(); ++k) {
            RowBlock& block = hit.rows[joints + k];
            const double right = asked[k] + block.softness[0] * block.multiplier[0];
            change = std::max(change, std::abs(right - block.right[0]));
            answered[joints + k] = std::abs(right - block.right[0]) <= left * fastest;
            block.right[0] = right;
        }
        if (change <= left * fastest || again == most_again) break;
        report = solve_islands(hit, friction, solver_, options, rules, counters, &answered);
        settled = settled && report.converged;
    }
    const double enough = options.solver == SolverKind::direct ? 0.0 : options.residual_tolerance;
    if (report.finite && change > std::max(enough, tolerated * fastest)) ++counters.unsettled;
    if (report.finite && !settled) judge_impact(quality, motion, hit, friction, rules.friction);
}

/// Whether a joint's stop takes part in impacts: it sends back what hits it, or others may.
bool ImpactSolver::is_hit(const RowBlock& block) const noexcept {
    return block.stop.rebound != 0.0 || (plastic_too_ && block.stop.hit);
}

/// What is connected by rows of joints and by the step's points.
const Islands& ImpactSolver::connected(const MixedSystem& system, const ContactBodies& bodies,
                                       const ContactPoints& points) {
    connected_.begin(system, system.rows.size());
    points.tie(bodies, connected_);
    return connected_.find();
}

bool ImpactSolver::stop_is_hit(const MixedSystem& system, const ContactBodies& bodies,
                               const ContactPoints& points) {
    if (points.all.empty()) return false;
    const auto hit = [this](const RowBlock& block) { return is_hit(block); };
    if (std::none_of(system.rows.begin(), system.rows.end(), hit)) return false;
    if (rounds_ > most_rounds(points.all.size())) return false;
    const Islands& islands = connected(system, bodies, points);
    const auto own = [&](const StepContact& point) {
        return islands.of_body[bodies.solver_body(point.contact)];
    };
    std::vector<char>& touched = filled(work_.touched, islands.count);
    for (const StepContact& point : points.all) touched[own(point)] = 1;
    return std::any_of(system.rows.begin(), system.rows.end(),
                       [&](const RowBlock& block) { return is_hit(block) && touched[islands.of(block)]; });
}

/// Leaves out points that close where nothing is approached and no stop is hit: what goes on elsewhere is nothing to their
/// bodies. Then the rows of joints as an impact sees them, of those that are connected to a point that is left, or that
/// have a stop which is hit beside a point.
void ImpactSolver::take_part(MixedSystem& system, const ContactModel& model, const ContactPoints& points) {
    const Islands& islands = connected(system, model.bodies, points);
    const auto own = [&](const StepContact& point) {
        return islands.of_body[model.bodies.solver_body(point.contact)];
    };
    std::vector<std::size_t>& hit_points = work_.hit_points;
    const auto is_met =
        [&](const StepContact& point) {  // where impacts come in order, plastic ones have their turn
            return queue_.come_in_order(model, point) ? point.approach < -point.rounding : is_impact(point);
        };
    std::vector<char>&touched = filled(work_.touched, islands.count),
    &taking_part = filled(work_.taking_part, islands.count);
    for (const StepContact& point : points.all) touched[own(point)] = 1;
    for (const std::size_t k : hit_points)
        if (is_met(points.all[k])) taking_part[own(points.all[k])] = 1;
    for (const RowBlock& block : system.rows)
        if (is_hit(block) && touched[islands.of(block)]) taking_part[islands.of(block)] = 1;
    std::erase_if(hit_points, [&](std::size_t k) { return !taking_part[own(points.all[k])]; });
    joints_hit_.clear();
    std::vector<RowBlock>& rows = work_.hit.rows;
    for (RowBlock& given : system.rows) {
        if (!taking_part[islands.of(given)]) continue;
        given.stop.answered = is_hit(given);
        given.stop.limit_reached = rounds_ > most_rounds(points.all.size());
        joints_hit_.push_back(static_cast<std::size_t>(&given - system.rows.data()));
        RowBlock& block = rows.emplace_back(given);
        for (int i = 0; i < block.size; ++i) {
            const bool below = block.lower[i] == -unbounded, above = block.upper[i] == unbounded;
            block.multiplier[i] = 0.0;
            if (i == block.rotor) continue;
            if (below && above) block.right[i] = 0.0;
            else if (i == block.stop.row && (block.stop.touching || block.stop.answered))
                block.right[i] = block.stop.rebound;
            else if (i == block.stop.row) block.lower[i] = block.upper[i] = 0.0;
            else if (above && block.lower[i] == 0.0) block.right[i] = std::min(block.right[i], 0.0);
            else if (below && block.upper[i] == 0.0) block.right[i] = std::max(block.right[i], 0.0);
            else block.lower[i] = block.upper[i] = 0.0;
        }
    }
}

/// Whether a point is approached so that the impact is to answer it.
bool ImpactSolver::is_impact(const StepContact& point) const noexcept {
    const bool answered = point.bounce > 0.0 || (point.bounce == 0.0 && queue_.rebounds(point.contact));
    return answered && point.approach < -point.rounding;
}

/// Rows of the points that take part, behind those of joints.
void ImpactSolver::add_points(const StepMotion& motion, const ContactPoints& points) {
    MixedSystem& hit = work_.hit;
    const ContactRows rows{motion, points};
    std::vector<Vec6>& before = work_.before = hit.momentum;
    for (std::size_t b = 0; b < before.size(); ++b) solve_six(factor_six(hit.mass[b]), before[b]);
    work_.friction.clear(), work_.pushed.clear();
    work_.returned.assign(work_.hit_points.size(), {});
    for (std::size_t j = 0; j < work_.hit_points.size(); ++j) {
        const StepContact& point = points.all[work_.hit_points[j]];
        RowBlock block = rows.row_block(point, rows.packed(point), point.friction > 0.0 ? 3 : 1);
        if (std::any_of(block.right.begin(), block.right.begin() + block.size,
                        [](double r) { return r != 0.0; }))
            work_.pushed.push_back(hit.rows.size());
        block.right[0] += std::max(0.0, -point.bounce * point.approach);
        block.state[0] = point.approach < 0.0 ? RowState::free : RowState::at_lower;
        if (block.size == 3) {
            work_.friction.push_back({static_cast<int>(hit.rows.size()), point.friction, 0.0, -1.0});
            work_.friction.back().anisotropic = points.extras(point).is_anisotropic();
            const double slip = point.bounce > 0.0 && is_impact(point)
                                    ? std::max(motion.surfaces()[point.contact.first].tangential_restitution,
                                               motion.surfaces()[point.contact.second].tangential_restitution)
                                    : 0.0;
            for (int i = 1; i < 3 && slip > 0.0; ++i)
                block.right[i] -= work_.returned[j][i - 1] =
                    slip * (row_velocity(block, i, before) - block.right[i]);
        }
        hit.rows.push_back(block);
    }
}

/// Gives islands whose energy rises a part of the plastic impact. `solve` solves that.
template <class Solve> void ImpactSolver::keep_energy(std::size_t joints, const Solve& solve) {
    Arrays& work = work_;
    const Islands& islands = connected_.find(work.hit);
    find_kinetic_energy(work.hit, work.before, islands, work.limit);
    find_kinetic_energy(work.hit, work.hit.velocity, islands, work.energy);
    work.share.assign(islands.count, 1.0);
    std::vector<char>& rises = filled(work.rises, islands.count);
    for (int k = 0; k < islands.count; ++k) rises[k] = work.energy[k] > work.limit[k] * (1.0 + gain);
    for (const std::size_t k : work.pushed) rises[islands.of(work.hit.rows[k])] = 0;
    if (std::find(rises.begin(), rises.end(), 1) == rises.end()) return;
    MixedSystem& plastic = work.plastic;
    plastic = work.start, work.plastic_friction = work.fresh;
    for (std::size_t k = 0; k < joints; ++k)
        if (RowBlock& block = plastic.rows[k]; block.stop.row >= 0) block.right[block.stop.row] = 0.0;
    for (std::size_t k = joints; k < plastic.rows.size(); ++k) {
        plastic.rows[k].right[0] = 0.0;
        for (int i = 1; i < 3; ++i) plastic.rows[k].right[i] += work.returned[k - joints][i - 1];
    }
    solve(plastic, work.plastic_friction);
    blend(work, islands);
}

/// Adds what the impact did to joints and points.
void ImpactSolver::deliver(std::size_t joints, std::vector<Vec6>& impulses, ContactPoints& points) const {
    const Islands& islands = connected_.islands();
    for (std::size_t k = 0; k < work_.hit.rows.size(); ++k) {
        const RowBlock& block = work_.hit.rows[k];
        const double s = work_.share[islands.of(block)];
        const RowBlock& soft = s < 1.0 ? work_.plastic.rows[k] : block;
        const auto blended = [&](int i) {
            return soft.multiplier[i] + s * (block.multiplier[i] - soft.multiplier[i]);
        };
        if (k < joints) {
            for (int i = 0; i < block.size; ++i) impulses[joints_hit_[k]][i] += blended(i);
            continue;
        }
        StepContact& point = points.all[work_.hit_points[k - joints]];
        point.impact += blended(0);
        points.own_extras(point).impact_impulse +=
            s < 1.0 ? (1.0 - s) * impulse_of(soft) + s * impulse_of(block) : impulse_of(block);
    }
}

void ImpactSolver::find_next(MixedSystem& system, const OpenPairs& open, StepMotion& motion,
                             ContactPoints& points) {
    ++rounds_;
    const bool in_order = queue_.possible() && rounds_ <= most_rounds(points.all.size());
    std::vector<std::size_t>& hit_points = filled(work_.hit_points, 0);
    if (in_order) queue_.find_next(system, open, motion, points, hit_points);
    for (std::size_t k = 0; !in_order && k < points.all.size(); ++k)
        if (points.all[k].bounce >= 0.0) hit_points.push_back(k);
}

SolveQuality ImpactSolver::solve(MixedSystem& system, std::size_t few_enough, StepMotion& motion,
                                 ContactPoints& points, std::vector<Vec6>& impulses,
                                 ContactCounters& counters) {
    const ContactOptions& options = motion.options();
    ++counters.impacts;
    for (const std::size_t k : work_.hit_points)  // what was moved to the impact has turned
        points.all[k].approach =
            relative_velocity(points.all[k], points.all[k].contact.point.normal, motion.velocity);
    MixedSystem& hit = work_.hit;
    hit.mass = system.mass;
    hit.momentum = system.momentum;
    hit.rows.clear(), hit.velocity.clear();
    take_part(system, motion.model(), points);
    const std::size_t joints = hit.rows.size();
    add_points(motion, points);
    share_impact(hit, joints, points);
    work_.start = hit, work_.fresh = work_.friction;
    // No step before has anything to say about an impact: the box takes this one's own normal impulses.
    const bool box = options.friction == FrictionModel::box;
    const IslandRules rules{.friction = box ? FrictionModel::scaled_box : options.friction,
                            .enough = options.residual_tolerance,
                            .few_enough = few_enough};
    SolveQuality quality;
    const auto solve = [&](MixedSystem& rows, std::vector<FrictionPoint>& friction) {
        solve_rows(rows, joints, friction, rules, motion, counters, quality);
    };
    solve(hit, work_.friction);
    keep_energy(joints, solve);
    system.velocity = hit.velocity;
    impulses.resize(system.rows.size());
    deliver(joints, impulses, points);
    return quality;
}

bool ImpactSolver::measure(const StepMotion& motion, const std::vector<double>& reach,
                           ContactPoints& points) {
    const double h = motion.options().time_step;
    needed_ = false;
    for (StepContact& point : points.all) {
        const Contact& contact = point.contact;
        const double gap = contact.point.gap;
        motion.measure(point);
        const double psi = motion.surfaces().pair(contact).restitution, speed = -point.approach;
        const bool plastic = (psi == 0.0 || slow_too_) && queue_.rebounds(contact);
        point.bounce = -1.0;
        if (motion.bodies().is_closed(contact)) {
            point.bounce = speed > 0.0 ? psi : 0.0;
        } else if (plastic && !point.event &&
                   point.impact > 0.0) {  // an impact of this step has brought them together
            point.bounce = 0.0;
        } else if (speed > 0.0 && gap + motion.time_left(point) * (point.approach + point.dv_ext) < 0.0) {
            const double push = relative_velocity(point, contact.point.normal, motion.whole_dv_ext);
            const double ahead = point.queued ? 0.0 : 2.0 * (-push / h) * gap / (speed * speed);
            const double left = psi > 0.0 ? psi * psi - (1.0 - psi * psi) * ahead : 0.0;
            if (left > 0.0) point.bounce = std::min(1.0, std::sqrt(left));
            else if (plastic) point.bounce = 0.0;
        }
        const double kick =
            norm(linear(motion.dv_ext[contact.first])) + norm(linear(motion.dv_ext[contact.second]));
        point.rounding = 1e-6 * kick + 1e-12 * (reach[contact.first] + reach[contact.second]) / h;
        needed_ = needed_ || is_impact(point);
    }
    return needed_;
}

bool ImpactSolver::look_again(const ContactModel& model, const ContactPoints& points) {
    needed_ = false;
    const bool again = rounds_ <= most_rounds(points.all.size());
    for (const StepContact& point : points.all) {
        if (queue_.come_in_order(model, point))
            needed_ |= again && point.bounce >= 0.0 && point.approach < -point.rounding;
        else if (rounds_ < simultaneous_rounds)  // what was hit already is not hit again
            needed_ |= point.impact == 0.0 && point.toi >= 0.0 && is_impact(point);
    }
    return needed_;
}

}  // namespace spook

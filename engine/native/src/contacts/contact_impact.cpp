// The contact stage's second part: impacts.
//
// Why the impact cannot raise the kinetic energy E = ½ vᵀ M v. Let v_p be the plastic impact (psi = 0): with
// impulse P, M (v_p − v₋) = P and E_p − E₋ = v_p·P − ½ |v_p − v₋|²_M, where v_p·P = Σ nu C v_p + beta·D v_p, whose
// first part is zero by complementarity and whose second is negative, friction acting against the slip. So
// E_p <= E₋. Newton's law, v_N, can raise E where restitutions differ, or where friction turns a slip round: then
// v₊ = v_p + s (v_N − v_p) with the largest s in 0 … 1 for which E(v₊) <= E₋, island by island. It exists, E being
// convex in s and E(v_p) <= E₋; and v₊ obeys all that v_p and v_N obey: C v₊ >= 0, nu >= 0, |beta| <= mu nu are convex.
#include <algorithm>
#include <cmath>
#include <utility>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::contact_impact;

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
        energy[islands.of_body[std::max(block.first, block.second)]] +=
            0.5 * speed * speed / block.softness[block.rotor];
    }
}

/// In islands whose energy rises, velocities between the plastic ones and those of Newton's law that keep it; `share` is
/// how much of the latter.
void blend(ImpactArrays& work, const Islands& islands) {
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

/// A pair that meets at more points than its motion can tell apart may share an impact among them in many ways, and
/// friction turns the bodies otherwise with each. Points that give way alike share it in one: their rows get a
/// softness, which solve_impact() takes back.
void ContactStage::share_impact(MixedSystem& hit, std::size_t joints,
                                const std::vector<std::size_t>& hit_points) const {
    std::vector<std::pair<int, int>>& pairs =
        arrays_.impact.pairs;  // points of compounds do not come together
    const auto pair = [&](std::size_t k) {
        const Contact& contact = points_.all[k].contact;
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
void ContactStage::solve_impact(MixedSystem& hit, std::size_t joints, std::vector<FrictionPoint>& friction,
                                FrictionModel model) {
    const std::vector<FrictionPoint>& fresh = arrays_.impact.first_friction = friction;
    const IslandRules rules = rules_of(model, true);
    FrictionReport report =
        solve_islands(hit, friction, impact_solver_, model_->options, rules, state_.counters);
    if (report.converged && is_broken(hit, joints)) {
        for (std::size_t k = joints; k < hit.rows.size(); ++k) {
            RowBlock& block = hit.rows[k];
            block.multiplier.fill(0.0);
            block.state[0] = block.right[0] > 0.0 ? RowState::free : RowState::at_lower;
            block.softness[0] = impact_compliance * own_inertia(hit, block, 0);
        }
        friction = fresh;
        report = solve_islands(hit, friction, impact_solver_, model_->options, rules, state_.counters);
    }
    bool settled = report.converged;
    std::vector<double>& asked = filled(arrays_.impact.asked, 0);
    std::vector<char>& answered = filled<char>(arrays_.impact.answered, hit.rows.size(), 1);
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
        report =
            solve_islands(hit, friction, impact_solver_, model_->options, rules, state_.counters, &answered);
        settled = settled && report.converged;
    }
    const double enough =
        model_->options.solver == SolverKind::direct ? 0.0 : model_->options.residual_tolerance;
    if (report.finite && change > std::max(enough, tolerated * fastest)) ++state_.counters.unsettled;
    if (report.finite && !settled) judge_impact(quality_, judged(), hit, friction, model);
}

/// After a solve: whether an impact is to come first. Where impacts that rebound were left out, bodies that a plastic impact
/// sets in motion may meet others with restitution in this very step. The resting rows that answer such impacts know of no
/// bounce: plastic ones, too, are then met before, so that these are found in time. If there are none, what has been left out is
/// met as if it did not rebound. So come impacts of bodies that a stop sends back with `next` with others that no row knew
/// of: `known` is how many points there were.
bool ContactStage::needs_impact_first(const MixedSystem& system, std::size_t known,
                                      const std::vector<Vec6>& next, bool left_out) {
    if (left_out) {
        plastic_first_ = true;
        measure_points();
        if (impact_needed_) {
            points_.order(state_.cache, model_->surfaces.resists_turning);
            return true;
        }
        find_impacts({next, Cast::When::solved}, true);
    }
    if (points_.all.size() == known || !stop_is_hit(system)) return false;
    points_.order(state_.cache, model_->surfaces.resists_turning);
    measure_points();
    return true;
}

/// What is connected by rows of joints, of which `system` has so many, and by the step's points.
const Islands& ContactStage::connected(const MixedSystem& system, std::size_t joints) const {
    arrays_.connected.begin(static_cast<int>(system.mass.size()));
    for (std::size_t k = 0; k < joints; ++k) arrays_.connected.tie(system.rows[k]);
    for (const Point& point : points_.all)
        arrays_.connected.tie(model_->bodies.solver_index[point.contact.first],
                              model_->bodies.solver_index[point.contact.second]);
    return arrays_.connected.find();
}

int ContactStage::island_of(const Islands& islands, const Point& point) const noexcept {
    return islands.of_body[std::max(model_->bodies.solver_index[point.contact.first],
                                    model_->bodies.solver_index[point.contact.second])];
}

/// Whether a joint's stop takes part in impacts: it sends back what hits it, or plastic impacts are met as well.
bool ContactStage::is_hit(const RowBlock& block) const noexcept {
    return block.stop.rebound != 0.0 || (plastic_first_ && block.stop.hit);
}

/// Whether some stop is hit where contacts are to hear of it: what it sets in motion may push them, and
/// Newton's law for it and resting rows for them would raise the energy. A stop alone is left to the resting stage.
bool ContactStage::stop_is_hit(const MixedSystem& system) const {
    if (points_.all.empty()) return false;
    const auto hit = [this](const RowBlock& block) { return is_hit(block); };
    if (std::none_of(system.rows.begin(), system.rows.end(), hit)) return false;
    if (impact_rounds_ > most_rounds(points_.all.size())) return false;
    const Islands& islands = connected(system, system.rows.size());
    std::vector<char>& touched = filled(arrays_.impact.touched, islands.count);
    for (const Point& point : points_.all) touched[island_of(islands, point)] = 1;
    return std::any_of(system.rows.begin(), system.rows.end(), [&](const RowBlock& block) {
        return is_hit(block) && touched[islands.of_body[std::max(block.first, block.second)]];
    });
}

/// Leaves out points that close where nothing is approached and no stop is hit: what goes on elsewhere is nothing to their
/// bodies. Then the rows of joints as an impact sees them, of those that are connected to a point that is left, or that
/// have a stop which is hit beside a point.
void ContactStage::take_part(MixedSystem& system, std::vector<std::size_t>& hit_points,
                             std::vector<RowBlock>& rows) const {
    const Islands& islands = connected(system, system.rows.size());
    const auto island = [&](const RowBlock& block) {
        return islands.of_body[std::max(block.first, block.second)];
    };
    const auto is_met =
        [&](const Point& point) {  // where impacts come in order, plastic ones have their turn
            return come_in_order(point) ? point.approach < -point.rounding : is_impact(point);
        };
    std::vector<char>&touched = filled(arrays_.impact.touched, islands.count),
    &taking_part = filled(arrays_.impact.taking_part, islands.count);
    for (const Point& point : points_.all) touched[island_of(islands, point)] = 1;
    for (const std::size_t k : hit_points)
        if (is_met(points_.all[k])) taking_part[island_of(islands, points_.all[k])] = 1;
    for (const RowBlock& block : system.rows)
        if (is_hit(block) && touched[island(block)]) taking_part[island(block)] = 1;
    std::erase_if(hit_points,
                  [&](std::size_t k) { return !taking_part[island_of(islands, points_.all[k])]; });
    arrays_.joints_hit.clear();
    for (RowBlock& given : system.rows) {
        if (!taking_part[island(given)]) continue;
        given.stop.answered = is_hit(given);
        given.stop.limit_reached = impact_rounds_ > most_rounds(points_.all.size());
        arrays_.joints_hit.push_back(static_cast<std::size_t>(&given - system.rows.data()));
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
bool ContactStage::is_impact(const Point& point) const noexcept {
    const bool answered = point.bounce > 0.0 || (plastic_first_ && point.bounce == 0.0);
    return answered && point.approach < -point.rounding;
}

void ContactStage::impact(MixedSystem& system, std::vector<Vec6>& impulses) {
    ++state_.counters.impacts;
    ++impact_rounds_;
    quality_ = {};
    const bool in_order = !clock_.empty() && impact_rounds_ <= most_rounds(points_.all.size());
    ImpactArrays& work = arrays_.impact;
    std::vector<std::size_t>& hit_points = filled(work.hit_points, 0);
    if (in_order) find_earliest_impacts(system, hit_points);
    for (std::size_t k = 0; !in_order && k < points_.all.size(); ++k)
        if (points_.all[k].bounce >= 0.0) hit_points.push_back(k);
    MixedSystem& hit = work.hit;
    hit.mass = system.mass;
    hit.momentum = system.momentum;
    hit.rows.clear(), hit.velocity.clear();
    take_part(system, hit_points, hit.rows);
    const std::size_t joints = hit.rows.size();
    std::vector<FrictionPoint>& friction = filled(work.friction, 0);
    std::vector<std::size_t>& pushed = filled(work.pushed, 0);
    std::vector<Vec6>& before = work.before = hit.momentum;
    for (std::size_t b = 0; b < before.size(); ++b) solve_six(factor_six(hit.mass[b]), before[b]);
    auto& returned = work.returned;
    returned.assign(hit_points.size(), {});
    for (std::size_t j = 0; j < hit_points.size(); ++j) {
        const Point& point = points_.all[hit_points[j]];
        RowBlock block = rows().row_block(point, point.friction > 0.0 ? 3 : 1);
        if (std::any_of(block.right.begin(), block.right.begin() + block.size,
                        [](double r) { return r != 0.0; }))
            pushed.push_back(hit.rows.size());
        block.right[0] += std::max(0.0, -point.bounce * point.approach);
        block.state[0] = point.approach < 0.0 ? RowState::free : RowState::at_lower;
        if (block.size == 3) {
            friction.push_back({static_cast<int>(hit.rows.size()), point.friction, 0.0, -1.0});
            friction.back().anisotropic = points_.extras(point).is_anisotropic();
            const double slip = point.bounce > 0.0 && is_impact(point)
                                    ? std::max(model_->surfaces[point.contact.first].tangential_restitution,
                                               model_->surfaces[point.contact.second].tangential_restitution)
                                    : 0.0;
            for (int i = 1; i < 3 && slip > 0.0; ++i)
                block.right[i] -= returned[j][i - 1] =
                    slip * (row_velocity(block, i, before) - block.right[i]);
        }
        hit.rows.push_back(block);
    }
    // No step before has anything to say about an impact: the box takes this one's own normal impulses.
    const FrictionModel model =
        model_->options.friction == FrictionModel::box ? FrictionModel::scaled_box : model_->options.friction;
    share_impact(hit, joints, hit_points);
    work.start = hit, work.fresh = friction;
    solve_impact(hit, joints, friction, model);

    const Islands& islands = arrays_.connected.find(hit);
    const auto island = [&islands](const RowBlock& block) {
        return islands.of_body[std::max(block.first, block.second)];
    };
    find_kinetic_energy(hit, before, islands, work.limit);
    find_kinetic_energy(hit, hit.velocity, islands, work.energy);
    std::vector<double>& share = filled(work.share, islands.count, 1.0);  // of Newton's law, the rest plastic
    std::vector<char>& rises = filled(work.rises, islands.count);
    for (int k = 0; k < islands.count; ++k) rises[k] = work.energy[k] > work.limit[k] * (1.0 + gain);
    for (const std::size_t k : pushed) rises[island(hit.rows[k])] = 0;
    MixedSystem& plastic = work.plastic;
    if (std::find(rises.begin(), rises.end(), 1) != rises.end()) {
        plastic = work.start, work.plastic_friction = work.fresh;
        for (std::size_t k = 0; k < joints; ++k)
            if (RowBlock& block = plastic.rows[k]; block.stop.row >= 0) block.right[block.stop.row] = 0.0;
        for (std::size_t k = joints; k < plastic.rows.size(); ++k) {
            plastic.rows[k].right[0] = 0.0;
            for (int i = 1; i < 3; ++i) plastic.rows[k].right[i] += returned[k - joints][i - 1];
        }
        solve_impact(plastic, joints, work.plastic_friction, model);
        blend(work, islands);
    }
    system.velocity = hit.velocity;
    mark_rows(hit);
    impulses.resize(system.rows.size());
    for (std::size_t j = 0; j < joints; ++j) {
        const RowBlock& block = hit.rows[j];
        const double s = share[island(block)];
        for (int i = 0; i < block.size; ++i) {
            const double other = s < 1.0 ? plastic.rows[j].multiplier[i] : block.multiplier[i];
            impulses[arrays_.joints_hit[j]][i] += other + s * (block.multiplier[i] - other);
        }
    }
    for (std::size_t j = 0; j < hit_points.size(); ++j) {
        Point& point = points_.all[hit_points[j]];
        const RowBlock& block = hit.rows[joints + j];
        const double s = share[island(block)];
        double normal = block.multiplier[0];
        Vec3 impulse = impulse_of(block);
        if (s < 1.0) {
            const RowBlock& soft = plastic.rows[joints + j];
            normal = soft.multiplier[0] + s * (normal - soft.multiplier[0]);
            impulse = (1.0 - s) * impulse_of(soft) + s * impulse;
        }
        point.impact += normal;
        points_.own_extras(point).impact_impulse += impulse;
    }
    after_impact(system);
}

/// Impacts set bodies in motion that meet others within the same step.
void ContactStage::after_impact(const MixedSystem& system) {
    for (std::size_t b = 0; b < model_->bodies.count(); ++b)
        if (model_->bodies.solver_index[b] >= 0 && has_rows_[model_->bodies.solver_index[b]]) {
            motion_.release_support(static_cast<int>(b), system.velocity[model_->bodies.solver_index[b]]);
            motion_.velocity[b] = system.velocity[model_->bodies.solver_index[b]];
        }
    std::vector<Vec6>& next = arrays_.impact.next = motion_.velocity;
    for (std::size_t b = 0; b < next.size(); ++b)
        if (model_->bodies.solver_index[b] >= 0 && !motion_.supported[b] && !model_->bodies.jointed[b])
            next[b] = sum(motion_.velocity[b], motion_.dv_ext[b]);
    changed_.assign(next.size(), 1);
    const Cast cast{next};
    search_.widen(cast, changed_, motion_, points_);
    const std::size_t known = points_.all.size();
    if (search_.find_impacts(cast, changed_, false, motion_, points_).pairs > 0) {
        for (std::size_t k = known; k < points_.all.size(); ++k)
            if (come_in_order(points_.all[k])) move_to_last_impact(points_.all[k]);
        search_.move_impacts_to_start(known, next, motion_, points_);
        state_.counters.contacts += points_.all.size() - known;
        points_.order(state_.cache, model_->surfaces.resists_turning);
    }
    measure_points();
    impact_needed_ = false;
    const bool again = impact_rounds_ <= most_rounds(points_.all.size());
    for (const Point& point : points_.all) {
        if (come_in_order(point))
            impact_needed_ |= again && point.bounce >= 0.0 && point.approach < -point.rounding;
        else if (impact_rounds_ < simultaneous_rounds)  // what was hit already is not hit again
            impact_needed_ |= point.impact == 0.0 && point.toi >= 0.0 && is_impact(point);
    }
    if (!impact_needed_) motion_.lay_down(points_.all);
}

}  // namespace spook

// Successive impacts: which comes next, and the free balls that are moved to its time.
#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"

namespace spook {

/// How far a body has come since the step began, at a time from when on nothing has hit it.
Vec6 ContactStage::path_until(std::size_t body, double time) const {
    if (model_->bodies.solver_index[body] < 0) return sum(Vec6{}, motion_.drive.prescribed()[body], time);
    const double on = time - clock_[body];
    const Vec6 way = sum(path_[body], motion_.velocity[body], on);
    return motion_.supported[body] || model_->bodies.jointed[body] ? way : sum(way, motion_.dv_ext[body], on);
}

/// The gap of a point at that time, with both bodies on their ways.
double ContactStage::gap_at(const Point& point, double time) const {
    const Contact& contact = point.contact;
    const Vec3 n = contact.point.normal;
    return point.begun + dot(contact_row(n, point.first_arm), path_until(contact.first, time)) -
           dot(contact_row(n, point.second_arm), path_until(contact.second, time));
}

/// From when on the ways of both bodies of a point are straight, s.
double ContactStage::last_impact_time(const Point& point) const noexcept {
    return std::max(clock_[point.contact.first], clock_[point.contact.second]);
}

/// When a point that is approached closes, s. Forces are part of the ways: what they slow closes later.
double ContactStage::closing_time(const Point& point) const {
    const double from = last_impact_time(point), gap = std::max(0.0, gap_at(point, from));
    if (gap == 0.0) return from;
    const double speed = (gap - gap_at(point, from + model_->options.time_step)) / model_->options.time_step;
    return from + gap / (speed > 0.0 ? speed : -point.approach);
}

/// An open point among balls that are moved by successive impacts is moved to the time of their last one.
void ContactStage::move_to_last_impact(Point& point) {
    for (const int body : {point.contact.first, point.contact.second})
        if (model_->bodies.solver_index[body] >= 0 && motion_.event_time[body] < 0.0) return;
    const double time = last_impact_time(point), gap = gap_at(point, time);
    if (point.toi < 0.0 && model_->bodies.is_closed(point.contact, gap)) return;
    point.event = true;
    point.toi = time;
    point.contact.point.gap = std::max(0.0, gap);
}

/// Forces act on a free ball until the time it is moved to, and the rest of them after it: what a fall towards a wall wins
/// until then is lost on the way back.
void ContactStage::apply_forces_before(std::size_t b, double part, MixedSystem& system) {
    if (motion_.supported[b] || !(part > motion_.toi_fraction[b])) return;
    const Vec6 more = sum(Vec6{}, motion_.whole_dv_ext[b], part - motion_.toi_fraction[b]);
    motion_.apply_forces_until(b, part);
    const Mat6& mass = system.mass[model_->bodies.solver_index[b]];
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
            system.momentum[model_->bodies.solver_index[b]][i] += mass[6 * i + j] * more[j];
}

/// Whether impacts come one after the other between the bodies of a point.
bool ContactStage::come_in_order(const Point& point) const {
    if (model_->options.impacts == ImpactOrder::successive) return true;
    if (clock_.empty()) return false;
    for (const int b : {point.contact.first, point.contact.second})
        if (model_->bodies.solver_index[b] >= 0 && in_order_[b] <= 0) return false;
    return true;
}

/// Which islands meet one impact after the other: all, where impacts are successive; else those of free balls of which one pair
/// alone touches when the next impact comes. Then there is nothing that all of them could take part in.
void ContactStage::find_orderly(const Islands& islands, const std::vector<double>& first,
                                const std::vector<double>& closing) {
    std::vector<char>& orderly = arrays_.impact.orderly;
    orderly.assign(islands.count, 1);
    if (model_->options.impacts == ImpactOrder::successive) return;
    std::vector<std::uint64_t>& pairs = arrays_.impact.island_pair;
    pairs.assign(islands.count, 0);
    const auto island = [&](std::size_t b) {
        return model_->bodies.solver_index[b] >= 0 ? islands.of_body[model_->bodies.solver_index[b]] : -1;
    };
    for (std::size_t b = 0; b < model_->bodies.count(); ++b)
        if (island(b) >= 0)
            orderly[island(b)] =
                orderly[island(b)] && model_->bodies.ball[b] && motion_.is_free(b) && in_order_[b] >= 0;
    for (std::size_t k = 0; k < points_.all.size(); ++k) {
        const Point& point = points_.all[k];
        const int own = island_of(islands, point);
        const double now = first[own];
        if (now == unbounded ||
            (closing[k] > now && !model_->bodies.is_closed(point.contact, gap_at(point, now))))
            continue;
        const std::uint64_t pair = (point.contact.key >> feature_bits) + 1;
        const bool another = pairs[own] != 0 && pairs[own] != pair;
        if (another || !(model_->surfaces.pair(point.contact).restitution > 0.0)) orderly[own] = 0;
        pairs[own] = pair;
    }
    for (std::size_t b = 0; b < model_->bodies.count(); ++b)
        if (island(b) >= 0 && first[island(b)] < unbounded)
            in_order_[b] =
                orderly[island(b)] ? 1 : -1;  // where they are is not followed after another impact
}

/// Of impacts that come in order those to be answered next, of the others all: of what may meet in this step the points that are
/// approached, and closed when the first of them is. Free balls are moved there, as to the time of a single impact.
void ContactStage::find_earliest_impacts(MixedSystem& system, std::vector<std::size_t>& hit_points) {
    arrays_.connected.begin(static_cast<int>(system.mass.size()));
    for (const RowBlock& block : system.rows) arrays_.connected.tie(block);
    for (const Point& point : points_.all)
        arrays_.connected.tie(model_->bodies.solver_index[point.contact.first],
                              model_->bodies.solver_index[point.contact.second]);
    for (const OpenPair& open : search_.open().pairs)
        if (!open.has_met())
            arrays_.connected.tie(model_->bodies.solver_index[open.first],
                                  model_->bodies.solver_index[open.second]);
    const Islands& islands = arrays_.connected.find();
    const auto is_impact = [](const Point& point) {
        return point.bounce >= 0.0 && point.approach < -point.rounding;
    };
    std::vector<double>&first = filled(arrays_.impact.first, islands.count, unbounded),
    &closing = filled(arrays_.impact.closing, points_.all.size(), unbounded);
    for (std::size_t k = 0; k < points_.all.size(); ++k) {
        if (!is_impact(points_.all[k])) continue;
        closing[k] = closing_time(points_.all[k]);
        double& earliest = first[island_of(islands, points_.all[k])];
        earliest = std::min(earliest, closing[k]);
    }
    find_orderly(islands, first, closing);
    const std::vector<char>& orderly = arrays_.impact.orderly;
    std::vector<char>&hit = arrays_.impact.is_hit, &balls = arrays_.impact.balls;
    hit.assign(model_->bodies.count(), 0), balls.assign(islands.count, 1);
    for (std::size_t k = 0; k < points_.all.size(); ++k) {
        const Point& point = points_.all[k];
        const int own = island_of(islands, point);
        const double now = first[own];
        if (!orderly[own]) {
            if (point.bounce >= 0.0) hit_points.push_back(k);
            continue;
        }
        if (!is_impact(point) ||
            (closing[k] > now && !model_->bodies.is_closed(point.contact, gap_at(point, now))))
            continue;
        hit_points.push_back(k);
        hit[point.contact.first] = hit[point.contact.second] = 1;
    }
    const auto island = [&](std::size_t b) {
        return model_->bodies.solver_index[b] >= 0 ? islands.of_body[model_->bodies.solver_index[b]] : -1;
    };
    for (std::size_t b = 0; b < model_->bodies.count(); ++b)
        if (island(b) >= 0)
            balls[island(b)] = balls[island(b)] && model_->bodies.ball[b] && !model_->bodies.jointed[b];
    for (std::size_t b = 0; b < model_->bodies.count(); ++b) {
        const int own = island(b);
        if (own < 0 || first[own] == unbounded || !orderly[own]) continue;
        if (const double time = std::min(first[own], model_->options.time_step); hit[b] && time > clock_[b]) {
            path_[b] = path_until(b, time);
            clock_[b] = time;
            if (balls[own])
                apply_forces_before(
                    b, part_of_forces(time / model_->options.time_step, model_->surfaces.rebounds), system);
        }
        if (!balls[own] || motion_.moves_along_forces(static_cast<int>(b))) continue;
        motion_.event_time[b] = clock_[b];
        if (clock_[b] > 0.0) motion_.predicted[b] = sum(Vec6{}, path_[b], 1.0 / clock_[b]);
    }
    for (Point& point : points_.all)
        if (come_in_order(point)) move_to_last_impact(point);
    for (const std::size_t k : hit_points) {
        Point& point = points_.all[k];
        point.approach = relative_velocity(point, point.contact.point.normal, motion_.velocity);
        if (point.event && come_in_order(point))
            point.bounce = model_->surfaces.pair(point.contact).restitution;
    }
}

}  // namespace spook

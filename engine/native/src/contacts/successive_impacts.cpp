#include "contacts/successive_impacts.hpp"

#include <algorithm>

#include "contacts/contact_geometry.hpp"

namespace spook {

namespace {

bool is_approached(const StepContact& point) noexcept {
    return point.bounce >= 0.0 && point.approach < -point.rounding;
}

}  // namespace

void SuccessiveImpacts::begin(const ContactModel& model) {
    if (!model.surfaces.rebounds && model.options.impacts != ImpactOrder::successive) return;
    const std::size_t bodies = model.bodies.count();
    clock_.assign(bodies, 0.0), path_.assign(bodies, Vec6{}), in_order_.assign(bodies, 0);
}

/// How far a body has come since the step began, at a time from when on nothing has hit it.
Vec6 SuccessiveImpacts::path_until(const StepMotion& motion, std::size_t body, double time) const {
    if (!motion.bodies().moves(body)) return sum(Vec6{}, motion.drive.prescribed()[body], time);
    const double on = time - clock_[body];
    const Vec6 way = sum(path_[body], motion.velocity[body], on);
    return motion.supported[body] || motion.bodies().jointed[body] ? way : sum(way, motion.dv_ext[body], on);
}

/// The gap of a point at that time, with both bodies on their ways.
double SuccessiveImpacts::gap_at(const StepMotion& motion, const StepContact& point, double time) const {
    const Contact& contact = point.contact;
    const Vec3 n = contact.point.normal;
    return point.begun + dot(contact_row(n, point.first_arm), path_until(motion, contact.first, time)) -
           dot(contact_row(n, point.second_arm), path_until(motion, contact.second, time));
}

/// From when on the ways of both bodies of a point are straight, s.
double SuccessiveImpacts::last_impact_time(const StepContact& point) const noexcept {
    return std::max(clock_[point.contact.first], clock_[point.contact.second]);
}

/// When a point that is approached closes, s. Forces are part of the ways: what they slow closes later.
double SuccessiveImpacts::closing_time(const StepMotion& motion, const StepContact& point) const {
    const double from = last_impact_time(point), gap = std::max(0.0, gap_at(motion, point, from));
    if (gap == 0.0) return from;
    const double speed =
        (gap - gap_at(motion, point, from + motion.options().time_step)) / motion.options().time_step;
    return from + gap / (speed > 0.0 ? speed : -point.approach);
}

void SuccessiveImpacts::move_to_last_impact(const StepMotion& motion, StepContact& point) const {
    for (const int body : {point.contact.first, point.contact.second})
        if (motion.bodies().moves(body) && motion.event_time[body] < 0.0) return;
    const double time = last_impact_time(point), gap = gap_at(motion, point, time);
    if (point.toi < 0.0 && motion.bodies().is_closed(point.contact, gap)) return;
    point.event = true;
    point.toi = time;
    point.contact.point.gap = std::max(0.0, gap);
}

/// Forces act on a free ball until the time it is moved to, and the rest of them after it: what a fall towards a wall wins
/// until then is lost on the way back.
void SuccessiveImpacts::apply_forces_before(std::size_t b, double part, StepMotion& motion,
                                            MixedSystem& system) {
    if (motion.supported[b] || !(part > motion.toi_fraction[b])) return;
    const Vec6 more = sum(Vec6{}, motion.whole_dv_ext[b], part - motion.toi_fraction[b]);
    motion.apply_forces_until(b, part);
    const Mat6& mass = system.mass[motion.bodies().solver_index[b]];
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
            system.momentum[motion.bodies().solver_index[b]][i] += mass[6 * i + j] * more[j];
}

bool SuccessiveImpacts::come_in_order(const ContactModel& model, const StepContact& point) const {
    if (model.options.impacts == ImpactOrder::successive) return true;
    if (clock_.empty()) return false;
    for (const int b : {point.contact.first, point.contact.second})
        if (model.bodies.moves(static_cast<int>(b)) && in_order_[b] <= 0) return false;
    return true;
}

const Islands& SuccessiveImpacts::connected(const MixedSystem& system, const OpenPairs& open_pairs,
                                            const ContactBodies& bodies, const ContactPoints& points) {
    connected_.begin(system, system.rows.size());
    points.tie(bodies, connected_);
    for (const OpenPair& open : open_pairs.pairs)
        if (!open.has_met()) connected_.tie(bodies.solver_pair(open));
    return connected_.find();
}

/// The island of a body, −1 for what does not move by itself and what is connected to nothing.
int SuccessiveImpacts::island(const ContactBodies& bodies, std::size_t body) const noexcept {
    return bodies.moves(body) ? connected_.islands().of_body[bodies.solver_index[body]] : -1;
}

/// When each point that is approached closes, and the first of each island.
void SuccessiveImpacts::find_closing(const StepMotion& motion, const ContactPoints& points) {
    const Islands& islands = connected_.islands();
    first_.assign(islands.count, unbounded), closing_.assign(points.all.size(), unbounded);
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        if (!is_approached(points.all[k])) continue;
        closing_[k] = closing_time(motion, points.all[k]);
        double& earliest = first_[islands.of_body[motion.bodies().solver_body(points.all[k].contact)]];
        earliest = std::min(earliest, closing_[k]);
    }
}

/// Whether a point is closed when the first impact of its island comes.
bool SuccessiveImpacts::closes_then(const StepMotion& motion, const ContactPoints& points,
                                    std::size_t k) const {
    const StepContact& point = points.all[k];
    const double now = first_[connected_.islands().of_body[motion.bodies().solver_body(point.contact)]];
    return !(closing_[k] > now) || motion.bodies().is_closed(point.contact, gap_at(motion, point, now));
}

/// Which islands meet one impact after the other: all, where impacts are successive; else those of free balls of which one pair
/// alone touches when the next impact comes. Then there is nothing that all of them could take part in.
void SuccessiveImpacts::find_orderly(const StepMotion& motion, const ContactPoints& points) {
    const ContactBodies& bodies = motion.bodies();
    const Islands& islands = connected_.islands();
    orderly_.assign(islands.count, 1);
    if (motion.options().impacts == ImpactOrder::successive) return;
    pairs_.assign(islands.count, 0);
    for (std::size_t b = 0; b < bodies.count(); ++b)
        if (const int own = island(bodies, b); own >= 0)
            orderly_[own] = orderly_[own] && bodies.ball[b] && motion.is_free(b) && in_order_[b] >= 0;
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        const StepContact& point = points.all[k];
        const int own = islands.of_body[bodies.solver_body(point.contact)];
        if (first_[own] == unbounded || !closes_then(motion, points, k)) continue;
        const std::uint64_t pair = pair_of(point.contact) + 1;
        const bool another = pairs_[own] != 0 && pairs_[own] != pair;
        if (another || !(motion.surfaces().pair(point.contact).restitution > 0.0)) orderly_[own] = 0;
        pairs_[own] = pair;
    }
    for (std::size_t b = 0; b < bodies.count(); ++b)
        if (const int own = island(bodies, b); own >= 0 && first_[own] < unbounded)
            in_order_[b] = orderly_[own] ? 1 : -1;  // where they are is not followed after another impact
}

/// Follows the bodies of orderly islands to their first impact. Free balls are moved there.
void SuccessiveImpacts::advance(MixedSystem& system, StepMotion& motion) {
    const ContactBodies& bodies = motion.bodies();
    balls_.assign(connected_.islands().count, 1);
    for (std::size_t b = 0; b < bodies.count(); ++b)
        if (const int own = island(bodies, b); own >= 0)
            balls_[own] = balls_[own] && bodies.ball[b] && !bodies.jointed[b];
    const double h = motion.options().time_step;
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        const int own = island(bodies, b);
        if (own < 0 || first_[own] == unbounded || !orderly_[own]) continue;
        if (const double time = std::min(first_[own], h); hit_[b] && time > clock_[b]) {
            path_[b] = path_until(motion, b, time);
            clock_[b] = time;
            if (balls_[own])
                apply_forces_before(b, part_of_forces(time / h, motion.surfaces().rebounds), motion, system);
        }
        if (!balls_[own] || motion.moves_along_forces(static_cast<int>(b))) continue;
        motion.event_time[b] = clock_[b];
        if (clock_[b] > 0.0) motion.predicted[b] = sum(Vec6{}, path_[b], 1.0 / clock_[b]);
    }
}

void SuccessiveImpacts::find_earliest(MixedSystem& system, const OpenPairs& open_pairs, StepMotion& motion,
                                      ContactPoints& points, std::vector<std::size_t>& hit_points) {
    const ContactBodies& bodies = motion.bodies();
    const Islands& islands = connected(system, open_pairs, bodies, points);
    find_closing(motion, points);
    find_orderly(motion, points);
    hit_.assign(bodies.count(), 0);
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        const StepContact& point = points.all[k];
        if (!orderly_[islands.of_body[bodies.solver_body(point.contact)]]) {
            if (point.bounce >= 0.0) hit_points.push_back(k);
        } else if (is_approached(point) && closes_then(motion, points, k)) {
            hit_points.push_back(k);
            hit_[point.contact.first] = hit_[point.contact.second] = 1;
        }
    }
    advance(system, motion);
    for (StepContact& point : points.all)
        if (come_in_order(motion.model(), point)) move_to_last_impact(motion, point);
    for (const std::size_t k : hit_points) {
        StepContact& point = points.all[k];
        point.approach = relative_velocity(point, point.contact.point.normal, motion.velocity);
        if (point.event && come_in_order(motion.model(), point))
            point.bounce = motion.surfaces().pair(point.contact).restitution;
    }
}

}  // namespace spook

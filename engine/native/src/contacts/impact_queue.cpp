#include "contacts/impact_queue.hpp"

#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::impact_queue;

bool is_approached(const StepContact& point) noexcept {
    return point.bounce >= 0.0 && point.approach < -point.rounding;
}

}  // namespace

void ImpactQueue::begin(const ContactModel& model) {
    possible_ = model.surfaces.rebounds || model.options.stops_rebound ||
                model.options.impacts == ImpactOrder::successive;
    const std::size_t bodies = model.bodies.count();
    clock_.assign(bodies, 0.0), path_.assign(bodies, Vec6{}), in_order_.assign(bodies, 0),
        rebounds_.assign(bodies, 0);
}

/// How far a body has come since the step began, at a time from when on nothing has hit it.
Vec6 ImpactQueue::path_until(const StepMotion& motion, std::size_t body, double time) const {
    if (!motion.bodies().moves(body)) return sum(Vec6{}, motion.drive.prescribed()[body], time);
    const double on = time - clock_[body];
    const Vec6 way = sum(path_[body], motion.velocity[body], on);
    return motion.supported[body] || motion.bodies().jointed[body] ? way : sum(way, motion.dv_ext[body], on);
}

/// The gap of a point at that time, with both bodies on their ways.
double ImpactQueue::gap_at(const StepMotion& motion, const StepContact& point, double time) const {
    const Contact& contact = point.contact;
    const Vec3 n = contact.point.normal;
    return point.begun + dot(contact_row(n, point.first_arm), path_until(motion, contact.first, time)) -
           dot(contact_row(n, point.second_arm), path_until(motion, contact.second, time));
}

/// From when on the ways of both bodies of a point are straight, s.
double ImpactQueue::last_impact_time(const StepContact& point) const noexcept {
    return std::max(clock_[point.contact.first], clock_[point.contact.second]);
}

/// When a point that is approached closes, s. Forces are part of the ways: what they slow closes later.
double ImpactQueue::closing_time(const StepMotion& motion, const StepContact& point) const {
    const double from = last_impact_time(point), gap = std::max(0.0, gap_at(motion, point, from));
    if (gap == 0.0) return from;
    const double speed =
        (gap - gap_at(motion, point, from + motion.options().time_step)) / motion.options().time_step;
    return from + gap / (speed > 0.0 ? speed : -point.approach);
}

void ImpactQueue::move_to_last_impact(const StepMotion& motion, StepContact& point) const {
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
void ImpactQueue::apply_forces_before(std::size_t b, double part, StepMotion& motion, MixedSystem& system) {
    if (!motion.is_free(b) || !(part > motion.toi_fraction[b])) return;
    const Vec6 more = sum(Vec6{}, motion.whole_dv_ext[b], part - motion.toi_fraction[b]);
    motion.apply_forces_until(b, part);
    const int own = motion.bodies().solver_index[b];
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) system.momentum[own][i] += system.mass[own][6 * i + j] * more[j];
}

bool ImpactQueue::come_in_order(const ContactModel& model, const StepContact& point) const {
    if (!rebounds(point.contact)) return false;
    if (model.options.impacts == ImpactOrder::successive) return true;
    for (const int b : {point.contact.first, point.contact.second})
        if (model.bodies.moves(static_cast<int>(b)) && in_order_[b] <= 0) return false;
    return true;
}

/// What may meet in this step is an island.
void ImpactQueue::find_islands(const OpenPairs& open_pairs, const StepMotion& motion,
                               const ContactPoints& points) {
    const ContactBodies& bodies = motion.bodies();
    connected_.begin(static_cast<int>(bodies.body_of.size()));
    for (const JointTie& joint : bodies.joints)
        if (joint.first >= 0 && joint.second >= 0 && bodies.moves(joint.first) && bodies.moves(joint.second))
            connected_.tie(bodies.solver_pair(joint));
    points.tie(bodies, connected_);
    for (const OpenPair& open : open_pairs.pairs)
        if (possible_ && !open.has_met()) connected_.tie(bodies.solver_pair(open));
    islands_.assign(connected_.find().count, {});
    const auto rebounds = [&](int a, int b) {
        return motion.surfaces()[a].restitution > 0.0 || motion.surfaces()[b].restitution > 0.0;
    };
    for (const StepContact& point : points.all)
        of(bodies, point).rebounds |= rebounds(point.contact.first, point.contact.second);
    for (const OpenPair& open : open_pairs.pairs) {
        if (!possible_ || open.has_met()) continue;
        islands_[island(bodies, bodies.moves(open.first) ? open.first : open.second)].rebounds |=
            rebounds(open.first, open.second);
    }
    look_at_bodies(motion);
}

/// What bodies say of their islands. Those in which something rebounds are followed: all where impacts are successive; else those
/// of balls, of any number that fly, of a few that something holds, and another body that flies alone, faster than a fall. What one
/// of several bodies without rebound sets in motion may meet others that no one looked for yet.
void ImpactQueue::look_at_bodies(const StepMotion& motion) {
    const ContactBodies& bodies = motion.bodies();
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        const int own = island(bodies, b);
        if (own < 0) continue;
        Island& at = islands_[own];
        ++at.members;
        at.balls &= bodies.ball[b] != 0;
        at.flies &= motion.is_free(b);
        at.fast |= in_order_[b] > 0 ||
                   norm(linear(motion.predicted[b])) > falls * norm(linear(motion.whole_dv_ext[b]));
        at.known &= in_order_[b] >= 0;
        at.moving_along += motion.moves_along_forces(static_cast<int>(b));
        at.fastest = std::max(at.fastest, norm(linear(motion.predicted[b])));
    }
    const bool all = motion.options().impacts == ImpactOrder::successive;
    for (Island& at : islands_) {
        at.rebounds |= possible_ && (all || at.members > 1);
        at.moved = at.balls || (at.flies && at.fast && at.members == 1);
        at.followed =
            at.rebounds && (all || (at.moved && at.known && (at.flies || at.members <= event_bodies)));
    }
    for (std::size_t b = 0; b < bodies.count(); ++b)
        if (const int own = island(bodies, b); own >= 0) rebounds_[b] = islands_[own].rebounds;
}

/// The island of a body, −1 for what does not move by itself and what is connected to nothing.
int ImpactQueue::island(const ContactBodies& bodies, std::size_t body) const noexcept {
    return bodies.moves(body) ? connected_.islands().of_body[bodies.solver_index[body]] : -1;
}

/// The pair of an island that meets in this step, and whether its is not the only point that is approached.
void ImpactQueue::look_at_meeting(const StepContact& point, const std::vector<double>& reach,
                                  const StepMotion& motion) {
    const ContactBodies& bodies = motion.bodies();
    Island& own = of(bodies, point);
    if (motion.drive.acts_at(point.contact, motion.surfaces())) own.may_move_along = event_bodies;
    else if (pushes_against_forces(point, bodies, motion.dv_ext))
        own.may_move_along = std::max(own.may_move_along, 1);
    if (point.toi < 0.0) {
        own.open = own.open || -relative_velocity(point, point.contact.point.normal, motion.predicted) >
                                   still * (reach[point.contact.first] + reach[point.contact.second]) /
                                       motion.options().time_step;
        return;
    }
    const std::uint64_t pair = pair_of(point.contact) + 1;
    own.open = own.open || (own.pair != 0 && own.pair != pair);
    own.pair = pair, own.first = point.toi;
}

/// A plastic impact among bodies that may meet others after it acts at the start of the step, as the rows of those
/// others will: bodies moved to an event's time would not be where such rows expect them.
void ImpactQueue::look_at_open(const OpenPairs& open_pairs, const StepMotion& motion) {
    const ContactBodies& bodies = motion.bodies();
    for (const OpenPair& open : open_pairs.pairs) {
        if (open.has_met()) continue;
        double speed = 0.0;
        for (const int body : {open.first, open.second}) {
            const int own = island(bodies, body);
            speed += own < 0 ? norm(linear(motion.predicted[body])) : islands_[own].fastest;
        }
        if (open.apart.gap > motion.options().time_step * speed) continue;
        for (const int body : {open.first, open.second})
            if (const int own = island(bodies, body); own >= 0) islands_[own].open = true;
    }
}

void ImpactQueue::find_meetings(const CandidateSearch& search, StepMotion& motion, ContactPoints& points) {
    const ContactBodies& bodies = motion.bodies();
    find_islands(search.open(), motion, points);
    for (StepContact& point : points.all) {
        const Island& own = of(bodies, point);
        point.queued = point.toi >= 0.0 && own.followed && own.moved;
        look_at_meeting(point, search.margins().reach(), motion);
    }
    look_at_open(search.open(), motion);
    for (Island& own : islands_)
        own.followed = own.pair != 0 && !own.rebounds && !own.open && own.balls &&
                       own.members <= event_bodies && own.moving_along <= own.may_move_along;
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        const int own = island(bodies, b);
        if (own < 0 || !islands_[own].followed) continue;
        motion.event_time[b] = islands_[own].first;
        if (motion.is_free(b))
            motion.apply_forces_until(b, part_of_forces(islands_[own].first / motion.options().time_step,
                                                        motion.surfaces().rebounds));
    }
    for (StepContact& point : points.all) {
        point.event = point.toi >= 0.0 && of(bodies, point).followed;
        if (point.event) point.contact.point.gap = std::max(0.0, point.meeting_gap);
    }
}

/// When each point that is approached closes, and the first of each island.
void ImpactQueue::find_closing(const StepMotion& motion, const ContactPoints& points) {
    closing_.assign(points.all.size(), unbounded);
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        if (!is_approached(points.all[k]) || !of(motion.bodies(), points.all[k]).rebounds) continue;
        closing_[k] = closing_time(motion, points.all[k]);
        double& first = of(motion.bodies(), points.all[k]).first;
        first = std::min(first, closing_[k]);
    }
}

/// Follows bodies to the first impact of their island. Balls are moved there: those that take part, and those that something holds.
void ImpactQueue::advance(StepMotion& motion, MixedSystem& system) {
    const ContactBodies& bodies = motion.bodies();
    const double h = motion.options().time_step;
    for (std::size_t b = 0; b < bodies.count(); ++b) {
        const int own = island(bodies, b);
        if (own < 0 || islands_[own].first == unbounded) continue;
        const Island& at = islands_[own];
        in_order_[b] = at.followed ? 1 : -1;  // where others are is not known after another impact
        if (!at.followed) continue;
        const double time = std::min(at.first, h);
        if ((hit_[b] || (at.balls && !motion.is_free(b))) && time > clock_[b]) {
            path_[b] = path_until(motion, b, time);
            clock_[b] = time;
            if (at.moved)
                apply_forces_before(b, part_of_forces(time / h, motion.surfaces().rebounds), motion, system);
        }
        if (!at.moved || (at.rebounds && motion.moves_along_forces(static_cast<int>(b)))) continue;
        motion.event_time[b] = clock_[b];
        if (clock_[b] > 0.0) motion.predicted[b] = sum(Vec6{}, path_[b], 1.0 / clock_[b]);
    }
}

void ImpactQueue::find_next(MixedSystem& system, const OpenPairs& open_pairs, StepMotion& motion,
                            ContactPoints& points, std::vector<std::size_t>& hit_points) {
    const ContactBodies& bodies = motion.bodies();
    const bool one_by_one = motion.options().impacts == ImpactOrder::successive;
    find_islands(open_pairs, motion, points);
    find_closing(motion, points);
    hit_.assign(bodies.count(), 0);
    for (std::size_t k = 0; k < points.all.size(); ++k) {
        const StepContact& point = points.all[k];
        const Island& own = of(bodies, point);
        if (!own.followed) {
            if (point.bounce >= 0.0) hit_points.push_back(k);
            continue;
        }
        if (own.first == unbounded || point.bounce < 0.0 || (one_by_one && !is_approached(point))) continue;
        if (closing_[k] > own.first && !bodies.is_closed(point.contact, gap_at(motion, point, own.first)))
            continue;
        hit_points.push_back(k);
        hit_[point.contact.first] = hit_[point.contact.second] = 1;
    }
    advance(motion, system);
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

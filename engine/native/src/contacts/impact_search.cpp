// The search for impacts: which open pairs meet within the step, when, and with which points.
#include <algorithm>
#include <utility>

#include "contacts/candidate_search.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"
#include "linear/ahead.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

using namespace tolerances::impact_search;

/// An open point lies midway between both surfaces. Beside a body that does not move it will be closed on the surface of the one
/// that does: a rebound's friction turns it about that arm, and no angular momentum of a pair has to be kept.
void put_on_mover(StepContact& point, bool first_moves, bool second_moves) noexcept {
    if (first_moves == second_moves) return;
    const Vec3 aside = (first_moves ? 0.5 : -0.5) * point.contact.point.gap * point.contact.point.normal;
    point.contact.point.position += aside;
    point.first_arm += aside;
    point.second_arm += aside;
}

}  // namespace

/// When an open pair that does not surely pass meets, s; negative if it does not in this step.
double CandidateSearch::meeting(const OpenPair& open, const Cast& cast, const StepMotion& motion,
                                const ContactPoints& points) const {
    const SearchedStep at = step(motion, points);
    const OpenWays way(at, open, cast.velocity);
    const double time =
        time_of_impact(way.first, way.second, motion.options().time_step, edges.slop(at, open));
    if (time < 0.0 || edges.is_internal_edge(at, way.first, open.first, way.second, open, cast, time) ||
        edges.is_internal_edge(at, way.second, open.second, way.first, open, cast, time))
        return -1.0;
    return time;
}

/// Whether a point of the pair presses along `velocity`: what else turns in then is as deep as where bodies touch.
bool CandidateSearch::presses(const OpenPair& open, const std::vector<Vec6>& velocity,
                              const StepMotion& motion, const ContactPoints& points) const {
    const std::uint64_t key = pair_of(open.pair);
    const double h = motion.options().time_step;
    const auto end = points.all.begin() + static_cast<std::ptrdiff_t>(points.ordered);
    auto at = std::lower_bound(points.all.begin(), end, key, [](const StepContact& point, std::uint64_t k) {
        return pair_of(point.contact) < k;
    });
    for (; at != end && pair_of(at->contact) == key; ++at)
        if (at->contact.point.gap + h * relative_velocity(*at, at->contact.point.normal, velocity) <=
            closed * motion.bodies().size(at->contact))
            return true;
    return false;
}

int CandidateSearch::find_impacts(const Cast& given, const std::vector<char>& changed, StepMotion& motion,
                                  ContactPoints& points) {
    const bool steady = motion.bodies().tumblers.empty();
    const Cast cast{steady ? given.velocity : motion.along(given.velocity), given.when};
    const std::vector<Vec6>& velocity = cast.velocity;
    const bool late = cast.when != Cast::When::ahead;
    meetings_.clear();
    if (motion.bodies().swings && !open_.pairs.empty()) edges.index(step(motion, points));
    open_.drop_met(most_met);
    asked_.resize(open_.pairs.size() + 1);
    std::size_t count = 0;
    for (std::size_t k = 0; k < open_.pairs.size(); ++k) {  // the others were judged before
        asked_[count] = k;
        count += !late || (changed[open_.bodies[k].first] | changed[open_.bodies[k].second]) != 0;
    }
    const std::size_t all = std::exchange(count, 0);
    for (std::size_t at = 0; at < all; ++at) {  // nearly all pass: the others are gathered first
        asked_[count] = asked_[at];
        const OpenPair& open = open_.pairs[asked_[at]];
        count += !open.has_met() && !passes(open, motion, points, velocity) &&
                 !(open.pressed &&
                   (cast.when != Cast::When::solved || presses(open, given.velocity, motion, points)));
    }
    for (std::size_t at = 0; at < count; ++at) {
        if (at + ahead < count) prefetch_bodies(open_.pairs[asked_[at + ahead]], motion.poses, motion.dv_ext);
        if ((at + 1) % pairs_a_look == 0) Watch::look();
        if (const double time = meeting(open_.pairs[asked_[at]], cast, motion, points); !(time < 0.0))
            meetings_.push_back({asked_[at], time});
    }
    edges.remove_occluded(step(motion, points), open_.pairs, velocity, meetings_);
    int found = 0;
    for (std::size_t at = 0; at < meetings_.size(); ++at) {
        if (at + ahead < meetings_.size()) {
            const OpenPair& later = open_.pairs[meetings_[at + ahead].open];
            prefetch(detection.pose(later.pair.first)), prefetch(detection.pose(later.pair.second));
            prefetch_bodies(later, motion.poses, velocity);
        }
        const auto& [k, time] = meetings_[at];
        OpenPair& open = open_.pairs[k];
        if (!(late && add_toi_point_at_start(open, time, given.velocity, motion, points)) &&
            !add_toi_points(open, time, velocity, given.velocity, motion, points))
            continue;
        open_.meet(open);
        ++found;
    }
    return found;
}

/// What add_toi_points() and move_impacts_to_start() make of spheres and planes without a point at their meeting: half of the
/// contacts of a heap that moves come so. False if another side of what does not move by itself may be met than is faced at the
/// start, or if the point of the start does not stop them.
bool CandidateSearch::add_toi_point_at_start(const OpenPair& open, double time,
                                             const std::vector<Vec6>& velocity, const StepMotion& motion,
                                             ContactPoints& points) {
    bool elsewhere = !(motion.bodies().moves(open.first) && motion.bodies().moves(open.second));
    for (const int collider : {open.pair.first, open.pair.second}) {
        const Collider::View own = detection.collider(collider);
        const bool flat = own.shape.kind == ShapeKind::plane;
        if (!flat && own.shape.kind != ShapeKind::sphere) return false;
        if (flat && angular(velocity[own.body]) == Vec3{}) elsewhere = false;
    }
    if (elsewhere) return false;
    const int a = open.first, b = open.second;
    scratch_.clear();
    detection.collide_pair(open.pair, margins_.search()[a] + margins_.search()[b], scratch_);
    if (scratch_.empty()) return false;
    const Contact& contact = scratch_.front();
    add_point(motion.model(), points, contact, motion.poses[a], motion.poses[b], time);
    const double closing = relative_velocity(points.all.back(), contact.point.normal, velocity);
    const bool stops = contact.point.gap + motion.options().time_step * closing < 0.0;
    if (stops) points.all.back().at_start = true;
    else points.all.pop_back();
    return stops;
}

/// The points of a pair that meets at `time`, with the bodies where they will be then.
bool CandidateSearch::add_toi_points(const OpenPair& open, double time, const std::vector<Vec6>& along,
                                     const std::vector<Vec6>& velocity, const StepMotion& motion,
                                     ContactPoints& points) {
    const int a = open.first, b = open.second;
    const OpenWays way(step(motion, points), open, along);
    const Pose first = way.first.body_at(time), second = way.second.body_at(time);
    const Vec3 led = (way.first_body.position - motion.poses[a].position) -
                     (way.second_body.position - motion.poses[b].position);
    const double radius = std::max(motion.bodies().radius[a], motion.bodies().radius[b]);
    scratch_.clear();
    detection.collide_pair(open.pair, first, second,
                           std::max(margins_.reach()[a] + margins_.reach()[b], 2.0 * closed * radius),
                           scratch_);
    bool met = false;
    for (const Contact& contact : scratch_) {
        if (is_turned_through(detection, contact, first, second, velocity, motion.dv_ext,
                              motion.options().time_step))
            continue;
        StepContact& point = add_point(motion.model(), points, contact, first, second, time);
        const double closing = -relative_velocity(point, contact.point.normal, velocity);
        point.meeting_gap = contact.point.gap;
        point.begun = contact.point.gap + time * closing;
        point.contact.point.gap = std::max(0.0, point.begun);
        point.begun -= dot(point.contact.point.normal, led);
        met = true;
    }
    return met;
}

void CandidateSearch::move_impacts_to_start(std::size_t from, const std::vector<Vec6>& velocity,
                                            const StepMotion& motion, ContactPoints& points) {
    const ContactBodies& bodies = motion.bodies();
    const double h = motion.options().time_step;
    const auto is_there = [](const StepContact& point) {
        return point.event || point.queued || point.at_start || point.toi < 0.0;
    };
    if (std::all_of(points.all.begin() + static_cast<std::ptrdiff_t>(from), points.all.end(), is_there))
        return;
    const LargeArray<StepContact>& found = points.take_from(from);
    for (std::size_t k = 0; k < found.size();) {
        if (k + ahead < found.size()) prefetch_bodies(found[k + ahead].contact, motion.poses, velocity);
        const Contact meeting = found[k].contact;
        const double toi = found[k].toi;
        std::size_t end = k;
        while (end < found.size() && pair_of(found[end].contact) == (pair_of(meeting))) ++end;
        if (is_there(found[k])) {
            for (; k < end; ++k) points.all.push_back(found[k]);
            continue;
        }
        const IndexPair pair = colliders_of(meeting);
        scratch_.clear();
        detection.collide_pair(pair, margins_.search()[meeting.first] + margins_.search()[meeting.second],
                               scratch_);
        const std::size_t old = points.all.size();
        bool stops = false;
        // Past an edge, another side is met than the one that is faced at the start; of two that move, surely another.
        const bool fixed =
            std::min(bodies.solver_index[meeting.first], bodies.solver_index[meeting.second]) < 0;
        const double same =
            fixed ? same_side
            : have_sides(detection.collider(pair.first).shape, detection.collider(pair.second).shape)
                ? other_side
                : -unbounded;
        if (std::any_of(scratch_.begin(), scratch_.end(), [&](const Contact& contact) {
                return dot(contact.point.normal, meeting.point.normal) < same;
            }))
            scratch_.clear();
        for (const Contact& contact : scratch_) {
            const Pose &one = motion.poses[contact.first], &two = motion.poses[contact.second];
            if (is_turned_through(detection, contact, one, two, velocity, motion.dv_ext, h)) continue;
            add_point(motion.model(), points, contact, one, two, toi);
            if (motion.surfaces().pair(contact).restitution > 0.0)
                put_on_mover(points.all.back(), bodies.moves(contact.first), bodies.moves(contact.second));
            stops = stops || contact.point.gap + h * relative_velocity(points.all.back(),
                                                                       contact.point.normal, velocity) <
                                 0.0;
        }
        if (stops) {
            k = end;
            continue;
        }
        points.all.resize(old);
        for (; k < end; ++k) {
            StepContact& p = points.all.emplace_back(found[k]);
            const int a = p.contact.first, b = p.contact.second;
            const bool alone = !(bodies.moves(a) && bodies.moves(b));  // then its arm is that of the meeting
            const Vec3 own = linear(velocity[!bodies.moves(a) ? b : a]);
            p.contact.point.position -= p.toi * (alone ? own : 0.5 * (own + linear(velocity[b])));
            if (alone) continue;
            p.first_arm = p.contact.point.position - motion.poses[a].position;
            p.second_arm = p.contact.point.position - motion.poses[b].position;
        }
    }
}

}  // namespace spook

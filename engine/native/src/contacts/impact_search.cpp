// The contact stage's search for impacts: which open pairs meet within the step, when, and with which points.
#include <algorithm>
#include <utility>

#include "collision/shape_cast.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
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

/// When an open pair that does not surely pass meets along `velocity`, s; negative if it does not in this step.
double ContactStage::meeting(const OpenPair& open, const std::vector<Vec6>& velocity, bool late) const {
    const Pose at_first = motion_.moved(open.first, velocity),
               at_second = motion_.moved(open.second, velocity);
    const Mover first = mover(open.pair.first, at_first, velocity),
                second = mover(open.pair.second, at_second, velocity);
    const double time = time_of_impact(first, second, model_->options.time_step, slop(open));
    if (time < 0.0 || is_internal_edge(first, open.first, second, open, velocity, time, late) ||
        is_internal_edge(second, open.second, first, open, velocity, time, late))
        return -1.0;
    return time;
}

/// A collider whose body goes on from `pose`, which must outlive it.
Mover ContactStage::mover(int collider, const Pose& pose, const std::vector<Vec6>& velocity) const {
    const Collider::View own = detection_.collider(collider);
    return {own.shape, own.part, pose, linear(velocity[own.body]), angular(velocity[own.body])};
}

/// Casts the open pairs along `velocity`; those that meet get points. Late impacts, after the solve, come too late
/// for an impact: if they need one, late_impact_ tells so, see needs_plastic_impact().
int ContactStage::find_impacts(const std::vector<Vec6>& velocity, bool late) {
    meetings_.clear();
    if (model_->bodies.swings && !open_.pairs.empty()) points_of_.find(points_.all, model_->bodies);
    open_.drop_met(most_met);
    std::vector<std::size_t>& asked = arrays_.asked;
    asked.resize(open_.pairs.size() + 1);
    std::size_t count = 0;
    for (std::size_t k = 0; k < open_.pairs.size(); ++k) {  // the others were judged before
        asked[count] = k;
        count += !late || (changed_[open_.bodies[k].first] | changed_[open_.bodies[k].second]) != 0;
    }
    const std::size_t all = std::exchange(count, 0);
    for (std::size_t at = 0; at < all; ++at) {  // nearly all pass: the others are gathered first
        asked[count] = asked[at];
        const OpenPair& open = open_.pairs[asked[at]];
        count += !open.has_met() && !passes(open, velocity);
    }
    for (std::size_t at = 0; at < count; ++at) {
        if (at + ahead < count) {
            const OpenPair& later = open_.pairs[asked[at + ahead]];
            for (const int body : {later.first, later.second})
                prefetch(motion_.poses[body]), prefetch(motion_.dv_ext[body]);
        }
        if ((at + 1) % pairs_a_look == 0) Watch::look();
        if (const double time = meeting(open_.pairs[asked[at]], velocity, late); !(time < 0.0))
            meetings_.push_back({asked[at], time});
    }
    remove_occluded(meetings_, velocity);
    int found = 0;
    for (std::size_t at = 0; at < meetings_.size(); ++at) {
        if (at + ahead < meetings_.size()) {
            const OpenPair& later = open_.pairs[meetings_[at + ahead].open];
            prefetch(detection_.pose(later.pair.first)), prefetch(detection_.pose(later.pair.second));
            for (const int body : {later.first, later.second})
                prefetch(motion_.poses[body]), prefetch(velocity[body]);
        }
        const auto& [k, time] = meetings_[at];
        OpenPair& open = open_.pairs[k];
        if (late && add_toi_point_at_start(open, time, velocity)) {
            open_.meet(open);
            ++found;
            continue;
        }
        const Pose first = motion_.moved(open.first, velocity), second = motion_.moved(open.second, velocity);
        const std::size_t known = points_.all.size();
        const bool met =
            add_toi_points(open.pair, mover(open.pair.first, first, velocity).body_at(time),
                           mover(open.pair.second, second, velocity).body_at(time), time, velocity, late);
        const Vec3 led = (first.position - motion_.poses[open.first].position) -
                         (second.position - motion_.poses[open.second].position);
        for (std::size_t i = known; i < points_.all.size(); ++i)
            points_.all[i].begun -= dot(points_.all[i].contact.point.normal, led);
        if (!met) continue;
        open_.meet(open);
        ++found;
    }
    return found;
}

bool ContactStage::meets(const std::vector<Vec6>& next, bool stop_hit, bool rebounds) {
    plastic_first_ = rebounds;  // impacts that a stop's rebound leads to are found again after it
    late_impact_ = false;
    changed_ = model_->bodies.jointed;  // others have been cast along what they fly with
    if (margins_.outrun(model_->bodies, model_->options.time_step, next, changed_)) find_open_again();
    const std::size_t closed_points = points_.all.size();
    int found = find_impacts(next, true);
    if (late_impact_ && stop_hit && !plastic_first_) {  // as are those to a body that it only stops
        plastic_first_ = true;
        found += find_impacts(next, true);
    }
    if (found > 0) move_impacts_to_start(closed_points, next);
    if (points_.all.empty()) return false;
    state_.counters.contacts += points_.all.size();
    motion_.apply_half_of_forces();
    points_.order(state_.cache, model_->surfaces.resists_turning);
    return true;
}

/// What add_toi_points() and move_impacts_to_start() make of spheres and planes without a point at their meeting: half of the
/// contacts of a heap that moves come so. False if they may rebound, if another side of what does not move by itself may be
/// met than is faced at the start, or if the point of the start does not stop them.
bool ContactStage::add_toi_point_at_start(const OpenPair& open, double time,
                                          const std::vector<Vec6>& velocity) {
    bool elsewhere =
        std::min(model_->bodies.solver_index[open.first], model_->bodies.solver_index[open.second]) < 0;
    for (const int collider : {open.pair.first, open.pair.second}) {
        const Collider::View own = detection_.collider(collider);
        const bool flat = own.shape.kind == ShapeKind::plane;
        if (!flat && own.shape.kind != ShapeKind::sphere) return false;
        if (!plastic_first_ && model_->surfaces[own.body].restitution > 0.0) return false;
        if (flat && angular(velocity[own.body]) == Vec3{}) elsewhere = false;
    }
    if (elsewhere) return false;
    const int a = open.first, b = open.second;
    scratch_.clear();
    detection_.collide_pair(open.pair, margins_.search()[a] + margins_.search()[b], scratch_);
    if (scratch_.empty()) return false;
    const Contact& contact = scratch_.front();
    add_point(contact, motion_.poses[a], motion_.poses[b], time);
    const double closing = relative_velocity(points_.all.back(), contact.point.normal, velocity);
    const bool stops = contact.point.gap + model_->options.time_step * closing < 0.0;
    if (stops) points_.all.back().at_start = true;
    else points_.all.pop_back();
    return stops;
}

/// The points of a pair that meets at `time`, with the bodies where they will be then.
bool ContactStage::add_toi_points(IndexPair pair, const Pose& first, const Pose& second, double time,
                                  const std::vector<Vec6>& velocity, bool late) {
    const int a = detection_.collider(pair.first).body, b = detection_.collider(pair.second).body;
    const double radius = std::max(model_->bodies.radius[a], model_->bodies.radius[b]);
    scratch_.clear();
    detection_.collide_pair(pair, first, second,
                            std::max(margins_.reach()[a] + margins_.reach()[b], 2.0 * closed * radius),
                            scratch_);
    bool met = false;
    for (const Contact& contact : scratch_) {
        if (is_turned_through(detection_, contact, first, second, velocity, motion_.dv_ext,
                              model_->options.time_step))
            continue;
        add_point(contact, first, second, time);
        Point& point = points_.all.back();
        const double closing = -relative_velocity(point, contact.point.normal, velocity);
        // What forces give to one of them in this step is no impact, though both got it before one was held.
        const double push =
            std::max({std::abs(relative_velocity(point, contact.point.normal, motion_.dv_ext)),
                      std::abs(dot(contact.point.normal, linear(motion_.dv_ext[contact.first]))),
                      std::abs(dot(contact.point.normal, linear(motion_.dv_ext[contact.second])))});
        if (late && !plastic_first_ && model_->surfaces.pair(contact).restitution > 0.0 &&
            closing > 4.0 * push) {
            late_impact_ = true;
            points_.all.pop_back();
            continue;
        }
        point.meeting_gap = contact.point.gap;
        point.begun = contact.point.gap + time * closing;
        point.contact.point.gap = std::max(0.0, point.begun);
        met = true;
    }
    return met;
}

/// An impact that is no event acts with the bodies at the start of the step, or the angular momentum of both would
/// not be kept: with the points of that moment, if their rows stop the approach, else at the point of the meeting,
/// taken back half-way between both bodies, or with the one that moves by itself.
void ContactStage::move_impacts_to_start(std::size_t from, const std::vector<Vec6>& velocity) {
    const double h = model_->options.time_step;
    const auto is_there = [](const Point& point) { return point.at_start || point.toi < 0.0; };
    if (std::all_of(points_.all.begin() + static_cast<std::ptrdiff_t>(from), points_.all.end(), is_there))
        return;
    const LargeArray<Point>& found = points_.take_from(from);
    for (std::size_t k = 0; k < found.size();) {
        if (k + ahead < found.size()) {
            const Contact& later = found[k + ahead].contact;
            for (const int body : {later.first, later.second})
                prefetch(motion_.poses[body]), prefetch(velocity[body]);
        }
        const Contact meeting = found[k].contact;
        const double toi = found[k].toi;
        std::size_t end = k;
        while (end < found.size() &&
               (found[end].contact.key >> feature_bits) == (meeting.key >> feature_bits))
            ++end;
        if (toi < 0.0 || found[k].event || found[k].at_start) {
            for (; k < end; ++k) points_.all.push_back(found[k]);
            continue;
        }
        const IndexPair pair{static_cast<int>(meeting.key >> (feature_bits + 24)),
                             static_cast<int>(meeting.key >> feature_bits & 0xffffff)};
        scratch_.clear();
        detection_.collide_pair(pair, margins_.search()[meeting.first] + margins_.search()[meeting.second],
                                scratch_);
        const std::size_t old = points_.all.size();
        bool stops = false;
        // Past an edge, another side is met than the one that is faced at the start; of two that move, surely another.
        const bool fixed = std::min(model_->bodies.solver_index[meeting.first],
                                    model_->bodies.solver_index[meeting.second]) < 0;
        const double same =
            fixed ? same_side
            : have_sides(detection_.collider(pair.first).shape, detection_.collider(pair.second).shape)
                ? other_side
                : -unbounded;
        if (std::any_of(scratch_.begin(), scratch_.end(), [&](const Contact& contact) {
                return dot(contact.point.normal, meeting.point.normal) < same;
            }))
            scratch_.clear();
        for (const Contact& contact : scratch_) {
            const Pose &one = motion_.poses[contact.first], &two = motion_.poses[contact.second];
            if (is_turned_through(detection_, contact, one, two, velocity, motion_.dv_ext, h)) continue;
            add_point(contact, one, two, toi);
            if (model_->surfaces.pair(contact).restitution > 0.0)
                put_on_mover(points_.all.back(), model_->bodies.solver_index[contact.first] >= 0,
                             model_->bodies.solver_index[contact.second] >= 0);
            stops = stops || contact.point.gap + h * relative_velocity(points_.all.back(),
                                                                       contact.point.normal, velocity) <
                                 0.0;
        }
        if (stops) {
            k = end;
            continue;
        }
        points_.all.resize(old);
        for (; k < end; ++k) {
            Point& p = points_.all.emplace_back(found[k]);
            const int a = p.contact.first, b = p.contact.second;
            const bool alone = std::min(model_->bodies.solver_index[a], model_->bodies.solver_index[b]) <
                               0;  // then its arm is that of the meeting
            const Vec3 own = linear(velocity[model_->bodies.solver_index[a] < 0 ? b : a]);
            p.contact.point.position -= p.toi * (alone ? own : 0.5 * (own + linear(velocity[b])));
            if (alone) continue;
            p.first_arm = p.contact.point.position - motion_.poses[a].position;
            p.second_arm = p.contact.point.position - motion_.poses[b].position;
        }
    }
}

}  // namespace spook

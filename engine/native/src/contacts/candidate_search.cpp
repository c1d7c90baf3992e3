#include "contacts/candidate_search.hpp"

#include <algorithm>
#include <cmath>

#include "collision/cylinder.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/tolerances.hpp"
#include "linear/ahead.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

bool by_key(const Contact& a, const Contact& b) noexcept { return a.key < b.key; }

}  // namespace

bool is_turned_through(const Detection& detection, const Contact& contact, const Pose& first,
                       const Pose& second, const std::vector<Vec6>& velocity, const std::vector<Vec6>& dv_ext,
                       double h) noexcept {
    constexpr std::uint64_t lower = (std::uint64_t{1} << collider_bits) - 1;
    const std::uint64_t pair = pair_of(contact);
    const Collider::View one = detection.collider(static_cast<int>(pair >> collider_bits)),
                         two = detection.collider(static_cast<int>(pair & lower));
    const bool swapped = one.shape.kind == ShapeKind::plane;
    const Collider::View& rim = swapped ? two : one;
    const Collider::View& plane = swapped ? one : two;
    if (plane.shape.kind != ShapeKind::plane || !is_between(rim.shape, contact.point.feature)) return false;
    const Pose at = placed(swapped ? second : first, rim.part);
    const Vec3 axis = column(at.rotation, 2);
    const Vec6& now = velocity[rim.body];
    const double spin = std::max(std::abs(dot(axis, angular(now))),
                                 std::abs(dot(axis, angular(now) + angular(dv_ext[rim.body]))));
    const double lever =
        std::abs(dot(contact.point.normal, cross(axis, contact.point.position - at.position)));
    const double gap = contact.point.gap, none = closed * detection.radius()[rim.body];
    return gap > none && gap <= h * spin * lever + none;
}

/// Bodies that pass each other sideways need no row: what counts is the speed along the normal.
bool CandidateSearch::reachable(const StepMotion& motion, const Contact& contact) const {
    const std::vector<double>& radius = detection.radius();
    const Vec3 n = contact.point.normal;
    auto speed = [&](int b) {
        const Vec6 free = sum(motion.velocity[b], motion.dv_ext[b]);
        const double spin = std::max(norm(angular(motion.velocity[b])), norm(angular(free)));
        return std::max(std::abs(dot(n, linear(motion.velocity[b]))), std::abs(dot(n, linear(free)))) +
               spin * radius[b];
    };
    return contact.point.gap <= motion.options().time_step * (speed(contact.first) + speed(contact.second)) +
                                    closed * motion.bodies().size(contact);
}

void CandidateSearch::begin(StepMotion& motion, const std::vector<Vec6>& free_velocity,
                            const ContactCache& last, ContactPoints& points) {
    const ContactOptions& options = motion.options();
    woken.clear();
    last_ = &last;
    margins_.begin(motion.bodies(), options.time_step, motion.velocity, free_velocity,
                   options.solver == SolverKind::iterative || options.impacts == ImpactOrder::successive);
    find_open(motion, points);
}

void CandidateSearch::find_open(StepMotion& motion, ContactPoints& points) {
    open_.clear();
    look_at(detection.near(motion.poses, margins_.search()), motion, points);
}

void CandidateSearch::widen(const Cast& cast, std::vector<char>& changed, StepMotion& motion,
                            ContactPoints& points) {
    if (!margins_.outrun(motion.bodies(), motion.options().time_step, cast.velocity, changed)) return;
    if (!detection.near_again(margins_.grown(), margins_.search(), near_)) {
        changed.assign(motion.bodies().count(), 1);
        return find_open(motion, points);
    }
    for (const int body : margins_.grown()) changed[body] = 1;
    std::erase_if(near_, [&](const IndexPair& pair) { return open_.has(pair); });
    const auto old = static_cast<std::ptrdiff_t>(open_.pairs.size());
    look_at(near_, motion, points);
    open_.merge(old);
}

void CandidateSearch::look_at(const std::vector<IndexPair>& near, StepMotion& motion, ContactPoints& points) {
    known_.clear();
    open_.bodies.clear();
    const std::size_t before = points.all.size();
    const auto unmet = static_cast<std::ptrdiff_t>(open_.pairs.size());
    for (const StepContact& point : points.all) known_.push_back(pair_of(point.contact));
    std::sort(known_.begin(), known_.end());
    for (std::size_t k = 0; k < near.size(); ++k) {
        if (k + ahead < near.size()) {
            prefetch(detection.pose(near[k + ahead].first));
            prefetch(detection.pose(near[k + ahead].second));
        }
        if ((k + 1) % pairs_a_look == 0) Watch::look();
        if (!std::binary_search(known_.begin(), known_.end(), pair_of(near[k])))
            look_at(near[k], motion, points);
    }
    if (skip_grazing(before, motion, points))
        std::sort(open_.pairs.begin() + unmet, open_.pairs.end(), OpenPairs::in_order);
    for (std::size_t k = before; k < points.all.size(); ++k) {
        if (k + ahead < points.all.size())
            prefetch_bodies(points.all[k + ahead].contact, motion.velocity, motion.dv_ext);
        motion.supported.note(points.all[k], motion.bodies(), motion.velocity, motion.dv_ext);
    }
}

/// Gives a pair that touches its points; one that is apart, and near enough to meet, is open.
void CandidateSearch::look_at(const IndexPair& pair, const StepMotion& motion, ContactPoints& points) {
    const ContactBodies& bodies = motion.bodies();
    const Collider::View first = detection.collider(pair.first), second = detection.collider(pair.second);
    const double reach = margins_.search()[first.body] + margins_.search()[second.body];
    const OpenPair open = opened(pair, separation(first.shape, detection.pose(pair.first), second.shape,
                                                  detection.pose(pair.second), reach));
    if (open.apart.gap > reach) return;
    const bool solids = first.shape.faceted() && second.shape.faceted();
    const double size = std::max(bodies.radius[first.body], bodies.radius[second.body]);
    const bool pressed =
        (bodies.driven[first.body] || bodies.driven[second.body]) && last_->pressed(pair_of(pair));
    if (!first.shape.faceted() && !second.shape.faceted() && open.apart.gap > 1e-6 * size && !pressed) {
        open_.pairs.push_back(open);  // clearly apart: no need for its points
        return;
    }
    scratch_.clear();
    detection.collide_pair(pair, reach, scratch_);
    if (std::none_of(scratch_.begin(), scratch_.end(),
                     [&](const Contact& contact) { return bodies.is_closed(contact); })) {
        // Any two shapes apart give a point, if they are near enough to meet; but not solids corner to corner, nor
        // where a triangle's neighbour comes first.
        const auto is_triangle = [](const Primitive& shape) { return shape.kind == ShapeKind::triangle; };
        if (!scratch_.empty() || solids || is_triangle(first.shape) || is_triangle(second.shape))
            open_.pairs.push_back(open);
        if (!pressed || std::none_of(scratch_.begin(), scratch_.end(),
                                     [&](const Contact& contact) { return reachable(motion, contact); }))
            return;
        open_.pairs.back().pressed = true;
    }
    for (std::size_t i = 1; i < scratch_.size(); ++i)  // a few, nearly always in order
        for (std::size_t at = i; at > 0 && by_key(scratch_[at], scratch_[at - 1]); --at)
            std::swap(scratch_[at], scratch_[at - 1]);
    for (const Contact& contact : scratch_) {
        const Pose &one = motion.poses[contact.first], &two = motion.poses[contact.second];
        if (reachable(motion, contact) && !is_turned_through(detection, contact, one, two, motion.velocity,
                                                             motion.dv_ext, motion.options().time_step))
            add_point(motion.model(), points, contact, one, two, -1.0);
    }
}

OpenPair CandidateSearch::opened(const IndexPair& pair, const Separation& apart) const {
    const Collider::View first = detection.collider(pair.first), second = detection.collider(pair.second);
    const auto arm = [this](int collider, const Collider::View& of) {
        return of.shape.kind == ShapeKind::plane ? -1.0 : detection.arm(collider);
    };
    return {pair, first.body, second.body, apart, arm(pair.first, first), arm(pair.second, second)};
}

StepContact& CandidateSearch::add_point(const ContactModel& model, ContactPoints& points,
                                        const Contact& contact, const Pose& first, const Pose& second,
                                        double toi) {
    for (const int body : {contact.first, contact.second})
        if (detection.is_asleep(body)) woken.push_back(body);
    return points.add(model, contact, first, second, toi);
}

/// Takes out the points from `from` on of pairs that only graze: they touch with a side or an edge, and as they move no
/// overlap comes of it. Two bodies whose edges lie on each other touch with either face, and the one they move past is no
/// obstacle. Whether there are such pairs: they are open then.
bool CandidateSearch::skip_grazing(std::size_t from, const StepMotion& motion, ContactPoints& points) {
    if (!motion.bodies().swings || from == points.all.size()) return false;
    const double h = motion.options().time_step;
    grazing_.clear();
    edges.index(step(motion, points));
    for (std::size_t k = from, end = from; k < points.all.size(); k = end) {
        const std::uint64_t key = pair_of(points.all[k].contact);
        std::size_t deepest = k;
        double most = 0.0;
        for (; end < points.all.size() && pair_of(points.all[end].contact) == key; ++end) {
            const Contact& contact = points.all[end].contact;
            const double closing = -relative_velocity(points.all[end], contact.point.normal, motion.velocity);
            const double overlap = h * closing - std::max(0.0, contact.point.gap);
            if (overlap > most) most = overlap, deepest = end;
        }
        if (!(most > 0.0)) continue;
        const Contact& contact = points.all[deepest].contact;
        const IndexPair pair = colliders_of(contact);
        const OpenPair open = opened(pair, {contact.point.gap, contact.point.normal});
        if (edges.is_grazing(step(motion, points), points.all[deepest], open, most)) grazing_.push_back(pair);
    }
    for (const IndexPair& pair : grazing_) {
        const Collider::View one = detection.collider(pair.first), two = detection.collider(pair.second);
        open_.pairs.push_back(opened(
            pair, separation(one.shape, detection.pose(pair.first), two.shape, detection.pose(pair.second))));
        std::erase_if(points.all,
                      [&](const StepContact& point) { return pair_of(point.contact) == pair_of(pair); });
    }
    return !grazing_.empty();
}

/// Whether a pair surely does not meet: the direction that separates it keeps it apart for the whole step. The first
/// round of time_of_impact(), without what that needs before.
bool CandidateSearch::passes(const OpenPair& open, const StepMotion& motion, const ContactPoints& points,
                             const std::vector<Vec6>& velocity) const {
    const int a = open.first, b = open.second;
    if (motion.event_time[a] >= 0.0 || motion.event_time[b] >= 0.0) return false;
    const double closing = dot(open.apart.normal, linear(velocity[b]) - linear(velocity[a]));
    double turning = 0.0;
    if (open.first_arm != 0.0 || open.second_arm != 0.0) {
        const double first = norm(cross(angular(velocity[a]), open.apart.normal)),
                     second = norm(cross(angular(velocity[b]), open.apart.normal));
        if ((open.first_arm < 0.0 && first > 0.0) || (open.second_arm < 0.0 && second > 0.0)) return false;
        turning = first * open.first_arm + second * open.second_arm;
    }
    const double speed = std::max(0.0, closing) + turning;
    if (!(speed * motion.options().time_step > open.apart.gap)) return open.apart.gap > 0.0;
    const double slop = edges.slop(step(motion, points), open);
    return open.apart.gap > -0.5 * slop && !(speed * motion.options().time_step > open.apart.gap + slop);
}

}  // namespace spook

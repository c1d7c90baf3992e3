// The contact stage's first part: which points are closed, and which pairs are near enough to meet.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "collision/cylinder.hpp"
#include "collision/shape_cast.hpp"
#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "contacts/tolerances.hpp"
#include "linear/ahead.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

bool by_key(const Contact& a, const Contact& b) noexcept { return a.key < b.key; }
bool round_or_plane(const Primitive& shape) noexcept { return !shape.faceted(); }

}  // namespace

bool is_turned_through(const Detection& detection, const Contact& contact, const Pose& first,
                       const Pose& second, const std::vector<Vec6>& velocity, const std::vector<Vec6>& dv_ext,
                       double h) noexcept {
    constexpr std::uint64_t lower = (std::uint64_t{1} << collider_bits) - 1;
    const std::uint64_t pair = contact.key >> feature_bits;
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
bool ContactStage::reachable(const Contact& contact) const {
    const std::vector<double>& radius = detection_.radius();
    const Vec3 n = contact.point.normal;
    auto speed = [&](int b) {
        const Vec6 free = sum(motion_.velocity[b], motion_.dv_ext[b]);
        const double spin = std::max(norm(angular(motion_.velocity[b])), norm(angular(free)));
        return std::max(std::abs(dot(n, linear(motion_.velocity[b]))), std::abs(dot(n, linear(free)))) +
               spin * radius[b];
    };
    return contact.point.gap <= model_->options.time_step * (speed(contact.first) + speed(contact.second)) +
                                    closed * model_->bodies.size(contact);
}

bool ContactStage::detect(const std::vector<Pose>& poses, const std::vector<Vec6>& velocity,
                          const std::vector<Vec6>& free_velocity) {
    const std::size_t bodies = model_->bodies.count();
    motion_.begin(poses, velocity, free_velocity);
    projector_.begin_step();
    // By island, of which there may be as many as bodies, however late; a copy of the stage has no room for them.
    arrays_.sums.reserve(bodies);
    std::fill(depth_.begin(), depth_.end(), 0.0);
    std::fill(predicted_sinking_.begin(), predicted_sinking_.end(), 0.0);
    correction_.clear();
    points_.clear();
    woken_.clear();
    impact_needed_ = plastic_first_ = false;
    iterating_ = ran_away_ = false;  // of a step that was taken back, or is over
    impact_rounds_ = 0;
    if (model_->surfaces.rebounds || model_->options.impacts == ImpactOrder::successive)
        clock_.assign(bodies, 0.0), path_.assign(bodies, Vec6{}), in_order_.assign(bodies, 0);

    margins_.begin(model_->bodies, model_->options.time_step, velocity, free_velocity,
                   model_->options.solver == SolverKind::iterative ||
                       model_->options.impacts == ImpactOrder::successive);
    find_open();
    motion_.predict(free_velocity);
    const std::size_t closed_points = points_.all.size();
    if (!state_.initial_penetration_known) note_initial_penetrations();
    if (find_impacts(motion_.predicted, false) > 0) {
        find_events();
        move_impacts_to_start(closed_points, motion_.predicted);
    }
    if (points_.all.empty()) {
        state_.cache.points.clear();
        return false;
    }
    state_.counters.contacts += points_.all.size();
    motion_.apply_half_of_forces();
    points_.order(state_.cache, model_->surfaces.resists_turning);
    measure_points();
    return true;
}

/// Takes down how deep pairs overlap where the run begins: nothing but the scene has brought them there.
void ContactStage::note_initial_penetrations() {
    state_.initial_penetration_known = true;
    for (const Point& point : points_.all) {
        const double excess = -point.contact.point.gap - elastic_depth(model_->bodies, point);
        if (!(excess > 0.0)) continue;
        double& given = state_.initial_penetration[point.contact.key >> feature_bits];
        given = std::max(given, excess);
    }
}

/// Pairs near enough to meet: the closed ones get points, the others are open. Pairs that have points are known.
void ContactStage::find_open() {
    open_.clear();
    look_at(detection_.near(motion_.poses, margins_.search()));
}

/// The same where the search has been widened for some bodies since: what is new is theirs.
void ContactStage::find_open_again() {
    if (!detection_.near_again(margins_.grown(), margins_.search(), near_)) {
        changed_.assign(model_->bodies.count(), 1);
        return find_open();
    }
    for (const int body : margins_.grown()) changed_[body] = 1;
    std::erase_if(near_, [&](const IndexPair& pair) { return open_.has(pair); });
    const auto old = static_cast<std::ptrdiff_t>(open_.pairs.size());
    look_at(near_);
    open_.merge(old);
}

void ContactStage::look_at(const std::vector<IndexPair>& near) {
    const double h = model_->options.time_step;
    known_.clear();
    open_.bodies.clear();
    const std::size_t before = points_.all.size();
    const auto unmet = static_cast<std::ptrdiff_t>(open_.pairs.size());
    for (const Point& point : points_.all) known_.push_back(point.contact.key >> feature_bits);
    std::sort(known_.begin(), known_.end());
    for (std::size_t k = 0; k < near.size(); ++k) {
        const IndexPair& pair = near[k];
        if (k + ahead < near.size()) {
            prefetch(detection_.pose(near[k + ahead].first));
            prefetch(detection_.pose(near[k + ahead].second));
        }
        if ((k + 1) % pairs_a_look == 0) Watch::look();
        if (std::binary_search(known_.begin(), known_.end(), pair_of(pair))) continue;
        const Collider::View first = detection_.collider(pair.first),
                             second = detection_.collider(pair.second);
        const double reach = margins_.search()[first.body] + margins_.search()[second.body];
        const OpenPair open = opened(pair, separation(first.shape, detection_.pose(pair.first), second.shape,
                                                      detection_.pose(pair.second), reach));
        if (open.apart.gap > reach && first.shape.faceted() && second.shape.faceted()) continue;
        const double size = std::max(model_->bodies.radius[first.body], model_->bodies.radius[second.body]);
        if (round_or_plane(first.shape) && round_or_plane(second.shape) && open.apart.gap > 1e-6 * size) {
            if (open.apart.gap <= reach)
                open_.pairs.push_back(open);  // clearly apart: no need for its points
            continue;
        }
        scratch_.clear();
        detection_.collide_pair(pair, reach, scratch_);
        const bool touching = std::any_of(scratch_.begin(), scratch_.end(),
                                          [this](const Contact& c) { return model_->bodies.is_closed(c); });
        // Any two shapes apart give a point, if they are near enough to meet; but not solids corner to corner, nor
        // where a triangle's neighbour comes first.
        const bool solids = (first.shape.faceted() && second.shape.faceted()) ||
                            first.shape.kind == ShapeKind::triangle ||
                            second.shape.kind == ShapeKind::triangle;
        if (!touching) {
            if (!scratch_.empty() || solids) open_.pairs.push_back(open);
            continue;
        }
        for (std::size_t i = 1; i < scratch_.size(); ++i)  // a few, nearly always in order
            for (std::size_t at = i; at > 0 && by_key(scratch_[at], scratch_[at - 1]); --at)
                std::swap(scratch_[at], scratch_[at - 1]);
        for (const Contact& contact : scratch_) {
            const Pose &one = motion_.poses[contact.first], &two = motion_.poses[contact.second];
            if (reachable(contact) &&
                !is_turned_through(detection_, contact, one, two, motion_.velocity, motion_.dv_ext, h))
                add_point(contact, one, two, -1.0);
        }
    }
    for (std::size_t k = before; k < points_.all.size(); ++k) {
        // As deep as a body will be when it meets the next part of what holds it.
        const double depth = depth_at_toi(points_.all[k], false);
        for (const int b : {points_.all[k].contact.first, points_.all[k].contact.second})
            depth_[b] = std::max(depth_[b], depth);
    }
    if (skip_grazing(before)) std::sort(open_.pairs.begin() + unmet, open_.pairs.end(), OpenPairs::in_order);
    for (std::size_t k = before; k < points_.all.size(); ++k) {
        if (k + ahead < points_.all.size()) {
            const Contact& later = points_.all[k + ahead].contact;
            for (const int body : {later.first, later.second})
                prefetch(motion_.velocity[body]), prefetch(motion_.dv_ext[body]);
        }
        motion_.supported.note(points_.all[k], model_->bodies, motion_.velocity, motion_.dv_ext);
    }
}

OpenPair ContactStage::opened(const IndexPair& pair, const Separation& apart) const {
    const Collider::View first = detection_.collider(pair.first), second = detection_.collider(pair.second);
    const auto arm = [this](int collider, const Collider::View& of) {
        return of.shape.kind == ShapeKind::plane ? -1.0 : detection_.arm(collider);
    };
    return {pair, first.body, second.body, apart, arm(pair.first, first), arm(pair.second, second)};
}

void ContactStage::add_point(const Contact& contact, const Pose& first, const Pose& second, double toi) {
    points_.add(*model_, contact, first, second, toi);
    if (!state_.cache.asleep.empty()) state_.cache.add_sleepers(contact, woken_);
}

/// The overlap at which a pair counts as met, m. Bodies that sink while iterations have not settled meet the sides of the next
/// part of what holds them as deep as that; round shapes and planes have no sides.
double ContactStage::slop(const OpenPair& open) const noexcept {
    const int a = open.first, b = open.second;
    const bool sides =
        have_sides(detection_.collider(open.pair.first).shape, detection_.collider(open.pair.second).shape);
    return closed * std::max(model_->bodies.radius[a], model_->bodies.radius[b]) +
           (sides ? 2.0 * std::max(predicted_sinking_[a], predicted_sinking_[b]) : 0.0);
}

/// Whether a pair surely does not meet: the direction that separates it keeps it apart for the whole step. The first
/// round of time_of_impact(), without what that needs before.
bool ContactStage::passes(const OpenPair& open, const std::vector<Vec6>& velocity) const {
    const int a = open.first, b = open.second;
    if (motion_.event_time[a] >= 0.0 || motion_.event_time[b] >= 0.0) return false;
    const double closing = dot(open.apart.normal, linear(velocity[b]) - linear(velocity[a]));
    double turning = 0.0;
    if (open.first_arm != 0.0 || open.second_arm != 0.0) {
        const double first = norm(cross(angular(velocity[a]), open.apart.normal)),
                     second = norm(cross(angular(velocity[b]), open.apart.normal));
        if ((open.first_arm < 0.0 && first > 0.0) || (open.second_arm < 0.0 && second > 0.0)) return false;
        turning = first * open.first_arm + second * open.second_arm;
    }
    const double speed = std::max(0.0, closing) + turning;
    if (!(speed * model_->options.time_step > open.apart.gap)) return open.apart.gap > 0.0;
    const double slop = this->slop(open);
    return open.apart.gap > -0.5 * slop && !(speed * model_->options.time_step > open.apart.gap + slop);
}

}  // namespace spook

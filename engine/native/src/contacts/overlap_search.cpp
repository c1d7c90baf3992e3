#include "contacts/overlap_search.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/tolerances.hpp"
#include "linear/ahead.hpp"
#include "run/watch.hpp"

namespace spook {

using namespace tolerances::overlap_search;

bool OverlapSearch::is_far(double way, double radius) const noexcept {
    return way > (by_pgs_ ? min_separation_to_propagate_pgs : min_separation_to_propagate) * radius;
}

bool OverlapSearch::moves_far(const PenetrationRecord& record) const noexcept {
    if (!is_far(record.depth, model_->bodies.moving_size(record.contact))) return false;
    const auto swings = [this](int b) { return model_->bodies.moves(b) && model_->bodies.ball[b] == 0; };
    return !by_pgs_ || swings(record.contact.first) || swings(record.contact.second);
}

void OverlapSearch::add(const Contact& contact, const std::vector<Pose>& poses, double excess) {
    PenetrationRecord& record = records.emplace_back();
    record.contact = contact;
    record.damping =
        std::max(model_->surfaces[contact.first].damping, model_->surfaces[contact.second].damping);
    record.first_arm = contact.point.position - poses[contact.first].position;
    record.second_arm = contact.point.position - poses[contact.second].position;
    record.depth = excess;
}

/// How far some point of a body has gone in the step, m.
double OverlapSearch::way(int b, const StepEnd& end) const {
    double turned = 0.0;
    for (int i = 0; i < 9; ++i)
        turned = std::max(turned, std::abs(end.poses[b].rotation.m[i] - end.begun[b].rotation.m[i]));
    return norm(end.poses[b].position - end.begun[b].position) +
           (turned > 0.0 ? 3.0 * turned * model_->bodies.radius[b] : 0.0);
}

OverlapSearch::Found OverlapSearch::find(const StepEnd& end) {
    Found found;
    found.deepest = find(end, {}, false, found.goes_on);
    return found;
}

double OverlapSearch::find_again(const StepEnd& end, const std::vector<char>& reconsidered) {
    bool goes_on = true;
    return find(end, reconsidered, true, goes_on);
}

/// Balls have the same points however near one looks, and are looked at once: as near as the last step lets expect.
double OverlapSearch::find(const StepEnd& end, const std::vector<char>& reconsidered, bool again,
                           bool& goes_on) {
    const double expected = model_->bodies.swings ? 0.0 : 2.0 * search_factor * expected_;
    double deepest = look(end, expected, reconsidered, again);
    if (again) deepest = std::max(deepest, look_at_neighbours(end, 0.0, reconsidered));
    expected_ = deepest;
    if (!(deepest > 0.0)) return deepest;
    const double margin = search_factor * deepest;
    if (margin > expected) look(end, margin, reconsidered, again);
    else
        std::erase_if(
            records, [margin](const PenetrationRecord& record) { return record.contact.point.gap > margin; });
    if (!again) goes_on = find_neighbours(end, margin) || !by_pgs_;
    look_at_neighbours(end, margin, reconsidered);
    return deepest;
}

/// Points of the step's pairs up to gaps of `margin`; without one, only the overlap. It does not count pairs that have not
/// moved against each other and did not overlap before.
double OverlapSearch::look(const StepEnd& at, double margin, const std::vector<char>& reconsidered,
                           bool again) {
    records.clear();
    double deepest = 0.0;
    unsigned seen = 0;
    const std::vector<CachedContact>& cache = at.cache.points;
    for (std::size_t from = 0, end = 0; from < cache.size(); from = end) {
        const std::uint64_t key = pair_of(cache[from].contact);
        const int a = cache[from].contact.first, b = cache[from].contact.second;
        const double rounding = model_->bodies.slack(cache[from].contact);
        double most_compression = 0.0;
        bool overlapped = false;
        for (; end < cache.size() && pair_of(cache[end].contact) == key; ++end) {
            most_compression = std::max(most_compression, cache[end].compression);
            overlapped = overlapped || cache[end].contact.point.gap < -rounding;
        }
        if (from + ahead < cache.size()) prefetch_bodies(cache[from + ahead].contact, at.poses, at.begun);
        if (!is_among(reconsidered, a, b)) continue;
        const auto is_still = [&] { return !overlapped && way(a, at) + way(b, at) < 0.1 * rounding; };
        if (margin == 0.0 && is_still()) continue;
        if (++seen % pairs_a_look == 0) Watch::look();
        scratch_.clear();
        const IndexPair pair{static_cast<int>(key >> 24), static_cast<int>(key & 0xffffff)};
        at.detection.collide_pair(pair, at.poses[a], at.poses[b], margin, scratch_);
        for (const Contact& contact : scratch_) {
            double compression = 0.0;
            if (model_->surfaces[a].compliance + model_->surfaces[b].compliance > 0.0)
                compression = most_compression;
            for (std::size_t k = from; k < end; ++k)
                if (cache[k].contact.key == contact.key) compression = cache[k].compression;
            double excess = -contact.point.gap - compression - rounding;
            if (again && excess > 0.0 && at.initial_penetration.contains(key))
                excess = std::max(0.0, excess - at.initial_penetration.at(key));
            if (excess > deepest && (margin == 0.0 || !is_still())) deepest = excess;
            if (margin > 0.0) add(contact, at.poses, excess);
        }
    }
    return deepest;
}

/// Pairs without points within `max_hops` neighbours of a displaced body that its displacement may push into each other: one
/// neighbour after the other. Whether any body is displaced so far.
bool OverlapSearch::find_neighbours(const StepEnd& end, double margin) {
    neighbours_.clear();
    untouched_.clear();
    reached_.assign(model_->bodies.count(), 0);
    char round = 1;
    const auto reach = [&](int b) {
        if (reached_[b] || !model_->bodies.moves(b)) return;
        if (round == 1 && grown_.empty()) margin_ = end.margin;
        reached_[b] = round;
        grown_.push_back(b);
        margin_[b] = std::max(margin_[b], margin + way(b, end));
    };
    grown_.clear();
    for (const PenetrationRecord& record : records)
        if (moves_far(record)) reach(record.contact.first), reach(record.contact.second);
    const bool some = !grown_.empty();
    for (int hop = 0; hop < max_hops && !grown_.empty() && grown_.size() <= max_neighbours; ++hop) {
        std::sort(grown_.begin(), grown_.end());
        if (!end.detection.near_again(grown_, margin_, near_)) near_ = end.detection.near(end.begun, margin_);
        const auto inside = [&](int b) { return reached_[b] != 0 && reached_[b] < round; };
        ++round;
        grown_.clear();
        for (const CachedContact& cached : end.cache.points) {
            const int a = cached.contact.first, b = cached.contact.second;
            if (inside(a)) reach(b);
            if (inside(b)) reach(a);
        }
        for (const IndexPair& pair : near_) {
            const int a = end.detection.collider(pair.first).body,
                      b = end.detection.collider(pair.second).body;
            if (!inside(a) && !inside(b)) continue;
            if (end.cache.has_pair(pair_of(pair))) continue;
            scratch_.clear();
            end.detection.collide_pair(pair, end.poses[a], end.poses[b], margin, scratch_);
            if (scratch_.empty()) continue;
            neighbours_.push_back(pair);
            if (std::any_of(scratch_.begin(), scratch_.end(),
                            [this](const Contact& c) { return model_->bodies.is_deep(c); }))
                untouched_.push_back(pair);
            reach(a);
            reach(b);
        }
    }
    for (std::vector<IndexPair>* pairs : {&neighbours_, &untouched_}) {
        std::sort(pairs->begin(), pairs->end());
        pairs->erase(std::unique(pairs->begin(), pairs->end()), pairs->end());
    }
    return some;
}

/// The same pairs' points. What overlapped without points before anything was parted is left alone as an internal edge; what
/// overlaps since has been pushed.
double OverlapSearch::look_at_neighbours(const StepEnd& end, double margin,
                                         const std::vector<char>& reconsidered) {
    double deepest = 0.0;
    unsigned seen = 0;
    for (const IndexPair& pair : neighbours_) {
        const int a = end.detection.collider(pair.first).body, b = end.detection.collider(pair.second).body;
        if (!is_among(reconsidered, a, b)) continue;
        if (++seen % pairs_a_look == 0) Watch::look();
        scratch_.clear();
        end.detection.collide_pair(pair, end.poses[a], end.poses[b], margin, scratch_);
        const bool was_overlapping = std::binary_search(untouched_.begin(), untouched_.end(), pair);
        for (const Contact& contact : scratch_) {
            if (was_overlapping && model_->bodies.is_deep(contact)) continue;
            const double excess = -contact.point.gap - model_->bodies.slack(contact);
            deepest = std::max(deepest, excess);
            if (margin > 0.0) add(contact, end.poses, excess);
        }
    }
    return deepest;
}

}  // namespace spook

// Position projection: which pairs without points its displacements may push into each other.
#include <algorithm>

#include "contacts/contact_geometry.hpp"
#include "contacts/contact_stage.hpp"
#include "contacts/tolerances.hpp"
#include "run/watch.hpp"

namespace spook {

namespace {

using namespace tolerances::projection_neighbours;

}  // namespace

/// Pairs without points within `max_hops` neighbours of a displaced body that its displacement may push into each other: one neighbour
/// after the other.
void ContactStage::find_neighbours(const std::vector<Pose>& poses, double margin) {
    neighbours_.clear();
    initial_overlaps_.clear();
    std::vector<char>& reached = arrays_.reached;  // in which round, from one on
    reached.assign(solver_index_.size(), 0);
    char round = 1;
    const auto reach = [&](int b) {
        if (reached[b] || solver_index_[b] < 0) return;
        reached[b] = round;
        grown_.push_back(b);
        search_[b] = std::max(search_[b], margin + way(b, poses));
    };
    grown_.clear();
    for (const PenetrationRecord& record : penetrations_)
        if (moves_far(record)) reach(record.contact.first), reach(record.contact.second);
    moved_far_ = !projects_by_pgs() || !grown_.empty();
    for (int hop = 0; hop < max_hops && !grown_.empty() && grown_.size() <= max_neighbours; ++hop) {
        std::sort(grown_.begin(), grown_.end());
        if (!detection_.near_again(grown_, search_, near_)) near_ = detection_.near(poses_, search_);
        const auto inside = [&](int b) { return reached[b] != 0 && reached[b] < round; };
        ++round;
        grown_.clear();
        for (const CachedContact& cached : state_.cache.points) {
            const int a = cached.contact.first, b = cached.contact.second;
            if (inside(a)) reach(b);
            if (inside(b)) reach(a);
        }
        for (const IndexPair& pair : near_) {
            const int a = detection_.collider(pair.first).body, b = detection_.collider(pair.second).body;
            if (!inside(a) && !inside(b)) continue;
            if (state_.cache.has_pair(pair_of(pair))) continue;
            scratch_.clear();
            detection_.collide_pair(pair, poses[a], poses[b], margin, scratch_);
            if (scratch_.empty()) continue;
            neighbours_.push_back(pair);
            if (std::any_of(scratch_.begin(), scratch_.end(),
                            [this](const Contact& c) { return is_deep(c); }))
                initial_overlaps_.push_back(pair);
            reach(a);
            reach(b);
        }
    }
    for (std::vector<IndexPair>* pairs : {&neighbours_, &initial_overlaps_}) {
        std::sort(pairs->begin(), pairs->end());
        pairs->erase(std::unique(pairs->begin(), pairs->end()), pairs->end());
    }
}

/// The same pairs' points. What overlapped without points before anything was parted is left alone as an internal edge; what overlaps
/// since has been pushed.
double ContactStage::find_neighbour_overlaps(const std::vector<Pose>& poses, double margin) {
    double deepest = 0.0;
    unsigned seen = 0;
    for (const IndexPair& pair : neighbours_) {
        const int a = detection_.collider(pair.first).body, b = detection_.collider(pair.second).body;
        if (!is_reconsidered(a, b)) continue;
        if (++seen % pairs_a_look == 0) Watch::look();
        scratch_.clear();
        detection_.collide_pair(pair, poses[a], poses[b], margin, scratch_);
        const bool was_overlapping =
            std::binary_search(initial_overlaps_.begin(), initial_overlaps_.end(), pair);
        for (const Contact& contact : scratch_) {
            if (was_overlapping && is_deep(contact)) continue;
            const double excess = -contact.point.gap - slack(contact);
            deepest = std::max(deepest, excess);
            if (margin > 0.0) add_penetration(contact, poses, excess);
        }
    }
    return deepest;
}

}  // namespace spook

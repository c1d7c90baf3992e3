// In which order contacts are updated: islands, and levels of contacts that share no body.
#include <algorithm>
#include <utility>

#include "contacts/pgs_solver.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

using namespace tolerances::pgs_schedule;

/// Joins the islands of both bodies.
void PgsSolver::link(int first, int second) {
    bodies_of_.push_back({first >= 0 ? first : bodies_, second >= 0 ? second : bodies_});
    if (first >= 0 && second >= 0) join(first, second);
    if (started_ && (first >= 0 || second >= 0)) active_[root(first >= 0 ? first : second)] = 1;
}

void PgsSolver::join(int first, int second) {
    int a = root(first), b = root(second);
    if (!sets_.join(a, b)) return;
    if (a > b) std::swap(a, b);
    joined_ = true;
    last_change_[a] = larger(last_change_[a], last_change_[b]);
    limit_reached_[a] = limit_reached_[a] || limit_reached_[b];
    active_[a] = active_[a] || active_[b];
}

/// Islands of all items, and levels of those that have none yet; contacts that have no place yet get one in that order.
void PgsSolver::schedule() {
    const std::size_t items = bodies_of_.size();
    if (items - scheduled_ > few_late * static_cast<double>(items)) {  // all anew, or levels would be short
        scheduled_ = listed_ = sized_ = 0;
        order_.clear();
        level_end_.clear();
        roots_.clear();
        known_.assign(bodies_ + 1, 0);
    }
    if (joined_) {
        for (Scheduled& scheduled : order_)
            scheduled.island = root(std::min(scheduled.first, scheduled.second));
        std::erase_if(roots_, [this](int island) { return !sets_.is_root(island); });
        joined_ = false;
        sized_ = 0;
    }
    next_level_.assign(bodies_ + 1, 0);
    level_.resize(items);
    const std::size_t levels = level_end_.size();
    for (std::size_t item = std::max(scheduled_, static_cast<std::size_t>(joint_count_)); item < items;
         ++item) {
        const Both bodies = bodies_of_[item];
        if (std::min(bodies.first, bodies.second) == bodies_) continue;
        const int level = std::max(next_level_[bodies.first], next_level_[bodies.second]);
        level_[item] = level;
        if (bodies.first < bodies_) next_level_[bodies.first] = level + 1;
        if (bodies.second < bodies_) next_level_[bodies.second] = level + 1;
        if (levels + level == level_end_.size()) level_end_.push_back(0);
        ++level_end_[levels + level];
    }
    std::size_t sum = order_.size();
    for (std::size_t level = levels; level < level_end_.size(); ++level) {
        const std::size_t count = level_end_[level];
        level_end_[level] = sum;
        sum += count;
    }
    const std::size_t known = order_.size();
    order_.resize(sum);
    for (std::size_t item = scheduled_; item < items; ++item) {
        const Both bodies = bodies_of_[item];
        const int body = std::min(bodies.first, bodies.second);
        if (body == bodies_) continue;
        const int island = root(body);
        if (!known_[island]) {
            known_[island] = 1;
            roots_.push_back(island);
        }
        if (item < static_cast<std::size_t>(joint_count_)) continue;
        order_[level_end_[levels + level_[item]]++] = {static_cast<int>(item), bodies.first, bodies.second,
                                                       island};
    }
    const std::size_t contacts = items - static_cast<std::size_t>(joint_count_);
    int next = static_cast<int>(place_.size());
    place_.resize(contacts, -1);
    for (std::size_t k = known; k < sum; ++k) {
        int& place = place_[order_[k].item - joint_count_];
        if (place < 0) place = next++;
        order_[k].item = joint_count_ + place;
    }
    for (int& place : place_)
        if (place < 0) place = next++;  // neither body moves
    scheduled_ = items;
    if (sized_ == 0) size_.assign(bodies_ + 1, 0);
    for (; sized_ < order_.size(); ++sized_) ++size_[order_[sized_].island];
    marked_ = false;
    select();
}

/// Contacts of active bodies, in this iteration and, from then on, the next.
void PgsSolver::mark_active() {
    if (listed_ == 0) first_marked_.assign(bodies_, -1);
    next_marked_.resize(2 * order_.size());
    for (; listed_ < order_.size(); ++listed_) {
        const int bodies[2] = {order_[listed_].first, order_[listed_].second};
        for (std::size_t side = 0; side < 2; ++side) {
            if (bodies[side] == bodies_) continue;
            const std::size_t at = 2 * listed_ + side;
            next_marked_[at] = std::exchange(first_marked_[bodies[side]], static_cast<int>(at));
        }
    }
    marked_now_.assign(order_.size() / 64 + 1, 0);
    marked_next_.assign(order_.size() / 64 + 1, 0);
    for (int b = 0; b < bodies_; ++b)
        if (active_bodies_[b] != 0) mark(b);
    std::fill(marked_next_.begin(), marked_next_.end(), 0);
    for (int b = 0; b < bodies_; ++b)
        if ((active_bodies_[b] & active_now) != 0) mark(b);
    marked_ = true;
}

void PgsSolver::mark(int body) noexcept {
    for (int at = first_marked_[body]; at >= 0; at = next_marked_[at]) {
        const std::size_t place = static_cast<std::size_t>(at) / 2;
        const std::uint64_t bit = std::uint64_t{1} << (place % 64);
        marked_now_[place / 64] |= bit;
        marked_next_[place / 64] |= bit;
    }
}

/// The contacts of islands that are active.
void PgsSolver::select() {
    whole_ = std::all_of(roots_.begin(), roots_.end(), [this](int island) { return active_[island] != 0; });
    if (whole_) return;
    active_order_.clear();
    active_level_end_.clear();
    std::size_t place = 0;
    for (const std::size_t end : level_end_) {
        const std::size_t before = active_order_.size();
        for (; place < end; ++place)
            if (active_[order_[place].island]) active_order_.push_back(order_[place]);
        if (active_order_.size() > before) active_level_end_.push_back(active_order_.size());
    }
}

}  // namespace spook

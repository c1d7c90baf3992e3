#include "contacts/pgs_schedule.hpp"

#include <algorithm>
#include <utility>

#include "contacts/pgs_rows.hpp"
#include "contacts/tolerances.hpp"

namespace spook {

using namespace tolerances::pgs_schedule;

void PgsSchedule::begin(int bodies) {
    bodies_ = bodies;
    sets_.begin(static_cast<std::size_t>(bodies) + 1);
    active.assign(bodies + 1, 0);
    limit_reached.assign(bodies + 1, 0);
    last_change.assign(bodies + 1, 0.0);
    place.clear();
    items.clear();
    roots.clear();
    known_.assign(bodies + 1, 0);
    scheduled_ = sized_ = 0;
    order.clear();
    level_end.clear();
    joined_ = false;
}

void PgsSchedule::link(int first, int second, bool is_active) {
    items.push_back({first >= 0 ? first : bodies_, second >= 0 ? second : bodies_});
    if (first >= 0 && second >= 0) join(first, second);
    if (is_active && (first >= 0 || second >= 0)) active[root(first >= 0 ? first : second)] = 1;
}

void PgsSchedule::join(int first, int second) {
    int a = root(first), b = root(second);
    if (!sets_.join(a, b)) return;
    if (a > b) std::swap(a, b);
    joined_ = true;
    last_change[a] = larger(last_change[a], last_change[b]);
    limit_reached[a] = limit_reached[a] || limit_reached[b];
    active[a] = active[a] || active[b];
}

bool PgsSchedule::complete_order() {
    const std::size_t count = items.size();
    const bool anew = count - scheduled_ > few_late * static_cast<double>(count);
    if (anew) {  // levels would be short
        scheduled_ = sized_ = 0;
        order.clear();
        level_end.clear();
        roots.clear();
        known_.assign(bodies_ + 1, 0);
    }
    if (joined_) {
        for (Scheduled& scheduled : order)
            scheduled.island = root(std::min(scheduled.first, scheduled.second));
        std::erase_if(roots, [this](int island) { return !sets_.is_root(island); });
        joined_ = false;
        sized_ = 0;
    }
    next_level_.assign(bodies_ + 1, 0);
    level_.resize(count);
    const std::size_t levels = level_end.size();
    for (std::size_t item = std::max(scheduled_, static_cast<std::size_t>(joints)); item < count; ++item) {
        const Both bodies = items[item];
        if (std::min(bodies.first, bodies.second) == bodies_) continue;
        const int level = std::max(next_level_[bodies.first], next_level_[bodies.second]);
        level_[item] = level;
        if (bodies.first < bodies_) next_level_[bodies.first] = level + 1;
        if (bodies.second < bodies_) next_level_[bodies.second] = level + 1;
        if (levels + level == level_end.size()) level_end.push_back(0);
        ++level_end[levels + level];
    }
    std::size_t sum = order.size();
    for (std::size_t level = levels; level < level_end.size(); ++level) {
        const std::size_t in_level = level_end[level];
        level_end[level] = sum;
        sum += in_level;
    }
    const std::size_t known = order.size();
    order.resize(sum);
    for (std::size_t item = scheduled_; item < count; ++item) {
        const Both bodies = items[item];
        const int body = std::min(bodies.first, bodies.second);
        if (body == bodies_) continue;
        const int island = root(body);
        if (!known_[island]) {
            known_[island] = 1;
            roots.push_back(island);
        }
        if (item < static_cast<std::size_t>(joints)) continue;
        order[level_end[levels + level_[item]]++] = {static_cast<int>(item), bodies.first, bodies.second,
                                                     island};
    }
    const std::size_t contacts = count - static_cast<std::size_t>(joints);
    int next = static_cast<int>(place.size());
    place.resize(contacts, -1);
    for (std::size_t k = known; k < sum; ++k) {
        int& own = place[order[k].item - joints];
        if (own < 0) own = next++;
        order[k].item = joints + own;
    }
    for (int& own : place)
        if (own < 0) own = next++;  // neither body moves
    scheduled_ = count;
    if (sized_ == 0) size.assign(bodies_ + 1, 0);
    for (; sized_ < order.size(); ++sized_) ++size[order[sized_].island];
    select();
    return anew;
}

void PgsSchedule::select() {
    whole = std::all_of(roots.begin(), roots.end(), [this](int island) { return active[island] != 0; });
    if (whole) return;
    active_order_.clear();
    active_level_end_.clear();
    std::size_t at = 0;
    for (const std::size_t end : level_end) {
        const std::size_t before = active_order_.size();
        for (; at < end; ++at)
            if (active[order[at].island]) active_order_.push_back(order[at]);
        if (active_order_.size() > before) active_level_end_.push_back(active_order_.size());
    }
}

}  // namespace spook

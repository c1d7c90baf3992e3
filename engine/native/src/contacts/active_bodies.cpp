#include "contacts/active_bodies.hpp"

#include <algorithm>
#include <utility>

namespace spook {

void ActiveBodies::begin(int bodies) {
    bodies_ = bodies;
    active_.assign(bodies + 1, 0);
    listed_ = 0;
}

void ActiveBodies::activate(int first, int second) noexcept {
    if (!marking_) marked_ = false;
    for (const int body : {first, second}) {
        if (body == bodies_ || (active_[body] & active_now) != 0) continue;
        active_[body] |= active_now;
        if (marking_) mark(body);
    }
}

void ActiveBodies::begin_marks(const LargeArray<PgsSchedule::Scheduled>& order) {
    if (!marked_) mark_active(order);
    else marked_now_.swap(marked_next_), std::fill(marked_next_.begin(), marked_next_.end(), 0);
    marking_ = true;
}

void ActiveBodies::mark_active(const LargeArray<PgsSchedule::Scheduled>& order) {
    if (listed_ == 0) first_marked_.assign(bodies_, -1);
    next_marked_.resize(2 * order.size());
    for (; listed_ < order.size(); ++listed_) {
        const int bodies[2] = {order[listed_].first, order[listed_].second};
        for (std::size_t side = 0; side < 2; ++side) {
            if (bodies[side] == bodies_) continue;
            const std::size_t at = 2 * listed_ + side;
            next_marked_[at] = std::exchange(first_marked_[bodies[side]], static_cast<int>(at));
        }
    }
    marked_now_.assign(order.size() / 64 + 1, 0);
    marked_next_.assign(order.size() / 64 + 1, 0);
    for (int b = 0; b < bodies_; ++b)
        if (active_[b] != 0) mark(b);
    std::fill(marked_next_.begin(), marked_next_.end(), 0);
    for (int b = 0; b < bodies_; ++b)
        if ((active_[b] & active_now) != 0) mark(b);
    marked_ = true;
}

void ActiveBodies::mark(int body) noexcept {
    for (int at = first_marked_[body]; at >= 0; at = next_marked_[at]) {
        const std::size_t place = static_cast<std::size_t>(at) / 2;
        const std::uint64_t bit = std::uint64_t{1} << (place % 64);
        marked_now_[place / 64] |= bit;
        marked_next_[place / 64] |= bit;
    }
}

}  // namespace spook

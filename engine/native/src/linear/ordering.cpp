#include "linear/ordering.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <tuple>
#include <utility>

#include "linear/pieces.hpp"

namespace spook {
namespace {

// A body is eliminated before its constraints until they have this many rows more than one body has unknowns.
constexpr std::int64_t kRawPenalty = 36;
// A few rows may be dragged along a chain so that a joint can be eliminated while its body is still free.
constexpr std::int64_t kDraggedRows = 6;
constexpr std::int64_t kNever = std::int64_t{1} << 40;
constexpr std::size_t orders_a_piece = 64;  // blocks

/// Short lists side by side in one array: one that outgrows its room gets another behind the rest.
class Lists {
public:
    void reset(int count) {
        numbers_.clear();
        lists_.assign(count, {});
    }
    /// Room for so many in a list that is empty.
    void reserve(int list, int room) {
        lists_[list] = {numbers_.size(), 0, room};
        numbers_.resize(numbers_.size() + room);
    }
    std::span<int> operator[](int list) noexcept {
        return {numbers_.data() + lists_[list].at, static_cast<std::size_t>(lists_[list].size)};
    }
    std::span<const int> operator[](int list) const noexcept {
        return {numbers_.data() + lists_[list].at, static_cast<std::size_t>(lists_[list].size)};
    }
    void push_back(int list, int number) {
        List& own = lists_[list];
        if (own.size == own.room) {
            const List old = own;
            reserve(list, std::max(4, 2 * old.room));
            std::copy_n(numbers_.begin() + static_cast<std::ptrdiff_t>(old.at), old.size,
                        numbers_.begin() + static_cast<std::ptrdiff_t>(own.at));
            own.size = old.size;
        }
        numbers_[own.at + own.size++] = number;
    }
    void assign(int list, const std::vector<int>& numbers) {
        const int size = static_cast<int>(numbers.size());
        if (size > lists_[list].room) reserve(list, size + size / 2);
        std::copy(numbers.begin(), numbers.end(),
                  numbers_.begin() + static_cast<std::ptrdiff_t>(lists_[list].at));
        lists_[list].size = size;
    }
    void shorten(int list, std::ptrdiff_t size) noexcept { lists_[list].size = static_cast<int>(size); }

private:
    struct List {
        std::size_t at = 0;
        int size = 0, room = 0;
    };
    std::vector<int> numbers_;
    std::vector<List> lists_;
};

/// Its memory outlives an ordering, its values do not.
class Elimination {
public:
    void run(std::span<const int> sizes, std::span<const BlockEdge> edges,
             std::span<const std::uint8_t> is_constraint, bool strict, Ordering& result) {
        strict_ = strict;
        begin(sizes, edges, is_constraint);
        result.order.clear();
        result.column_rows.clear();
        result.column_start.assign(1, 0);
        while (!queue_.empty()) {
            std::pop_heap(queue_.begin(), queue_.end(), std::greater<>{});
            const auto [key, block, stamp] = queue_.back();
            queue_.pop_back();
            if (gone_[block] || stamp != stamp_[block]) continue;
            eliminate(block, result);
            if (result.order.size() % orders_a_piece == 0) end_piece();
        }
        std::vector<int>& position = parent_;
        for (int k = 0; k < count_; ++k) position[result.order[k]] = k;
        for (int k = 0; k < count_; ++k)
            std::sort(result.column_rows.begin() + result.column_start[k],
                      result.column_rows.begin() + result.column_start[k + 1],
                      [&](int a, int b) { return position[a] < position[b]; });
    }

private:
    using Entry = std::tuple<std::int64_t, int, int>;  // key, block, stamp

    void begin(std::span<const int> sizes, std::span<const BlockEdge> edges,
               std::span<const std::uint8_t> is_constraint) {
        sizes_ = sizes;
        is_constraint_ = is_constraint;
        count_ = static_cast<int>(sizes.size());
        degree_.assign(sizes.size(), 0);
        stamp_.assign(sizes.size(), 0);
        parent_.resize(sizes.size());
        budget_.assign(sizes.size(), 0);
        gone_.assign(sizes.size(), 0);
        grounded_.assign(sizes.size(), 0);
        live_bodies_.assign(sizes.size(), 0);
        queue_.clear();
        regions_.reset(count_);
        neighbours_.reset(count_);
        for (const BlockEdge& edge : edges) ++stamp_[edge.first], ++stamp_[edge.second];
        for (int i = 0; i < count_; ++i) neighbours_.reserve(i, std::exchange(stamp_[i], 0)), parent_[i] = i;
        for (const BlockEdge& edge : edges) {
            neighbours_.push_back(edge.first, edge.second);
            neighbours_.push_back(edge.second, edge.first);
        }
        for (int i = 0; i < count_; ++i)
            for (int j : sort_unique(neighbours_, i)) {
                degree_[i] += sizes_[j];
                live_bodies_[i] += is_constraint_[j] == 0;
            }
        own_.reset(strict_ ? count_ : 0);
        for (int i = 0; strict_ && i < count_; ++i)
            for (int j : neighbours_[i])
                if (is_constraint_[j]) own_.push_back(i, j);
        for (int i = 0; i < count_; ++i) grounded_[i] = is_constraint_[i] && live_bodies_[i] == 1;
        for (int i = 0; i < count_; ++i) push(i);
    }

    int find(int i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }

    static std::span<int> sort_unique(Lists& lists, int list) {
        const std::span<int> numbers = lists[list];
        std::sort(numbers.begin(), numbers.end());
        lists.shorten(list, std::unique(numbers.begin(), numbers.end()) - numbers.begin());
        return lists[list];
    }

    std::span<int> keep_live(int block) {
        const std::span<int> list = neighbours_[block];
        neighbours_.shorten(block, std::remove_if(list.begin(), list.end(), [&](int j) {
                                       return gone_[j] != 0;
                                   }) - list.begin());
        return neighbours_[block];
    }

    /// Degrees of freedom left in the eliminated regions next to a block; compresses its list of regions.
    std::int64_t budget_at(int block) {
        for (int& region : regions_[block]) region = find(region);
        std::int64_t sum = 0;
        for (int region : sort_unique(regions_, block)) sum += budget_[region];
        return sum;
    }

    /// Rows of larger joints that could be eliminated now but not after this small constraint.
    std::int64_t spoiled(int block, std::int64_t budget) const {
        std::int64_t worst = 0;
        for (int other : neighbours_[block]) {
            if (gone_[other] || !is_constraint_[other] || sizes_[other] <= sizes_[block]) continue;
            if (sizes_[other] > budget || sizes_[other] <= budget - sizes_[block]) continue;
            std::int64_t dragged = 0;
            for (int third : neighbours_[other]) {
                if (gone_[third] || !is_constraint_[third]) continue;
                dragged += sizes_[third];
                if (dragged > kDraggedRows) break;
            }
            if (dragged <= kDraggedRows) worst = std::max<std::int64_t>(worst, sizes_[other]);
        }
        return worst;
    }

    /// Whether the pivot of a constraint is sure to be of full rank: all it ties is gone, or it is the only constraint left
    /// around a region that can still move as a whole.
    bool is_held(int block) {
        if (live_bodies_[block] == 0) return true;
        budget_at(block);
        if (regions_[block].empty()) return false;
        for (int region : regions_[block])
            if (grounded_[region]) return false;
        for (int other : keep_live(block))
            if (is_constraint_[other]) return false;
        return true;
    }

    void push(int block) {
        std::int64_t key = 2 * degree_[block];
        if (strict_) {
            key += is_constraint_[block] ? (is_held(block) ? 0 : kNever) : 1;
        } else if (is_constraint_[block]) {
            const std::int64_t budget = budget_at(block);
            key += 2 * (budget < sizes_[block] ? kRawPenalty : spoiled(block, budget));
        } else {
            key += 1;  // at equal cost a constraint first: it turns two bodies into one, without cancellation
        }
        queue_.emplace_back(key, block, ++stamp_[block]);
        std::push_heap(queue_.begin(), queue_.end(), std::greater<>{});
    }

    void eliminate(int block, Ordering& result) {
        gone_[block] = 1;
        const std::span<const int> live = keep_live(block);
        result.order.push_back(block);
        result.column_rows.insert(result.column_rows.end(), live.begin(), live.end());
        // Lists move when others grow: these are the same blocks, and stay.
        const std::span<const int> around(result.column_rows.data() + result.column_start.back(),
                                          live.size());
        result.column_start.push_back(static_cast<std::int64_t>(result.column_rows.size()));

        if (strict_ && !is_constraint_[block])
            for (int own : own_[block]) --live_bodies_[own];
        budget_at(block);
        budget_[block] = is_constraint_[block] ? -sizes_[block] : sizes_[block];
        for (int region : regions_[block]) {
            budget_[block] += budget_[region];
            grounded_[block] |= grounded_[region];
            parent_[region] = block;
        }

        for (int other : around) {
            regions_.push_back(other, block);
            if (around.size() == 1) {  // nothing is filled in, and a hub's list is not walked for every leaf
                degree_[other] -= sizes_[block];
            } else {
                const std::span<const int> list = keep_live(other);
                merged_.clear();
                std::set_union(list.begin(), list.end(), around.begin(), around.end(),
                               std::back_inserter(merged_));
                merged_.erase(std::lower_bound(merged_.begin(), merged_.end(), other));
                neighbours_.assign(other, merged_);
                degree_[other] = 0;
                for (int j : merged_) degree_[other] += sizes_[j];
            }
        }
        for (int other : around) push(other);
    }

    std::span<const int> sizes_;
    std::span<const std::uint8_t> is_constraint_;
    int count_ = 0;
    Lists neighbours_, regions_;
    std::vector<std::int64_t> degree_;
    std::vector<int> stamp_, parent_;
    std::vector<std::int64_t> budget_;
    bool strict_ = false;
    std::vector<std::uint8_t> gone_,
        grounded_;                  // of a region: a constraint in it ties it to what does not move
    std::vector<int> live_bodies_;  // that a constraint ties itself
    Lists own_;                     // constraints of a body
    std::vector<int> merged_;
    std::vector<Entry> queue_;  // a heap, the least first
};

}  // namespace

void order_blocks(std::span<const int> sizes, std::span<const BlockEdge> edges,
                  std::span<const std::uint8_t> is_constraint, Ordering& result, bool strict) {
    static thread_local Elimination elimination;
    elimination.run(sizes, edges, is_constraint, strict, result);
}

}  // namespace spook

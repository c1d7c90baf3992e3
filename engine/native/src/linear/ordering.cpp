#include "linear/ordering.hpp"

#include <algorithm>
#include <functional>
#include <queue>
#include <tuple>

#include "linear/pieces.hpp"

namespace spook {
namespace {

// A body is eliminated before its constraints until they have this many rows more than one body has unknowns.
constexpr std::int64_t kRawPenalty = 36;
// A few rows may be dragged along a chain so that a joint can be eliminated while its body is still free.
constexpr std::int64_t kDraggedRows = 6;
constexpr std::size_t orders_a_piece = 64;  // blocks

class Elimination {
public:
    Elimination(std::span<const int> sizes, std::span<const BlockEdge> edges,
                std::span<const std::uint8_t> is_constraint)
        : sizes_(sizes),
          is_constraint_(is_constraint),
          count_(static_cast<int>(sizes.size())),
          neighbours_(sizes.size()),
          regions_(sizes.size()),
          degree_(sizes.size(), 0),
          stamp_(sizes.size(), 0),
          parent_(sizes.size()),
          budget_(sizes.size(), 0),
          gone_(sizes.size(), 0) {
        std::vector<int> counts(sizes.size(), 0);
        for (const BlockEdge& edge : edges) ++counts[edge.first], ++counts[edge.second];
        for (int i = 0; i < count_; ++i) neighbours_[i].reserve(counts[i]), parent_[i] = i;
        for (const BlockEdge& edge : edges) {
            neighbours_[edge.first].push_back(edge.second);
            neighbours_[edge.second].push_back(edge.first);
        }
        for (int i = 0; i < count_; ++i) {
            auto& list = neighbours_[i];
            std::sort(list.begin(), list.end());
            list.erase(std::unique(list.begin(), list.end()), list.end());
            for (int j : list) degree_[i] += sizes_[j];
        }
        for (int i = 0; i < count_; ++i) push(i);
    }

    Ordering run() {
        Ordering result;
        result.order.reserve(count_);
        result.column_start.reserve(count_ + 1);
        result.column_start.push_back(0);
        while (!queue_.empty()) {
            const auto [key, block, stamp] = queue_.top();
            queue_.pop();
            if (gone_[block] || stamp != stamp_[block]) continue;
            eliminate(block, result);
            if (result.order.size() % orders_a_piece == 0) end_piece();
        }
        std::vector<int> position(count_);
        for (int k = 0; k < count_; ++k) position[result.order[k]] = k;
        for (int k = 0; k < count_; ++k)
            std::sort(result.column_rows.begin() + result.column_start[k],
                      result.column_rows.begin() + result.column_start[k + 1],
                      [&](int a, int b) { return position[a] < position[b]; });
        return result;
    }

private:
    using Entry = std::tuple<std::int64_t, int, int>;  // key, block, stamp

    int find(int i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }

    void keep_live(std::vector<int>& list) const {
        list.erase(std::remove_if(list.begin(), list.end(), [&](int j) { return gone_[j] != 0; }),
                   list.end());
    }

    /// Degrees of freedom left in the eliminated regions next to a block; compresses its list of regions.
    std::int64_t budget_at(int block) {
        auto& list = regions_[block];
        for (int& region : list) region = find(region);
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
        std::int64_t sum = 0;
        for (int region : list) sum += budget_[region];
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

    void push(int block) {
        std::int64_t key = 2 * degree_[block];
        if (is_constraint_[block]) {
            const std::int64_t budget = budget_at(block);
            key += 2 * (budget < sizes_[block] ? kRawPenalty : spoiled(block, budget));
        } else {
            key += 1;  // at equal cost a constraint first: it turns two bodies into one, without cancellation
        }
        queue_.emplace(key, block, ++stamp_[block]);
    }

    void eliminate(int block, Ordering& result) {
        auto& around = neighbours_[block];
        gone_[block] = 1;
        keep_live(around);
        result.order.push_back(block);
        result.column_rows.insert(result.column_rows.end(), around.begin(), around.end());
        result.column_start.push_back(static_cast<std::int64_t>(result.column_rows.size()));

        budget_at(block);
        budget_[block] = is_constraint_[block] ? -sizes_[block] : sizes_[block];
        for (int region : regions_[block]) {
            budget_[block] += budget_[region];
            parent_[region] = block;
        }
        std::vector<int>().swap(regions_[block]);

        for (int other : around) {
            regions_[other].push_back(block);
            if (around.size() == 1) {  // nothing is filled in, and a hub's list is not walked for every leaf
                degree_[other] -= sizes_[block];
            } else {
                auto& list = neighbours_[other];
                keep_live(list);
                merged_.clear();
                std::set_union(list.begin(), list.end(), around.begin(), around.end(),
                               std::back_inserter(merged_));
                merged_.erase(std::lower_bound(merged_.begin(), merged_.end(), other));
                list.assign(merged_.begin(), merged_.end());
                degree_[other] = 0;
                for (int j : list) degree_[other] += sizes_[j];
            }
        }
        for (int other : around) push(other);
        std::vector<int>().swap(around);
    }

    std::span<const int> sizes_;
    std::span<const std::uint8_t> is_constraint_;
    int count_;
    std::vector<std::vector<int>> neighbours_, regions_;
    std::vector<std::int64_t> degree_;
    std::vector<int> stamp_, parent_;
    std::vector<std::int64_t> budget_;
    std::vector<std::uint8_t> gone_;
    std::vector<int> merged_;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

}  // namespace

Ordering order_blocks(std::span<const int> sizes, std::span<const BlockEdge> edges,
                      std::span<const std::uint8_t> is_constraint) {
    return Elimination(sizes, edges, is_constraint).run();
}

}  // namespace spook

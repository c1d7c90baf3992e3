#include "linear/block_lu.hpp"

#include <algorithm>

#include "linear/block_lu_kernels.hpp"

namespace spook {

void BlockLu::analyse(std::span<const int> sizes, std::span<const BlockEdge> edges,
                      std::span<const std::uint8_t> is_constraint) {
    const int blocks = static_cast<int>(sizes.size());
    static thread_local Ordering ordering;  // its memory outlives an analysis
    order_blocks(sizes, edges, is_constraint, ordering, true);
    order_ = ordering.order;
    column_start_ = ordering.column_start;
    position_.resize(blocks);
    for (int k = 0; k < blocks; ++k) position_[order_[k]] = k;
    column_rows_.resize(ordering.column_rows.size());
    for (std::size_t r = 0; r < column_rows_.size(); ++r)
        column_rows_[r] = position_[ordering.column_rows[r]];

    targets_.clear();
    operations_ = 0;
    for (int k = 0; k < blocks; ++k) {
        const std::int64_t begin = column_start_[k], end = column_start_[k + 1];
        operations_ += (end - begin) * (end - begin + 1) + 1;
        for (std::int64_t r = begin; r < end; ++r) {
            // Both lists ascend, and the later one contains the rest of this one.
            std::int64_t q = column_start_[column_rows_[r]];
            for (std::int64_t s = r + 1; s < end; ++s) {
                while (column_rows_[q] != column_rows_[s]) ++q;
                targets_.push_back(q);
            }
        }
    }
    edge_.resize(edges.size());
    for (std::size_t e = 0; e < edges.size(); ++e) {
        const int first = position_[edges[e].first], second = position_[edges[e].second];
        const auto begin = column_rows_.begin() + column_start_[std::min(first, second)];
        const auto end = column_rows_.begin() + column_start_[std::min(first, second) + 1];
        edge_[e] = {std::lower_bound(begin, end, std::max(first, second)) - column_rows_.begin(),
                    first < second};
    }
    pivot_.assign(36 * static_cast<std::size_t>(blocks), 0.0);
    lower_.assign(36 * column_rows_.size(), 0.0);
    upper_.assign(36 * column_rows_.size(), 0.0);
}

void BlockLu::clear() noexcept {
    std::fill(pivot_.begin(), pivot_.end(), 0.0);
    std::fill(lower_.begin(), lower_.end(), 0.0);
    std::fill(upper_.begin(), upper_.end(), 0.0);
}

LuFactor BlockLu::view() noexcept {
    return {blocks(),        order_.data(), column_start_.data(), column_rows_.data(),
            targets_.data(), pivot_.data(), lower_.data(),        upper_.data()};
}

bool BlockLu::factor() { return lu_kernels().factor(view()); }

void BlockLu::solve(double* x) const noexcept {
    lu_kernels().solve(const_cast<BlockLu*>(this)->view(), x);  // it only reads
}

}  // namespace spook

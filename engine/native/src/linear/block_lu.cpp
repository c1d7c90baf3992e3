#include "linear/block_lu.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "linear/pieces.hpp"
#include "linear/six.hpp"

namespace spook {

namespace {

constexpr std::int64_t operations_a_piece = 50'000;  // of blocks: some milliseconds

constexpr double only_k[6][6] = {{1}, {0, 1}, {0, 0, 1}, {0, 0, 0, 1}, {0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 1}};
constexpr double not_k[6][6] = {{0, 1, 1, 1, 1, 1}, {1, 0, 1, 1, 1, 1}, {1, 1, 0, 1, 1, 1},
                                {1, 1, 1, 0, 1, 1}, {1, 1, 1, 1, 0, 1}, {1, 1, 1, 1, 1, 0}};

/// C −= A B.
inline void subtract_product(const double* a, const double* b, double* c) noexcept {
    const Six b0 = Six::load(b), b1 = Six::load(b + 6), b2 = Six::load(b + 12);
    const Six b3 = Six::load(b + 18), b4 = Six::load(b + 24), b5 = Six::load(b + 30);
    for (int i = 0; i < 36; i += 6) {
        Six row = Six::load(c + i);
        row.subtract(a[i], b0), row.subtract(a[i + 1], b1), row.subtract(a[i + 2], b2);
        row.subtract(a[i + 3], b3), row.subtract(a[i + 4], b4), row.subtract(a[i + 5], b5);
        row.store(c + i);
    }
}

/// A ← A B.
inline void multiply(double* a, const double* b) noexcept {
    const Six b0 = Six::load(b), b1 = Six::load(b + 6), b2 = Six::load(b + 12);
    const Six b3 = Six::load(b + 18), b4 = Six::load(b + 24), b5 = Six::load(b + 30);
    for (int i = 0; i < 36; i += 6) {
        Six row = Six::zero();
        row.add(a[i], b0), row.add(a[i + 1], b1), row.add(a[i + 2], b2);
        row.add(a[i + 3], b3), row.add(a[i + 4], b4), row.add(a[i + 5], b5);
        row.store(a + i);
    }
}

inline void subtract_image(const double* a, const double* x, double* y) noexcept {
    const Six change = image(a, Six::load(x));
    Six sum = Six::load(y);
    sum.a -= change.a, sum.b -= change.b, sum.c -= change.c;
    sum.store(y);
}

/// A ← A⁻¹ by Gauss and Jordan in place, with row pivots; false if it has none.
bool invert(double* a) noexcept {
    int swapped[6];
    for (int k = 0; k < 6; ++k) {
        int best = k;
        for (int i = k + 1; i < 6; ++i)
            if (std::abs(a[6 * i + k]) > std::abs(a[6 * best + k])) best = i;
        swapped[k] = best;
        if (best != k) std::swap_ranges(a + 6 * k, a + 6 * k + 6, a + 6 * best);
        const double over = 1.0 / a[7 * k];
        if (!std::isfinite(over)) return false;
        // Column k gives its place to that of the inverse: by masks, since writing one number of a row that is read
        // as pairs right after is slow.
        const Six others = Six::load(not_k[k]);
        Six own = Six::load(a + 6 * k);
        own.multiply(others);
        own.add(1.0, Six::load(only_k[k]));
        own.scale(over);
        for (int i = 0; i < 6; ++i) {
            if (i == k) continue;
            const double share = a[6 * i + k];
            Six row = Six::load(a + 6 * i);
            row.multiply(others);
            row.subtract(share, own);
            row.store(a + 6 * i);
        }
        own.store(a + 6 * k);
    }
    for (int k = 5; k >= 0; --k)
        if (swapped[k] != k)
            for (int i = 0; i < 36; i += 6) std::swap(a[i + k], a[i + swapped[k]]);
    return true;
}

/// What an analysis needs besides what it gives; its memory outlives it.
struct Analysis {
    Ordering ordering;
    std::vector<int> sizes;
    std::vector<std::uint8_t> is_constraint;
};

}  // namespace

void BlockLu::analyse(int blocks, std::span<const BlockEdge> edges) {
    static thread_local Analysis analysis;
    analysis.sizes.assign(blocks, 6);
    analysis.is_constraint.assign(blocks, 0);
    order_blocks(analysis.sizes, edges, analysis.is_constraint, analysis.ordering);
    const Ordering& ordering = analysis.ordering;
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

bool BlockLu::factor() {
    const std::int64_t* target = targets_.data();
    std::int64_t piece = 0;
    for (int k = 0; k < blocks(); ++k) {
        double* pivot = pivot_.data() + 36 * static_cast<std::size_t>(k);
        if (!invert(pivot)) return false;
        const std::int64_t begin = column_start_[k], end = column_start_[k + 1];
        piece += (end - begin) * (end - begin + 1) + 1;
        if (piece > operations_a_piece) piece = 0, end_piece();
        for (std::int64_t r = begin; r < end; ++r) multiply(lower(r), pivot);
        for (std::int64_t r = begin; r < end; ++r) {
            const double *low = lower(r), *up = upper(r);
            subtract_product(low, up, pivot_.data() + 36 * static_cast<std::size_t>(column_rows_[r]));
            for (std::int64_t s = r + 1; s < end; ++s) {
                subtract_product(low, upper(s), upper(*target));
                subtract_product(lower(s), up, lower(*target));
                ++target;
            }
        }
    }
    return true;
}

void BlockLu::solve(double* x) const noexcept {
    auto place = [&](int position) { return x + 6 * static_cast<std::size_t>(order_[position]); };
    for (int k = 0; k < blocks(); ++k)
        for (std::int64_t r = column_start_[k]; r < column_start_[k + 1]; ++r)
            subtract_image(lower_.data() + 36 * r, place(k), place(column_rows_[r]));
    for (int k = blocks(); k-- > 0;) {
        double* own = place(k);
        for (std::int64_t r = column_start_[k]; r < column_start_[k + 1]; ++r)
            subtract_image(upper_.data() + 36 * r, place(column_rows_[r]), own);
        image(pivot_.data() + 36 * static_cast<std::size_t>(k), Six::load(own)).store(own);
    }
}

}  // namespace spook

#include "linear/block_lu.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "linear/pieces.hpp"

namespace spook {

namespace {

constexpr std::int64_t operations_a_piece = 50'000;  // of blocks: some milliseconds

/// C −= A B.
inline void subtract_product(const double* a, const double* b, double* c) noexcept {
    for (int i = 0; i < 6; ++i) {
        double row[6];
        for (int j = 0; j < 6; ++j) row[j] = c[6 * i + j];
        for (int k = 0; k < 6; ++k)
            for (int j = 0; j < 6; ++j) row[j] -= a[6 * i + k] * b[6 * k + j];
        for (int j = 0; j < 6; ++j) c[6 * i + j] = row[j];
    }
}

/// A ← A B.
inline void multiply(double* a, const double* b) noexcept {
    for (int i = 0; i < 6; ++i) {
        double row[6] = {0, 0, 0, 0, 0, 0};
        for (int k = 0; k < 6; ++k)
            for (int j = 0; j < 6; ++j) row[j] += a[6 * i + k] * b[6 * k + j];
        for (int j = 0; j < 6; ++j) a[6 * i + j] = row[j];
    }
}

inline void subtract_image(const double* a, const double* x, double* y) noexcept {
    for (int i = 0; i < 6; ++i) {
        double sum = 0.0;
        for (int j = 0; j < 6; ++j) sum += a[6 * i + j] * x[j];
        y[i] -= sum;
    }
}

/// A ← A⁻¹ by Gauss and Jordan with row pivots; false if it has none.
bool invert(double* a) noexcept {
    double inverse[36] = {};
    for (int i = 0; i < 6; ++i) inverse[7 * i] = 1.0;
    for (int k = 0; k < 6; ++k) {
        int best = k;
        for (int i = k + 1; i < 6; ++i)
            if (std::abs(a[6 * i + k]) > std::abs(a[6 * best + k])) best = i;
        if (best != k)
            for (int j = 0; j < 6; ++j)
                std::swap(a[6 * best + j], a[6 * k + j]),
                    std::swap(inverse[6 * best + j], inverse[6 * k + j]);
        const double over = 1.0 / a[7 * k];
        if (!std::isfinite(over)) return false;
        for (int j = 0; j < 6; ++j) a[6 * k + j] *= over, inverse[6 * k + j] *= over;
        for (int i = 0; i < 6; ++i) {
            if (i == k) continue;
            const double share = a[6 * i + k];
            for (int j = 0; j < 6; ++j)
                a[6 * i + j] -= share * a[6 * k + j], inverse[6 * i + j] -= share * inverse[6 * k + j];
        }
    }
    std::copy_n(inverse, 36, a);
    return true;
}

}  // namespace

void BlockLu::analyse(int blocks, std::span<const BlockEdge> edges) {
    const std::vector<int> sizes(blocks, 6);
    const std::vector<std::uint8_t> is_constraint(blocks, 0);
    const Ordering ordering = order_blocks(sizes, edges, is_constraint);
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
        double image[6] = {0, 0, 0, 0, 0, 0};
        const double* pivot = pivot_.data() + 36 * static_cast<std::size_t>(k);
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) image[i] += pivot[6 * i + j] * own[j];
        std::copy_n(image, 6, own);
    }
}

}  // namespace spook

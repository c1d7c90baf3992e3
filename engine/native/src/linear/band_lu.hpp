// A small system whose entries lie near the diagonal, neither symmetric nor definite: P A = L U.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace spook {

/// Gauss with row exchange inside a band; a full matrix is the widest one. Nothing is allocated after prepare().
class BandLu {
public:
    /// Entries (i, j) with |i − j| ≤ `reach`.
    void prepare(int unknowns, int reach) {
        unknowns_ = unknowns;
        reach_ = std::min(reach, std::max(0, unknowns - 1));
        width_ = 3 * reach_ + 1;  // row exchange fills as much again above the diagonal
        values_.assign(static_cast<std::size_t>(unknowns) * static_cast<std::size_t>(width_), 0.0);
        exchanged_.assign(static_cast<std::size_t>(unknowns), 0);
    }
    int reach() const noexcept { return reach_; }
    void clear() noexcept { std::fill(values_.begin(), values_.end(), 0.0); }
    double& at(int i, int j) noexcept {
        const int place = i * width_ + j - i + reach_;
        return values_[static_cast<std::size_t>(place)];
    }

    /// False when a pivot is zero or not finite.
    bool factor() noexcept { return reach_ == NARROW ? factor<NARROW>() : factor<0>(); }
    /// x ← A⁻¹ x.
    void solve(double* x) const noexcept { reach_ == NARROW ? solve<NARROW>(x) : solve<0>(x); }

private:
    static constexpr int NARROW = 3;  // two rows between trees of two: loops of known length, twice as fast

    template <int REACH> bool factor() noexcept {
        const int reach = REACH > 0 ? REACH : reach_, width = 3 * reach + 1;
        const std::ptrdiff_t below = width - 1;  // from an entry to the one under it
        double* pivot = values_.data() + reach;
        const auto eliminate = [&](int k, int under, int right) {
            int best = 0;
            double largest = std::fabs(*pivot);
            for (int i = 1; i <= under; ++i) {
                const double size = std::fabs(pivot[i * below]);
                if (size > largest) largest = size, best = i;
            }
            exchanged_[static_cast<std::size_t>(k)] = k + best;
            if (best > 0)
                for (int j = 0; j <= right; ++j) std::swap(pivot[j], pivot[best * below + j]);
            const double over = 1.0 / *pivot;
            *pivot = over;
            for (int i = 1; i <= under; ++i) {
                double* to = pivot + i * below;
                const double share = *to * over;
                *to = share;
                if (share == 0.0) continue;
                for (int j = 1; j <= right; ++j) to[j] -= share * pivot[j];
            }
            pivot += width;
            return over - over == 0.0;
        };
        const int whole = unknowns_ - 2 * reach;  // rows with the band's whole width
        int k = 0;
        for (; k < whole; ++k)
            if (!eliminate(k, reach, 2 * reach)) return false;
        for (; k < unknowns_; ++k)
            if (!eliminate(k, std::min(unknowns_ - 1 - k, reach), unknowns_ - 1 - k)) return false;
        return true;
    }

    template <int REACH> void solve(double* x) const noexcept {
        const int reach = REACH > 0 ? REACH : reach_, width = 3 * reach + 1;
        const std::ptrdiff_t below = width - 1;
        const int whole = std::max(0, unknowns_ - 2 * reach);
        const double* pivot = values_.data() + reach;
        const auto forth = [&](int k, int under) {
            std::swap(x[k], x[exchanged_[static_cast<std::size_t>(k)]]);
            for (int i = 1; i <= under; ++i) x[k + i] -= pivot[i * below] * x[k];
            pivot += width;
        };
        for (int k = 0; k < whole; ++k) forth(k, reach);
        for (int k = whole; k < unknowns_; ++k) forth(k, std::min(unknowns_ - 1 - k, reach));
        const auto back = [&](int k, int right) {
            pivot -= width;
            double sum = x[k];
            for (int j = 1; j <= right; ++j) sum -= pivot[j] * x[k + j];
            x[k] = sum * *pivot;
        };
        for (int k = unknowns_; k-- > whole;) back(k, unknowns_ - 1 - k);
        for (int k = whole; k-- > 0;) back(k, 2 * reach);
    }

    int unknowns_ = 0, reach_ = 0, width_ = 1;
    std::vector<double> values_;  // row i: columns i − reach … i + 2 reach; pivots inverted in the factor
    std::vector<int> exchanged_;
};

}  // namespace spook

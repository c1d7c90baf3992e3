#include "contacts/mass_factors.hpp"

#include <algorithm>

namespace spook {

Mat6 factor_six(const Mat6& m) noexcept {
    Mat6 l{};
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j <= i; ++j) {
            double sum = m[6 * i + j];
            for (int k = 0; k < j; ++k) sum -= l[6 * i + k] * l[7 * k] * l[6 * j + k];
            l[6 * i + j] = i == j ? sum : sum / l[7 * j];
        }
    return l;
}

namespace {

/// x ← M⁻¹ x, of one vector or of several side by side: each rounds as it would alone.
template <class Number> void substitute(const Mat6& l, Number* x) noexcept {
    for (int i = 1; i < 6; ++i)
        for (int k = 0; k < i; ++k) x[i] -= l[6 * i + k] * x[k];
    for (int i = 0; i < 6; ++i) x[i] /= l[7 * i];
    for (int i = 4; i >= 0; --i)
        for (int k = i + 1; k < 6; ++k) x[i] -= l[6 * k + i] * x[k];
}

}  // namespace

void solve_six(const Mat6& l, Vec6& x) noexcept { substitute(l, x.data()); }

void own_inertias(const Mat6& l, const Vec6* rows, int count, double* own) noexcept {
    typedef double Four __attribute__((vector_size(32)));
    if (count == 1) {
        Vec6 x = rows[0];
        solve_six(l, x);
        own[0] = dot(rows[0], x);
        return;
    }
    for (int from = 0; from < count; from += 4) {
        const int left = std::min(4, count - from);
        Four row[6], x[6];
        for (int i = 0; i < 6; ++i) {
            row[i] = Four{};
            for (int k = 0; k < left; ++k) row[i][k] = rows[from + k][i];
            x[i] = row[i];
        }
        substitute(l, x);
        Four sum = row[0] * x[0];
        for (int i = 1; i < 6; ++i) sum += row[i] * x[i];
        for (int k = 0; k < left; ++k) own[from + k] = sum[k];
    }
}

}  // namespace spook

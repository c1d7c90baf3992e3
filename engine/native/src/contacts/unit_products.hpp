// Products of a unit's rows with vectors and blocks of bodies, six numbers at a time.
#pragma once

#include "contacts/pivot_solver.hpp"
#include "linear/six.hpp"

namespace spook {

/// M⁻¹ from its factor: good enough for directions, which are refined.
inline Mat6 inverse_six(const Mat6& factor) noexcept {
    Mat6 inverse{};
    for (int i = 0; i < 6; ++i) {
        Vec6 column{};
        column[i] = 1.0;
        solve_six(factor, column);
        for (int j = 0; j < 6; ++j) inverse[6 * i + j] = column[j];
    }
    return inverse;
}

/// K G' of a unit of N rows.
template <int N> void stiffen(const double* k, const Vec6* from, Six* image) noexcept {
    for (int i = 0; i < N; ++i) {
        image[i] = Six::zero();
        for (int j = 0; j < N; ++j) image[i].add(k[N * i + j], Six::load(from[j].data()));
    }
}

/// out += Gᵀ of N rows times what stiffen() gave.
template <int N> void add_stiffness(const Vec6* to, const Six* image, double* out) noexcept {
    for (int a = 0; a < 6; ++a) {
        Six row = Six::load(out + 6 * a);
        for (int i = 0; i < N; ++i) row.add(to[i][a], image[i]);
        row.store(out + 6 * a);
    }
}

/// x += Gᵀ z of one body's N rows.
template <int N> void add_push(const Vec6* rows, const double* z, double* x) noexcept {
    Six sum = Six::load(x);
    for (int i = 0; i < N; ++i) sum.add(z[i], Six::load(rows[i].data()));
    sum.store(x);
}

}  // namespace spook

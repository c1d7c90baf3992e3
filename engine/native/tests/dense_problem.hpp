// The same problem without any of the engine's algebra: dense, and every set of bound rows tried in turn.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "contacts/pivot_system.hpp"

namespace spook {

inline Mat6 diagonal(double mass, double inertia) {
    Mat6 m{};
    for (int i = 0; i < 6; ++i) m[7 * i] = i < 3 ? mass : inertia;
    return m;
}

/// Dense symmetric positive solve by Gauss elimination, independent of the engine's factorisations.
inline std::vector<double> dense_solve(std::vector<std::vector<double>> a, std::vector<double> b) {
    const int n = static_cast<int>(b.size());
    for (int k = 0; k < n; ++k) {
        int pivot = k;
        for (int i = k; i < n; ++i)
            if (std::abs(a[i][k]) > std::abs(a[pivot][k])) pivot = i;
        std::swap(a[k], a[pivot]);
        std::swap(b[k], b[pivot]);
        for (int i = k + 1; i < n; ++i) {
            const double f = a[i][k] / a[k][k];
            for (int j = k; j < n; ++j) a[i][j] -= f * a[k][j];
            b[i] -= f * b[k];
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        for (int j = k + 1; j < n; ++j) b[k] -= a[k][j] * b[j];
        b[k] /= a[k][k];
    }
    return b;
}

struct Flat {  // every row of a system, for enumeration: S z + q = w
    std::vector<std::vector<double>> s;
    std::vector<double> q, lower, upper;
};

inline Flat flatten(const MixedSystem& system) {
    struct Row {
        const RowBlock* block;
        int i;
    };
    std::vector<Row> rows;
    for (const RowBlock& block : system.rows)
        for (int i = 0; i < block.size; ++i) rows.push_back({&block, i});
    auto jacobian = [&](const Row& row, int body) {
        Vec6 j{};
        if (row.block->first == body) j = row.block->first_jacobian[row.i];
        if (row.block->second == body) j = row.block->second_jacobian[row.i];
        return j;
    };
    Flat flat;
    const std::size_t n = rows.size();
    flat.s.assign(n, std::vector<double>(n, 0.0));
    for (std::size_t r = 0; r < n; ++r) {
        flat.q.push_back(-rows[r].block->right[rows[r].i]);
        flat.lower.push_back(rows[r].block->lower[rows[r].i]);
        flat.upper.push_back(rows[r].block->upper[rows[r].i]);
        for (int b = 0; b < static_cast<int>(system.mass.size()); ++b)
            for (int a = 0; a < 6; ++a)
                flat.q[r] += jacobian(rows[r], b)[a] * system.momentum[b][a] / system.mass[b][7 * a];
        for (std::size_t c = 0; c < n; ++c) {
            for (int b = 0; b < static_cast<int>(system.mass.size()); ++b)
                for (int a = 0; a < 6; ++a)
                    flat.s[r][c] += jacobian(rows[r], b)[a] * jacobian(rows[c], b)[a] / system.mass[b][7 * a];
            if (r == c) flat.s[r][c] += rows[r].block->softness[rows[r].i];
        }
    }
    return flat;
}

/// The multipliers by trying every assignment of rows to lower, free and upper; empty if none fits.
inline std::vector<double> enumerate(const Flat& flat) {
    const int n = static_cast<int>(flat.q.size());
    int cases = 1;
    for (int i = 0; i < n; ++i) cases *= 3;
    for (int code = 0; code < cases; ++code) {
        std::vector<int> state(n), free;
        std::vector<double> z(n, 0.0);
        bool possible = true;
        for (int i = 0, rest = code; i < n; ++i, rest /= 3) {
            state[i] = rest % 3;
            if (state[i] == 0) free.push_back(i);
            else z[i] = state[i] == 1 ? flat.lower[i] : flat.upper[i];
            possible = possible && std::isfinite(z[i]);
        }
        if (!possible) continue;
        std::vector<std::vector<double>> a(free.size(), std::vector<double>(free.size()));
        std::vector<double> b(free.size());
        for (std::size_t r = 0; r < free.size(); ++r) {
            b[r] = -flat.q[free[r]];
            for (int c = 0; c < n; ++c) b[r] -= flat.s[free[r]][c] * z[c];
            for (std::size_t c = 0; c < free.size(); ++c) a[r][c] = flat.s[free[r]][free[c]];
        }
        const std::vector<double> x = dense_solve(a, b);
        for (std::size_t r = 0; r < free.size(); ++r) z[free[r]] = x[r];
        bool good = true;
        for (int i = 0; i < n && good; ++i) {
            double w = flat.q[i];
            for (int c = 0; c < n; ++c) w += flat.s[i][c] * z[c];
            good = state[i] == 0   ? z[i] >= flat.lower[i] - 1e-12 && z[i] <= flat.upper[i] + 1e-12
                   : state[i] == 1 ? w >= -1e-12
                                   : w <= 1e-12;
        }
        if (good) return z;
    }
    return {};
}

}  // namespace spook

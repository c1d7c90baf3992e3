// The loops over the columns of a block factor L U. Included once per instruction set, with SPOOK_ISA naming it: only
// elementwise operations and fixed orders of summation, and contraction is off, so all round alike.

#define SPOOK_INLINE inline __attribute__((always_inline))

namespace spook::SPOOK_ISA {
namespace {

#include "linear/six.inl"

constexpr std::int64_t operations_a_piece = 50'000;  // of blocks: some milliseconds

constexpr double only_k[6][6] = {{1}, {0, 1}, {0, 0, 1}, {0, 0, 0, 1}, {0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 1}};
constexpr double not_k[6][6] = {{0, 1, 1, 1, 1, 1}, {1, 0, 1, 1, 1, 1}, {1, 1, 0, 1, 1, 1},
                                {1, 1, 1, 0, 1, 1}, {1, 1, 1, 1, 0, 1}, {1, 1, 1, 1, 1, 0}};

/// C −= A B.
SPOOK_INLINE void subtract_product(const double* a, const double* b, double* c) noexcept {
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
SPOOK_INLINE void multiply(double* a, const double* b) noexcept {
    const Six b0 = Six::load(b), b1 = Six::load(b + 6), b2 = Six::load(b + 12);
    const Six b3 = Six::load(b + 18), b4 = Six::load(b + 24), b5 = Six::load(b + 30);
    for (int i = 0; i < 36; i += 6) {
        Six row = Six::zero();
        row.add(a[i], b0), row.add(a[i + 1], b1), row.add(a[i + 2], b2);
        row.add(a[i + 3], b3), row.add(a[i + 4], b4), row.add(a[i + 5], b5);
        row.store(a + i);
    }
}

SPOOK_INLINE void subtract_image(const double* a, const double* x, double* y) noexcept {
    Six sum = Six::load(y);
    sum.subtract(image(a, Six::load(x)));
    sum.store(y);
}

/// A ← A⁻¹ by Gauss and Jordan in place, with row pivots; false if it has none.
SPOOK_INLINE bool invert(double* a) noexcept {
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

bool factor(const LuFactor& f) {
    const std::int64_t* target = f.targets;
    std::int64_t piece = 0;
    for (int k = 0; k < f.blocks; ++k) {
        double* pivot = f.pivot + 36 * static_cast<std::size_t>(k);
        if (!invert(pivot)) return false;
        const std::int64_t begin = f.column_start[k], end = f.column_start[k + 1];
        piece += (end - begin) * (end - begin + 1) + 1;
        if (piece > operations_a_piece) piece = 0, end_piece();
        for (std::int64_t r = begin; r < end; ++r) multiply(f.lower_at(r), pivot);
        for (std::int64_t r = begin; r < end; ++r) {
            const double *low = f.lower_at(r), *up = f.upper_at(r);
            subtract_product(low, up, f.pivot + 36 * static_cast<std::size_t>(f.column_rows[r]));
            for (std::int64_t s = r + 1; s < end; ++s) {
                subtract_product(low, f.upper_at(s), f.upper_at(*target));
                subtract_product(f.lower_at(s), up, f.lower_at(*target));
                ++target;
            }
        }
    }
    return true;
}

void solve(const LuFactor& f, double* x) noexcept {
    auto place = [&](int position) { return x + 6 * static_cast<std::size_t>(f.order[position]); };
    for (int k = 0; k < f.blocks; ++k)
        for (std::int64_t r = f.column_start[k]; r < f.column_start[k + 1]; ++r)
            subtract_image(f.lower + 36 * r, place(k), place(f.column_rows[r]));
    for (int k = f.blocks; k-- > 0;) {
        double* own = place(k);
        for (std::int64_t r = f.column_start[k]; r < f.column_start[k + 1]; ++r)
            subtract_image(f.upper + 36 * r, place(f.column_rows[r]), own);
        image(f.pivot + 36 * static_cast<std::size_t>(k), Six::load(own)).store(own);
    }
}

}  // namespace

constexpr LuKernels lu_table = {factor, solve};

}  // namespace spook::SPOOK_ISA

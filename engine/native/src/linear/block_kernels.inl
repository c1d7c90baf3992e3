// Included once per instruction set, with SPOOK_ISA naming it. Only elementwise vector operations and fixed
// orders of summation are used and contraction is off, so every instruction set rounds alike.

#define SPOOK_INLINE inline __attribute__((always_inline))
#ifdef __wasm__  // a reader's browser loads the module first: loops stay loops, the order of sums is theirs anyway
#define SPOOK_UNROLL _Pragma("clang loop unroll(disable)")
#else
#define SPOOK_UNROLL _Pragma("GCC unroll 6")
#endif

namespace spook::kernel::SPOOK_ISA {
namespace {

typedef double V4 __attribute__((vector_size(32), aligned(8), may_alias));
typedef double V2 __attribute__((vector_size(16), aligned(8), may_alias));

/// A row of N numbers in registers.
template <int N> struct Row {
    static constexpr int fours = N / 4, twos = (N % 4) / 2, ones = N % 2;
    V4 a;
    V2 b;
    double c;

    SPOOK_INLINE void clear() {
        if constexpr (fours) a = V4{0, 0, 0, 0};
        if constexpr (twos) b = V2{0, 0};
        if constexpr (ones) c = 0;
    }
    SPOOK_INLINE void load(const double* p) {
        if constexpr (fours) a = *reinterpret_cast<const V4*>(p);
        if constexpr (twos) b = *reinterpret_cast<const V2*>(p + 4 * fours);
        if constexpr (ones) c = p[N - 1];
    }
    SPOOK_INLINE void store(double* p) const {
        if constexpr (fours) *reinterpret_cast<V4*>(p) = a;
        if constexpr (twos) *reinterpret_cast<V2*>(p + 4 * fours) = b;
        if constexpr (ones) p[N - 1] = c;
    }
    SPOOK_INLINE void add(double s, const Row& r) {
        if constexpr (fours) a += s * r.a;
        if constexpr (twos) b += s * r.b;
        if constexpr (ones) c += s * r.c;
    }
    SPOOK_INLINE void subtract(double s, const Row& r) {
        if constexpr (fours) a -= s * r.a;
        if constexpr (twos) b -= s * r.b;
        if constexpr (ones) c -= s * r.c;
    }
    SPOOK_INLINE void subtract(const Row& r) {
        if constexpr (fours) a -= r.a;
        if constexpr (twos) b -= r.b;
        if constexpr (ones) c -= r.c;
    }
    SPOOK_INLINE void scale(double s) {
        if constexpr (fours) a *= s;
        if constexpr (twos) b *= s;
        if constexpr (ones) c *= s;
    }
    SPOOK_INLINE double dot(const Row& r) const {
        double sum = 0;
        V2 pair = {0, 0};
        if constexpr (fours) {
            const V4 p = a * r.a;
            pair = V2{p[0], p[1]} + V2{p[2], p[3]};
        }
        if constexpr (twos) pair += b * r.b;
        if constexpr (fours || twos) sum = pair[0] + pair[1];
        if constexpr (ones) sum += c * r.c;
        return sum;
    }
};

/// A = Uᵀ D U in place for one pivot block. Returns replaced pivots, or −1.
template <int N>
SPOOK_INLINE int pivot(double* u, double* inverse, const double* scale, double sign, double floor,
                       double replacement) {
    int replaced = 0;
    for (int i = 0; i < N; ++i) {
        double d = u[i * N + i];
        const double size = sign * d;
        if (!(size > floor * scale[i])) [[unlikely]] {
            if (!(size - size == 0.0) || replacement == 0.0) return -1;
            d = sign * (scale[i] > 0.0 ? replacement * scale[i] : 1.0);
            ++replaced;
        }
        const double over = 1.0 / d;
        inverse[i] = over;
        Row<N> row, other;
        row.load(u + i * N);
        SPOOK_UNROLL
        for (int j = i + 1; j < N; ++j) {
            other.load(u + j * N);
            other.subtract(u[i * N + j] * over, row);
            other.store(u + j * N);
        }
        row.scale(over);
        row.store(u + i * N);
    }
    return inverse[N - 1] - inverse[N - 1] == 0.0 ? replaced : -1;
}

/// Y ← U⁻ᵀ A (in place of A), Z ← D⁻¹ Y.
template <int N, int R>
SPOOK_INLINE void divide(const double* u, const double* inverse, double* z, double* y) {
    Row<R> rows[N];
    SPOOK_UNROLL
    for (int i = 0; i < N; ++i) rows[i].load(y + i * R);
    SPOOK_UNROLL
    for (int i = 0; i < N; ++i) {
        SPOOK_UNROLL
        for (int j = i + 1; j < N; ++j) rows[j].subtract(u[i * N + j], rows[i]);
        rows[i].store(y + i * R);
        rows[i].scale(inverse[i]);
        rows[i].store(z + i * R);
    }
}

/// T −= Yᵣᵀ Zₛ.
template <int N, int R, int S> SPOOK_INLINE void update(const double* y, const double* z, double* t) {
    Row<S> rows[N];
    SPOOK_UNROLL
    for (int k = 0; k < N; ++k) rows[k].load(z + k * S);
    SPOOK_UNROLL
    for (int a = 0; a < R; ++a) {
        Row<S> sum, target;
        sum.clear();
        SPOOK_UNROLL
        for (int k = 0; k < N; ++k) sum.add(y[k * R + a], rows[k]);
        target.load(t + a * S);
        target.subtract(sum);
        target.store(t + a * S);
    }
}

/// T −= Yᵀ Z on the diagonal, and the magnitudes it takes away to `scale` when asked.
template <int N, int R>
SPOOK_INLINE void update_diagonal(const double* y, const double* z, double* t, double* scale, bool note) {
    Row<R> rows[N];
    SPOOK_UNROLL
    for (int k = 0; k < N; ++k) rows[k].load(z + k * R);
    SPOOK_UNROLL
    for (int a = 0; a < R; ++a) {
        Row<R> sum, target;
        sum.clear();
        SPOOK_UNROLL
        for (int k = 0; k < N; ++k) sum.add(y[k * R + a], rows[k]);
        target.load(t + a * R);
        const double before = t[a * R + a];
        target.subtract(sum);
        target.store(t + a * R);
        if (note) scale[a] += before - t[a * R + a];
    }
}

/// U above its diagonal, row by row: entry (i, j) with j > i.
constexpr int packed(int n, int i, int j) { return i * n - i * (i + 1) / 2 + j - i - 1; }

template <int N> SPOOK_INLINE void pack(const double* u, double* p) {
    SPOOK_UNROLL
    for (int i = 0; i < N; ++i) SPOOK_UNROLL
    for (int j = i + 1; j < N; ++j) p[packed(N, i, j)] = u[i * N + j];
}

template <int N> SPOOK_INLINE void forward_pivot(const double* p, double* x) {
    SPOOK_UNROLL
    for (int i = 0; i < N; ++i) SPOOK_UNROLL
    for (int j = i + 1; j < N; ++j) x[j] -= p[packed(N, i, j)] * x[i];
}

/// xᵣ −= Zᵀ x.
template <int N, int R> SPOOK_INLINE void forward_row(const double* z, const double* x, double* xr) {
    Row<R> sum, row;
    sum.clear();
    SPOOK_UNROLL
    for (int i = 0; i < N; ++i) {
        row.load(z + i * R);
        sum.add(x[i], row);
    }
    row.load(xr);
    row.subtract(sum);
    row.store(xr);
}

/// x −= Z xᵣ.
template <int N, int R> SPOOK_INLINE void backward_row(const double* z, const double* xr, double* x) {
    Row<R> row, right;
    right.load(xr);
    SPOOK_UNROLL
    for (int i = 0; i < N; ++i) {
        row.load(z + i * R);
        x[i] -= row.dot(right);
    }
}

template <int N> SPOOK_INLINE void backward_pivot(const double* p, double* x) {
    SPOOK_UNROLL
    for (int i = N - 1; i >= 0; --i) SPOOK_UNROLL
    for (int j = i + 1; j < N; ++j) x[i] -= p[packed(N, i, j)] * x[j];
}

template <int N, int R, int S> void update_call(const double* y, const double* z, double* t) {
    update<N, R, S>(y, z, t);
}
template <int N, int R>
void update_diagonal_call(const double* y, const double* z, double* t, double* scale, bool note) {
    update_diagonal<N, R>(y, z, t, scale, note);
}
template <int N, int R> void divide_call(const double* u, const double* inverse, double* z, double* y) {
    divide<N, R>(u, inverse, z, y);
}
template <int N, int R> void forward_row_call(const double* z, const double* x, double* xr) {
    forward_row<N, R>(z, x, xr);
}
template <int N, int R> void backward_row_call(const double* z, const double* xr, double* x) {
    backward_row<N, R>(z, xr, x);
}
template <int N>
int pivot_call(double* u, double* inverse, const double* scale, double sign, double floor,
               double replacement) {
    return pivot<N>(u, inverse, scale, sign, floor, replacement);
}
template <int N> void pack_call(const double* u, double* p) { pack<N>(u, p); }
template <int N> void forward_pivot_call(const double* u, double* x) { forward_pivot<N>(u, x); }
template <int N> void backward_pivot_call(const double* u, double* x) { backward_pivot<N>(u, x); }

#define SPOOK_SIX(f) {f(1), f(2), f(3), f(4), f(5), f(6)}
#define SPOOK_P(n) pivot_call<n>
constexpr int (*pivot_table[6])(double*, double*, const double*, double, double, double) = SPOOK_SIX(SPOOK_P);
#define SPOOK_PK(n) pack_call<n>
constexpr void (*pack_table[6])(const double*, double*) = SPOOK_SIX(SPOOK_PK);
#define SPOOK_FP(n) forward_pivot_call<n>
constexpr void (*forward_pivot_table[6])(const double*, double*) = SPOOK_SIX(SPOOK_FP);
#define SPOOK_BP(n) backward_pivot_call<n>
constexpr void (*backward_pivot_table[6])(const double*, double*) = SPOOK_SIX(SPOOK_BP);
#define SPOOK_BY_TWO(name, n) {name<n, 1>, name<n, 2>, name<n, 3>, name<n, 4>, name<n, 5>, name<n, 6>}
#define SPOOK_D(n) SPOOK_BY_TWO(divide_call, n)
constexpr void (*divide_table[6][6])(const double*, const double*, double*, double*) = SPOOK_SIX(SPOOK_D);
#define SPOOK_UD(n) SPOOK_BY_TWO(update_diagonal_call, n)
constexpr void (*update_diagonal_table[6][6])(const double*, const double*, double*, double*,
                                              bool) = SPOOK_SIX(SPOOK_UD);
#define SPOOK_FR(n) SPOOK_BY_TWO(forward_row_call, n)
constexpr void (*forward_row_table[6][6])(const double*, const double*, double*) = SPOOK_SIX(SPOOK_FR);
#define SPOOK_BR(n) SPOOK_BY_TWO(backward_row_call, n)
constexpr void (*backward_row_table[6][6])(const double*, const double*, double*) = SPOOK_SIX(SPOOK_BR);
#define SPOOK_U3(n, r)                                                 \
    {update_call<n, r, 1>, update_call<n, r, 2>, update_call<n, r, 3>, \
     update_call<n, r, 4>, update_call<n, r, 5>, update_call<n, r, 6>}
#define SPOOK_U(n) \
    {SPOOK_U3(n, 1), SPOOK_U3(n, 2), SPOOK_U3(n, 3), SPOOK_U3(n, 4), SPOOK_U3(n, 5), SPOOK_U3(n, 6)}
constexpr void (*update_table[6][6][6])(const double*, const double*, double*) = SPOOK_SIX(SPOOK_U);

template <int U> SPOOK_INLINE void load_block(const Factor& f, const Load& item) {
    const int rows = U ? U : item.rows, columns = U ? U : item.columns;
    const double* from = f.matrix + item.from;
    double* to = f.work + item.to;
    switch (item.kind) {
        case Load::zero: std::fill_n(to, rows * columns, 0.0); return;
        case Load::transposed:
            for (int a = 0; a < rows; ++a)
                for (int b = 0; b < columns; ++b) to[b * rows + a] = from[a * columns + b];
            return;
        case Load::diagonal: {
            const int step = item.thin ? 1 : rows + 1;
            double* scale = f.scale + item.offset;
            for (int a = 0; a < rows; ++a) scale[a] = (item.raw ? scale[a] : 0.0) + std::abs(from[a * step]);
            if (item.thin) {
                std::fill_n(to, rows * rows, 0.0);
                for (int a = 0; a < rows; ++a) to[a * rows + a] = from[a];
            } else {
                std::copy_n(from, rows * rows, to);
            }
            if (item.constraint && f.shift != 0.0)
                for (int a = 0; a < rows; ++a) to[a * rows + a] -= f.shift;
            return;
        }
        default: std::copy_n(from, rows * columns, to);
    }
}

/// Most blocks are bodies, or points with friction: those sizes without a call through a table.
#ifdef __wasm__
constexpr bool common(int, int) { return false; }
#else
constexpr bool common(int n, int m) { return (n == 6 || n == 3) && (m == 6 || m == 3); }
#endif
SPOOK_INLINE void forward_row_of(int n, int m, const double* z, const double* x, double* xr) {
    if (!common(n, m)) return forward_row_table[n - 1][m - 1](z, x, xr);
    if (n == 6) m == 6 ? forward_row<6, 6>(z, x, xr) : forward_row<6, 3>(z, x, xr);
    else m == 6 ? forward_row<3, 6>(z, x, xr) : forward_row<3, 3>(z, x, xr);
}
SPOOK_INLINE void backward_row_of(int n, int m, const double* z, const double* xr, double* x) {
    if (!common(n, m)) return backward_row_table[n - 1][m - 1](z, xr, x);
    if (n == 6) m == 6 ? backward_row<6, 6>(z, xr, x) : backward_row<6, 3>(z, xr, x);
    else m == 6 ? backward_row<3, 6>(z, xr, x) : backward_row<3, 3>(z, xr, x);
}
SPOOK_INLINE void forward_pivot_of(int n, const double* u, double* x) {
    if (!common(n, n)) return forward_pivot_table[n - 1](u, x);
    n == 6 ? forward_pivot<6>(u, x) : forward_pivot<3>(u, x);
}
SPOOK_INLINE void backward_pivot_of(int n, const double* u, double* x) {
    if (!common(n, n)) return backward_pivot_table[n - 1](u, x);
    n == 6 ? backward_pivot<6>(u, x) : backward_pivot<3>(u, x);
}

template <int U> SPOOK_INLINE void forward_column(const Factor& f, const Column& column, double* x) {
    const int n = U ? U : column.size;
    const double* u = f.values + column.at;
    double* xk = x + column.offset;
    if constexpr (U) forward_pivot<U>(u, xk);
    else forward_pivot_of(n, u, xk);
    const double* z = u + n * (n + 1) / 2;
    for (std::int64_t r = column.first_row; r < column.first_row + column.row_count; ++r) {
        const int m = U ? U : f.row_size[r];
        if constexpr (U) forward_row<U, U>(z, xk, x + f.row_offset[r]);
        else forward_row_of(n, m, z, xk, x + f.row_offset[r]);
        z += n * m;
    }
}

/// U is the size of all blocks, known to the compiler, or 0.
template <int U> std::int64_t factor_columns(const Factor& f, double floor, double replacement, double* x) {
    std::int64_t replaced = 0;
    for (std::int64_t k = 0; k < f.column_count; ++k) {
        for (std::int64_t i = f.load_start[k]; i < f.load_start[k + 1]; ++i) load_block<U>(f, f.loads[i]);
        const Column& column = f.columns[k];
        const int n = U ? U : column.size;
        double* u = f.work + column.work;
        double* inverse = f.values + column.at + n * (n - 1) / 2;
        const double sign = column.is_constraint ? -1.0 : 1.0;
        const double* scale = f.scale + column.offset;
        int count;
        if constexpr (U) count = pivot<U>(u, inverse, scale, sign, floor, replacement);
        else count = pivot_table[n - 1](u, inverse, scale, sign, floor, replacement);
        if (count < 0) return -1;
        replaced += count;
        if constexpr (U) pack<U>(u, f.values + column.at);
        else pack_table[n - 1](u, f.values + column.at);
        double* z = inverse + n;
        double* y = u + n * n;
        const std::uint8_t* sizes = f.row_size + column.first_row;
        for (int r = 0; r < column.row_count; ++r) {
            const int m = U ? U : sizes[r];
            if constexpr (U) divide<U, U>(u, inverse, z, y);
            else divide_table[n - 1][m - 1](u, inverse, z, y);
            z += n * m;
            y += n * m;
        }
        const std::int64_t* target = f.targets + column.first_target;
        const std::int32_t* offsets = f.row_offset + column.first_row;
        const double* zr = inverse + n;
        y = u + n * n;
        for (int r = 0; r < column.row_count; ++r) {
            const int m = U ? U : sizes[r];
            double* goal = f.work + *target++;
            if constexpr (U) update_diagonal<U, U>(y, zr, goal, f.scale + offsets[r], !column.is_constraint);
            else
                update_diagonal_table[n - 1][m - 1](y, zr, goal, f.scale + offsets[r], !column.is_constraint);
            zr += n * m;
            const double* zs = zr;
            for (int s = r + 1; s < column.row_count; ++s) {
                const int l = U ? U : sizes[s];
                goal = f.work + *target++;
                if constexpr (U) update<U, U, U>(y, zs, goal);
                else update_table[n - 1][m - 1][l - 1](y, zs, goal);
                zs += n * l;
            }
            y += n * m;
        }
        if (x) forward_column<U>(f, column, x);
    }
    return replaced;
}

template <int U> void forward_columns(const Factor& f, double* x) {
    for (std::int64_t k = 0; k < f.column_count; ++k) forward_column<U>(f, f.columns[k], x);
}

template <int U> void backward_columns(const Factor& f, double* x) {
    for (std::int64_t k = f.column_count - 1; k >= 0; --k) {
        const Column& column = f.columns[k];
        const int n = U ? U : column.size;
        const double* u = f.values + column.at;
        double* xk = x + column.offset;
        const double* inverse = u + n * (n - 1) / 2;
        for (int i = 0; i < n; ++i) xk[i] *= inverse[i];
        const double* z = inverse + n;
        for (std::int64_t r = column.first_row; r < column.first_row + column.row_count; ++r) {
            const int m = U ? U : f.row_size[r];
            if constexpr (U) backward_row<U, U>(z, x + f.row_offset[r], xk);
            else backward_row_of(n, m, z, x + f.row_offset[r], xk);
            z += n * m;
        }
        if constexpr (U) backward_pivot<U>(u, xk);
        else backward_pivot_of(n, u, xk);
    }
}

std::int64_t factor_all(const Factor& f, int uniform_size, double floor, double* x) {
    const double replacement = std::sqrt(floor);
    switch (uniform_size) {
        case 6: return factor_columns<6>(f, floor, replacement, x);
        case 3: return factor_columns<3>(f, floor, replacement, x);
        default: return factor_columns<0>(f, floor, replacement, x);
    }
}

void forward_all(const Factor& f, int uniform_size, double* x) {
    switch (uniform_size) {
        case 6: return forward_columns<6>(f, x);
        case 3: return forward_columns<3>(f, x);
        default: return forward_columns<0>(f, x);
    }
}

void backward_all(const Factor& f, int uniform_size, double* x) {
    switch (uniform_size) {
        case 6: return backward_columns<6>(f, x);
        case 3: return backward_columns<3>(f, x);
        default: return backward_columns<0>(f, x);
    }
}

void subtract_product(int rows, int columns, const double* b, const double* x2, double* y) {
    backward_row_of(rows, columns, b, x2, y);
}

void subtract_coupling(int rows, int columns, const double* b, const double* x1, const double* x2, double* y,
                       double* z) {
    backward_row_of(rows, columns, b, x2, y);
    forward_row_of(rows, columns, b, x1, z);
}

}  // namespace

constexpr Kernels table = {factor_all, forward_all, backward_all, subtract_product, subtract_coupling};

}  // namespace spook::kernel::SPOOK_ISA

// Six numbers in registers, as three pairs: every machine has pairs, and they round as single numbers do.
#pragma once

namespace spook {

struct Six {
    typedef double Pair __attribute__((vector_size(16), aligned(8), may_alias));
    Pair a, b, c;

    static Six zero() noexcept { return {Pair{}, Pair{}, Pair{}}; }
    static Six load(const double* p) noexcept { return {at(p), at(p + 2), at(p + 4)}; }
    void store(double* p) const noexcept {
        *reinterpret_cast<Pair*>(p) = a;
        *reinterpret_cast<Pair*>(p + 2) = b;
        *reinterpret_cast<Pair*>(p + 4) = c;
    }
    void add(double s, const Six& x) noexcept { a += s * x.a, b += s * x.b, c += s * x.c; }
    void subtract(double s, const Six& x) noexcept { a -= s * x.a, b -= s * x.b, c -= s * x.c; }
    void subtract(const Six& x) noexcept { a -= x.a, b -= x.b, c -= x.c; }
    void multiply(const Six& x) noexcept { a *= x.a, b *= x.b, c *= x.c; }
    void scale(double s) noexcept { a *= s, b *= s, c *= s; }
    double dot(const Six& x) const noexcept {
        const Pair sum = products(x);
        return sum[0] + sum[1];
    }
    /// The products with x and with y of two rows, as one pair.
    static Pair dots(const Six& row, const Six& x, const Six& next_row, const Six& y) noexcept {
        const Pair one = row.products(x), two = next_row.products(y);
        return Pair{one[0], two[0]} + Pair{one[1], two[1]};
    }

private:
    static Pair at(const double* p) noexcept { return *reinterpret_cast<const Pair*>(p); }
    Pair products(const Six& x) const noexcept { return a * x.a + b * x.b + c * x.c; }
};

/// y ← A x of a row-major 6×6 block.
inline Six image(const double* block, const Six& x) noexcept {
    const Six r0 = Six::load(block), r1 = Six::load(block + 6), r2 = Six::load(block + 12);
    const Six r3 = Six::load(block + 18), r4 = Six::load(block + 24), r5 = Six::load(block + 30);
    return {Six::dots(r0, x, r1, x), Six::dots(r2, x, r3, x), Six::dots(r4, x, r5, x)};
}

}  // namespace spook

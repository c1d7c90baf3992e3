// Vectors of numbers as wide as the machine has them, and six numbers in them. Included within a namespace per
// instruction set, where SPOOK_FOURS says whether vectors of four are at hand: elementwise operations and sums in the
// order of linear/six.hpp, so all round alike.

#include "linear/fours.inl"

#ifdef SPOOK_FOURS
struct Six {
    typedef ::spook::Six::Pair Pair;
    Four a;
    Pair b;

#define SPOOK_SIX_INLINE inline __attribute__((always_inline))
    static SPOOK_SIX_INLINE Six zero() noexcept { return {Four{}, Pair{}}; }
    static SPOOK_SIX_INLINE Six load(const double* p) noexcept {
        return {*reinterpret_cast<const FourInMemory*>(p), *reinterpret_cast<const Pair*>(p + 4)};
    }
    SPOOK_SIX_INLINE void store(double* p) const noexcept {
        *reinterpret_cast<FourInMemory*>(p) = a;
        *reinterpret_cast<Pair*>(p + 4) = b;
    }
    SPOOK_SIX_INLINE void add(double s, const Six& x) noexcept { a += s * x.a, b += s * x.b; }
    SPOOK_SIX_INLINE void subtract(double s, const Six& x) noexcept { a -= s * x.a, b -= s * x.b; }
    SPOOK_SIX_INLINE void subtract(const Six& x) noexcept { a -= x.a, b -= x.b; }
    SPOOK_SIX_INLINE void multiply(const Six& x) noexcept { a *= x.a, b *= x.b; }
    SPOOK_SIX_INLINE void scale(double s) noexcept { a *= s, b *= s; }
    SPOOK_SIX_INLINE double dot(const Six& x) const noexcept {
        const Pair sum = products(x);
        return sum[0] + sum[1];
    }
    static SPOOK_SIX_INLINE Pair dots(const Six& row, const Six& x, const Six& next_row,
                                      const Six& y) noexcept {
        const Pair one = row.products(x), two = next_row.products(y);
        return Pair{one[0], two[0]} + Pair{one[1], two[1]};
    }

    SPOOK_SIX_INLINE Pair products(const Six& x) const noexcept {
        const Four p = a * x.a;
        return Pair{p[0], p[1]} + Pair{p[2], p[3]} + b * x.b;
    }
};

/// y ← A x of a row-major 6×6 block.
SPOOK_SIX_INLINE Six image(const double* block, const Six& x) noexcept {
    const Six r0 = Six::load(block), r1 = Six::load(block + 6), r2 = Six::load(block + 12);
    const Six r3 = Six::load(block + 18), r4 = Six::load(block + 24), r5 = Six::load(block + 30);
    const Six::Pair one = Six::dots(r0, x, r1, x), two = Six::dots(r2, x, r3, x);
    return {Four{one[0], one[1], two[0], two[1]}, Six::dots(r4, x, r5, x)};
}
#undef SPOOK_SIX_INLINE
#else
using ::spook::image;
using ::spook::Six;
#endif

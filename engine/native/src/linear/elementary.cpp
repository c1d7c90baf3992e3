#include "linear/elementary.hpp"

#include <bit>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

namespace spook {
namespace {

/// A number of twice the digits: high + low, |low| at most half an ULP of high.
struct Twin {
    double high, low;
};

constexpr Twin half_pi{0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};

/// Dekker's error-free sum and product.
constexpr Twin exact_sum(double a, double b) noexcept {
    const double sum = a + b, part = sum - a;
    return {sum, (a - (sum - part)) + (b - part)};
}
constexpr Twin exact_product(double a, double b) noexcept {
    constexpr double splitter = 134217729.0;  // 2²⁷ + 1
    const double ca = splitter * a, cb = splitter * b;
    const double a1 = ca - (ca - a), a2 = a - a1, b1 = cb - (cb - b), b2 = b - b1, product = a * b;
    return {product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2};
}
constexpr Twin sum(Twin a, Twin b) noexcept {
    const Twin high = exact_sum(a.high, b.high);
    return exact_sum(high.high, high.low + (a.low + b.low));
}

constexpr double factorial(int n) noexcept { return n < 2 ? 1.0 : n * factorial(n - 1); }

/// 1/n!, divided when this is compiled.
template <int N> constexpr double over_factorial = 1.0 / factorial(N);

/// The terms n, n − 4 … of a series, innermost first.
template <int N> constexpr double sine_terms(double z, double p) noexcept {
    p = z * (z * p + over_factorial<N>)-over_factorial<N - 2>;
    if constexpr (N > 5) p = sine_terms<N - 4>(z, p);
    return p;
}
template <int N> constexpr double cosine_terms(double z, double q) noexcept {
    q = over_factorial<N - 2> - z * (over_factorial<N> - z * q);
    if constexpr (N > 6) q = cosine_terms<N - 4>(z, q);
    return q;
}

/// Taylor series on |r| <= pi/4; the first term left out is below 1e-19 of the value.
SineCosine near_zero(Twin r) noexcept {
    const double x = r.high, z = x * x;
    const double p = sine_terms<17>(z, 0.0), q = cosine_terms<18>(z, 0.0);
    const double sine = x + (x * z * p + r.low);
    const double half = 0.5 * z,
                 rough = 1.0 - half;  // the cosine's largest error is that of z: carry it along
    const double lost = ((1.0 - rough) - half) - 0.5 * exact_product(x, x).low;
    return {sine, rough + (lost + (z * z * q - x * r.low))};
}

/// The bits of 2/pi, 32 in a word.
constexpr std::uint32_t two_over_pi[] = {
    0xa2f9836e, 0x4e441529, 0xfc2757d1, 0xf534ddc0, 0xdb629599, 0x3c439041, 0xfe5163ab, 0xdebbc561,
    0xb7246e3a, 0x424dd2e0, 0x06492eea, 0x09d1921c, 0xfe1deb1c, 0xb129a73e, 0xe88235f5, 0x2ebb4484,
    0xe99c7026, 0xb45f7e41, 0x3991d639, 0x835339f4, 0x9c845f8b, 0xbdf9283b, 0x1ff897ff, 0xde05980f,
    0xef2f118b, 0x5a0a6d1f, 0x6d367ecf, 0x27cb09b7, 0x4f463f66, 0x9e5fea2d, 0x7527bac7, 0xebe5f17b,
    0x3d0739f7, 0x8a5292ea, 0x6bfb5fb1, 0x1f8d5d08, 0x56033046};

struct Reduced {
    int quarters;  // modulo 4
    Twin rest;     // |rest| <= pi/4
};

/// Payne and Hanek: x = m 2^e with a whole m; of m · (2/pi) 2^e only the bits from 2 down to 2^-190 are formed.
/// No double comes closer to a multiple of pi/2 than 2^-62, so enough of them remain.
Reduced reduce(double x) noexcept {
    constexpr int words = 7, limbs = words + 2;
    const auto bits = std::bit_cast<std::uint64_t>(x);
    const int e = static_cast<int>(bits >> 52 & 0x7ff) - 1075;
    const std::uint64_t m = (bits & 0xfffffffffffff) | 0x10000000000000;
    const int first = e >= 2 ? (e - 2) / 32 : 0;  // words before it give whole turns
    std::uint32_t product[limbs] = {};            // least significant limb first
    for (int part = 0; part < 2; ++part) {
        const std::uint64_t factor = m >> 32 * part & 0xffffffff;
        std::uint64_t carry = 0;
        for (int i = 0; i < words; ++i) {
            carry += factor * two_over_pi[first + words - 1 - i] + product[i + part];
            product[i + part] = static_cast<std::uint32_t>(carry);
            carry >>= 32;
        }
        product[words + part] = static_cast<std::uint32_t>(carry);
    }
    // The binary point stands below bit `point`; shift so that two whole bits remain on top.
    const int point = 32 * (first + words) - e, shift = 32 * limbs - 2 - point;
    std::uint32_t top[limbs + 1] = {};
    for (int i = limbs - 1; i >= 0; --i) {
        const int from = i - shift / 32;
        const std::uint64_t high = from >= 0 ? product[from] : 0, low = from >= 1 ? product[from - 1] : 0;
        top[i] = static_cast<std::uint32_t>((high << 32 | low) << shift % 32 >> 32);
    }
    int quarters = static_cast<int>(top[limbs - 1] >> 30);
    top[limbs - 1] &= 0x3fffffff;
    double sign = 1.0;
    if (top[limbs - 1] >> 29) {  // more than half of a quarter: count down from the next
        quarters += 1;
        sign = -1.0;
        std::uint64_t carry = 1;
        for (int i = 0; i < limbs; ++i) {
            carry += static_cast<std::uint32_t>(~top[i]);
            top[i] = static_cast<std::uint32_t>(carry);
            carry >>= 32;
        }
        top[limbs - 1] &= 0x3fffffff;
    }
    Twin part{0.0, 0.0};
    double unit = 0x1p-30;  // of the top limb, whose two upper bits were the quarters
    for (int i = limbs - 1; i >= 0; --i, unit *= 0x1p-32) {
        const Twin next = exact_sum(part.high, unit * top[i]);
        part = {next.high, part.low + next.low};
    }
    const Twin scaled = exact_product(part.high, half_pi.high);
    const Twin rest =
        exact_sum(scaled.high, scaled.low + (part.high * half_pi.low + part.low * half_pi.high));
    return {quarters & 3, {sign * rest.high, sign * rest.low}};
}

/// Cody and Waite, where so few quarters that their products with a third of pi/2's digits are exact: the same numbers.
Reduced reduce_near(double x) noexcept {
    constexpr double thirds[] = {0x1.921fb544p+0, 0x1.0b4611a6p-34, 0x1.3198a2ep-69},
                     rest = 0x1.b839a252049c1p-104;
    double k = (x * (2.0 / std::numbers::pi) + 0x1.8p52) - 0x1.8p52;
    for (;;) {
        const Twin high = exact_sum(x - k * thirds[0], -k * thirds[1]),
                   low = exact_sum(high.high, -k * thirds[2]);
        const Twin found = exact_sum(low.high, (high.low + low.low) - k * rest);
        const double beyond = std::abs(found.high) - 0.5 * half_pi.high,
                     below = std::copysign(1.0, found.high) * found.low - 0.5 * half_pi.low;
        if (beyond < 0.0 || (beyond == 0.0 && below <= 0.0)) return {static_cast<int>(k) & 3, found};
        k += std::copysign(1.0, found.high);
    }
}

/// atan(k/16)
constexpr Twin arc[] = {{0.0, 0.0},
                        {0x1.ff55bb72cfdeap-5, -0x1.c934d86d23f1dp-60},
                        {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
                        {0x1.7b97b4bce5b02p-3, 0x1.347b0b4f881cap-58},
                        {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
                        {0x1.362773707ebccp-2, -0x1.963a544b672d8p-57},
                        {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
                        {0x1.a64eec3cc23fdp-2, -0x1.24dec1b50b7ffp-56},
                        {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
                        {0x1.0657e94db30d0p-1, -0x1.d5b495f6349e6p-56},
                        {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
                        {0x1.345f01cce37bbp-1, 0x1.1021137c71102p-55},
                        {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
                        {0x1.5d58987169b18p-1, 0x1.0028e4bc5e7cap-57},
                        {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
                        {0x1.819d0b7158a4dp-1, -0x1.bf76229d3b917p-56},
                        {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}};

/// atan(y/x) for 0 <= y <= x, x in [1, 2): atan(c) + atan((y − c x)/(x + c y)) with the nearest c = k/16.
Twin first_octant(double y, double x) noexcept {
    const int k = static_cast<int>(16.0 * y / x + 0.5);
    const double c = k / 16.0;
    const Twin cx = exact_product(c, x), cy = exact_product(c, y);
    const Twin above = sum({y, 0.0}, {-cx.high, -cx.low}), below = sum({x, 0.0}, cy);
    const double t = above.high / below.high;
    const Twin back = exact_product(t, below.high);
    const double low = ((above.high - back.high - back.low) + above.low - t * below.low) / below.high;
    const double z = t * t;
    double p = 0.0;
    for (int n = 13; n >= 3; n -= 2) p = z * p + (n % 4 == 1 ? 1.0 : -1.0) / n;
    return sum(arc[k], exact_sum(t, low + t * z * p));
}

}  // namespace

SineCosine sine_cosine_beyond(double angle) noexcept {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    const double size = std::abs(angle);
    if (!(size <= std::numeric_limits<double>::max())) return {none, none};
    if (size <= 0.25 * std::numbers::pi) return near_zero({angle, 0.0});
    const Reduced reduced = size < 0x1p19 ? reduce_near(size) : reduce(size);
    const SineCosine r = near_zero(reduced.rest);
    const bool swapped = reduced.quarters & 1;
    const double sine = swapped ? r.cosine : r.sine, cosine = swapped ? r.sine : r.cosine;
    const bool lower = reduced.quarters & 2, left = (reduced.quarters + 1) & 2;
    return {lower != (angle < 0.0) ? -sine : sine, left ? -cosine : cosine};
}

double arc_tangent(double y, double x) noexcept {
    if (std::isnan(x) || std::isnan(y)) return std::numeric_limits<double>::quiet_NaN();
    double high = std::abs(x), low = std::abs(y);
    if (std::isinf(high) || std::isinf(low)) {  // the same directions, of lengths that divide
        high = std::isinf(high) ? 1.0 : 0.0;
        low = std::isinf(low) ? 1.0 : 0.0;
    }
    const bool steep = low > high;
    if (steep) std::swap(low, high);
    Twin angle{0.0, 0.0};
    if (low > 0.0 && !(steep || std::signbit(x)) && low < 0x1p-30 * high) {
        angle.high = low / high;  // t − t³/3, and a quotient below the normal numbers is rounded once
    } else if (low > 0.0) {
        int exponent = 0;
        std::frexp(high, &exponent);
        angle = first_octant(std::ldexp(low, 1 - exponent), std::ldexp(high, 1 - exponent));
    }
    if (steep) angle = sum(half_pi, {-angle.high, -angle.low});
    if (std::signbit(x)) angle = sum({2.0 * half_pi.high, 2.0 * half_pi.low}, {-angle.high, -angle.low});
    return std::copysign(angle.high + angle.low, y);
}

double hyperbolic_tangent(double x) noexcept {
    double y = std::abs(x);
    if (!(y < 20.0)) return std::isnan(x) ? x : std::copysign(1.0, x);  // 1 − 2e⁻⁴⁰
    int halvings = 0;
    while (y > 0.25) y *= 0.5, ++halvings;
    double below = 13.0;  // Lambert's fraction, y/(1 + y²/(3 + y²/(5 + …
    for (int odd = 11; odd > 0; odd -= 2) below = odd + y * y / below;
    double t = y / below;
    for (; halvings > 0; --halvings) t = 2.0 * t / (1.0 + t * t);
    return std::copysign(t, x);
}

}  // namespace spook

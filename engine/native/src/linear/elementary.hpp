// Sine, cosine, arc tangent and hyperbolic tangent from additions, multiplications and divisions alone. C libraries differ in the
// last bit; these give the same bits wherever IEEE 754 holds. What else the engine takes from the C library
// (sqrt, abs, round) is exact by definition.
#pragma once

#include <cmath>

namespace spook {

struct SineCosine {
    double sine, cosine;
};

SineCosine sine_cosine_beyond(double angle) noexcept;  // of |angle| > 1/4

/// Of any finite angle [rad], each within 0.9 ULP; NaN for what is not finite. Up to 1/4, as the turns of a step are, by
/// Taylor's series here: the first terms left out are below 1e-19.
inline SineCosine sine_cosine(double angle) noexcept {
    const double x = angle, z = x * x, zz = z * z;
    if (!(std::fabs(x) <= 0.25)) return sine_cosine_beyond(x);
    if (std::fabs(x) < 0x1p-30) return {x, 1.0};
    const double sine = (-1.0 / 6 + z * (1.0 / 120)) + zz * ((-1.0 / 5040 + z * (1.0 / 362880)) +
                                                             zz * (-1.0 / 39916800 + z * (1.0 / 6227020800)));
    const double cosine =
        (1.0 / 24 - z * (1.0 / 720)) + zz * ((1.0 / 40320 - z * (1.0 / 3628800)) + zz * (1.0 / 479001600));
    return {x + x * (z * sine), 1.0 - (0.5 * z - zz * cosine)};
}

/// The angle of (x, y) from the x-axis, −pi … pi [rad], within 0.6 ULP. Signed zeros, infinities and NaN as in IEC 60559.
double arc_tangent(double y, double x) noexcept;

/// Of any number, within 4 ULP; NaN for NaN.
double hyperbolic_tangent(double x) noexcept;

/// Length of (a, b), relative error at most 2^-52. Squares beyond 1e308 are infinite, below 1e-308 lose digits.
inline double length(double a, double b) noexcept { return std::sqrt(a * a + b * b); }

}  // namespace spook

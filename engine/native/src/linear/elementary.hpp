// Sine, cosine, arc tangent and hyperbolic tangent from additions, multiplications and divisions alone. C libraries differ in the
// last bit; these give the same bits wherever IEEE 754 holds. What else the engine takes from the C library
// (sqrt, abs, round) is exact by definition.
#pragma once

#include <cmath>

namespace spook {

struct SineCosine {
    double sine, cosine;
};

/// Of any finite angle [rad], each within 0.9 ULP; NaN for what is not finite.
SineCosine sine_cosine(double angle) noexcept;

/// The angle of (x, y) from the x-axis, −pi … pi [rad], within 0.6 ULP. Signed zeros, infinities and NaN as in IEC 60559.
double arc_tangent(double y, double x) noexcept;

/// Of any number, within 4 ULP; NaN for NaN.
double hyperbolic_tangent(double x) noexcept;

/// Length of (a, b), relative error at most 2^-52. Squares beyond 1e308 are infinite, below 1e-308 lose digits.
inline double length(double a, double b) noexcept { return std::sqrt(a * a + b * b); }

}  // namespace spook

// Projections that end a complementarity, smoothed: onto the positive numbers, and onto the cone y₀ >= |y_t|.
#pragma once

#include <algorithm>
#include <cmath>

#include "linear/elementary.hpp"

namespace spook {

/// max(0, λ), smoothed by b: its derivative, what that lacks to one, and the derivative by b.
struct Positive {
    double value, slope, rest, bend;
};
inline Positive positive(double lambda, double b) noexcept {
    const double root = std::sqrt(lambda * lambda + 4.0 * b * b);
    if (root == 0.0) return {0.0, 0.5, 0.5, 1.0};
    const double large = 0.5 * (std::abs(lambda) + root), small = b * b / large, over = 1.0 / root;
    const double more = large * over, less = small * over, bend = 2.0 * b * over;
    return lambda > 0.0 ? Positive{large, more, less, bend} : Positive{small, less, more, bend};
}

/// Its value alone.
inline double positive_part(double lambda, double b) noexcept {
    const double large = 0.5 * (std::abs(lambda) + std::sqrt(lambda * lambda + 4.0 * b * b));
    return lambda > 0.0 ? large : large > 0.0 ? b * b / large : 0.0;
}

/// P_b on L and its derivative by eigenvalues: along (1, −t), (1, t) and across.
struct Spectrum {
    double value[3];  // of P_b, in the frame 0, t, across
    double slope[3], rest[3];
    double bend[2];  // of value, by b
    double t1, t2;
};
inline Spectrum project(double a0, double a1, double a2, double b) noexcept {
    const double reach = length(a1, a2);
    Spectrum s;
    s.t1 = reach > 0.0 ? a1 / reach : 1.0;
    s.t2 = reach > 0.0 ? a2 / reach : 0.0;
    const Positive one = positive(a0 - reach, b), two = positive(a0 + reach, b);
    s.value[0] = 0.5 * (one.value + two.value);
    s.value[1] = 0.5 * (two.value - one.value);
    s.bend[0] = 0.5 * (one.bend + two.bend);
    s.bend[1] = 0.5 * (two.bend - one.bend);
    s.slope[0] = one.slope, s.rest[0] = one.rest;
    s.slope[1] = two.slope, s.rest[1] = two.rest;
    if (reach > 1e-8 * std::abs(a0) && reach > 1e-8 * b) {
        s.slope[2] = std::clamp((two.value - one.value) / (2.0 * reach), 0.0, 1.0);
        s.rest[2] = 1.0 - s.slope[2];
        if (s.rest[2] < 0.25) {  // without cancellation: max(0, λ) − max(0, −λ) = λ
            const double un_one = positive_part(reach - a0, b), un_two = positive_part(-a0 - reach, b);
            s.rest[2] = std::max(0.0, (un_one - un_two) / (2.0 * reach));
        }
    } else {
        s.slope[2] = 0.5 * (one.slope + two.slope);
        s.rest[2] = 0.5 * (one.rest + two.rest);
    }
    return s;
}

}  // namespace spook

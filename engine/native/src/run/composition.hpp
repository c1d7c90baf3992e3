// Symmetric compositions: a symmetric second-order step Φ done with h γ_1, …, h γ_s is of higher order.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

#include "run/named_enum.hpp"

namespace spook {

SPOOK_NAMED_ENUM(Composition, none, order4, order6, order8)

/// The order of accuracy of a step that is composed so.
inline int order_of(Composition composition) noexcept { return 2 + 2 * static_cast<int>(composition); }

/// Stage lengths γ of an order, in time steps; they sum to 1 and read the same backwards.
/// Order 4: Suzuki, Phys. Lett. A 146 (1990) 319. Orders 6 and 8: Kahan and Li, Math. Comp. 66 (1997) 1089,
/// nine and seventeen stages; their largest |γ| is about half that of the schemes with fewest stages.
inline std::span<const double> composition_stages(int order) {
    static constexpr double FOUR[] = {0.41449077179437573714, 0.41449077179437573714, -0.65796308717750294857,
                                      0.41449077179437573714, 0.41449077179437573714};
    static constexpr double SIX[] = {0.39216144400731413928,  0.33259913678935943860, -0.70624617255763935981,
                                     0.08221359629355080023,  0.79854399093482996340, 0.08221359629355080023,
                                     -0.70624617255763935981, 0.33259913678935943860, 0.39216144400731413928};
    static constexpr double EIGHT[] = {
        0.13020248308889008088,  0.56116298177510838456, -0.38947496264484728641, 0.15884190655515560090,
        -0.39590389413323757734, 0.18453964097831570709, 0.25837438768632204729,  0.29501172360931029887,
        -0.60550853383003451170, 0.29501172360931029887, 0.25837438768632204729,  0.18453964097831570709,
        -0.39590389413323757734, 0.15884190655515560090, -0.38947496264484728641, 0.56116298177510838456,
        0.13020248308889008088};
    switch (order) {
        case 4: return FOUR;
        case 6: return SIX;
        case 8: return EIGHT;
        default: throw std::invalid_argument("there is no composition of this order; there are 4, 6 and 8");
    }
}

/// Of τ² times the square of the rate of tension: a stage τ is unstable above 4.
inline constexpr double max_tension_turn = 2.0;
inline constexpr int max_tension_parts = 1024;  // of a step

/// The longest stage of an order, in time steps.
inline double longest_stage(int order) {
    double longest = 0.0;
    for (const double stage : composition_stages(order)) longest = std::max(longest, std::abs(stage));
    return longest;
}

/// Into how many parts, halves of halves, a step is to be taken that is in `parts` so far: `turned` is of its longest stage as a whole.
/// A light body under much tension is turned back at many times the rate of its swing.
inline int parts_for_tension(double turned, int parts) noexcept {
    while (turned > max_tension_turn * parts * parts && parts < max_tension_parts) parts *= 2;
    return parts;
}

}  // namespace spook

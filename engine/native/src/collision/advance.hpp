// How long a direction that turns keeps two moving shapes apart.
#pragma once

#include "collision/shape_cast.hpp"

namespace spook {

/// A time [s], at most `left`, until which the shapes surely do not overlap by more than `slop` [m], from where they
/// are at `time`, when `normal` (unit, from second to first) parts them. Zero if nothing can be promised.
///
/// A direction fixed in either body keeps its sides where they are, one that turns with two crossing edges keeps both;
/// what can use the gap up are corners then, each at its own height, speed and acceleration, which are known, and with
/// changes of those, which are bounded. What turns about an edge it stands on comes no nearer, and that is seen.
double separated_for(const Mover& first, const Mover& second, Vec3 normal, double time, double left,
                     double slop) noexcept;

}  // namespace spook

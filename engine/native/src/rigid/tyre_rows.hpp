// A tyre: a disc that carries its load on a flat road with a spring, and is held along and across as far as it slips.
//
//   load     0 <= N ⟂ the SPOOK row of the disc's lowest point with compliance 1/stiffness
//   along    F_x = −C_x s_x/V     s the speed of the disc's lowest point over the road, V the wheel's speed along
//   across   F_y = −C_y s_y/V     its heading: s_x/V is the slip, s_y/V the (tangent of the) slip angle
//   slides   (F_x/µ_x)² + (F_y/µ_y)² <= N²; beyond, the forces go on in the same ratio F_x/µ_x : F_y/µ_y
//
// As velocity rows: s + V/(C h) λ = 0 with λ = h F, implicit in s, so that a slow or light wheel is not stiff. Sliding, both rows
// are softer by one factor, for which (λ_x/µ_x)² + (λ_y/µ_y)² = (h N)²: the ratio of the forces is then that of the slip. Below a
// millimetre a second V is that, and the wheel creeps instead of rolling.
#pragma once

#include "rigid/joint_rows.hpp"

namespace spook {

/// How a wheel stands on its road: axes of the footprint, its height over the road (negative: pressed in) and how far it is
/// from both centres.
struct Stand {
    Vec3 forward, sideways, normal;
    double height = 0.0;
    Vec3 first_reach, second_reach;
};

/// A wheel that lies flat has no heading, and its footprint no forward and sideways (zero).
Stand stand(const JointConstants& joint, double radius, const BodyState& road,
            const BodyState& wheel) noexcept;

}  // namespace spook

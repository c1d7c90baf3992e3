// Rotation of a free body over one step: the variational quaternion step, which keeps angular momentum exactly
// and energy bounded (order 2).
#pragma once

#include "linear/vec.hpp"

namespace spook {

/// Finds the body-frame rate w of c I w + (h/2) w × I w = p with c = √(1 − h²|w|²/4), by Newton from I⁻¹ p;
/// h w/2 and c are the vector and scalar part of the unit quaternion of the step. `inertia` holds the principal
/// moments, p is the angular momentum in body axes. False when there is no such w with h|w| < 2: the body turns
/// too fast for the time step. With `near`, w holds a guess to start from.
bool rotation_rate(Vec3 inertia, double time_step, Vec3 p, Vec3& w, bool near = false) noexcept;

/// R − 1 of a unit quaternion (w, e): 2 w [e] + 2 [e]², with the relative accuracy of e however small it is.
inline Mat3 rotation_less_one(Quat q) noexcept {
    const double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
    return {{-2 * (yy + zz), 2 * (q.x * q.y - q.w * q.z), 2 * (q.x * q.z + q.w * q.y),
             2 * (q.x * q.y + q.w * q.z), -2 * (xx + zz), 2 * (q.y * q.z - q.w * q.x),
             2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x), -2 * (xx + yy)}};
}

/// Back to unit length; one Newton step is exact to rounding for a drift of rounding.
inline Quat unit(Quat q) noexcept {
    const double s = 1.5 - 0.5 * (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return {s * q.w, s * q.x, s * q.y, s * q.z};
}

}  // namespace spook

// The turn of a free body over a step: that of Euler's equations, to rounding, whatever it spins.
#pragma once

#include "linear/vec.hpp"

namespace spook {

/// A body that turns freely about its centre of mass, or about a pivot.
class FreeRotor {
public:
    FreeRotor() = default;
    /// Principal moments, positive [kg m²].
    explicit FreeRotor(Vec3 moments) noexcept;

    /// The turn over a time h, which may be negative, and `p`, the angular momentum, in the principal axes where it begins. Momentum
    /// and energy are kept to rounding. Where a body tumbles by more than a thousand radians in h, its mean turn.
    Quat turn(double h, Vec3 p) const noexcept;

private:
    enum class Kind { sphere, symmetric, triaxial };

    Quat mean_turn(double h, Vec3 p) const noexcept;
    Quat triaxial_turn(double h, Vec3 p) const noexcept;
    Quat short_turn(double h, double angle, Vec3 p) const noexcept;

    Kind kind_ = Kind::sphere;
    int first_ = 0;       // taken as x: the z of a symmetric body, else so that y has the middle moment
    double unit_ = 1.0;   // of momenta and moments: a power of two
    Vec3 over_{1, 1, 1};  // 1/moment, in that order and unit
    double wide_ = 0.0, narrow_ = 0.0;  // over_: x − z, y − z
};

/// The turn of a constant angular velocity over h.
Quat turn_of(double h, Vec3 angular_velocity) noexcept;

/// R − 1 of a unit quaternion (w, e): 2 w [e] + 2 [e]², with the relative accuracy of e however small it is.
inline Mat3 rotation_less_one(Quat q) noexcept {
    const double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
    return {{-2 * (yy + zz), 2 * (q.x * q.y - q.w * q.z), 2 * (q.x * q.z + q.w * q.y),
             2 * (q.x * q.y + q.w * q.z), -2 * (xx + zz), 2 * (q.y * q.z - q.w * q.x),
             2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x), -2 * (xx + yy)}};
}

/// v turned by R, given R − 1.
constexpr Vec3 carried(const Mat3& turn_less_one, Vec3 v) noexcept { return v + turn_less_one * v; }
constexpr Vec3 vector_of(Quat q) noexcept { return {q.x, q.y, q.z}; }
/// Entry by entry.
constexpr Vec3 times(Vec3 a, Vec3 b) noexcept { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

/// Back to unit length; one Newton step is exact to rounding for a drift of rounding.
inline Quat unit(Quat q) noexcept {
    const double s = 1.5 - 0.5 * (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return {s * q.w, s * q.x, s * q.y, s * q.z};
}

}  // namespace spook

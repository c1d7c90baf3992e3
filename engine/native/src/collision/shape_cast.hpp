// When two moving shapes first touch.
#pragma once

#include "collision/shape.hpp"

namespace spook {

/// A lower bound of the distance of two shapes along a fixed direction: no point of the first lies nearer to the
/// second along `normal` (unit, from second to first) than `gap` [m]. Positive exactly if they are apart; minus
/// the least overlap among the directions tried if not. What some direction parts by more than `far` may be farther apart.
struct Separation {
    double gap = 0.0;
    Vec3 normal;
};
Separation separation(const Primitive& first, const Pose& at_first, const Primitive& second,
                      const Pose& at_second, double far = 1e300) noexcept;

/// A shape on a body that moves on steadily from `body`: velocity [m/s] of its centre, spin [rad/s], world axes.
struct Mover {
    const Primitive& shape;
    const Pose& part;  // of the shape, in body axes
    const Pose& body;
    Vec3 velocity, spin;

    Pose body_at(double time) const noexcept;
    Pose at(double time) const noexcept { return placed(body_at(time), part); }
};

/// How far from its body's centre a body's spin can move the shape's surface, m: a ball's own turning moves nothing,
/// a capsule's only its axis.
double turning_arm(const Primitive& shape, const Pose& part) noexcept;

/// The first time [s] in 0 … duration at which the shapes overlap by more than `slop` [m], carried back to where
/// they touch; negative if there is none. Conservative advancement (Mirtich 1996): a direction that separates two
/// shapes by a gap keeps them apart until their approach along it has used the gap up. Shapes that slide along
/// each other or pass by never touch.
double time_of_impact(const Mover& first, const Mover& second, double duration, double slop) noexcept;

}  // namespace spook

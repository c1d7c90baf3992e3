// What of a convex primitive lies below a plane surface: its volume, where that is centred, and its shadow.
#pragma once

#include "collision/shape.hpp"

namespace spook {

/// Volume below the surface [m³] and its centre, world axes.
struct Submerged {
    double volume = 0.0;
    Vec3 centre;
};

/// The surface is up · x = level, `up` a unit vector. Sphere: the cap, in closed form. Box and hull: their faces clipped, each cone
/// over a point of the surface, which the lid does not add to. Capsule and cylinder: discs across their axis, each cut by the
/// surface in closed form, integrated piece by piece to rounding (16 points of Gauss a piece, between the places
/// where the surface enters or leaves). A plane displaces nothing.
Submerged submerged(const Primitive& shape, const Pose& at, Vec3 up, double level) noexcept;

/// Of the whole primitive, m³.
double volume(const Primitive& shape) noexcept;

/// The area of its shadow along a unit direction, m².
double shadow(const Primitive& shape, const Pose& at, Vec3 direction) noexcept;

}  // namespace spook

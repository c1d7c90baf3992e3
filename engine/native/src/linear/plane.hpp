// Vectors and turns of a plane that is spanned by two axes of the world: plain values.
#pragma once

#include <cmath>

#include "linear/elementary.hpp"
#include "linear/vec.hpp"

namespace spook {

struct Vec2 {
    double x = 0.0, y = 0.0;
};

constexpr Vec2 operator+(Vec2 a, Vec2 b) noexcept { return {a.x + b.x, a.y + b.y}; }
constexpr Vec2 operator-(Vec2 a, Vec2 b) noexcept { return {a.x - b.x, a.y - b.y}; }
constexpr Vec2 operator*(double s, Vec2 a) noexcept { return {s * a.x, s * a.y}; }
constexpr Vec2& operator+=(Vec2& a, Vec2 b) noexcept { return a = a + b; }
constexpr Vec2& operator-=(Vec2& a, Vec2 b) noexcept { return a = a - b; }
constexpr double dot(Vec2 a, Vec2 b) noexcept { return a.x * b.x + a.y * b.y; }
/// The component of a × b across the plane.
constexpr double cross(Vec2 a, Vec2 b) noexcept { return a.x * b.y - a.y * b.x; }
/// A quarter turn on: normal × a.
constexpr Vec2 across(Vec2 a) noexcept { return {-a.y, a.x}; }

/// Cosine and sine of half an angle: the unit quaternion of a turn in the plane.
struct HalfTurn {
    double cosine = 1.0, sine = 0.0;
};

constexpr HalfTurn operator*(HalfTurn a, HalfTurn b) noexcept {
    return {a.cosine * b.cosine - a.sine * b.sine, a.cosine * b.sine + a.sine * b.cosine};
}
constexpr HalfTurn conjugate(HalfTurn a) noexcept { return {a.cosine, -a.sine}; }
/// Back to unit length; one Newton step is exact to rounding for a drift of rounding.
constexpr HalfTurn unit(HalfTurn a) noexcept {
    const double s = 1.5 - 0.5 * (a.cosine * a.cosine + a.sine * a.sine);
    return {s * a.cosine, s * a.sine};
}

inline HalfTurn half_turn(double angle) noexcept {
    const SineCosine half = sine_cosine(0.5 * angle);
    return {half.cosine, half.sine};
}

/// The turn's matrix less one, [[fall, −sine], [sine, fall]], with the relative accuracy of a small angle.
struct TurnLessOne {
    double fall = 0.0, sine = 0.0;
};

constexpr TurnLessOne less_one(HalfTurn a) noexcept {
    return {-2.0 * a.sine * a.sine, 2.0 * a.cosine * a.sine};
}
constexpr Vec2 operator*(TurnLessOne a, Vec2 v) noexcept {
    return {a.fall * v.x - a.sine * v.y, a.sine * v.x + a.fall * v.y};
}
constexpr Vec2 carried(TurnLessOne a, Vec2 v) noexcept { return v + a * v; }

/// Which axis of the world stands on the plane; the other two span it, in cyclic order.
struct Plane3 {
    int normal = 2;
    constexpr int first() const noexcept { return (normal + 1) % 3; }
    constexpr int second() const noexcept { return (normal + 2) % 3; }
    constexpr Vec2 operator()(Vec3 v) const noexcept { return {v[first()], v[second()]}; }
    constexpr Vec3 lifted(Vec2 v) const noexcept {
        Vec3 out;
        out[first()] = v.x, out[second()] = v.y;
        return out;
    }
};

}  // namespace spook

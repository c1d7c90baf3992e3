// Where the rigid bodies are. Positions are kept as displacements from the start, and orientations as turns from
// the start: a violation of 1e-11 m is then known to sixteen digits, however far from the origin the scene lies.
#pragma once

#include <algorithm>
#include <cmath>

#include "collision/rotation.hpp"
#include "rigid/rigid_scene.hpp"

namespace spook {

/// What does not change during a run.
struct BodyConstants {
    Motion motion = Motion::dynamic;
    bool particle = false;
    double mass = 0.0;
    Vec3 inertia;  // principal
    FreeRotor rotor;
    Mat3 start_rotation;
    Vec3 start;            // position at the start
    Quat start_turn;       // orientation at the start
    Vec3 force, torque;    // constant loads
    Mat3 start_principal;  // principal axes of inertia at the start
    bool tilted = false;   // whether they are others than those of the body

    bool moves() const noexcept { return motion == Motion::dynamic; }
};

struct BodyState {
    Vec3 displacement;  // from the start
    Quat turn;          // from the start: orientation = turn · start_turn
    Vec3 velocity, angular_velocity;
    Vec3 angular_momentum;  // world axes, about the centre of mass; what a free body keeps exactly
    // Derived from the above:
    Mat3 turn_less_one;  // rotation matrix of `turn`, minus the identity
    Mat3 inertia;        // world axes
};

inline bool isotropic(Vec3 inertia) noexcept { return inertia.x == inertia.y && inertia.y == inertia.z; }

inline Vec3 position(const BodyConstants& body, const BodyState& state) noexcept {
    return body.start + state.displacement;
}
inline Quat orientation(const BodyConstants& body, const BodyState& state) noexcept {
    return state.turn * body.start_turn;
}
/// A vector that the body has turned with since the start.
constexpr Vec3 carried(const BodyState& body, Vec3 v) noexcept { return carried(body.turn_less_one, v); }
/// The turn of the second body seen from the first, in the first body's frame.
inline Quat relative_turn(const BodyState& first, const BodyState& second) noexcept {
    const Quat q = conjugate(first.turn) * second.turn;
    return q.w < 0.0 ? Quat{-q.w, -q.x, -q.y, -q.z} : q;
}
/// Body axes to world axes.
Mat3 axes(const BodyConstants& body, const BodyState& state) noexcept;
/// Principal axes of inertia to world axes.
Mat3 inertia_axes(const BodyConstants& body, const BodyState& state) noexcept;

BodyConstants constants_of(const RigidBodySpec& spec) noexcept;
BodyState start_of(const RigidBodySpec& spec, const BodyConstants& body) noexcept;

/// Angular velocity from angular momentum, and the derived matrices, at the state's orientation.
void refresh(const BodyConstants& body, BodyState& state) noexcept;

/// How much of the bend of its rows a joint follows: 0 where what it holds turns little in a step, 1 where it turns far [rad]; and of
/// the bend of its angles, 0 where it turns by a radian: then where an axle points does not follow from how it spins.
double share_of_bend(double turn) noexcept;
double share_of_angles(double turn) noexcept;
/// The same of a point, where bodies and the arms that hold it turn by so much: of a spin that turns far in a step it is not known how
/// it is itself turned, and what lies along it is led about by its arm's turn alone.
inline double share_of_point(double turn, double of_arms) noexcept {
    return std::lerp(share_of_bend(of_arms), share_of_bend(turn), share_of_angles(turn));
}
/// The larger turn of two bodies in a step h [rad].
inline double turn_in_step(double h, const BodyState& first, const BodyState& second) noexcept {
    return h * std::sqrt(std::max(dot(first.angular_velocity, first.angular_velocity),
                                  dot(second.angular_velocity, second.angular_velocity)));
}

/// The larger turn in a step h [rad] of two arms that bodies hold a point by.
inline double turn_of_arms(double h, const BodyState& first, Vec3 first_arm, const BodyState& second,
                           Vec3 second_arm) noexcept {
    const auto square = [](Vec3 spin, Vec3 arm) {
        const Vec3 way = cross(spin, arm);
        const double length = dot(arm, arm);
        return length > 0.0 ? dot(way, way) / length : 0.0;
    };
    return h * std::sqrt(std::max(square(first.angular_velocity, first_arm),
                                  square(second.angular_velocity, second_arm)));
}

/// A step back and a step on of a body that goes on as it came: its spin turns on with the body (`next`). All three begin as it is.
void look_around(const BodyConstants& body, double h, BodyState& behind, BodyState& next,
                 BodyState& ahead) noexcept;

/// Where integrate() takes a body, without the rest of what is derived from it: displacement, turn, turn_less_one.
void move(const BodyConstants& body, double h, BodyState& state) noexcept;

/// The same for a dynamic body whose inertia_axes() are at hand.
void lead(const BodyConstants& body, const Mat3& axes, double h, const BodyState& from,
          BodyState& to) noexcept;

/// Moves a body on by h with its velocities (kinematic) or its momenta (dynamic, after a solve).
void integrate(const BodyConstants& body, double h, BodyState& state) noexcept;

/// Moves a body by h times velocities that leave no trace in its momenta.
void displace(const BodyConstants& body, double h, Vec3 velocity, Vec3 angular_velocity,
              BodyState& state) noexcept;

/// I⁻¹ L in world axes at the state's orientation; of a particle zero.
Vec3 turned_by(const BodyConstants& body, const BodyState& state, Vec3 angular_momentum) noexcept;

/// Twice the kinetic energy of a body, J.
inline double twice_energy(const BodyConstants& body, const BodyState& s) noexcept {
    return body.mass * dot(s.velocity, s.velocity) +
           (body.particle ? 0.0 : dot(s.angular_momentum, s.angular_velocity));
}

}  // namespace spook

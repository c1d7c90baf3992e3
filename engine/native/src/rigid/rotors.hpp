// Inertia that goes with the free coordinate of a joint, as a geared rotor's does. Its row keeps the sum of momenta:
//
//     G v₊ + λ/I = w,    w₊ = w − λ/I,
//
// with w its speed before. The coordinate goes a little faster than G v₊ says of where the step begins, as its axis turns; that
// lead is taken from the right side as the step before had it, and w is the speed in the middle of a step, of order 2.
//
// reads: bodies, multipliers of joints. writes: the rotors' part of the states of joints.
#pragma once

#include <span>

#include "rigid/joint_set.hpp"

namespace spook {

/// Right side of a rotor's row where the bodies move so; at first it goes as they do.
double rotor_right(JointState& state, double rate) noexcept;
/// How much faster the rotor of a block goes for the impulse of the last solve.
double rotor_change(const JointSet& joints, int block) noexcept;
/// At which speed the bodies turn it.
double rotor_speed(const JointSet& joints, int block, std::span<const BodyState> bodies) noexcept;
/// How much further its coordinate goes from one place to another than the rotor in that time, after an impulse on it [m or rad].
double rotor_gap(const JointSet& joints, int block, std::span<const BodyState> from,
                 std::span<const BodyState> to, double time, double impulse) noexcept;
/// Of all rotors where the bodies move so [J].
double rotor_energy(const JointSet& joints, std::span<const BodyState> bodies) noexcept;
/// Once bodies have moved by h, before overlaps are parted.
void turn_rotor(JointSet& joints, int block, std::span<const BodyState> bodies, double h) noexcept;

}  // namespace spook

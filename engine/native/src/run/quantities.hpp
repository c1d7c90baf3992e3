// What can be read of a state between steps, by name; each pipeline says how.
#pragma once

#include <string>

#include "linear/vec.hpp"
#include "run/named_enum.hpp"
#include "run/recorder.hpp"

namespace spook {

SPOOK_NAMED_ENUM(Quantity, position, velocity, orientation, angular_velocity, kinetic_energy,
                 potential_energy, energy, momentum, angular_momentum, violation, constraint_force,
                 joint_coordinate, contact_force, contact_count, penetration, contact_points)

/// A quantity by its name.
struct QuantityRequest {
    std::string kind;
    int index = -1;  // of a body, row or joint; −1: all; of contact points, how many at most
    Vec3 point;      // centre of an angular momentum; of a body, its axes, from the centre of mass, m
    int other = -1;  // the other body of a contact force; −1: all
};

constexpr int CONTACT_NUMBERS = 10;  // of a contact point: place, normal, force, coefficient of friction

inline void put(double* out, Vec3 v) noexcept {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

/// `read(i, out)` for one index, or for all `count` of them in turn.
template <class Read> Sampler one_or_all(int index, int count, int width, Read read) {
    if (index >= 0) return {width, [=](double* out) { read(index, out); }};
    return {width * count, [=](double* out) {
                for (int i = 0; i < count; ++i) read(i, out + i * width);
            }};
}

}  // namespace spook

// What a sweep reads of contacts and bodies, and the function that solves four contacts at once.
#pragma once

#include "contacts/pivot_system.hpp"
#include "linear/vec.hpp"

namespace spook {

/// What a sweep reads of every contact: two lines of a cache, four vectors of four numbers.
struct alignas(64) SweptContact {
    int first, second;  // bodies; one behind the last for what does not move by itself
    Vec3 first_arm;
    Vec3 second_arm;
    double right;  // of the normal
    Vec3 normal;
    double own;  // of the normal, with Sig
    double impulse[3], own_inverse;
};
static_assert(sizeof(SweptContact) == 128);

/// The same of its friction, read only where some contact of a sweep has any.
struct alignas(64) SweptSlip {
    Vec3 tangent;
    double friction = 0.0;
    double coupling[2] = {0.0, 0.0};  // between normal and tangents
    double step = 1.0;                // 1/lambda_max of the tangents' part
};
static_assert(sizeof(SweptSlip) == 64);

/// What else there is, read only where some contact of a sweep has any of it.
struct alignas(64) SweptRest {
    Vec3 across;  // the second tangent; of an unstretched friction the normal × the tangent
    double right_along;
    double right_across, softness, slip_softness, normal_before;
};
static_assert(sizeof(SweptRest) == 64);

/// A body, in one line.
struct alignas(64) SweptBody {
    Vec6 velocity{};
    double inverse_mass = 0.0;  // 1/kg
    double round = 0.0;         // inverse inertia of one that turns alike about every axis, 1/(kg m²)
};
static_assert(sizeof(SweptBody) == 64);

/// The inverse of a body's inertia about world axes, 1/(kg m²), symmetric; read only where some body is not round.
struct alignas(64) SweptInertia {
    double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

    bool is_round() const noexcept { return xy == 0.0 && xz == 0.0 && yz == 0.0 && xx == yy && xx == zz; }
    Vec3 turn(Vec3 moment) const noexcept {
        return {xx * moment.x + xy * moment.y + xz * moment.z, xy * moment.x + yy * moment.y + yz * moment.z,
                xz * moment.x + yz * moment.y + zz * moment.z};
    }
};
static_assert(sizeof(SweptInertia) == 64);

/// Solves four contacts with unstretched friction on the disc, none of which shares a moving body with another, and
/// writes the largest change of a row of each, m/s. `slips` and `rests` are null where no contact of the sweep has any, and
/// `inertia` where all bodies are round.
struct SweepGroup {
    SweptContact* const* contacts;
    const SweptSlip* const* slips;
    const SweptRest* const* rests;
    SweptBody* bodies;
    const SweptInertia* inertia;
    int nobody;  // does not move, and is not written
    double* change;
};
using SweepFour = void (*)(const SweepGroup& group);

void portable_sweep_four(const SweepGroup& group);
void avx2_sweep_four(const SweepGroup& group);  // the portable one where the compiler cannot build it

/// The fastest one this machine runs: all give the same bits.
SweepFour sweep_four() noexcept;
/// For tests: from now on the portable one, or the fastest again. Not for use between threads.
void use_portable_sweeps(bool portable) noexcept;

}  // namespace spook

// What an iteration reads of contacts and bodies, and the function that solves four contacts at once.
#pragma once

#include "contacts/pivot_system.hpp"
#include "linear/vec.hpp"

namespace spook {

/// What an iteration reads of every contact: two lines of a cache, four vectors of four numbers.
struct alignas(64) PackedContact {
    int first, second;  // bodies; one behind the last for what does not move by itself
    Vec3 first_arm;
    Vec3 second_arm;
    double right;  // of the normal
    Vec3 normal;
    double diagonal;  // of C M⁻¹ Cᵀ + Sig
    double impulse[3], inverse_diagonal;
};
static_assert(sizeof(PackedContact) == 128);

/// The same of its friction, read only where some contact of an iteration has any.
struct alignas(64) PackedFriction {
    Vec3 tangent;
    double friction = 0.0;
    double coupling[2] = {0.0, 0.0};  // between normal and tangents
    double step = 1.0;                // 1/lambda_max of the tangents' part
};
static_assert(sizeof(PackedFriction) == 64);

/// What else there is, read only where some contact of an iteration has any of it.
struct alignas(64) PackedExtras {
    Vec3 across;  // the second tangent; of an isotropic friction the normal × the tangent
    double right_along;
    double right_across, softness, slip_softness, normal_before;
};
static_assert(sizeof(PackedExtras) == 64);

/// A body, in one line.
struct alignas(64) PgsBody {
    Vec6 velocity{};
    double inverse_mass = 0.0;     // 1/kg
    double inverse_inertia = 0.0;  // where the inertia is isotropic, 1/(kg m²)
};
static_assert(sizeof(PgsBody) == 64);

/// The inverse of a body's inertia about world axes, 1/(kg m²), symmetric; read only where some inertia is not isotropic.
struct alignas(64) PgsInertia {
    double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

    bool is_isotropic() const noexcept { return xy == 0.0 && xz == 0.0 && yz == 0.0 && xx == yy && xx == zz; }
    Vec3 turn(Vec3 moment) const noexcept {
        return {xx * moment.x + xy * moment.y + xz * moment.z, xy * moment.x + yy * moment.y + yz * moment.z,
                xz * moment.x + yz * moment.y + zz * moment.z};
    }
};
static_assert(sizeof(PgsInertia) == 64);

/// Solves four contacts with isotropic friction on the disc (pgs_contact.inl), none of which shares a moving body with another;
/// `change`: of a row of each, the largest, m/s. `slips` and `extras` are null where none has any, `inertia` where all are isotropic.
struct PgsGroup {
    PackedContact* const* contacts;
    const PackedFriction* const* slips;
    const PackedExtras* const* extras;
    PgsBody* bodies;
    const PgsInertia* inertia;
    int fixed_body;  // does not move, and is not written
    double* change;
};
using SolveFour = void (*)(const PgsGroup& group);

void portable_solve_four(const PgsGroup& group);
void avx2_solve_four(const PgsGroup& group);  // the portable one where the compiler cannot build it

/// The fastest one this machine runs: all give the same bits.
SolveFour solve_four() noexcept;
/// For tests: from now on the portable one, or the fastest again. Not for use between threads.
void use_portable_pgs(bool portable) noexcept;

}  // namespace spook

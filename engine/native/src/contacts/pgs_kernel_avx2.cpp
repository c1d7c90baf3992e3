// Four contacts in vectors of four. Not fused multiply-add: that would round differently.
#include "contacts/pgs_kernel.hpp"

#include <cmath>
#include <cstddef>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2")
#define SPOOK_ISA avx2
#define SPOOK_FOURS
#include "contacts/pgs_contact.inl"
#define FOURS inline __attribute__((always_inline))

namespace spook {

namespace avx2 {
namespace {

/// Rows become columns.
FOURS void transpose(Four& a, Four& b, Four& c, Four& d) {
    const Four ab = __builtin_shuffle(a, b, FourBits{0, 4, 2, 6}),
               ba = __builtin_shuffle(a, b, FourBits{1, 5, 3, 7});
    const Four cd = __builtin_shuffle(c, d, FourBits{0, 4, 2, 6}),
               dc = __builtin_shuffle(c, d, FourBits{1, 5, 3, 7});
    a = __builtin_shuffle(ab, cd, FourBits{0, 1, 4, 5});
    b = __builtin_shuffle(ba, dc, FourBits{0, 1, 4, 5});
    c = __builtin_shuffle(ab, cd, FourBits{2, 3, 6, 7});
    d = __builtin_shuffle(ba, dc, FourBits{2, 3, 6, 7});
}

/// Four numbers of each of four places, transposed.
FOURS void gather(const double* const from[4], int at, Four& a, Four& b, Four& c, Four& d) {
    a = *reinterpret_cast<const FourInMemory*>(from[0] + at);
    b = *reinterpret_cast<const FourInMemory*>(from[1] + at);
    c = *reinterpret_cast<const FourInMemory*>(from[2] + at);
    d = *reinterpret_cast<const FourInMemory*>(from[3] + at);
    transpose(a, b, c, d);
}

template <bool isotropic_only> struct FourBodies {
    const int* at;
    PgsBody* bodies;
    const PgsInertia* inertia;
    int fixed_body;

    FOURS void read(Three<Four>& v, Three<Four>& w, Four& inverse_mass, Four& inverse_inertia) const {
        const double* from[4];
        for (int i = 0; i < 4; ++i) from[i] = bodies[at[i]].velocity.data();
        gather(from, 0, v.x, v.y, v.z, w.x);
        gather(from, 4, w.y, w.z, inverse_mass, inverse_inertia);
    }
    FOURS Three<Four> turned(const Three<Four>& moment, const Four& inverse_inertia) const {
        if (isotropic_only)
            return {inverse_inertia * moment.x, inverse_inertia * moment.y, inverse_inertia * moment.z};
        const double* from[4];
        for (int k = 0; k < 4; ++k) from[k] = &inertia[at[k]].xx;
        Four xx, xy, xz, yy, yz, zz, one, two;
        gather(from, 0, xx, xy, xz, yy);
        gather(from, 4, yz, zz, one, two);
        return {xx * moment.x + xy * moment.y + xz * moment.z, xy * moment.x + yy * moment.y + yz * moment.z,
                xz * moment.x + yz * moment.y + zz * moment.z};
    }
    FOURS void write(const Three<Four>& v, const Three<Four>& w, const Four& inverse_mass,
                     const Four& inverse_inertia) const {
        Four a = v.x, b = v.y, c = v.z, d = w.x, e = w.y, f = w.z, g = inverse_mass, h = inverse_inertia;
        transpose(a, b, c, d);
        transpose(e, f, g, h);
        const Four front[4] = {a, b, c, d}, back[4] = {e, f, g, h};
        for (int i = 0; i < 4; ++i) {
            if (at[i] == fixed_body) continue;
            double* const to = bodies[at[i]].velocity.data();
            *reinterpret_cast<FourInMemory*>(to) = front[i];
            *reinterpret_cast<FourInMemory*>(to + 4) = back[i];
        }
    }
};

template <bool with_slip, bool with_extras, bool isotropic_only> struct FourContacts {
    static constexpr bool rough = with_slip;
    double* const* at;
    const double* const* slip;
    const double* const* extras;
    const int *firsts, *seconds;
    PgsBody* bodies;
    const PgsInertia* inertia;
    int fixed_body;

    FOURS FourBodies<isotropic_only> first() const { return {firsts, bodies, inertia, fixed_body}; }
    FOURS FourBodies<isotropic_only> second() const { return {seconds, bodies, inertia, fixed_body}; }
    FOURS void arms(Three<Four>& first, Three<Four>& second, Four& right) const {
        Four names;
        gather(at, 0, names, first.x, first.y, first.z);
        gather(at, 4, second.x, second.y, second.z, right);
    }
    FOURS void normal(Three<Four>& n, Four& diagonal) const { gather(at, 8, n.x, n.y, n.z, diagonal); }
    FOURS void impulse(Four* z, Four& inverse_diagonal) const {
        gather(at, 12, z[0], z[1], z[2], inverse_diagonal);
    }
    FOURS void tangent(Three<Four>& t, Four& friction) const {
        t.x = t.y = t.z = friction = Four{};
        if (with_slip) gather(slip, 0, t.x, t.y, t.z, friction);
    }
    FOURS void normal_extras(Four& softness, Four& before) const {
        softness = before = Four{};
        if (!with_extras) return;
        Four a, b;
        gather(extras, 4, a, softness, b, before);
    }
    FOURS void across(Three<Four>& u, const Three<Four>& normal, const Three<Four>& tangent) const {
        if (!with_extras) {
            u = cross(normal, tangent);
            return;
        }
        Four a;
        gather(extras, 0, u.x, u.y, u.z, a);
    }
    FOURS void tangent_scales(Four& coupling1, Four& coupling2, Four& step) const {
        Four a;
        gather(slip, 4, coupling1, coupling2, step, a);
    }
    FOURS void tangent_extras(Four& right1, Four& right2, Four& softness) const {
        right1 = right2 = softness = Four{};
        if (!with_extras) return;
        Four a, b, c;
        gather(extras, 0, a, b, c, right1);
        gather(extras, 4, right2, a, softness, b);
    }
    FOURS void write(const Four* z, const Four& inverse_diagonal) const {
        Four a = z[0], b = z[1], c = z[2], d = inverse_diagonal;
        transpose(a, b, c, d);
        const Four all[4] = {a, b, c, d};
        for (int i = 0; i < 4; ++i) *reinterpret_cast<FourInMemory*>(at[i] + 12) = all[i];
    }
};

}  // namespace
}  // namespace avx2

void avx2_solve_four(const PgsGroup& group) {
    using namespace avx2;
    static_assert(offsetof(PackedContact, first_arm) == 8 && offsetof(PackedContact, second_arm) == 32 &&
                  offsetof(PackedContact, normal) == 64 && offsetof(PackedContact, impulse) == 96 &&
                  offsetof(PackedFriction, coupling) == 32 && offsetof(PackedExtras, right_across) == 32 &&
                  offsetof(PgsBody, inverse_mass) == 48 && offsetof(PgsInertia, yz) == 32);
    double* at[4];
    const double *slip[4], *extras[4];
    int first[4], second[4];
    for (int i = 0; i < 4; ++i) {
        at[i] = reinterpret_cast<double*>(group.contacts[i]);
        first[i] = group.contacts[i]->first;
        second[i] = group.contacts[i]->second;
        if (group.slips != nullptr) slip[i] = reinterpret_cast<const double*>(group.slips[i]);
        if (group.extras != nullptr) extras[i] = reinterpret_cast<const double*>(group.extras[i]);
    }
    FourInMemory& change = *reinterpret_cast<FourInMemory*>(group.change);
    const auto solve = [&]<bool with_slip, bool with_extras>() __attribute__((always_inline)) {
        const auto over = [&]<bool isotropic_only>() __attribute__((always_inline)) {
            change = solve_contact<Four>(
                FourContacts<with_slip, with_extras, isotropic_only>{
                    at, slip, extras, first, second, group.bodies, group.inertia, group.fixed_body},
                Disc{}, false);
        };
        if (group.inertia == nullptr) over.template operator()<true>();
        else over.template operator()<false>();
    };
    if (group.extras != nullptr) solve.template operator()<true, true>();
    else if (group.slips != nullptr) solve.template operator()<true, false>();
    else solve.template operator()<false, false>();
}

}  // namespace spook
#pragma GCC pop_options
#else
namespace spook {
void avx2_solve_four(const PgsGroup& group) { portable_solve_four(group); }
}  // namespace spook
#endif

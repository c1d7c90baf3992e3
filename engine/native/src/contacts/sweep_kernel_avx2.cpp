// Four contacts in vectors of four. Not fused multiply-add: that would round differently.
#include "contacts/sweep_kernel.hpp"

#include <cmath>
#include <cstddef>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2")
#define SPOOK_ISA avx2
#define SPOOK_FOURS
#include "contacts/contact_update.inl"
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

struct FourBodies {
    const int* at;
    Vec6* velocities;
    const SweptBody* bodies;
    int nobody;

    FOURS void velocity(Three<Four>& v, Three<Four>& w) const {
        const double* from[4];
        for (int i = 0; i < 4; ++i) from[i] = velocities[at[i]].data();
        Four z, x;
        gather(from, 0, v.x, v.y, v.z, w.x);
        gather(from, 2, z, x, w.y, w.z);
    }
    FOURS void inertia(Four& inverse_mass, Four& xx, Four& xy, Four& xz, Four& yy, Four& yz, Four& zz) const {
        const double* from[4];
        for (int k = 0; k < 4; ++k) from[k] = &bodies[at[k]].inverse_mass;
        Four rest;
        gather(from, 0, inverse_mass, xx, xy, xz);
        gather(from, 4, yy, yz, zz, rest);
    }
    FOURS void write(const Three<Four>& v, const Three<Four>& w) const {
        Four a = v.x, b = v.y, c = v.z, d = w.x, e = v.z, f = w.x, g = w.y, h = w.z;
        transpose(a, b, c, d);
        transpose(e, f, g, h);
        const Four front[4] = {a, b, c, d}, back[4] = {e, f, g, h};
        for (int i = 0; i < 4; ++i) {
            if (at[i] == nobody) continue;
            *reinterpret_cast<FourInMemory*>(velocities[at[i]].data()) = front[i];
            *reinterpret_cast<FourInMemory*>(velocities[at[i]].data() + 2) = back[i];
        }
    }
};

template <bool with_rest> struct FourContacts {
    double* const* at;
    const double* const* rest;
    const int *firsts, *seconds;
    Vec6* velocities;
    const SweptBody* bodies;
    int nobody;

    FOURS FourBodies first() const { return {firsts, velocities, bodies, nobody}; }
    FOURS FourBodies second() const { return {seconds, velocities, bodies, nobody}; }
    FOURS void arms(Three<Four>& first, Three<Four>& second, Four& right) const {
        Four names;
        gather(at, 0, names, first.x, first.y, first.z);
        gather(at, 4, second.x, second.y, second.z, right);
    }
    FOURS void normal(Three<Four>& n, Four& own) const { gather(at, 8, n.x, n.y, n.z, own); }
    FOURS void impulse(Four* z, Four& own_inverse) const { gather(at, 12, z[0], z[1], z[2], own_inverse); }
    FOURS void tangent(Three<Four>& t, Four& friction) const { gather(at, 16, t.x, t.y, t.z, friction); }
    FOURS void normal_rest(Four& softness, Four& before) const {
        softness = before = Four{};
        if (!with_rest) return;
        Four a, b;
        gather(rest, 4, a, softness, b, before);
    }
    FOURS void across(Three<Four>& u, const Three<Four>& normal, const Three<Four>& tangent) const {
        if (!with_rest) {
            u = cross(normal, tangent);
            return;
        }
        Four a;
        gather(rest, 0, u.x, u.y, u.z, a);
    }
    FOURS void tangent_scales(Four& coupling1, Four& coupling2, Four& step) const {
        Four a;
        gather(at, 20, coupling1, coupling2, step, a);
    }
    FOURS void tangent_rest(Four& right1, Four& right2, Four& softness) const {
        right1 = right2 = softness = Four{};
        if (!with_rest) return;
        Four a, b, c;
        gather(rest, 0, a, b, c, right1);
        gather(rest, 4, right2, a, softness, b);
    }
    FOURS void write(const Four* z, const Four& own_inverse) const {
        Four a = z[0], b = z[1], c = z[2], d = own_inverse;
        transpose(a, b, c, d);
        const Four all[4] = {a, b, c, d};
        for (int i = 0; i < 4; ++i) *reinterpret_cast<FourInMemory*>(at[i] + 12) = all[i];
    }
};

}  // namespace
}  // namespace avx2

void avx2_sweep_four(const SweepGroup& group) {
    using namespace avx2;
    static_assert(offsetof(SweptContact, first_arm) == 8 && offsetof(SweptContact, second_arm) == 32 &&
                  offsetof(SweptContact, normal) == 64 && offsetof(SweptContact, impulse) == 96 &&
                  offsetof(SweptContact, tangent) == 128 && offsetof(SweptContact, coupling) == 160 &&
                  offsetof(SweptRest, right_across) == 32);
    double* at[4];
    const double* rest[4];
    int first[4], second[4];
    for (int i = 0; i < 4; ++i) {
        at[i] = reinterpret_cast<double*>(group.contacts[i]);
        first[i] = group.contacts[i]->first;
        second[i] = group.contacts[i]->second;
    }
    FourInMemory& change = *reinterpret_cast<FourInMemory*>(group.change);
    if (group.rests == nullptr) {
        change = solve_contact<Four>(
            FourContacts<false>{at, rest, first, second, group.velocity, group.bodies, group.nobody}, Disc{},
            false);
        return;
    }
    for (int i = 0; i < 4; ++i) rest[i] = reinterpret_cast<const double*>(group.rests[i]);
    change = solve_contact<Four>(
        FourContacts<true>{at, rest, first, second, group.velocity, group.bodies, group.nobody}, Disc{},
        false);
}

}  // namespace spook
#pragma GCC pop_options
#else
namespace spook {
void avx2_sweep_four(const SweepGroup& group) { portable_sweep_four(group); }
}  // namespace spook
#endif

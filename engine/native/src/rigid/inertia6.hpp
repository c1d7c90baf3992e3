// Velocities, impulses and inertias of rigid bodies as pairs of three-vectors, and where they are seen from.
#pragma once

#include <algorithm>

#include "linear/vec.hpp"
#include "rigid/tolerances.hpp"

namespace spook {

/// A velocity or an impulse: linear part, then angular part.
struct Twist {
    Vec3 linear, angular;
};

/// Symmetric 6 × 6: [[linear, mixed], [mixedᵀ, angular]]; symmetric blocks as xx, xy, xz, yy, yz, zz.
struct Inertia6 {
    double linear[6], mixed[9], angular[6];
};

inline Twist operator+(Twist a, Twist b) noexcept { return {a.linear + b.linear, a.angular + b.angular}; }
inline Twist operator-(Twist a, Twist b) noexcept { return {a.linear - b.linear, a.angular - b.angular}; }
inline Twist& operator+=(Twist& a, Twist b) noexcept { return a = a + b; }
inline Twist& operator-=(Twist& a, Twist b) noexcept { return a = a - b; }

/// A velocity at a centre, seen at the joint that is `arm` away; and the other way round.
inline Twist to_joint(Twist v, Vec3 arm) noexcept { return {v.linear + cross(v.angular, arm), v.angular}; }
inline Twist to_centre(Twist v, Vec3 arm) noexcept { return {v.linear - cross(v.angular, arm), v.angular}; }
/// An impulse at the joint, and its moment about the centre; and the other way round.
inline Twist about_centre(Twist p, Vec3 arm) noexcept { return {p.linear, p.angular + cross(arm, p.linear)}; }
inline Twist about_joint(Twist p, Vec3 arm) noexcept { return {p.linear, p.angular - cross(arm, p.linear)}; }

/// The same inertia for velocities `arm` away: Xᵀ M X with X = [[1, arm ×], [0, 1]].
inline Inertia6 shifted(const Inertia6& m, Vec3 arm) noexcept {
    Inertia6 out;
    const double* l = m.linear;
    const Vec3 rows[3] = {{l[0], l[1], l[2]}, {l[1], l[3], l[4]}, {l[2], l[4], l[5]}};
    std::copy_n(l, 6, out.linear);
    for (int i = 0; i < 3; ++i) {
        const Vec3 r = cross(rows[i], arm);
        out.mixed[3 * i] = m.mixed[3 * i] + r.x;
        out.mixed[3 * i + 1] = m.mixed[3 * i + 1] + r.y;
        out.mixed[3 * i + 2] = m.mixed[3 * i + 2] + r.z;
    }
    Vec3 before[3], after[3];
    for (int j = 0; j < 3; ++j) {
        before[j] = cross(Vec3{m.mixed[j], m.mixed[3 + j], m.mixed[6 + j]}, arm);
        after[j] = cross(Vec3{out.mixed[j], out.mixed[3 + j], out.mixed[6 + j]}, arm);
    }
    out.angular[0] = m.angular[0] + (before[0].x + after[0].x);
    out.angular[1] = m.angular[1] + (before[0].y + after[1].x);
    out.angular[2] = m.angular[2] + (before[0].z + after[2].x);
    out.angular[3] = m.angular[3] + (before[1].y + after[1].y);
    out.angular[4] = m.angular[4] + (before[1].z + after[2].y);
    out.angular[5] = m.angular[5] + (before[2].z + after[2].z);
    return out;
}

inline Twist operator*(const Inertia6& m, Twist v) noexcept {
    const double *l = m.linear, *x = m.mixed, *a = m.angular;
    const Vec3 p = v.linear, w = v.angular;
    return {{l[0] * p.x + l[1] * p.y + l[2] * p.z + (x[0] * w.x + x[1] * w.y + x[2] * w.z),
             l[1] * p.x + l[3] * p.y + l[4] * p.z + (x[3] * w.x + x[4] * w.y + x[5] * w.z),
             l[2] * p.x + l[4] * p.y + l[5] * p.z + (x[6] * w.x + x[7] * w.y + x[8] * w.z)},
            {x[0] * p.x + x[3] * p.y + x[6] * p.z + (a[0] * w.x + a[1] * w.y + a[2] * w.z),
             x[1] * p.x + x[4] * p.y + x[7] * p.z + (a[1] * w.x + a[3] * w.y + a[4] * w.z),
             x[2] * p.x + x[5] * p.y + x[8] * p.z + (a[2] * w.x + a[4] * w.y + a[5] * w.z)}};
}

inline void add(Inertia6& a, const Inertia6& b) noexcept {
    for (int i = 0; i < 6; ++i) a.linear[i] += b.linear[i];
    for (int i = 0; i < 9; ++i) a.mixed[i] += b.mixed[i];
    for (int i = 0; i < 6; ++i) a.angular[i] += b.angular[i];
}

/// Entry (i, j) of the upper triangle of 6 × 6 numbers, row by row.
constexpr int at(int i, int j) noexcept { return i <= j ? 6 * i - i * (i + 1) / 2 + j : at(j, i); }

/// The upper triangle row by row, and back.
inline void spread(const Inertia6& m, double* k) noexcept {
    const double *l = m.linear, *x = m.mixed, *a = m.angular;
    const double rows[21] = {l[0], l[1], l[2], x[0], x[1], x[2], l[3], l[4], x[3], x[4], x[5],
                             l[5], x[6], x[7], x[8], a[0], a[1], a[2], a[3], a[4], a[5]};
    std::copy_n(rows, 21, k);
}

inline void gather(const double* k, Inertia6& m) noexcept {
    m = {{k[0], k[1], k[2], k[6], k[7], k[11]},
         {k[3], k[4], k[5], k[8], k[9], k[10], k[12], k[13], k[14]},
         {k[15], k[16], k[17], k[18], k[19], k[20]}};
}

/// (K⁻¹ + c eᵢ eᵢᵀ)⁻¹. The direction's own row is divided, not subtracted from: a soft one keeps its digits.
template <int I, int A, int B> inline void soften_entry(double* k, double share) noexcept {
    if constexpr (A != I && B != I && A <= B) k[at(A, B)] -= share * k[at(I, B)];
}
template <int I, int A> inline void soften_row(double* k, double gain) noexcept {
    if constexpr (A != I) {
        const double share = gain * k[at(I, A)];
        soften_entry<I, A, 0>(k, share);
        soften_entry<I, A, 1>(k, share);
        soften_entry<I, A, 2>(k, share);
        soften_entry<I, A, 3>(k, share);
        soften_entry<I, A, 4>(k, share);
        soften_entry<I, A, 5>(k, share);
    }
}
template <int I> inline void soften(double* k, double softness) noexcept {
    const double keeps = 1.0 / (1.0 + softness * k[at(I, I)]), gain = softness * keeps;
    soften_row<I, 0>(k, gain);
    soften_row<I, 1>(k, gain);
    soften_row<I, 2>(k, gain);
    soften_row<I, 3>(k, gain);
    soften_row<I, 4>(k, gain);
    soften_row<I, 5>(k, gain);
    k[at(I, 0)] *= keeps, k[at(I, 1)] *= keeps, k[at(I, 2)] *= keeps;
    k[at(I, 3)] *= keeps, k[at(I, 4)] *= keeps, k[at(I, 5)] *= keeps;
}

/// K from N for the softness along and about all axes, and the rest of it about the tilt.
inline void soften_all(Inertia6& m, const double* softness, Vec3 tilt, double tilt_softness) noexcept {
    double k[21];
    spread(m, k);
    if (softness[1] > 0.0) {
        soften<3>(k, softness[1]);
        soften<4>(k, softness[1]);
        soften<5>(k, softness[1]);
    }
    if (softness[0] > 0.0) {
        soften<0>(k, softness[0]);
        soften<1>(k, softness[0]);
        soften<2>(k, softness[0]);
    }
    gather(k, m);
    if (!(tilt_softness > 0.0) || !(dot(tilt, tilt) > slight_tilt)) return;
    const Twist r = m * Twist{{}, tilt};
    const double v[6] = {r.linear.x, r.linear.y, r.linear.z, r.angular.x, r.angular.y, r.angular.z};
    const double gain = tilt_softness / (1.0 + tilt_softness * dot(tilt, r.angular));
    spread(m, k);
    for (int i = 0; i < 6; ++i)
        for (int j = i; j < 6; ++j) k[at(i, j)] -= gain * v[i] * v[j];
    gather(k, m);
}

/// In place M = L D Lᵀ, the factor below as the upper triangle; then M⁻¹ p with it.
inline void factor_whole(Inertia6& m) noexcept {
    double k[21];
    spread(m, k);
    for (int i = 0; i < 6; ++i) {
        const double over = 1.0 / k[at(i, i)];
        for (int a = i + 1; a < 6; ++a) {
            const double share = over * k[at(i, a)];
            for (int b = a; b < 6; ++b) k[at(a, b)] -= share * k[at(i, b)];
        }
        for (int a = i + 1; a < 6; ++a) k[at(i, a)] *= over;
    }
    gather(k, m);
}

inline Twist solve_whole(const Inertia6& m, Twist p) noexcept {
    double k[21], x[6] = {p.linear.x, p.linear.y, p.linear.z, p.angular.x, p.angular.y, p.angular.z};
    spread(m, k);
    for (int i = 0; i < 6; ++i)
        for (int j = i + 1; j < 6; ++j) x[j] -= k[at(i, j)] * x[i];
    for (int i = 5; i >= 0; --i) {
        x[i] /= k[at(i, i)];
        for (int j = i + 1; j < 6; ++j) x[i] -= k[at(i, j)] * x[j];
    }
    return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
}

}  // namespace spook

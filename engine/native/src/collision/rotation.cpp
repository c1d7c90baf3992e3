// Euler's equations for three moments, j = 1/I, p' = p × j p, by what the discrete ones of Moser and Veselov (Comm. Math.
// Phys. 139 (1991) 217) do exactly. These turn the body by the unit quaternion along (1, k j (p + p₊)/2), which takes p
// along its true path, only at another pace, and differs from the true turn by one about the momentum. Pace and difference
// depend on the motion's invariants and h alone (Hairer and Vilmart, J. Phys. A 39 (2006) 13225, expand them in h), so they
// are found here where they are simplest: for the stretch of time about the moment at which p crosses the plane across the
// middle axis.
//
// With a = j₂ − j₃, b = j₁ − j₃ and P₁², P₃² the squares of p there, s(t) = sn(√A t)/√A with s'² = (1 − A s²)(1 − B s²),
// A = a b P₃², B = b (b − a) P₁². Jacobi's addition theorem then moves p by rational functions of itself, and no phase is
// looked for. Which of A and B is larger, so about which axis p circles, makes no difference.
#include "collision/rotation.hpp"

#include <algorithm>
#include <cmath>

#include "collision/tolerances.hpp"
#include "linear/elementary.hpp"

namespace spook {
namespace {

using namespace tolerances::rotation;

/// v with the axis `first` as x, and back.
Vec3 ordered(int first, Vec3 v) noexcept {
    return first == 0 ? v : first == 1 ? Vec3{v.y, v.z, v.x} : Vec3{v.z, v.x, v.y};
}
Quat restored(int first, Quat q) noexcept {
    return first == 0 ? q : first == 1 ? Quat{q.w, q.z, q.x, q.y} : Quat{q.w, q.y, q.z, q.x};
}

/// To rounding.
bool is_about_one_axis(Vec3 v) noexcept {
    const double xx = v.x * v.x, yy = v.y * v.y, zz = v.z * v.z;
    return std::fmin(std::fmin(xx + yy, yy + zz), zz + xx) <= steady_squared * (xx + yy + zz);
}

/// s(t) for A t², B t² up to PART²/4: the series of sn, to the ninth power.
double pace(double a, double b, double t) noexcept {
    const double p = (a + b) * t * t, q = a * t * (b * t) * t * t, pp = p * p;
    return t * (1.0 - p * (1.0 / 6) + (pp + 12 * q) * (1.0 / 120) - p * (pp + 132 * q) * (1.0 / 5040) +
                (pp * pp + 1224 * pp * q + 3024 * q * q) * (1.0 / 362880));
}

}  // namespace

Quat turn_of(double h, Vec3 angular_velocity) noexcept {
    const double angle = 0.5 * h * norm(angular_velocity);
    const SineCosine half = sine_cosine(angle);
    const Vec3 e = (angle != 0.0 ? 0.5 * h * half.sine / angle : 0.0) * angular_velocity;
    return {half.cosine, e.x, e.y, e.z};
}

FreeRotor::FreeRotor(Vec3 moments) noexcept {
    const double largest = std::fmax(moments.x, std::fmax(moments.y, moments.z));
    int exponent = 0;
    std::frexp(largest, &exponent);
    unit_ = std::ldexp(1.0, std::clamp(exponent, -1000, 1000));
    const Vec3 over{unit_ / moments.x, unit_ / moments.y, unit_ / moments.z};
    const bool xy = moments.x == moments.y, yz = moments.y == moments.z, zx = moments.z == moments.x;
    if (xy && yz) {
        over_ = over;
        return;
    }
    kind_ = xy || yz || zx ? Kind::symmetric : Kind::triaxial;
    const auto between = [&](int middle) {
        const double low = moments[(middle + 2) % 3], high = moments[(middle + 1) % 3];
        return (low < moments[middle]) == (moments[middle] < high);
    };
    if (kind_ == Kind::symmetric) first_ = xy ? 0 : yz ? 1 : 2;
    else first_ = between(1) ? 0 : between(2) ? 1 : 2;
    over_ = ordered(first_, over);
    wide_ = over_.x - over_.z;
    narrow_ = over_.y - over_.z;
}

Quat FreeRotor::turn(double h, Vec3 momentum) const noexcept {
    const Vec3 p = ordered(first_, (1.0 / unit_) * momentum);
    switch (kind_) {
        case Kind::sphere: return turn_of(h, over_.x * p);
        case Kind::symmetric:
            return restored(first_, turn_of(h, over_.x * p) * turn_of(h, {0.0, 0.0, -wide_ * p.z}));
        default: return restored(first_, triaxial_turn(h, p));
    }
}

/// About the momentum: what a steady spin is, and a tumbling body's on average.
Quat FreeRotor::mean_turn(double h, Vec3 p) const noexcept {
    const double squared = dot(p, p);
    return turn_of(h, (dot(p, times(over_, p)) / squared) * p);
}

Quat FreeRotor::triaxial_turn(double h, Vec3 p) const noexcept {
    const Vec3 w = times(over_, p);
    const double squared = dot(p, p), energy = dot(p, w);  // twice that
    if (squared == 0.0) return {};
    if (is_about_one_axis(p) && is_about_one_axis(w)) return mean_turn(h, p);  // as what a hinge holds
    // The fastest spin on the path: where it lies in the plane of the outer axes.
    const double angle = std::fabs(h) * std::sqrt(energy * (over_.x + over_.z) - squared * over_.x * over_.z);
    if (angle <= piece_angle) return short_turn(h, angle, p);
    if (!(angle <= tumbling_angle)) return mean_turn(h, p);
    const double count = std::ceil(angle * (1.0 / piece_angle));
    Quat q;
    for (int k = static_cast<int>(count); k > 0; --k)
        q = unit(q * short_turn(h / count, angle / count, transposed_times(rotation(q), p)));
    return q;
}

Quat FreeRotor::short_turn(double h, double angle, Vec3 p) const noexcept {
    // Squares of Gauss and Legendre's nodes on 0 … 1, and of four the weight of the outer ones.
    constexpr double gauss2[] = {0.21132486540518712 * 0.21132486540518712,
                                 0.7886751345948129 * 0.7886751345948129};
    constexpr double gauss4[] = {
        0.06943184420297371 * 0.06943184420297371, 0.33000947820757187 * 0.33000947820757187,
        0.6699905217924281 * 0.6699905217924281, 0.9305681557970262 * 0.9305681557970262};
    constexpr double outer = 0.17392742256872692;
    const Vec3 j = over_;
    const double a = narrow_, b = wide_, share = a / b;
    const double p1 = p.x * p.x + share * p.y * p.y, p3 = p.z * p.z + (1.0 - share) * p.y * p.y;  // P²
    const double pace_a = a * b * p3, pace_b = b * (b - a) * p1;
    const double e1 = j.x * p1, e3 = j.z * p3, w1 = j.x * e1, w3 = j.z * e3, energy = e1 + e3;
    const int parts = std::max(1, static_cast<int>(std::ceil(angle * (1.0 / series_angle))));
    const double t = h / parts;

    const double s = pace(pace_a, pace_b, 0.5 * t), ss = s * s, as = pace_a * ss, bs = pace_b * ss;
    const double c2 = 1.0 - as, d2 = 1.0 - bs, cd = std::sqrt(c2 * d2);
    // Moser and Veselov's turn over t about that moment is along (c d, s j p), p between the two ends.
    const double own = s * cd / (c2 * d2 + ss * (w1 * c2 + w3 * d2));
    // What the true turn is ahead of it, about the momentum: ∫ (2E − its own rate), by s instead of the time.
    const auto rate = [&](double y) {
        const double c = 1.0 - pace_a * y, d = 1.0 - pace_b * y, cd = c * d, over = 1.0 / cd;
        const double along = e1 * c + e3 * d, across = w1 * c + w3 * d;
        const double along_slope = e1 * c * c + e3 * d * d, across_slope = w1 * c * c + w3 * d * d;
        return (along_slope - y * along * across_slope / (cd + y * across)) * (over * over) * std::sqrt(cd);
    };
    double behind;
    if (angle <= short_angle) {
        behind = energy - 0.5 * (rate(ss * gauss2[0]) + rate(ss * gauss2[1]));
    } else {
        double rates[4];
        for (int k = 0; k < 4; ++k) rates[k] = rate(ss * gauss4[k]);
        behind = energy - (outer * (rates[0] + rates[3]) + (0.5 - outer) * (rates[1] + rates[2]));
    }
    const double ahead = parts * (energy * (t - 2.0 * s) + 2.0 * s * behind) / dot(p, p);

    // sn, cn and dn of the whole of t.
    const double over = 1.0 / (1.0 - as * bs), sn = 2.0 * s * cd * over, cn = (c2 - as * d2) * over,
                 dn = (d2 - bs * c2) * over;
    Quat q;
    Vec3 at = p;
    for (int k = 0; k < parts; ++k) {
        const double scale = 1.0 / (1.0 - a * (b - a) * sn * sn * at.y * at.y);
        const Vec3 next =
            scale * Vec3{cn * at.x - a * sn * dn * at.y * at.z, cn * dn * at.y + b * sn * at.x * at.z,
                         dn * at.z - (b - a) * sn * cn * at.x * at.y};
        const Vec3 sine = own * times(j, at + next);
        const double cosine = std::sqrt(1.0 - dot(sine, sine)), half = std::sqrt(0.5 * (1.0 + cosine));
        const Vec3 e = (0.5 / half) * sine;
        const Quat part{half, e.x, e.y, e.z};
        q = k == 0 ? part : q * part;
        at = next;
    }
    return turn_of(ahead, p) * q;
}

}  // namespace spook

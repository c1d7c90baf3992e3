#include "rigid/rotation.hpp"

#include <algorithm>
#include <cmath>

namespace spook {
namespace {

Vec3 times(Vec3 a, Vec3 b) noexcept { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

/// All moments equal: |p|/I = |w| c is a quadratic for |w|².
bool sphere_rate(double inertia, double h, Vec3 p, Vec3& w) noexcept {
    const Vec3 s = (1.0 / inertia) * p;
    const double z = h * h * dot(s, s);  // 4 y (1 − y) with y = h²|w|²/4
    if (!(z <= 1.0)) return false;
    const double y = 0.5 * z / (1.0 + std::sqrt(1.0 - z));
    w = (1.0 / std::sqrt(1.0 - y)) * s;
    return true;
}

constexpr double LARGE = 0x1p200;  // of moments: their cubes stay far from the ends of the numbers

}  // namespace

bool rotation_rate(Vec3 inertia, double h, Vec3 p, Vec3& w, bool near) noexcept {
    if (!(inertia.x < LARGE && inertia.x > 1.0 / LARGE)) {
        int exponent = 0;
        std::frexp(std::fmax(inertia.x, std::fmax(inertia.y, inertia.z)), &exponent);
        const double scale =
            std::ldexp(1.0, -std::clamp(exponent, -1000, 1000));  // exact: no bit of w differs
        if (scale * inertia.x < LARGE && scale * inertia.x > 1.0 / LARGE)
            return rotation_rate(scale * inertia, h, scale * p, w, near);
    }
    if (inertia.x == inertia.y && inertia.y == inertia.z) return sphere_rate(inertia.x, h, p, w);
    const Vec3 over{1.0 / inertia.x, 1.0 / inertia.y, 1.0 / inertia.z};
    if (!near) w = times(over, p);
    const double target = 4e-16 * 4e-16 * dot(p, p), half = 0.5 * h;
    double last = -1.0;
    for (int round = 0; round < 40; ++round) {
        const double squared = 1.0 - 0.25 * h * h * dot(w, w);
        if (!(squared > 0.0)) {
            if (round > 0 || !std::isfinite(squared)) return false;
            w = (1.0 / (h * norm(w))) * w;  // a start inside the domain
            continue;
        }
        const double c = std::sqrt(squared);
        const Vec3 momentum = times(inertia, w);
        const Vec3 f = c * momentum + half * cross(w, momentum) - p;
        const double size = dot(f, f);
        if (size <= target || (size >= last && last >= 0.0 && last <= 1e-28 * dot(p, p))) return true;
        last = size;
        if (h * h * dot(w, w) < 1e-12) {  // the Jacobian is I to 1e-6, and a second round is below rounding
            w -= times(over, f);
            continue;
        }
        const double k = -0.25 * h * h / c;
        const Vec3 m = momentum;
        const Mat3 j = {{c * inertia.x + k * m.x * w.x, k * m.x * w.y + half * (m.z - w.z * inertia.y),
                         k * m.x * w.z + half * (w.y * inertia.z - m.y),
                         k * m.y * w.x + half * (w.z * inertia.x - m.z), c * inertia.y + k * m.y * w.y,
                         k * m.y * w.z + half * (m.x - w.x * inertia.z),
                         k * m.z * w.x + half * (m.y - w.y * inertia.x),
                         k * m.z * w.y + half * (w.x * inertia.y - m.x), c * inertia.z + k * m.z * w.z}};
        const Vec3 a{j.m[0], j.m[3], j.m[6]}, b{j.m[1], j.m[4], j.m[7]}, d{j.m[2], j.m[5], j.m[8]};
        const Vec3 bd = cross(b, d);
        const double det = dot(a, bd);
        if (!(std::abs(det) > 0.0)) return false;
        w -= (1.0 / det) * Vec3{dot(f, bd), dot(a, cross(f, d)), dot(a, cross(b, f))};
    }
    return false;
}

}  // namespace spook

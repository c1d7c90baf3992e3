#include "contacts/cone_unit.hpp"

#include <algorithm>
#include <cmath>

#include "contacts/smooth_cone.hpp"
#include "linear/elementary.hpp"

namespace spook {

double ConeUnit::natural(const Vec& at_z, const Vec& at_u, const Aid& aid, double* out) const {
    const double blur = aid.blur, hold = aid.hold;
    if (size == 1) {
        const double y = at_z[0] * over, w = root * at_u[0] + hold * (y - held[0]), a = y - w;
        double p = a;
        if (lower == upper) p = lower;
        else if (lower > -unbounded) {
            p = lower + positive_part(a - lower, blur);
            if (upper < unbounded) p -= positive_part(a - upper, blur);
        } else if (upper < unbounded) {
            p = upper - positive_part(upper - a, blur);
        }
        out[0] = y - p;
        if (lower == -unbounded && upper == unbounded) out[0] = w;
        return out[0] * out[0];
    }
    const double mu = friction, w1 = root * mu * at_u[1], w2 = root * mu * at_u[2];
    const double rounded = kink(blur), slide = std::sqrt(w1 * w1 + w2 * w2 + rounded * rounded) - rounded;
    const double y0 = at_z[0] * over, y1 = at_z[1] * along, y2 = at_z[2] * along;
    const double a0 = y0 - (root * at_u[0] + slide) - hold * (y0 - held[0]);
    const double a1 = y1 - w1 - hold * (y1 - held[1]), a2 = y2 - w2 - hold * (y2 - held[2]);
    const double reach = length(a1, a2);
    const double one = positive_part(a0 - reach, blur), two = positive_part(a0 + reach, blur);
    const double shrink = reach > 0.0 ? 0.5 * (two - one) / reach : 0.0;
    out[0] = y0 - 0.5 * (one + two);
    out[1] = y1 - shrink * a1;
    out[2] = y2 - shrink * a2;
    return out[0] * out[0] + out[1] * out[1] + out[2] * out[2];
}

void ConeUnit::linearise_row(const Aid& aid) {
    const double blur = aid.blur, hold = aid.hold;
    slope[0] = 1.0, rest[0] = 0.0, bend[0] = 0.0;
    const double y = z[0] * over, a = y - root * u[0] - hold * (y - held[0]);
    if (lower == upper) slope[0] = 0.0, rest[0] = 1.0;
    else if (lower > -unbounded) {
        const Positive low = positive(a - lower, blur);
        slope[0] = low.slope, rest[0] = low.rest, bend[0] = -low.bend;
        if (upper < unbounded) {
            const Positive high = positive(upper - a, blur);
            slope[0] = std::max(0.0, slope[0] - high.rest), rest[0] += high.rest, bend[0] += high.bend;
        }
    } else if (upper < unbounded) {
        const Positive high = positive(upper - a, blur);
        slope[0] = high.slope, rest[0] = high.rest, bend[0] = high.bend;
    }
    rest[0] += hold * slope[0];
    over_rest[0] = 1.0 / rest[0];
    const double stiffness = root * root * slope[0] * over_rest[0];
    g[0] = 1.0 / (1.0 + stiffness * softness[0]);
    k[0] = g[0] * stiffness;
}

void ConeUnit::linearise(const Aid& aid) {
    const double blur = aid.blur, hold = aid.hold;
    if (size == 1) {
        natural(z, u, aid, map.data());
        return linearise_row(aid);
    }
    const double rho = root * root, mu = friction;
    const double w1 = root * mu * u[1], w2 = root * mu * u[2];
    const double rounded = kink(blur), sliding = std::sqrt(w1 * w1 + w2 * w2 + rounded * rounded);
    s1 = sliding > 0.0 ? w1 / sliding : 0.0, s2 = sliding > 0.0 ? w2 / sliding : 0.0;
    const double y0 = z[0] * over, y1 = z[1] * along, y2 = z[2] * along;
    const double a0 = y0 - (root * u[0] + sliding - rounded) - hold * (y0 - held[0]);
    const Spectrum s = project(a0, y1 - w1 - hold * (y1 - held[1]), y2 - w2 - hold * (y2 - held[2]), blur);
    t1 = s.t1, t2 = s.t2;
    map = {y0 - s.value[0], y1 - s.value[1] * t1, y2 - s.value[1] * t2};
    double ratio[3], image[3];
    for (int i = 0; i < 3; ++i) {
        slope[i] = s.slope[i], rest[i] = s.rest[i] + hold * s.slope[i];
        over_rest[i] = 1.0 / rest[i];
        ratio[i] = slope[i] * over_rest[i];
    }
    // K = rho E (1 − D)⁻¹ D E': Q is the middle, by its eigenvalues, and E' adds mu s of its first column to the others.
    const double even = 0.5 * (ratio[0] + ratio[1]), odd = 0.5 * (ratio[1] - ratio[0]),
                 cross = even - ratio[2];
    const double q01 = odd * t1, q02 = odd * t2, q12 = cross * t1 * t2;
    const double q11 = even * t1 * t1 + ratio[2] * t2 * t2, q22 = even * t2 * t2 + ratio[2] * t1 * t1;
    const double rho_mu = rho * mu, rho_mu2 = rho_mu * mu;
    k[0] = rho * even, k[1] = rho_mu * (s1 * even + q01), k[2] = rho_mu * (s2 * even + q02);
    k[3] = rho_mu * q01, k[4] = rho_mu2 * (s1 * q01 + q11), k[5] = rho_mu2 * (s2 * q01 + q12);
    k[6] = rho_mu * q02, k[7] = rho_mu2 * (s1 * q02 + q12), k[8] = rho_mu2 * (s2 * q02 + q22);
    const double by_blur = blur > 0.0 ? blur * (blur + 2.0 * load) / ((blur + load) * (blur + load)) : 0.0;
    const double push[3] = {sliding > 0.0 ? by_blur * (1.0 - rounded / sliding) : 0.0, 0.0, 0.0};
    spectral(slope, push, image);
    bend = {-s.bend[0] - image[0], -s.bend[1] * t1 - image[1], -s.bend[1] * t2 - image[2]};
    if (soft) soften();
}

/// g = (1 + K Sig)⁻¹, K ← g K: what is left when the rows give way themselves.
void ConeUnit::soften() {
    double m[9];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) m[3 * i + j] = (i == j) + k[3 * i + j] * softness[j];
    for (int i = 0; i < 9; ++i) g[i] = i % 4 == 0;
    for (int p = 0; p < 3; ++p) {
        const double over_pivot = 1.0 / m[4 * p];
        for (int j = 0; j < 3; ++j) m[3 * p + j] *= over_pivot, g[3 * p + j] *= over_pivot;
        for (int i = 0; i < 3; ++i) {
            if (i == p) continue;
            const double f = m[3 * i + p];
            for (int j = 0; j < 3; ++j) m[3 * i + j] -= f * m[3 * p + j], g[3 * i + j] -= f * g[3 * p + j];
        }
    }
    double softened[9];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            softened[3 * i + j] = g[3 * i] * k[j] + g[3 * i + 1] * k[3 + j] + g[3 * i + 2] * k[6 + j];
    std::copy_n(softened, 9, k);
}

/// Σ fᵢ eᵢ eᵢᵀ x, with eᵢ = (1, −t)/√2, (1, t)/√2, (0, t⊥).
void ConeUnit::spectral(const double* f, const double* x, double* y) const {
    const double even = 0.5 * (f[0] + f[1]), odd = 0.5 * (f[1] - f[0]);
    const double radial = t1 * x[1] + t2 * x[2], across = f[2] * (t1 * x[2] - t2 * x[1]);
    const double forth = odd * x[0] + even * radial;
    y[0] = even * x[0] + odd * radial;
    y[1] = forth * t1 - across * t2;
    y[2] = forth * t2 + across * t1;
}

void ConeUnit::respond(const Vec& missing) {
    if (size == 1) {
        c[0] = g[0] * root * missing[0] * over_rest[0];
        return;
    }
    double image[3];
    spectral(over_rest, missing.data(), image);
    for (int i = 0; i < 3; ++i) image[i] *= root * (i == 0 ? 1.0 : friction);
    for (int i = 0; i < 3; ++i)
        c[i] = soft ? g[3 * i] * image[0] + g[3 * i + 1] * image[1] + g[3 * i + 2] * image[2] : image[i];
}

ConeUnit::Vec ConeUnit::law(const Vec& change_z, const Vec& change_u) const {
    const double mu = friction;
    if (size == 1) return {rest[0] * change_z[0] * over + slope[0] * root * change_u[0], 0.0, 0.0};
    const double dy[3] = {change_z[0] * over, change_z[1] * along, change_z[2] * along};
    const double dw[3] = {root * (change_u[0] + mu * (s1 * change_u[1] + s2 * change_u[2])),
                          root * mu * change_u[1], root * mu * change_u[2]};
    double one[3], two[3];
    spectral(rest, dy, one);
    spectral(slope, dw, two);
    return {one[0] + two[0], one[1] + two[1], one[2] + two[2]};
}

void ConeUnit::finish() {
    const double rho = root * root;
    if (size == 1) {
        const double low = lower * root, high = upper * root;
        z[0] = z[0] - rho * u[0] <= low ? low : std::clamp(z[0], low, high);
        return;
    }
    const double mu = friction, slide = mu * length(u[1], u[2]);
    const double a0 = z[0] - rho * (u[0] + slide);
    const double a1 = z[1] / mu - rho * mu * u[1], a2 = z[2] / mu - rho * mu * u[2];
    if (z[0] <= 0.0 || a0 <= -length(a1, a2)) {
        z = {};
        return;
    }
    const double bound = mu * z[0], reach = length(z[1], z[2]);
    if (reach > bound)
        for (int i = 1; i < 3; ++i) z[i] *= bound / reach;
}

}  // namespace spook

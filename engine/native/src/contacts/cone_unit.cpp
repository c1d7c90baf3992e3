#include "contacts/cone_unit.hpp"

#include <algorithm>
#include <cmath>

#include "linear/elementary.hpp"

namespace spook {

void ConeFour::clear(int of_size) {
    *this = ConeFour{};
    size = of_size;
    pushing = true;
    std::fill_n(friction, most, 1.0);
    std::fill_n(root, most, 1.0);
    std::fill_n(over, most, 1.0);
    std::fill_n(along, most, 1.0);
    std::fill_n(upper, most, unbounded);
}

void ConeFour::soften(int at) noexcept {
    double m[9], left[9];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) m[3 * i + j] = (i == j) + k[3 * i + j][at] * softness[j][at];
    for (int i = 0; i < 9; ++i) left[i] = i % 4 == 0;
    for (int p = 0; p < 3; ++p) {
        const double over_pivot = 1.0 / m[4 * p];
        for (int j = 0; j < 3; ++j) m[3 * p + j] *= over_pivot, left[3 * p + j] *= over_pivot;
        for (int i = 0; i < 3; ++i) {
            if (i == p) continue;
            const double f = m[3 * i + p];
            for (int j = 0; j < 3; ++j)
                m[3 * i + j] -= f * m[3 * p + j], left[3 * i + j] -= f * left[3 * p + j];
        }
    }
    double softened[9];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            softened[3 * i + j] =
                left[3 * i] * k[j][at] + left[3 * i + 1] * k[3 + j][at] + left[3 * i + 2] * k[6 + j][at];
    for (int i = 0; i < 9; ++i) g[i][at] = left[i], k[i][at] = softened[i];
}

void ConeFour::finish(int i) noexcept {
    const double scale = root[i], rho = scale * scale;
    double& z0 = z[0][i];
    if (size == 1) {
        const double low = lower[i] * scale, high = upper[i] * scale;
        z0 = z0 - rho * u[0][i] <= low ? low : std::clamp(z0, low, high);
        return;
    }
    const double mu = friction[i], slide = mu * length(u[1][i], u[2][i]);
    const double a0 = z0 - rho * (u[0][i] + slide);
    const double a1 = z[1][i] / mu - rho * mu * u[1][i], a2 = z[2][i] / mu - rho * mu * u[2][i];
    if (z0 <= 0.0 || a0 <= -length(a1, a2)) {
        z0 = z[1][i] = z[2][i] = 0.0;
        return;
    }
    const double bound = mu * z0, reach = length(z[1][i], z[2][i]);
    if (reach > bound)
        for (int k = 1; k < 3; ++k) z[k][i] *= bound / reach;
}

}  // namespace spook

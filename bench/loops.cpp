// The particle scenes as loops written by hand: what a programmer would write for only this scene.
// Same arithmetic as the engine's plain SPOOK step, -O3, no fast-math. Each returns a number of the end state so
// that nothing is optimised away; h = 1/60 s, g = 9.81 m/s².
#include <cmath>
#include <vector>

namespace {

constexpr double H = 1.0 / 60.0, G = 9.81, EPS = 1e-13;
constexpr double VIOLATION = 4.0 / (H * 5.0), VELOCITY = 0.8, SOFT = 4.0 * EPS / (H * H * 5.0);  // tau = h

}  // namespace

extern "C" {

double falling(long steps) {
    double x[3] = {0, 0, 0}, v[3] = {0, 0, 0};
    const double kick[3] = {0, 0, -H * G};
    for (long n = 0; n < steps; ++n)
        for (int i = 0; i < 3; ++i) {
            v[i] += kick[i];
            x[i] += H * v[i];
        }
    return x[2];
}

double planetarium(long steps) {
    const double k = 2.0 * M_PI / 365.0, xi = 0.017, strength = k * k;
    double x[3] = {1, 0, 0}, v[3] = {-xi * k, k, 0};
    for (long n = 0; n < steps; ++n) {
        const double r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
        const double pull = H * strength / (r2 * std::sqrt(r2));
        for (int i = 0; i < 3; ++i) {
            v[i] -= pull * x[i];
            x[i] += H * v[i];
        }
    }
    return x[0];
}

double pendulum(long steps) {
    double x[3] = {1, 0, 0}, v[3] = {0, 0, 0};
    const double kick[3] = {0, 0, -H * G};
    for (long n = 0; n < steps; ++n) {
        const double length = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), inverse = 1.0 / length;
        const double u[3] = {inverse * x[0], inverse * x[1], inverse * x[2]};
        const double rate = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
        const double pushed = u[0] * kick[0] + u[1] * kick[1] + u[2] * kick[2];
        const double lambda = (-VIOLATION * (length - 1.0) - VELOCITY * rate - pushed) / (1.0 + SOFT);
        for (int i = 0; i < 3; ++i) {
            v[i] += lambda * u[i] + kick[i];
            x[i] += H * v[i];
        }
    }
    return x[0];
}

double chain(long links, long steps) {
    const auto n = static_cast<std::size_t>(links);
    std::vector<double> x(3 * n + 3), v(3 * n + 3), u(3 * n), y(n), lower(n), inverse(n);
    for (std::size_t k = 0; k <= n; ++k) x[3 * k] = static_cast<double>(k);
    for (long step = 0; step < steps; ++step) {
        for (std::size_t k = 0; k < n; ++k) {
            double d[3], w[3];
            for (int i = 0; i < 3; ++i) {
                d[i] = x[3 * k + 3 + i] - x[3 * k + i];
                w[i] = v[3 * k + 3 + i] - v[3 * k + i];
            }
            const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), scale = 1.0 / length;
            for (int i = 0; i < 3; ++i) u[3 * k + i] = scale * d[i];
            const double rate = u[3 * k] * w[0] + u[3 * k + 1] * w[1] + u[3 * k + 2] * w[2];
            double rhs = -VIOLATION * (length - 1.0) - VELOCITY * rate, pivot = (k ? 2.0 : 1.0) + SOFT;
            if (k == 0) rhs += H * G * u[2];
            else {
                const double off = -(u[3 * k] * u[3 * k - 3] + u[3 * k + 1] * u[3 * k - 2] + u[3 * k + 2] * u[3 * k - 1]);
                lower[k] = off * inverse[k - 1];
                pivot -= lower[k] * off;
                rhs -= lower[k] * y[k - 1];
            }
            inverse[k] = 1.0 / pivot;
            y[k] = rhs;
        }
        double above = 0.0;
        for (std::size_t k = n; k-- > 0;) {
            const double lambda = y[k] * inverse[k] - (k + 1 < n ? lower[k + 1] * above : 0.0);
            for (int i = 0; i < 3; ++i) {
                v[3 * k + 3 + i] += lambda * u[3 * k + i];
                if (k) v[3 * k + i] -= lambda * u[3 * k + i];
            }
            above = lambda;
        }
        for (std::size_t k = 1; k <= n; ++k) {
            v[3 * k + 2] -= H * G;
            for (int i = 0; i < 3; ++i) x[3 * k + i] += H * v[3 * k + i];
        }
    }
    return x[3 * n];
}

}  // extern "C"

// The hot loops: what advance() does when a scene needs no more. Operation for operation the arithmetic of the
// stages in particle_system.cpp and particle_paths.cpp, so a timed or observed run gives the same bits.
#include "particle_system.hpp"

#include <cmath>

namespace spook {

/// Bodies that nothing couples, under steady forces and at most one centre: each body flies its whole block of
/// steps with its state in registers.
void ParticleSystem::fly(std::int64_t steps) noexcept {
    const double h = h_;
    if (scene_.fields.empty()) {
        for (std::size_t node = 0; node < x_.size(); ++node) {
            Vec3 x = x_[node], v = v_[node];
            const Vec3 kick = steady_kick_[node];
            for (std::int64_t step = 0; step < steps; ++step) {
                v += kick;
                x += h * v;
            }
            x_[node] = x;
            v_[node] = v;
        }
        return;
    }
    const Vec3 centre = scene_.fields[0].centre;
    const double pull = h * scene_.fields[0].strength;
    for (std::size_t node = 0; node < x_.size(); ++node) {
        Vec3 x = x_[node], v = v_[node];
        const Vec3 kick = steady_kick_[node];
        for (std::int64_t step = 0; step < steps; ++step) {
            const Vec3 d = x - centre;
            const double r2 = dot(d, d), r = std::sqrt(r2);
            v += kick - (pull / (r2 * r)) * d;
            x += h * v;
        }
        x_[node] = x;
        v_[node] = v;
    }
}

/// Open paths under steady forces: geometry and elimination in one pass down, impulses and motion in one up.
void ParticleSystem::swing(std::int64_t steps) noexcept {
    const double h = h_;
    Vec3* const x = x_.data();
    Vec3* const v = v_.data();
    const Vec3* const kick = steady_kick_.data();
    const double* const w = w_.data();
    Link* const link = link_.data();
    const Row* const row = row_.data();
    const std::size_t paths = path_first_.size() - 1;
    const int nodes = static_cast<int>(x_.size()), on_paths = static_cast<int>(row_.size() + paths);
    for (std::int64_t step = 0; step < steps; ++step) {
        int node = 0;
        for (std::size_t path = 0; path < paths; ++path) {
            const int first = path_first_[path], end = path_first_[path + 1];
            Vec3 xa = x[node], va = v[node], ka = kick[node], u_above;
            double inverse = 0.0, y = 0.0;
            for (int k = first; k < end; ++k) {
                const Row& r = row[k];
                const Vec3 xb = x[node + 1], vb = v[node + 1], kb = kick[node + 1];
                const Vec3 d = xb - xa;
                const double length = norm(d);
                const Vec3 u = (1.0 / length) * d;
                const double g = length - r.rest;
                const double rhs = -r.violation_gain * g - r.velocity_gain * dot(u, vb - va) - dot(u, kb - ka);
                double lower = 0.0;
                if (k == first) {
                    y = rhs;
                    inverse = 1.0 / r.diagonal;
                } else {
                    const double off = -w[node] * dot(u_above, u);
                    lower = off * inverse;
                    inverse = 1.0 / (r.diagonal - lower * off);
                    y = rhs - lower * y;
                }
                link[k].u = u;
                link[k].lambda = y;
                link[k].lower = lower;
                link[k].pivot_inverse = inverse;
                xa = xb;
                va = vb;
                ka = kb;
                u_above = u;
                ++node;
            }
            // `node` is the last of the path: go up again.
            Vec3 out;
            double lambda = 0.0, lower_below = 0.0;
            for (int k = end - 1, at = node; k >= first; --k, --at) {
                const double above = link[k].lambda * link[k].pivot_inverse;
                lambda = k == end - 1 ? above : above - lower_below * lambda;
                lower_below = link[k].lower;
                link[k].lambda = lambda;
                const Vec3 in = lambda * link[k].u;
                v[at] += kick[at] + w[at] * (k == end - 1 ? in : in - out);
                x[at] += h * v[at];
                out = in;
            }
            const int top = node - (end - first);
            v[top] += kick[top] + w[top] * (Vec3{} - out);
            x[top] += h * v[top];
            ++node;
        }
        for (node = on_paths; node < nodes; ++node) {
            v[node] += kick[node];
            x[node] += h * v[node];
        }
    }
}

}  // namespace spook

// The hot loops: what advance() does when a scene needs no more. Operation for operation the arithmetic of the
// stages in particle_system.cpp and open_paths.cpp, so a timed or observed run gives the same bits.
#include "particles/particle_system.hpp"

#include <algorithm>
#include <cmath>

namespace spook {

namespace {

/// Component by component: copied whole, a Vec3 goes through the stack, where one load waits for two stores.
inline void put(Vec3& place, Vec3 value) noexcept {
    place.x = value.x;
    place.y = value.y;
    place.z = value.z;
}

}  // namespace

/// Bodies that nothing couples, under steady forces and at most one centre: each body flies its whole block of
/// steps with its state in registers.
void ParticleSystem::fly(std::int64_t steps) noexcept {
    const double h = parts_.h;
    if (parts_.forces.fields().empty()) {
        for (std::size_t node = 0; node < nodes_.x.size(); ++node) {
            Vec3 x = nodes_.x[node], v = nodes_.v[node];
            const Vec3 kick = nodes_.steady_kick[node];
            for (std::int64_t step = 0; step < steps; ++step) {
                v += kick;
                x += h * v;
            }
            nodes_.x[node] = x;
            nodes_.v[node] = v;
        }
        return;
    }
    const Vec3 centre = parts_.forces.fields()[0].centre;
    const double pull = h * parts_.forces.fields()[0].strength;
    for (std::size_t node = 0; node < nodes_.x.size(); ++node) {
        Vec3 x = nodes_.x[node], v = nodes_.v[node];
        const Vec3 kick = nodes_.steady_kick[node];
        for (std::int64_t step = 0; step < steps; ++step) {
            const Vec3 d = x - centre;
            const double r2 = dot(d, d), r = std::sqrt(r2);
            v += kick - (pull / (r2 * r)) * d;
            x += h * v;
        }
        nodes_.x[node] = x;
        nodes_.v[node] = v;
    }
}

/// Open paths under steady forces: geometry and elimination in one pass down, impulses and motion in one up.
/// Each correction of the curvature adds a pass down, with the same factor, and one up.
template <bool Curved> void ParticleSystem::swing_by(std::int64_t steps) noexcept {
    const double h = parts_.h, fraction = scene_.method.correction_cap;
    const int corrections = Curved ? corrections_ : 0;
    Vec3* const x = nodes_.x.data();
    Vec3* const v = nodes_.v.data();
    Vec3* const trial = trial_.data();
    const Vec3* const kick = nodes_.steady_kick.data();
    const double* const w = nodes_.w.data();
    Link* const link = rows_.link.data();
    const Row* const row = rows_.row.data();
    double* const first_rhs = first_rhs_.data();
    const std::size_t paths = parts_.paths.first().size() - 1;
    const int nodes = static_cast<int>(nodes_.x.size()),
              on_paths = static_cast<int>(rows_.row.size() + paths);
    for (std::int64_t step = 0; step < steps; ++step) {
        int node = 0;
        for (std::size_t path = 0; path < paths; ++path) {
            const int first = parts_.paths.first()[path], end = parts_.paths.first()[path + 1], top = node;
            Vec3 xa = x[node], va = v[node], ka = kick[node], u_above;
            double inverse = 0.0, y = 0.0;
            for (int k = first; k < end; ++k, ++node) {
                const Row& r = row[k];
                const Vec3 xb = x[node + 1], vb = v[node + 1], kb = kick[node + 1], dv = vb - va;
                const Vec3 d = xb - xa;
                const double length = norm(d);
                const Vec3 u = (1.0 / length) * d;
                const double g = length - r.rest;
                double rhs = -r.violation_gain * g - r.velocity_gain * dot(u, dv) - dot(u, kb - ka);
                if constexpr (Curved) {
                    const double back = std::min(fraction * r.rest, curvature(u, length, -h * dv));
                    rhs -= r.violation_gain * 0.25 * back;
                    first_rhs[k] = rhs;
                    link[k].length = length;
                }
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
                link[k].y = y;
                link[k].lower = lower;
                link[k].pivot_inverse = inverse;
                xa = xb;
                va = vb;
                ka = kb;
                u_above = u;
            }
            for (int round = 0;; ++round) {
                const bool last = !Curved || round == corrections;
                Vec3 out;
                double lambda = 0.0, lower_below = 0.0;
                for (int k = end - 1, at = node; k >= first; --k, --at) {
                    const double above = link[k].y * link[k].pivot_inverse;
                    lambda = k == end - 1 ? above : above - lower_below * lambda;
                    lower_below = link[k].lower;
                    link[k].lambda = lambda;
                    const Vec3 in = lambda * link[k].u;
                    const Vec3 moved = v[at] + (kick[at] + w[at] * (k == end - 1 ? in : in - out));
                    out = in;
                    if (last) {
                        put(v[at], moved);
                        x[at] += h * moved;
                    } else {
                        put(trial[at], moved);
                    }
                }
                const Vec3 moved = v[top] + (kick[top] + w[top] * (Vec3{} - out));
                if (last) {
                    put(v[top], moved);
                    x[top] += h * moved;
                    break;
                }
                put(trial[top], moved);
                y = 0.0;
                for (int k = first, at = top; k < end; ++k, ++at) {
                    const Row& r = row[k];
                    const double ahead =
                        std::min(fraction * r.rest,
                                 curvature(link[k].u, link[k].length, h * (trial[at + 1] - trial[at])));
                    const double rhs = first_rhs[k] - r.violation_gain * (0.25 + r.relaxation) * ahead;
                    y = k == first ? rhs : rhs - link[k].lower * y;
                    link[k].y = y;
                }
            }
            ++node;
        }
        for (node = on_paths; node < nodes; ++node) {
            v[node] += kick[node];
            x[node] += h * v[node];
        }
    }
}

void ParticleSystem::swing(std::int64_t steps) noexcept {
    if (corrections_ > 0) swing_by<true>(steps);
    else swing_by<false>(steps);
}

}  // namespace spook

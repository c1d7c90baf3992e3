#include "particles/distance_rows.hpp"

namespace spook {

void DistanceRows::assemble(const Nodes& nodes) noexcept {
    for (std::size_t k = 0; k < row.size(); ++k) {
        const Row& r = row[k];
        Link& l = link[k];
        const Vec3 d = nodes.x[r.b] - nodes.x[r.a];
        const double length = norm(d);
        const Vec3 u = (1.0 / length) * d;
        l.u = u;
        l.length = length;
        l.g = length - r.rest;
        l.rhs = -r.violation_gain * l.g - r.velocity_gain * dot(u, nodes.v[r.b] - nodes.v[r.a]) -
                dot(u, nodes.kick[r.b] - nodes.kick[r.a]);
    }
}

void DistanceRows::push(const Nodes& nodes, std::vector<Vec3>& v) const noexcept {
    for (std::size_t k = 0; k < row.size(); ++k) {
        const Vec3 impulse = link[k].lambda * link[k].u;
        v[row[k].a] -= nodes.w[row[k].a] * impulse;
        v[row[k].b] += nodes.w[row[k].b] * impulse;
    }
}

}  // namespace spook

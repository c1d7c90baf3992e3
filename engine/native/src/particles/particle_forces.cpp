#include "particles/particle_forces.hpp"

#include <cmath>

namespace spook {

void ParticleForces::take_springs(const std::vector<SpringForce>& springs, Nodes& nodes) {
    for (const SpringForce& spring : springs) {
        int node[2];
        for (int side = 0; side < 2; ++side) {
            const End& end = spring.ends[side];
            node[side] = end.body >= 0 ? nodes.of_body[end.body] : nodes.add(end.point);
        }
        springs_.push_back({node[0], node[1], spring});
    }
}

void ParticleForces::add_attraction(Nodes& nodes, double time_step) const noexcept {
    for (const CentralField& field : fields_)
        for (std::size_t node = 0; node < nodes.x.size(); ++node) {
            if (nodes.w[node] == 0.0) continue;
            const Vec3 d = nodes.x[node] - field.centre;
            const double r2 = dot(d, d), r = std::sqrt(r2);
            nodes.kick[node] = nodes.kick[node] - (time_step * field.strength / (r2 * r)) * d;
        }
}

void ParticleForces::add_springs(Nodes& nodes, double time_step) const noexcept {
    for (const SpringNodes& s : springs_) {
        const Vec3 pull = spook::pull(s.spring, nodes.x[s.b] - nodes.x[s.a], nodes.v[s.b] - nodes.v[s.a]);
        nodes.kick[s.a] += (time_step * nodes.w[s.a]) * pull;
        nodes.kick[s.b] -= (time_step * nodes.w[s.b]) * pull;
    }
}

double ParticleForces::spring_energy(const Nodes& nodes, double sum) const noexcept {
    for (const SpringNodes& s : springs_) sum += energy(s.spring, nodes.x[s.b] - nodes.x[s.a]);
    return sum;
}

}  // namespace spook

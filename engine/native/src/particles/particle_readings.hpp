// What can be seen of particles and their rows at the current sample; see particle_samples.cpp.
#pragma once

#include "particles/particle_parts.hpp"

namespace spook {

class ParticleReadings {
public:
    ParticleReadings(const ParticleScene& scene, const ParticleParts& parts, const Seen& seen) noexcept
        : scene_(scene), parts_(parts), seen_(seen) {}

    int bodies() const noexcept { return static_cast<int>(scene_.bodies.size()); }
    int rows() const noexcept { return static_cast<int>(scene_.rows.size()); }
    double mass(int body) const noexcept { return scene_.bodies[body].mass; }
    Vec3 position(int body) const noexcept { return parts_.nodes.x[parts_.nodes.of_body[body]]; }
    Vec3 velocity(int body) const noexcept { return seen_.v[parts_.nodes.of_body[body]]; }
    /// m, and N, positive where it pulls.
    double violation(int row) const noexcept;
    double tension(int row) const noexcept { return -seen_.lambda[parts_.rows.slot[row]] / parts_.h; }
    double kinetic_energy() const noexcept;
    double potential_energy() const noexcept;

private:
    const ParticleScene& scene_;
    const ParticleParts& parts_;
    const Seen& seen_;
};

}  // namespace spook

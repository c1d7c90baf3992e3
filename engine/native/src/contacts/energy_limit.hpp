// What a solve that did not settle may leave: its impulses are shortened so that the energy does not rise.
#pragma once

#include <functional>
#include <vector>

#include "contacts/contact_points.hpp"
#include "contacts/islands.hpp"
#include "contacts/step_motion.hpp"

namespace spook {

class EnergyLimit {
public:
    /// There may be as many islands as bodies, however late; a copy has no room for them.
    void reserve(std::size_t bodies) { sums_.reserve(bodies); }
    /// Per moving body: what is left of the impulses of its island, where a solve that did not settle would raise
    /// the energy; all of it in islands that joints hold or something drives. Shortens the velocities alike. Islands are of the
    /// points that `pushes` tells of, as the projection's are: what merely lies near pays for no gain.
    const std::vector<double>& shorten(MixedSystem& system, std::size_t joints, const StepMotion& motion,
                                       const ContactPoints& points,
                                       const std::function<bool(std::size_t)>& pushes);

private:
    struct Sums {
        double square = 0.0, linear = 0.0, fall = 0.0;  // E₊ − E = square s² + linear s − fall
        bool driven = false;
    };
    std::vector<double> share_;
    std::vector<char> pushes_;         // by point
    std::vector<Sums> sums_;           // by island
    std::vector<Vec6> free_velocity_;  // per moving body
    IslandFinder connected_;
};

}  // namespace spook

// Forces on particles that depend on where they are: springs and centres of gravity.
#pragma once

#include <vector>

#include "particles/particle_nodes.hpp"
#include "run/forces.hpp"

namespace spook {

class ParticleForces {
public:
    void take_fields(const std::vector<CentralField>& fields) { fields_ = fields; }
    /// Places the ends of the springs among the nodes, which get new ones for points of the world.
    void take_springs(const std::vector<SpringForce>& springs, Nodes& nodes);

    const std::vector<CentralField>& fields() const noexcept { return fields_; }
    std::size_t springs() const noexcept { return springs_.size(); }
    /// Whether any of these forces acts, so that kicks differ from step to step.
    bool any() const noexcept { return !fields_.empty() || !springs_.empty(); }

    void add_attraction(Nodes& nodes, double time_step) const noexcept;
    void add_springs(Nodes& nodes, double time_step) const noexcept;
    /// Steady kicks, and those of these forces at the nodes' state.
    void find_kicks(Nodes& nodes, double time_step) const noexcept {
        nodes.kick = nodes.steady_kick;
        if (!fields_.empty()) add_attraction(nodes, time_step);
        if (!springs_.empty()) add_springs(nodes, time_step);
    }
    /// Energy of the springs [J].
    double spring_energy(const Nodes& nodes, double sum) const noexcept;

private:
    struct SpringNodes {
        int a, b;
        SpringForce spring;
    };
    std::vector<CentralField> fields_;
    std::vector<SpringNodes> springs_;
};

}  // namespace spook

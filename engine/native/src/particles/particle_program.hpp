// A compiled particle scene with its observables: what Python holds and runs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "particles/particle_system.hpp"

namespace spook {

/// A quantity by its name; `index` is a body or row (−1: all), `point` the centre of an angular momentum.
struct QuantityRequest {
    std::string kind;
    int index = -1;
    Vec3 point;
};

class ParticleProgram {
public:
    ParticleProgram(const ParticleScene& scene, const std::vector<QuantityRequest>& quantities,
                    std::vector<Observation> observations);

    /// Run from the start. time_limit in s, 0 for none; timed asks for seconds by stage.
    RunReport run(std::int64_t steps, double time_limit, bool timed);
    const char* solver() const noexcept;
    bool held_twice() const noexcept { return system_.held_twice(); }

private:
    ParticleSystem system_;
    Recorder recorder_;
};

/// The sampler of a quantity; it reads `system`, which must outlive it. Throws std::invalid_argument.
Sampler particle_sampler(const ParticleSystem& system, const QuantityRequest& request);

}  // namespace spook

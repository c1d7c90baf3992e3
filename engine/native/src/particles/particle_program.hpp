// A compiled particle scene with its observables.
#pragma once

#include "particles/particle_stages.hpp"
#include "particles/particle_system.hpp"
#include "run/program.hpp"

namespace spook {

/// The sampler of a quantity; it reads `system`, which must outlive it. Throws std::invalid_argument.
Sampler sampler_of(ParticleSystem& system, const QuantityRequest& request);

using ParticleProgram = Program<ParticleSystem>;

}  // namespace spook

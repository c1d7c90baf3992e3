// A compiled rigid-body scene with its observables.
#pragma once

#include "rigid/rigid_stages.hpp"
#include "rigid/rigid_system.hpp"
#include "run/program.hpp"

namespace spook {

/// The sampler of a quantity; it reads `system`, which must outlive it. Throws std::invalid_argument.
Sampler sampler_of(RigidSystem& system, const QuantityRequest& request);

using RigidProgram = Program<RigidSystem>;

}  // namespace spook

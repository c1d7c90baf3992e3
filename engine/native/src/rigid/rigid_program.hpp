// A compiled rigid-body scene with its observables.
#pragma once

#include "rigid/rigid_stages.hpp"
#include "rigid/rigid_system.hpp"
#include "run/program.hpp"

namespace spook {

/// The sampler of a quantity; it reads `system`, which must outlive it. Throws std::invalid_argument.
Sampler sampler_of(RigidSystem& system, const QuantityRequest& request);

<<<<<<< HEAD
    /// Run from the start. time_limit in s, 0 for none; timed asks for seconds by stage.
    RunReport run(std::int64_t steps, double time_limit, bool timed);
    const char* solver() const noexcept;
    bool contacts_possible() const noexcept { return system_.contacts_possible(); }

private:
    int substeps_;
    RigidSystem system_;
    Recorder recorder_;
};
=======
using RigidProgram = Program<RigidSystem>;
>>>>>>> main

}  // namespace spook

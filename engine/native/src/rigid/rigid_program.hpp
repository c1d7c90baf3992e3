// A compiled rigid-body scene with its observables: what Python holds and runs.
#pragma once

#include <string>
#include <vector>

#include "particles/particle_program.hpp"
#include "rigid/rigid_system.hpp"

namespace spook {

/// Quantities are those of QuantityRequest; two more use `index`: "joint_coordinate" (joint) and
/// "contact_force" (body, and `other` in point.x, −1 for all).
class RigidProgram {
public:
    RigidProgram(const RigidScene& scene, const std::vector<QuantityRequest>& quantities,
                 std::vector<Observation> observations);

    /// Run from the start. time_limit in s, 0 for none; timed asks for seconds by stage.
    RunReport run(std::int64_t steps, double time_limit, bool timed);
    const char* solver() const noexcept;
    bool contacts_possible() const noexcept { return system_.contacts_possible(); }

private:
    RigidSystem system_;
    Recorder recorder_;
};

}  // namespace spook

// Velocities at mid-step: the step is the variational one, and only the start has to be found; see rigid_half_step.cpp.
#pragma once

#include <functional>

#include "rigid/block_rows.hpp"

namespace spook {

class HalfStep {
public:
    HalfStep(const RigidModel& model, RigidState& live, JointSet& joints, Forces& forces,
             BlockRows& rows) noexcept
        : model_(model), live_(live), joints_(joints), forces_(forces), rows_(rows) {}

    /// Velocities half a step back, with the accelerations that the rows allow.
    void start();
    /// The same with contacts. `find_velocities` solves the coming step where it stands; `begin_again` forgets what it left.
    void start_touching(const std::function<void()>& find_velocities,
                        const std::function<void()>& begin_again);
    /// What the step begins with.
    void note_before();
    /// Velocities at the sample: the mean of those half a step before and after, less what an impact within the step makes
    /// of them, which comes later: what it changed was taken from those before.
    void read();

private:
    void go_back(int body, Vec3 velocity, Vec3 momentum) noexcept;

    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    Forces& forces_;
    BlockRows& rows_;
};

}  // namespace spook

// Islands at rest are left out of the steps until something comes to them; see sleep.cpp and wake.cpp.
#pragma once

#include <vector>

#include "rigid/block_rows.hpp"
#include "rigid/mixed_rows.hpp"
#include "rigid/sleep.hpp"

namespace spook {

class Sleeping {
public:
    Sleeping(const RigidModel& model, RigidState& live, JointSet& joints, const Forces& forces,
             const BlockRows& rows, MixedRows& mixed, StepScratch& scratch) noexcept
        : model_(model),
          live_(live),
          joints_(joints),
          forces_(forces),
          rows_(rows),
          mixed_(mixed),
          scratch_(scratch) {}

    void take(const RigidScene& scene);
    bool is_on() const noexcept { return rules_.on(); }
    void begin();
    /// Where bodies are as a step begins, and how fast before their velocities are found.
    void note_places();
    void note_velocities();

    /// The stage: what a body that moves as it is told touches or holds is awake.
    void wake();
    /// Whether nothing moves: then the step is over, and slept through.
    bool sleep_through();
    /// Wakes the islands of some bodies; what is awake begins anew to be at rest.
    void wake(const std::vector<int>& met);
    /// What acts on a body, or on a joint, has been changed from outside.
    void wake_body(int body);
    void wake_joint(int joint);
    /// The stage, at the end of a step: what was met by a displaced body is awake, and islands that have been at rest fall asleep.
    void sleep();

private:
    struct Place {
        Vec3 displacement, velocity;
        Quat turn;
    };
    bool is_moving(int body) const noexcept;
    double surface_speed(int body) const noexcept;
    bool still(int body) noexcept;
    bool count_still_steps();
    const Islands& find_islands(std::vector<char>& kept_up);
    void keep_jacobians();

    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    const Forces& forces_;
    const BlockRows& rows_;
    MixedRows& mixed_;
    StepScratch& scratch_;
    SleepRules rules_;
    std::vector<Place> start_places_;  // per body: where it was, and how fast, as the step began
};

}  // namespace spook

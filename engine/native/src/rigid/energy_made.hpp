// Energy that comes out of nothing; see energy_made.cpp.
#pragma once

#include "rigid/forces.hpp"
#include "run/report.hpp"

namespace spook {

class EnergyMade {
public:
    EnergyMade(const RigidModel& model, RigidState& live, const JointSet& joints,
               const Forces& forces) noexcept
        : model_(model), live_(live), joints_(joints), forces_(forces) {}

    void begin();
    /// Whether this step is to be noted: what it came to, or with velocities at mid-step what the one before came to.
    bool is_due() const noexcept;
    void note(double penetration);
    /// Asked once the final state was read.
    void judge(RunReport& report) const;

private:
    bool has_power() const noexcept;
    double lost_in_the_mean() const noexcept;

    const RigidModel& model_;
    RigidState& live_;
    const JointSet& joints_;
    const Forces& forces_;
};

/// Energy that impacts were to give back and did not. Asked at the end of a run.
void judge_stopped(const RigidModel& model, const RigidState& live, RunReport& report);

}  // namespace spook

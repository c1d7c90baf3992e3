// Stops of joints, rows that only push one way: limits of free coordinates, and wires that may go slack. What they ask for is said
// here; they are solved with all other rows (solve_velocities.cpp), and rebound in impacts (contacts/impact_solver.hpp).
//
// reads: the time step. writes: what the states of joints say of stops.
#pragma once

#include <limits>
#include <utility>
#include <vector>

#include "contacts/pivot_system.hpp"
#include "linear/regularisation.hpp"
#include "rigid/joint_state.hpp"

namespace spook {

class JointStops {
public:
    explicit JointStops(double time_step) noexcept : time_step_(time_step) {}

    void add(int joint) { joints_.push_back(joint); }
    /// From now on in this step a stop that is hit, or by turns with its other end, is met at the times of these impacts, or none is.
    void fold(bool folds, LargeArray<JointState>& states) noexcept {
        fold_ = folds;
        for (const int joint : joints_) states[joint].folds = false;
    }
    /// Whether some limit was assembled, since this was asked last, that a step does not end at by its velocities: the scene
    /// began beyond it, or it was hit.
    bool take_some_overstepped() noexcept { return std::exchange(some_overstepped_, false); }
    /// A new step: whose stops were closed in the one before is known from then on, however often rows are assembled.
    void begin_step(LargeArray<JointState>& states) noexcept {
        for (const int joint : joints_) {
            states[joint].at_limit = states[joint].folds ? 0 : states[joint].closed;
            states[joint].rebounds = 0.0;
            states[joint].met = 0;
            states[joint].folds = states[joint].late = false;
            states[joint].push = std::numeric_limits<double>::quiet_NaN();
        }
    }
    /// The right side of a row that only pushes `inwards`; what else its solver needs to know is put into `stop`.
    double right(double inwards, double violation, double rate, const Regularisation& row, double restitution,
                 double room, JointState& state, StopRow& stop) noexcept;

private:
    bool is_met(bool open, double approach, double restitution, const JointState& state,
                StopRow& stop) const noexcept;
    double meet(double inwards, double violation, double rate, double restitution, JointState& state,
                StopRow& stop) noexcept;

    double time_step_;
    bool some_overstepped_ = false, fold_ = false;
    std::vector<int> joints_;
};

}  // namespace spook

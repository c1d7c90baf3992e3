// Stops of joints, rows that only push one way: limits of free coordinates, and wires that may go slack. What they ask for is said
// here; they are solved with all other rows (solve_velocities.cpp), and rebound in impacts (contacts/impact_solver.hpp).
//
// reads: the time step. writes: what the states of joints say of stops.
#pragma once

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
    /// From now on a stop that is hit several times in a step, by turns with its other end, gives back what all of these leave.
    void let_fold() noexcept { fold_ = true; }
    /// Whether some limit was assembled, since this was asked last, that a step does not end at by its velocities: the scene
    /// began beyond it, or it folds.
    bool take_some_overstepped() noexcept { return std::exchange(some_overstepped_, false); }
    /// A new step: whose stops were closed in the one before is known from then on, however often rows are assembled.
    void begin_step(LargeArray<JointState>& states) noexcept {
        for (const int joint : joints_) {
            states[joint].at_limit = states[joint].closed;
            states[joint].rebounds = 0.0;
            states[joint].met = 0;
            states[joint].folds = false;
        }
    }
    /// The right side of a row that only pushes `inwards`; what else its solver needs to know is put into `stop`.
    double right(double inwards, double violation, double rate, const Regularisation& row, double restitution,
                 double room, JointState& state, StopRow& stop) noexcept;

private:
    double fold(double inwards, double violation, double approach, double restitution, JointState& state,
                StopRow& stop) noexcept;

    double time_step_;
    bool some_overstepped_ = false, fold_ = false;
    std::vector<int> joints_;
};

}  // namespace spook

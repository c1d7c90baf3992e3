// The velocities of a step whose rows all hold: by links where locks make trees, else by one factorisation; see rigid_solve.cpp.
#pragma once

#include "rigid/block_rows.hpp"
#include "rigid/locked_tree.hpp"
#include "rigid/loop_watch.hpp"
#include "rigid/row_curvature.hpp"
#include "rigid/step_scratch.hpp"
#include "rigid/string_stiffness.hpp"

namespace spook {

class BilateralSolve {
public:
    BilateralSolve(const RigidModel& model, RigidState& live, JointSet& joints, Forces& forces,
                   BlockRows& rows, MixedRows& mixed, RowCurvature& curvature, StepScratch& scratch,
                   const StageTimer& clock) noexcept
        : loops(model, live, joints, rows, forces),
          stiffness(model, live, joints, forces, rows, mixed),
          model_(model),
          live_(live),
          joints_(joints),
          forces_(forces),
          rows_(rows),
          curvature_(curvature),
          scratch_(scratch),
          clock_(clock) {}

    LoopWatch loops;
    StringStiffness stiffness;

    /// Whether all joints are locks that make trees, and are to be solved link by link.
    Refusal take_links() { return locked_.analyse(model_.constants, joints_, model_.constrained); }
    /// By the solver that was chosen.
    void take();
    void begin();
    /// Solved link by link, without a matrix.
    bool by_links() const noexcept { return model_.solver == Solver::links; }
    LockedTree::Counters counters() const noexcept { return locked_.counters(); }

    /// Finds the velocities; `ahead`: into scratch.next, to see what they lead to, before they are taken. False where the
    /// system cannot be solved.
    bool find(bool ahead);
    void take_velocities(bool ahead);
    /// Whether bodies were moved while at hand, asked once.
    bool take_moved() noexcept { return std::exchange(moved_, false); }
    /// The multipliers of the last step, which no reader has asked for so far; or none will.
    void deliver();
    void forget() noexcept { undelivered_ = false; }

private:
    bool find_by_links(bool ahead);
    void take(int body, const Twist& v) noexcept;
    bool moves_at_once() const noexcept { return !clock_.is_on() && !model_.half_step; }

    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    Forces& forces_;
    BlockRows& rows_;
    RowCurvature& curvature_;
    StepScratch& scratch_;
    const StageTimer& clock_;
    LockedTree locked_;
    bool undelivered_ = false;  // its multipliers are not in the joints yet
    bool moved_ = false;
};

}  // namespace spook

// A scene of rigid bodies as all parts of its step read it.
#pragma once

#include <utility>
#include <vector>

#include "linear/large_array.hpp"
#include "rigid/joint_set.hpp"
#include "rigid/rigid_scene.hpp"
#include "rigid/rigid_state.hpp"
#include "rigid/solver.hpp"
#include "run/stages.hpp"

namespace spook {

struct RigidModel {
    RigidModel(StageList stages, Vec3 gravity, const RigidMethod& method)
        : stages(std::move(stages)),
          gravity(gravity),
          method(method),
          h(method.time_step / method.substeps) {}

    StageList stages;
    Vec3 gravity;
    RigidMethod method;
    double h;  // s, of one substep
    Solver solver = Solver::none;
    bool bilateral = false;  // there are joints, and a direct solver for rows that all hold
    // How the method goes beyond plain SPOOK; `curved`: whether RowCurvature does its corrections.
    bool composed = false, half_step = false, stiff = false, curved = false;
    bool rebounds = false;                // some surface or stop does
    LargeArray<BodyConstants> constants;  // the loads in them may be set between steps, see Forces
    LargeArray<BodyState> start;
    std::vector<int> constrained;   // dynamic bodies that have rows
    std::vector<int> free, driven;  // dynamic bodies that never have rows; kinematic ones
    std::vector<int> solver_index;  // per body: its place among the constrained bodies, −1

    /// One of a block's bodies that moves by itself.
    int mover(const JointBlock& block) const noexcept {
        return block.second >= 0 && constants[block.second].moves() ? block.second : block.first;
    }
    int bodies() const noexcept { return static_cast<int>(constants.size()); }
    /// Of a body among those of a state, world axes.
    Vec3 position(int body, const LargeArray<BodyState>& bodies) const noexcept {
        return spook::position(constants[body], bodies[body]);
    }
};

}  // namespace spook

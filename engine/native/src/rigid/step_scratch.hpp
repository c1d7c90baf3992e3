// What a step of rigid bodies fills anew: no stage reads of it what another step has left, which debug builds show (begin()).
// Memory is kept.
#pragma once

#include <vector>

#include "contacts/contact_islands.hpp"
#include "linear/large_array.hpp"
#include "linear/vec.hpp"
#include "rigid/joint_state.hpp"
#include "rigid/rigid_model.hpp"
#include "rigid/rigid_state.hpp"

namespace spook {

struct StepScratch {
    // detect(), per body of the scene:
    std::vector<Pose> poses;
    std::vector<Vec6> velocities, free_velocities, next;  // at the start; with forces; with joints as well
    struct Begun {
        Vec3 displacement;
        Quat turn;
        double energy = 0.0;  // twice the kinetic one
    };
    std::vector<Begun> start_of_contacts;  // of a step with contacts
    // solve_velocities():
    std::vector<int> other_ends;  // blocks of the step's joints whose stops have a row for each end
    std::vector<Vec6> impulses;   // of the step's impacts, per block of rows
    std::vector<char> touched;    // by JointSet::tree(): whether a body of it touches something
    std::vector<char> left_open;  // blocks of the step's joints that are not led back to where they hold
    struct Gone {                 // to an impact of the step
        double time = 0.0;        // s
        BodyState there;
    };
    std::vector<Gone> gone;      // by body, or empty
    bool led_by_joints = false;  // what moves has a good part of its energy from joints that are led back
    std::vector<char> anew;      // moving bodies whose next solve of the step knows nothing of the last one
    IslandSolver joint_solver;
    std::vector<std::size_t> rows;  // by island
    std::vector<char> answered;     // rows
    // project_positions():
    std::vector<Pose> end_poses;
    LargeArray<BodyState> before_projection;  // per body, before overlaps are projected out
    std::vector<double> dissipated;           // per island, see dissipated_energy()
    std::vector<std::vector<int>> island_members, island_blocks;  // per island: bodies, blocks of joints
    std::vector<double> overstep;                                 // per row of joints, before
    std::vector<std::size_t> overstep_at;                         // per block
    MixedSystem holding;
    std::vector<std::vector<FurtherBody>> holding_further;  // per block of joints, of its rows
    std::vector<int> place;               // of constrained bodies in their island, −1 of others
    LargeArray<JointState> joint_states;  // as they were before
    std::vector<char> beyond;             // project_limits(): islands beyond their limits
    IslandFinder finder;                  // of whatever is asked for
#ifndef NDEBUG
    void spoil() noexcept;  // step.cpp: what the step before has left is no number and no index
#endif
    void begin() {
        gone.clear();
#ifdef NDEBUG
        other_ends.clear();
        led_by_joints = false;
#else
        spoil();
#endif
    }
};

}  // namespace spook

// Arrays that a step of rigid bodies fills anew, kept for their memory.
#pragma once

#include <vector>

#include "contacts/contact_islands.hpp"
#include "linear/large_array.hpp"
#include "rigid/joint_set.hpp"

namespace spook {

struct StepArrays {
    IslandFinder finder;  // of whatever is asked for
    // hold_joints():
    std::vector<int> place;                    // of constrained bodies in their island, −1 of others
    LargeArray<JointSet::State> joint_states;  // as they were before
    std::vector<char> beyond;  // project_limits(): islands with something beyond its joint's limits
    // settle_joints():
    IslandSolver joint_solver;
    std::vector<std::size_t> rows;  // by island
    std::vector<char> answered;     // rows
};

}  // namespace spook

// The geometric stiffness of loaded joints, treated implicitly; see geometric_stiffness.cpp.
#pragma once

#include <vector>

#include "rigid/block_rows.hpp"
#include "rigid/mixed_rows.hpp"

namespace spook {

class StringStiffness {
public:
    StringStiffness(const RigidModel& model, RigidState& live, JointSet& joints, Forces& forces,
                    BlockRows& rows, MixedRows& mixed) noexcept
        : model_(model), live_(live), joints_(joints), forces_(forces), rows_(rows), mixed_(mixed) {}

    /// The forces at the start, which the stiffness of the first step is made of.
    void find_tensions();
    /// h²/4 K of every constrained body, from the forces of the step before.
    void add();
    /// Gives every floating island back the angular momentum that the stiffness took from its bodies.
    void keep_angular_momentum();

private:
    void find_islands();
    Vec3 turn_of(const std::vector<int>& members, Vec3 centre, Vec3 angular_momentum) const;

    const RigidModel& model_;
    RigidState& live_;
    JointSet& joints_;
    Forces& forces_;
    BlockRows& rows_;
    MixedRows& mixed_;                       // whose rows may be those of the last solve
    std::vector<std::vector<int>> islands_;  // of constrained bodies that nothing holds to the world
};

}  // namespace spook

// Some bodies as if they were one.
#pragma once

#include <vector>

#include "rigid/rigid_model.hpp"

namespace spook {

struct IslandFrame {
    Vec3 centre;   // of mass
    Mat3 inertia;  // about it
};

/// Of some constrained bodies, by their places among those.
IslandFrame island_frame(const RigidModel& model, const LargeArray<BodyState>& bodies,
                         const std::vector<int>& members);

}  // namespace spook

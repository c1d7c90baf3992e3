// Springs of free coordinates as forces −k (q − rest + τ q̇) along them, as compositions and Runge–Kutta take them.
//
// reads: places of bodies. writes: velocities and angular momenta; the angles of hinges, counted on.
#pragma once

#include "rigid/joint_set.hpp"

namespace spook {

/// Force and torque on a body per N or N m along the coordinate.
struct JointSpringPull {
    int body = -1;
    Vec3 force, torque;
};

/// Of each spring what it does to the bodies it moves, told to `take`.
template <class Take>
void pull_by_springs(JointSet& joints, const LargeArray<BodyConstants>& constants,
                     std::span<const BodyState> bodies, Take&& take) {
    for (const JointSpring& spring : joints.drives().springs()) {
        const JointBlock& block = joints.blocks()[spring.block];
        const AxialRow row = axial_row(joints.constants(block.joint), state_of(block.first, bodies),
                                       state_of(block.second, bodies));
        double& angle = joints.states[block.joint].angle;
        angle = joints.coordinate(block.joint, bodies);
        double pull = -spring.stiffness * (angle - spring.rest);
        if (spring.damping > 0.0) pull -= spring.stiffness * spring.damping * row.rate;
        for (const bool second : {false, true}) {
            const int body = second ? block.second : block.first;
            if (body < 0 || !constants[body].moves()) continue;
            const auto& along = second ? row.second : row.first;
            take(JointSpringPull{body, pull * Vec3{along[0], along[1], along[2]},
                                 pull * Vec3{along[3], along[4], along[5]}});
        }
    }
}

}  // namespace spook

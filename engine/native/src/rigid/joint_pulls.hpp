// What joints pull with at the arms of their bodies.
#pragma once

#include "rigid/joint_set.hpp"

namespace spook {

/// `look(body, arm, impulse)` for each end of a joint at a rigid body that is solved for: arm from its centre [m], impulse of
/// the last solve [N s]. `rows(k)`: those of block k on its second body.
template <class Indices, class Bodies, class Rows, class Look>
void each_pull(const JointSet& joints, const Indices& solver_index, const Bodies& constants, Rows&& rows,
               Look&& look) {
    for (std::size_t k = 0; k < joints.blocks().size(); ++k) {
        const JointBlock& block = joints.blocks()[k];
        if (block.axial) continue;
        const JointSet::State& state = joints.states[block.joint];
        const double* row = rows(static_cast<int>(k));
        Vec3 impulse;  // on the second body
        for (int i = 0; i < block.size; ++i, row += 6)
            impulse += state.multiplier[i] * Vec3{row[0], row[1], row[2]};
        for (const bool second : {false, true}) {
            const int body = second ? block.second : block.first;
            if (body < 0 || solver_index[body] < 0 || constants[body].particle) continue;
            look(body, second ? state.second_reach : state.first_reach, second ? impulse : -impulse);
        }
    }
}

}  // namespace spook

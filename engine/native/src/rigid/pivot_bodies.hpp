// The stages of joint_tree.hpp for bodies that each hang on one ball joint of the world.
//
// Such a body only turns about its pivot, as a free one with the inertia about the pivot does: a stage is the turn of
// rotation.hpp, and what it has about the pivot it keeps.
#pragma once

#include <cstdint>
#include <vector>

#include "linear/large_array.hpp"
#include "rigid/rigid_state.hpp"

namespace spook {

class PivotBodies {
public:
    bool empty() const noexcept { return pivots_.empty(); }
    void clear() noexcept { pivots_.clear(); }
    /// `arm`: from the centre of the body to its joint, at the start.
    void add(int body, const BodyConstants& constants, Vec3 arm);

    /// As JointTree::stage(), from no guess; a turn counts as one round.
    void stage(double tau, LargeArray<BodyState>& bodies, std::int64_t& rounds) noexcept;

private:
    struct Pivot {
        int body = -1;
        double mass = 0.0;
        Vec3 arm;
        FreeRotor rotor;  // about the pivot
        Mat3 axes;        // those of it, at the start, in the world
    };
    struct Turn {
        Quat moved;
        Vec3 reach;     // from the centre to the pivot, where the stage starts
        Vec3 momentum;  // about the pivot, world axes
    };
    std::vector<Pivot> pivots_;
    std::vector<Turn> turns_;
};

}  // namespace spook

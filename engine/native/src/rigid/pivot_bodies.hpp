// The stages of joint_tree.hpp for bodies that each hang on one ball joint of the world.
//
// Such a body only turns about its pivot. The momentum that turns it so in a stage is linear in its second moments of
// mass, and a point of mass m at r has m r × R r/τ: what the whole gains about the pivot is the variational turn of
// rotation.hpp with the inertia about the pivot. So a stage is that of a free body, and what it has about the pivot it keeps.
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

    /// As JointTree::stage(); a turn counts as one round.
    bool stage(double tau, LargeArray<BodyState>& bodies, double* increments, std::int64_t& rounds) noexcept;

private:
    struct Pivot {
        int body = -1;
        double mass = 0.0;
        Vec3 arm;
        Vec3 inertia;  // about the pivot, principal
        Mat3 axes;     // those of it, at the start, in the world
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

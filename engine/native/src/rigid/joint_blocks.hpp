// What a block of a joint's rows is, and what is known of some rows besides.
#pragma once

#include <array>
#include <vector>

#include "contacts/pivot_system.hpp"

namespace spook {

/// One block of up to six rows between two bodies: a joint's own rows, or those of its free coordinate.
struct JointBlock {
    int joint = 0;
    bool axial = false;           // motor, limit, spring, armature, friction, in this order, as it has them
    int first = -1, second = -1;  // bodies of the scene, −1 the world
    int size = 1;
    int rotor = -1;  // the row of its armature
    std::array<double, 6> softness{};
};

/// The numbers of a block in one step, besides its Jacobians. A row reads
/// G v₊ + softness λ = right where lower < λ < upper; λ are impulses on the second body.
struct BlockRight {
    std::array<double, 6> right, lower, upper;
    const double* softness = nullptr;  // of rows whose softness changes from step to step
    StopRow stop;
};

/// A row that rubs: the wire's, its own and those of the eyes before it, by block; tanh ½µφ.
struct EyeRow {
    int block = 0, wire = 0;
    std::vector<int> before;
    double grip = 0.0;
};
/// Three rows of a tyre, by block, and its friction along and across.
struct TyreRows {
    int block = 0;
    std::array<double, 2> friction{};
};
/// A row of friction in a joint whose bound grows with what the joint holds, by block.
struct BearingRow {
    int block = 0, row = 0, way = 0;     // way: 0 along the axis, 1 about it
    int holding = 0;                     // the block of what it holds
    double constant = 0.0, share = 0.0;  // N s or N m s; 1 or m
};
/// A spring of a free coordinate, by the block of its joint's own rows.
struct JointSpring {
    int block = 0;
    double stiffness = 0.0, rest = 0.0;
    double damping = 0.0;  // s: the force is −stiffness (q − rest + damping q̇)
};

}  // namespace spook

// What joints carry from step to step.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "linear/large_array.hpp"
#include "linear/vec.hpp"

namespace spook {

/// What a joint carries from step to step.
struct JointState {
    std::array<double, 6> multiplier{};
    std::array<double, 6> axial_multiplier{};
    double* multipliers(bool axial) noexcept { return axial ? axial_multiplier.data() : multiplier.data(); }
    const double* multipliers(bool axial) const noexcept {
        return axial ? axial_multiplier.data() : multiplier.data();
    }
    Vec3 first_reach, second_reach;  // from the centres to where forces were read last
    bool broken = false;
    signed char at_limit = 0;  // 1 or −1: the lower or upper limit was closed in the last step,
    signed char closed = 0;    // and is in this one
    signed char met = 0;       // the end at which an impact of the step has left it: it was on its way there
    double rebounds = 0.0;     // slower than this, m/s or rad/s, an impact of the step has answered it
    double initial_overstep = -1.0;  // of its limit, as far as it is left; negative: not known
    bool folds = false;              // a stop of the joint is hit within the step, or several times,
    double fold_to = 0.0;            // and its coordinate is here where the step ends, m or rad
    bool late = false;               // it is hit because of what forces do in the step
    /// What they give to its rate in all of the step, m/s or rad/s; NaN: not known.
    double push = std::numeric_limits<double>::quiet_NaN();
    double rotor = std::numeric_limits<double>::quiet_NaN();  // its armature's speed; NaN: not known
    double rotor_lead = 0.0;  // of the coordinate over the last step, before its row at the start
    double angle = 0.0;       // unwrapped coordinate of a hinge that needs it
    // N s: of an eye's row; of a tyre's rows along and across; of a joint's friction, as far as it follows the load
    std::array<double, 2> bound{};
    double slides = 1.0;  // a tyre: by how much softer than its slip stiffness its rows are
};

/// A joint that broke: in which step of h, and under what.
struct Break {
    int joint = 0;
    std::int64_t step = 0;             // counted from 1
    double force = 0.0, torque = 0.0;  // N, N m
};

/// Of all joints; copying it back goes back.
struct JointStates {
    LargeArray<JointState> states;
    std::vector<Break> breaks;  // of the run so far
};

}  // namespace spook

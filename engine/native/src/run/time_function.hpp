// Numbers that change with time: what a load, a motor or a moving body follows.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "linear/elementary.hpp"
#include "run/named_enum.hpp"

namespace spook {

SPOOK_NAMED_ENUM(TimeKind, sinusoid, table)

/// sinusoid: offset + amplitude sin(rate t + phase). table: straight lines between knots of rising times, the first
/// and the last value before and after them.
struct TimeFunction {
    TimeKind kind = TimeKind::table;
    double offset = 0.0, amplitude = 0.0, rate = 0.0, phase = 0.0;  // rate in rad/s
    std::vector<double> times, values;

    double at(double time) const noexcept {
        if (kind == TimeKind::sinusoid) return offset + amplitude * sine_cosine(rate * time + phase).sine;
        if (!(time > times.front())) return values.front();
        if (time >= times.back()) return values.back();
        const auto after =
            static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), time) - times.begin());
        const double part = (time - times[after - 1]) / (times[after] - times[after - 1]);
        return values[after - 1] + part * (values[after] - values[after - 1]);
    }
    /// When it bends next after a time; infinity if it does not.
    double next_knot(double time) const noexcept {
        const auto after =
            kind == TimeKind::table ? std::upper_bound(times.begin(), times.end(), time) : times.end();
        return after == times.end() ? std::numeric_limits<double>::infinity() : *after;
    }
};

/// What follows: a load; the speed of a motor, what it pushes with or may at most; the rest of a joint's spring; of a
/// kinematic body both velocities, its spin alone, its place along one of the world's axes, its angle about an axis.
SPOOK_NAMED_ENUM(DriveKind, load, motor, push, rest, pace, spin, path, angle)

struct TimeDrive {
    DriveKind kind = DriveKind::load;
    int index = 0;         // of the body or joint
    Vec3 linear, angular;  // what the number multiplies; of a path or an angle its axis
    TimeFunction function;
};

}  // namespace spook

#include "rigid/joint_stops.hpp"

#include <algorithm>
#include <cmath>

#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::joint_stops;

/// What the scene began with beyond the limit would come back as a speed: the bodies are moved back instead
/// (JointSet::overstep_to_return()). A rebound goes no further within the step than its `room`, to the other end.
double JointStops::right(double inwards, double violation, double rate, const Regularisation& row,
                         double restitution, double room, JointState& state, StopRow& stop) noexcept {
    const double beyond = std::max(0.0, -inwards * violation);
    state.initial_overstep = state.initial_overstep < 0.0 ? beyond : std::min(state.initial_overstep, beyond);
    if (state.initial_overstep > 0.0) some_overstepped_ = true, violation += inwards * state.initial_overstep;
    const double gap = inwards * violation, approach = -inwards * rate;
    const bool open = gap > 0.0, hit = approach > 0.0 && state.at_limit * inwards <= 0.0;
    // A far end asks for no more than what is out of reach: solvers take what rows ask for the size of a system's speeds.
    const double closing = std::min(gap / time_step_, unreachable_rate + unreachable_ratio * std::abs(rate));
    double value = open ? -inwards * closing : row.upsilon * rate - row.violation_gain * violation;
    stop.touching = !open || state.met * inwards > 0.0;
    stop.rebound = 0.0;
    stop.hit = approach > state.rebounds && (open ? time_step_ * approach > gap : hit);
    stop.cut = restitution > 0.0 && stop.hit && restitution * approach > room / time_step_;
    if (stop.cut && fold_ && state.initial_overstep == 0.0)
        value = fold(inwards, violation, approach, restitution, state, stop);
    else if (restitution > 0.0 && stop.hit)
        value = stop.rebound = inwards * std::min(restitution * approach, std::max(0.0, room) / time_step_);
    else if (!open && hit)  // plastic: the SPOOK row would let a part of the speed in and send it back
        value = -row.violation_gain * violation;
    state.closed = open ? 0 : inwards > 0.0 ? 1 : -1;
    return value;
}

/// What is left of a rate that goes to and fro between the ends of a stop, `restitution` of it after each impact; and where the
/// coordinate is then. Impacts act along one direction, and the joint's own rows are linear in the step: this is exact.
double JointStops::fold(double inwards, double violation, double approach, double restitution,
                        JointState& state, StopRow& stop) noexcept {
    constexpr int most_impacts = 10000;  // of those that lose speed
    double way = inwards, speed = restitution * approach;
    double left = time_step_ - std::max(0.0, inwards * violation) / approach;  // s
    if (restitution == 1.0) {
        const double impacts = std::floor(left * speed / stop.range);
        left = std::max(0.0, left - impacts * (stop.range / speed));
        if (std::fmod(impacts, 2.0) != 0.0) way = -way;
    } else {
        for (int impacts = 0; left * speed > stop.range && impacts < most_impacts; ++impacts) {
            left -= stop.range / speed;
            speed *= restitution;
            way = -way;
        }
    }
    const double gone = std::min(left * speed, stop.range);  // since the last impact
    state.folds = some_overstepped_ = true;
    state.fold_to =
        state.angle - violation + (way == inwards ? inwards * gone : inwards * (stop.range - gone));
    stop.room = unbounded;
    stop.cut = false;
    return stop.rebound = way * speed;
}

}  // namespace spook

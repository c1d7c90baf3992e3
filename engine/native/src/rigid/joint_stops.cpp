#include "rigid/joint_stops.hpp"

#include <algorithm>
#include <cmath>

#include "rigid/tolerances.hpp"

namespace spook {

using namespace tolerances::joint_stops;

namespace {

/// When what is `gap` before an end meets it, s.
double time_to_end(double gap, double speed, double pull) noexcept {
    const double root = std::sqrt(speed * speed - 2.0 * pull * gap);
    if (std::isnan(root) || (speed >= 0.0 && pull >= 0.0)) return unbounded;
    return speed < 0.0 ? 2.0 * gap / (root - speed) : (speed + root) / -pull;
}

}  // namespace

/// Whether a stop is met at its times within the step. It asks where that takes what forces give to its rate.
bool JointStops::is_met(bool open, double approach, double restitution, const JointState& state,
                        StopRow& stop) const noexcept {
    const bool may = fold_ && stop.range > 0.0 && restitution > 0.0 && state.initial_overstep == 0.0;
    stop.may_be_late = may && open && approach > 0.0 && !stop.hit && !state.late;
    stop.asks = may && (stop.hit || state.late) && std::isnan(state.push);
    return may && !stop.asks && (stop.hit || (state.late && approach > 0.5 * std::abs(state.push)));
}

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
    stop.rebound = stop.cut = 0.0;
    stop.hit = approach > state.rebounds && (open ? time_step_ * approach > gap : hit);
    if (is_met(open, approach, restitution, state, stop))
        value = meet(inwards, violation, rate, restitution, state, stop);
    else if (restitution > 0.0 && stop.hit) {
        const double due = restitution * approach, sent = std::min(due, std::max(0.0, room) / time_step_);
        // To and fro, each end taking its part, it would have so much left when the step is over.
        const double way = stop.range > 0.0 ? time_step_ * due / stop.range : 0.0,
                     left = std::max(sent, due / (1.0 + way * (1.0 - restitution) / restitution));
        stop.cut = 0.5 * (left - sent) * (left + sent) / (approach + sent);
        value = stop.rebound = inwards * sent;
    } else if (!open && hit)  // plastic: the SPOOK row would let a part of the speed in and send it back
        value = -row.violation_gain * violation;
    state.closed = open ? 0 : inwards > 0.0 ? 1 : -1;
    return value;
}

/// Follows a coordinate through the step along the parabola that keeps the energy of such steps, with v + k/2 as it begins, k being
/// what forces give it in all of the step (contacts/supported_bodies.cpp), and with `restitution` of its speed after each impact.
/// Impacts act along one direction, and the joint's own rows are linear in the step: this is exact.
double JointStops::meet(double inwards, double violation, double rate, double restitution, JointState& state,
                        StopRow& stop) noexcept {
    constexpr int most_impacts = 10000;  // of those that lose speed
    constexpr double rounding = 1e-12;   // of a step
    const double pull = inwards * state.push / time_step_;
    double at = std::max(0.0, inwards * violation), speed = inwards * rate + 0.5 * time_step_ * pull;
    double left = time_step_;
    if (pull == 0.0 && restitution == 1.0)  // to and fro changes nothing
        left = std::fmod(left, 2.0 * stop.range / std::abs(speed));
    bool rests = false;
    for (int impacts = 0; impacts < most_impacts && !rests; ++impacts) {
        const double near = time_to_end(at, speed, pull), far = time_to_end(stop.range - at, -speed, -pull);
        const double time = far < near ? far : near;
        if (!(time <= left + rounding * time_step_)) break;
        left = std::max(0.0, left - time);
        at = far < near ? stop.range : 0.0;
        speed = -restitution * (speed + time * pull);
        rests = speed * pull <= 0.0 && 2.0 * std::abs(speed) <= short_flight * time_step_ * std::abs(pull);
    }
    if (rests) speed = 0.0;
    else {
        at = std::clamp(at + left * (speed + 0.5 * left * pull), 0.0, stop.range);
        speed += (left - 0.5 * time_step_) * pull;
    }
    state.folds = some_overstepped_ = true;
    state.fold_to = state.angle - violation + inwards * at;
    stop.room = unbounded;
    return stop.rebound = inwards * speed;
}

}  // namespace spook

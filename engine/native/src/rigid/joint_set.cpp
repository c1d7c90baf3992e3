#include "rigid/joint_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "linear/disjoint_sets.hpp"
#include "rigid/rotors.hpp"
#include "rigid/tolerances.hpp"
#include "rigid/tyre_rows.hpp"

namespace spook {

using namespace tolerances::joint_set;

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// Two bodies a step before and after, and as they are.
struct Around {
    BodyState behind[2], next[2], ahead[2];
};

Around around(std::span<const BodyConstants> turning, IndexPair pair, const BodyState& first,
              const BodyState& second, double h) noexcept {
    Around at{{first, second}, {first, second}, {first, second}};
    if (pair.first >= 0) look_around(turning[pair.first], h, at.behind[0], at.next[0], at.ahead[0]);
    if (pair.second >= 0) look_around(turning[pair.second], h, at.behind[1], at.next[1], at.ahead[1]);
    return at;
}

/// How much faster a joint turns in a step than as it begins, at the spin at hand [rad/s]: of first order in h where a body spins
/// about an axis that is none of its own, for what keeps its momentum in the step does not keep its spin.
double bend_of_turn(const JointConstants& joint, std::span<const BodyConstants> turning, IndexPair pair,
                    const BodyState& first, const BodyState& second, double h) noexcept {
    const double share = share_of_bend(turn_in_step(h, first, second));
    if (!(share > 0.0)) return 0.0;
    const auto [behind, next, ahead] = around(turning, pair, first, second, h);
    const AxialRow here = axial_row(joint, next[0], next[1]);
    const double there = axial_row(joint, ahead[0], ahead[1]).coordinate;
    const double bend = std::remainder(there - here.coordinate - h * here.rate, 2.0 * std::numbers::pi) / h;
    return std::abs(bend) > rounding_of_turn * std::abs(here.rate) ? share * bend : 0.0;
}

}  // namespace

JointSet::JointSet(const RigidScene& scene, double time_step)
    : time_step_(time_step), drives_(time_step), stops_(time_step) {
    const bool composed = scene.method.composition > 2;
    for (const JointSpec& spec : scene.joints) {
        const int index = count();
        Joint joint;
        JointBlock block = add_own_rows(scene, spec, joint);
        joint.breakable = can_break(spec);
        joint.strength = time_step * spec.strength;
        joint.torque_strength = time_step * spec.torque_strength;
        joint.tracked = spec.limit.has_value() || spec.spring.has_value() || spec.armature > 0.0;
        if (joint.tracked) followed_.push_back(index);
        const int number = static_cast<int>(blocks_.size());
        block.axial = true;
        block.size = 0;
        block.softness = {};
        drives_.add(spec, joint.block, number, composed, block);
        if (block.rotor >= 0) rotors_.push_back(number);
        if (block.size > 0) blocks_.push_back(block);
        if (spec.limit || (joint.general >= 0 && generals_[joint.general].one_sided)) stops_.add(index);
        joints_.push_back(joint);
    }
    states.resize(joints_.size());
    for (int row = 0; row < generals_.size(); ++row)
        for (const GeneralRow::Term& term : generals_[row].terms) track(term.joint);
}

/// Geometry, bodies and coefficients of a joint's own rows, and their block.
JointBlock JointSet::add_own_rows(const RigidScene& scene, const JointSpec& spec, Joint& joint) {
    joint.block = static_cast<int>(blocks_.size());
    joint.constants = constants_of(scene, spec);
    joint.first = spec.first;
    joint.second = spec.second;
    if (spec.kind == JointKind::relation || spec.kind == JointKind::wire || spec.kind == JointKind::eye) {
        joint.general = generals_.size();
        generals_.add(scene, spec, time_step_);
        if (spec.kind == JointKind::eye)
            generals_.make_eye(spec, joint.block, joints_[spec.wire].general, joints_[spec.wire].block);
        const std::vector<int>& bodies = generals_[joint.general].bodies;
        joint.first = bodies.empty() ? -1 : bodies[0];
        joint.second = bodies.size() < 2 ? -1 : bodies[1];
    }
    if (spec.kind == JointKind::tyre) {
        joint.tyre = static_cast<int>(tyre_forms_.size());
        tyre_forms_.push_back({spec.radius, spec.slip_stiffness, {}});
        tyres_.push_back({joint.block, spec.friction});
    }
    JointBlock block;
    block.joint = count();
    block.first = joint.first;
    block.second = joint.second;
    block.size = joint.constants.rows;
    for (int k = 0; k < block.size; ++k) {
        const Regularisation row = regularise(spec.compliance[k], spec.damping[k], time_step_);
        joint.gain[k] = {row.upsilon, row.violation_gain};
        block.softness[k] = row.softness;
    }
    blocks_.push_back(block);
    return block;
}

void JointSet::assemble(int index, std::span<const BodyState> bodies, double* first, double* second,
                        BlockRight& right, bool follows) noexcept {
    const JointBlock& block = blocks_[index];
    const Joint& joint = joints_[block.joint];
    State& state = states[block.joint];
    right.lower.fill(-kUnbounded);
    right.upper.fill(kUnbounded);
    if (block.axial) {
        assemble_axial(block, bodies, first, second, right);
    } else if (joint.general >= 0) {
        generals_.assemble(joint.general, bodies, states, state, stops_, first, second, right);
    } else if (joint.tyre >= 0) {
        assemble_tyre(joint, state, bodies, first, second, right);
    } else {
        JointRows rows{first, second, {}, {}};
        assemble_joint(joint.constants, state_of(joint.first, bodies), state_of(joint.second, bodies), rows,
                       state.first_reach, state.second_reach);
        for (int k = 0; k < block.size; ++k)
            right.right[k] =
                joint.gain[k].upsilon * rows.rate[k] - joint.gain[k].violation * rows.violation[k];
        if (follows && joint.follows && !turning.empty() && joint.constants.kind != JointKind::distance)
            follow_turns(joint, bodies, right);
    }
    if (!state.broken) return;
    right.lower.fill(0.0);
    right.upper.fill(0.0);
}

/// What spins leaves the rows, linear in the turn, by half its square: beyond a fiftieth of a radian in a step the bend of the way
/// here and of the way on, at the velocities at hand, come into the right sides. What spins steadily then stays in place.
void JointSet::follow_turns(const Joint& joint, std::span<const BodyState> bodies,
                            BlockRight& right) const noexcept {
    const BodyState &first = state_of(joint.first, bodies), &second = state_of(joint.second, bodies);
    const double turn = turn_in_step(time_step_, first, second);
    if (!(share_of_bend(turn) > 0.0)) return;
    const int linear = joint.constants.holds.linear();
    const double of_arms = linear < 3
                               ? turn
                               : turn_of_arms(time_step_, first, carried(first, joint.constants.first_arm),
                                              second, carried(second, joint.constants.second_arm));
    const auto [behind, next, ahead] =
        around(turning, {joint.first, joint.second}, first, second, time_step_);
    double on[6], back[6];
    joint_curvature(joint.constants, next[0], next[1], ahead[0], ahead[1], time_step_, OpenGap::stays, on);
    joint_curvature(joint.constants, first, second, behind[0], behind[1], -time_step_, OpenGap::stays, back);
    for (int k = 0; k < joint.constants.rows; ++k) {
        const double relaxation = 0.25 * (1.0 / joint.gain[k].upsilon - 1.0);
        const double share =
            k < linear ? share_of_point(turn, of_arms) : share_of_bend(turn) * share_of_angles(turn);
        right.right[k] -= share * joint.gain[k].violation * (0.25 * (on[k] + back[k]) + relaxation * on[k]);
    }
}

void JointSet::assemble_axial(const JointBlock& block, std::span<const BodyState> bodies, double* first,
                              double* second, BlockRight& right) noexcept {
    const Joint& joint = joints_[block.joint];
    State& state = states[block.joint];
    AxialRow row = axial_row(joint.constants, state_of(joint.first, bodies), state_of(joint.second, bodies));
    if (joint.tracked) state.angle = unwrapped(joint.constants, row.coordinate, state.angle);
    const Axial& axial = *drives_.of(block.joint);
    int k = 0;
    const auto next = [&](double value) {
        std::copy_n(row.first, 6, first + 6 * k);
        std::copy_n(row.second, 6, second + 6 * k);
        right.right[k] = value;
        return k++;
    };
    if (axial.has_motor) {
        const bool follows =
            !turning.empty() && joint.follows && joint.constants.kind != JointKind::prismatic;
        const double faster =
            follows ? bend_of_turn(joint.constants, turning, {joint.first, joint.second},
                                   state_of(joint.first, bodies), state_of(joint.second, bodies), time_step_)
                    : 0.0;
        const int motor = next(axial.speed - faster);
        right.lower[motor] = axial.pushes ? axial.impulse : -axial.impulse;
        right.upper[motor] = axial.impulse;
    }
    if (axial.has_limit) {
        // The end that is ahead, if it is reached within the step, or else the nearer one. An open gap may close but
        // no more: then it meets no row at all, and a bounce off the limit would depend on the phase of the step.
        const double down = state.angle - axial.lower, up = axial.upper - state.angle;
        const double way = time_step_ * row.rate;
        const bool low = down == -up || (way > up ? -way > down : -way > down || down <= up);
        const double violation = state.angle - (low ? axial.lower : axial.upper);
        const Regularisation& r = axial.limit;
        const double held = r.upsilon * row.rate - r.violation_gain * violation;
        if (axial.lower == axial.upper) {
            next(held);
        } else {
            const double inwards = low ? 1.0 : -1.0;
            right.stop.row = k;
            const double room = right.stop.room = low ? up : down;
            right.stop.range = axial.upper - axial.lower;
            right.stop.other = inwards * (room > 0.0 ? room / time_step_ : r.violation_gain * room);
            const double value =
                stops_.right(inwards, violation, row.rate, r, axial.restitution, room, state, right.stop);
            next(value);
            const int row = right.stop.row;
            if (!state.folds) (low ? right.lower : right.upper)[row] = 0.0;
            if (right.stop.asks) right.lower[row] = right.upper[row] = 0.0;
        }
    }
    if (axial.has_spring && !axial.spring_pulls) {
        const double rest =
            axial.spring.violation_gain * (state.angle - drives_.springs()[axial.spring_at].rest);
        // A rest r(t) in the averaged law: G v₊ − r'₊ in place of G v₊, G v − r'₋ in place of G v.
        const int spring = next(axial.rest_moves ? axial.spring.upsilon * (row.rate - axial.rest_before) -
                                                       rest + axial.rest_ahead
                                                 : axial.spring.upsilon * row.rate - rest);
        right.lower[spring] = -axial.spring_impulse;
        right.upper[spring] = axial.spring_impulse;
    }
    if (block.rotor >= 0) next(rotor_right(state, row.rate));
    for (int way = 0; way < 2; ++way) {  // friction: at rest as far as it reaches
        if (!axial.rubs[way]) continue;
        row = axial_row(joint.constants, state_of(joint.first, bodies), state_of(joint.second, bodies),
                        way == 0);
        const int rub = next(0.0);
        right.upper[rub] = axial.friction[way] + state.bound[way];
        right.lower[rub] = -right.upper[rub];
    }
}

JointSet::RowGain JointSet::gain(int index, int row) const noexcept {
    const JointBlock& block = blocks_[index];
    const Joint& joint = joints_[block.joint];
    if (block.axial) return {0.0, 0.0, 1.0};
    const JointConstants& c = joint.constants;
    const auto& gain = joint.gain[row];
    const double relaxation = 0.25 * (1.0 / gain.upsilon - 1.0);
    if (c.kind == JointKind::distance || c.kind == JointKind::wire)
        return {gain.violation, relaxation, c.rest_length};
    const bool linear = row < c.holds.linear();
    const double arms = norm(c.first_arm) + norm(c.second_arm);
    return {gain.violation, relaxation, linear && arms > 0.0 ? arms : 1.0};
}

bool JointSet::find_trees(std::span<const BodyConstants> bodies) {
    DisjointSets tied;
    const int fixed =
        static_cast<int>(bodies.size());  // all that does not move by itself, which ties nothing
    const auto of = [&](int body) { return body >= 0 && bodies[body].moves() ? body : fixed; };
    const auto own = [](const Joint& joint) { return joint.general < 0 && joint.tyre < 0; };
    bool loops = false;
    tied.begin(bodies.size() + 1);
    for (const Joint& joint : joints_)
        if (own(joint)) loops |= !tied.join(of(joint.first), of(joint.second));
    tied.begin(bodies.size());
    for (const Joint& joint : joints_)
        if (of(joint.first) != fixed && of(joint.second) != fixed) tied.join(joint.first, joint.second);
    trees.resize(bodies.size());
    for (int body = 0; body < fixed; ++body) trees[body] = tied.root(body);
    std::vector<char> held(bodies.size(), 0), bends(bodies.size(), 0);
    const auto tree = [&](const Joint& joint) {
        return trees[of(joint.first) == fixed ? joint.second : joint.first];
    };
    for (const Joint& joint : joints_) {
        if (!own(joint)) continue;
        held[tree(joint)] |= of(joint.first) == fixed || of(joint.second) == fixed;
        bends[tree(joint)] |= joint.constants.holds.rows() < 6;
    }
    for (Joint& joint : joints_) joint.follows = own(joint) && (held[tree(joint)] || !bends[tree(joint)]);
    return !loops;
}

void JointSet::bias(int index, std::span<const BodyState> bodies, double* out) const noexcept {
    const JointBlock& block = blocks_[index];
    const Joint& joint = joints_[block.joint];
    const BodyState &first = state_of(joint.first, bodies), &second = state_of(joint.second, bodies);
    if (joint.general >= 0) {
        *out = generals_.bias(joint.general, bodies);
        return;
    }
    if (!block.axial) return joint_bias(joint.constants, first, second, out);
    std::fill_n(out, block.size, axial_bias(joint.constants, first, second));
}

void JointSet::curvature(int index, std::span<const BodyState> bodies, std::span<const BodyState> there,
                         double h, double* out) const noexcept {
    const Joint& joint = joints_[index];
    if (joint.general >= 0 || joint.tyre >= 0)
        return static_cast<void>(std::fill_n(out, joint.constants.rows, 0.0));
    joint_curvature(joint.constants, state_of(joint.first, bodies), state_of(joint.second, bodies),
                    state_of(joint.first, there), state_of(joint.second, there), h, OpenGap::goes_along, out);
}

void JointSet::violation(int index, std::span<const BodyState> bodies, double* out) const noexcept {
    const Joint& joint = joints_[index];
    if (joint.general >= 0) {
        *out = generals_.violation(joint.general, bodies, states);
        return;
    }
    if (joint.tyre >= 0) {
        out[0] = stand(joint.constants, tyre_forms_[joint.tyre].radius, state_of(joint.first, bodies),
                       state_of(joint.second, bodies))
                     .height;
        out[1] = out[2] = 0.0;
        return;
    }
    joint_violation(joint.constants, state_of(joint.first, bodies), state_of(joint.second, bodies), out);
}

void JointSet::overstep(int index, std::span<const BodyState> bodies, double* out) const noexcept {
    const JointBlock& block = blocks_[index];
    const Joint& joint = joints_[block.joint];
    std::fill_n(out, block.size, 0.0);
    if (states[block.joint].broken || gives_way(joint.constants.kind)) return;
    if (!block.axial) {
        violation(block.joint, bodies, out);
        if (joint.general >= 0 && generals_[joint.general].one_sided) *out = std::max(0.0, *out);
        return;
    }
    const Axial& axial = *drives_.of(block.joint);
    if (!axial.has_limit) return;
    const double at = coordinate(block.joint, bodies), low = at - axial.lower, high = at - axial.upper;
    if (states[block.joint].folds) {
        out[axial.has_motor ? 1 : 0] = at - states[block.joint].fold_to;
        return;
    }
    out[axial.has_motor ? 1 : 0] =
        axial.lower == axial.upper ? low : std::min(0.0, low) + std::max(0.0, high);
}

double JointSet::overstep_to_return(int index, int& row) const noexcept {
    const JointBlock& block = blocks_[index];
    const Joint& joint = joints_[block.joint];
    const double overstep = states[block.joint].initial_overstep;
    row = 0;
    if (!(overstep > 0.0) || states[block.joint].broken) return 0.0;
    if (!block.axial)
        return joint.general >= 0 && generals_[joint.general].one_sided
                   ? time_step_ * generals_[joint.general].row.violation_gain * overstep
                   : 0.0;
    const Axial& axial = *drives_.of(block.joint);
    row = axial.has_motor ? 1 : 0;
    const double angle = states[block.joint].angle;
    const bool low = angle - axial.lower <= axial.upper - angle;
    return (low ? -1.0 : 1.0) * time_step_ * axial.limit.violation_gain * overstep;
}

double JointSet::coordinate(int index, std::span<const BodyState> bodies) const noexcept {
    const Joint& joint = joints_[index];
    const AxialRow row =
        axial_row(joint.constants, state_of(joint.first, bodies), state_of(joint.second, bodies));
    return joint.tracked ? unwrapped(joint.constants, row.coordinate, states[index].angle) : row.coordinate;
}

void JointSet::follow(std::span<const BodyState> bodies) noexcept {
    for (const int index : followed_) {
        const Joint& joint = joints_[index];
        const BodyState &first = state_of(joint.first, bodies), &second = state_of(joint.second, bodies);
        const Vec3 spin = second.angular_velocity - first.angular_velocity;
        if (drives_.of(index) != nullptr && time_step_ * time_step_ * dot(spin, spin) < 1.0)
            continue;  // the next rows do
        const AxialRow row = axial_row(joint.constants, first, second);
        double& angle = states[index].angle;
        const State& state = states[index];
        angle = unwrapped(joint.constants, row.coordinate,
                          state.folds ? state.fold_to : angle + time_step_ * row.rate);
    }
}

void JointSet::break_overloaded(int index, std::int64_t step) {
    const Joint& joint = joints_[index];
    State& state = states[index];
    if (!joint.breakable || state.broken) return;
    const JointHolds holds = joint.constants.holds;
    const int linear = holds.rows() > 0 ? holds.linear() : 1;  // distance, wire and relation: their row
    double force = 0.0, torque = 0.0;
    for (int i = 0; i < joint.constants.rows; ++i)
        (i < linear ? force : torque) += state.multiplier[i] * state.multiplier[i];
    force = std::sqrt(force), torque = std::sqrt(torque);
    state.broken = force > joint.strength || torque > joint.torque_strength;
    if (state.broken) breaks.push_back({index, step, force / time_step_, torque / time_step_});
}

double JointSet::spring_energy(int joint, double rest, std::span<const BodyState> bodies) const noexcept {
    if (states[joint].broken) return 0.0;
    const double turned = coordinate(joint, bodies) - rest;
    return 0.5 * drives_.springs()[drives_.of(joint)->spring_at].stiffness * turned * turned;
}

double JointSet::spring_energy(std::span<const BodyState> bodies) const noexcept {
    double sum = 0.0;
    for (int joint = 0; joint < count(); ++joint) {
        const Axial* axial = drives_.of(joint);
        if (axial == nullptr || !axial->has_spring || axial->rest_moves) continue;
        sum += spring_energy(joint, drives_.springs()[axial->spring_at].rest, bodies);
    }
    return sum;
}

}  // namespace spook

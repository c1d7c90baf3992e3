#include "rigid/joint_set.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "rigid/rotors.hpp"
#include "rigid/tolerances.hpp"
#include "rigid/tyre_rows.hpp"

namespace spook {

namespace {

using namespace tolerances::joint_set;

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

}  // namespace

JointSet::JointSet(const RigidScene& scene, double time_step) : time_step_(time_step) {
    const bool composed = scene.method.composition > 2;
    for (const JointSpec& spec : scene.joints) {
        Joint joint;
        const auto start = [&](int body) { return body < 0 ? nullptr : &scene.bodies[body].position; };
        joint.constants = constants_of(spec, start(spec.first), start(spec.second));
        joint.first = spec.first;
        joint.second = spec.second;
        if (spec.kind == JointKind::relation || spec.kind == JointKind::wire || spec.kind == JointKind::eye) {
            General general = general_of(scene, spec);
            if (spec.kind == JointKind::eye) add_eye(spec, general);
            joint.first = general.bodies.empty() ? -1 : general.bodies[0];
            joint.second = general.bodies.size() < 2 ? -1 : general.bodies[1];
            joint.general = static_cast<int>(generals_.size());
            gradient_.resize(std::max<std::size_t>({gradient_.size(), 12, 6 * general.bodies.size()}));
            generals_.push_back(std::move(general));
        }
        if (spec.kind == JointKind::tyre) {
            joint.tyre = static_cast<int>(tyre_forms_.size());
            tyre_forms_.push_back({spec.radius, spec.slip_stiffness, {}});
            tyres_.push_back({static_cast<int>(blocks_.size()), spec.friction});
        }
        joint.breakable = can_break(spec);
        joint.strength = time_step * spec.strength;
        joint.torque_strength = time_step * spec.torque_strength;
        JointBlock block;
        block.joint = static_cast<int>(joints_.size());
        block.first = joint.first;
        block.second = joint.second;
        block.size = joint.constants.rows;
        for (int k = 0; k < block.size; ++k) {
            const Regularisation row = regularise(spec.compliance[k], spec.damping[k], time_step);
            joint.gain[k] = {row.upsilon, row.violation_gain};
            block.softness[k] = row.softness;
        }
        joint.block = static_cast<int>(blocks_.size());
        blocks_.push_back(block);

        joint.tracked = spec.limit.has_value() || spec.spring.has_value() || spec.armature > 0.0;
        if (spec.motor || spec.limit || spec.spring || spec.armature > 0.0 || rubs(spec)) {
            Axial axial;
            axial.has_motor = spec.motor.has_value();
            axial.has_limit = spec.limit.has_value();
            axial.has_spring = spec.spring.has_value();
            block.axial = true;
            block.size = 0;
            block.softness = {};
            if (spec.motor) {
                axial.speed = spec.motor->speed;
                axial.pushes = spec.motor->pushes;
                axial.impulse = time_step * spec.motor->force;
                block.softness[block.size++] = 0.0;
            }
            if (spec.limit) {
                axial.lower = spec.limit->lower;
                axial.upper = spec.limit->upper;
                axial.restitution = spec.limit->restitution;
                axial.limit = regularise(spec.limit->compliance, spec.limit->damping, time_step);
                block.softness[block.size++] = axial.limit.softness;
            }
            if (spec.spring) {
                axial.spring_at = static_cast<int>(springs_.size());
                axial.spring_pulls = composed;
                springs_.push_back({joint.block, spec.spring->stiffness, spec.spring->rest});
                axial.spring_impulse = time_step * spec.spring->force;
                axial.spring = regularise(1.0 / spec.spring->stiffness, spec.spring->damping, time_step);
                if (!composed) block.softness[block.size++] = axial.spring.softness;
            }
            if (spec.armature > 0.0) {  // G v₊ + λ/I = w, the rotor's speed before
                some_.rotors.push_back(static_cast<int>(blocks_.size()));
                block.rotor = block.size;
                block.softness[block.size++] = 1.0 / spec.armature;
            }
            for (int way = 0; way < 2; ++way) {
                if (!rubs(spec, way)) continue;
                axial.rubs[way] = true;
                axial.friction[way] = time_step * spec.dry_friction[way];
                if (spec.load_friction[way] > 0.0)
                    bearings_.push_back({static_cast<int>(blocks_.size()), block.size, way, joint.block,
                                         axial.friction[way], spec.load_friction[way]});
                block.softness[block.size++] = 0.0;
            }
            if (block.size > 0) blocks_.push_back(block);
            joint.axial = static_cast<int>(axials_.size());
            axials_.push_back(axial);
            if (joint.tracked) some_.followed.push_back(static_cast<int>(joints_.size()));
        }
        joints_.push_back(joint);
    }
    states.resize(joints_.size());
    for (std::size_t j = 0; j < joints_.size(); ++j) {
        const Joint& joint = joints_[j];
        const bool limit = joint.axial >= 0 && axials_[joint.axial].has_limit,
                   wire = joint.general >= 0 && generals_[joint.general].one_sided;
        if (limit || wire) some_.stops.push_back(static_cast<int>(j));
    }
    for (const General& general : generals_)
        for (const RelationTerm& term : general.terms) track(term.joint);
}

void JointSet::assemble(int index, std::span<const BodyState> bodies, double* first, double* second,
                        BlockRight& right) noexcept {
    const JointBlock& block = blocks_[index];
    const Joint& joint = joints_[block.joint];
    State& state = states[block.joint];
    right.lower.fill(-kUnbounded);
    right.upper.fill(kUnbounded);
    if (block.axial) {
        assemble_axial(joint, state, bodies, first, second, right);
    } else if (joint.general >= 0) {
        assemble_general(joint, state, bodies, first, second, right);
    } else if (joint.tyre >= 0) {
        assemble_tyre(joint, state, bodies, first, second, right);
    } else {
        JointRows rows{first, second, {}, {}};
        assemble_joint(joint.constants, body(joint.first, bodies), body(joint.second, bodies), rows,
                       state.first_reach, state.second_reach);
        for (int k = 0; k < block.size; ++k)
            right.right[k] =
                joint.gain[k].upsilon * rows.rate[k] - joint.gain[k].violation * rows.violation[k];
    }
    if (!state.broken) return;
    right.lower.fill(0.0);
    right.upper.fill(0.0);
}

double JointSet::unwrapped(const Joint& joint, double angle, double near) const noexcept {
    if (joint.constants.kind != JointKind::hinge) return angle;
    constexpr double turn = 2.0 * std::numbers::pi;
    return angle + turn * std::round((near - angle) / turn);
}

void JointSet::assemble_axial(const Joint& joint, State& state, std::span<const BodyState> bodies,
                              double* first, double* second, BlockRight& right) noexcept {
    AxialRow row = axial_row(joint.constants, body(joint.first, bodies), body(joint.second, bodies));
    if (joint.tracked) state.angle = unwrapped(joint, row.coordinate, state.angle);
    const Axial& axial = axials_[joint.axial];
    int k = 0;
    const auto next = [&](double value) {
        std::copy_n(row.first, 6, first + 6 * k);
        std::copy_n(row.second, 6, second + 6 * k);
        right.right[k] = value;
        return k++;
    };
    if (axial.has_motor) {
        const int motor = next(axial.speed);
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
                one_sided(inwards, violation, row.rate, r, axial.restitution, room, state, right.stop);
            (low ? right.lower : right.upper)[next(value)] = 0.0;
        }
    }
    if (axial.has_spring && !axial.spring_pulls) {
        const double rest = axial.spring.violation_gain * (state.angle - springs_[axial.spring_at].rest);
        // A rest r(t) in the averaged law: G v₊ − r'₊ in place of G v₊, G v − r'₋ in place of G v.
        const int spring = next(axial.rest_moves ? axial.spring.upsilon * (row.rate - axial.rest_before) -
                                                       rest + axial.rest_ahead
                                                 : axial.spring.upsilon * row.rate - rest);
        right.lower[spring] = -axial.spring_impulse;
        right.upper[spring] = axial.spring_impulse;
    }
    if (blocks_[joint.block + 1].rotor >= 0) next(rotor_right(state, row.rate));
    for (int way = 0; way < 2; ++way) {  // friction: at rest as far as it reaches
        if (!axial.rubs[way]) continue;
        row = axial_row(joint.constants, body(joint.first, bodies), body(joint.second, bodies), way == 0);
        const int rub = next(0.0);
        right.upper[rub] = axial.friction[way] + state.bound[way];
        right.lower[rub] = -right.upper[rub];
    }
}

/// The right side of a row that only pushes `inwards`. What the scene began with beyond the limit is no violation: it
/// would come back as a speed, at a tiny step as megajoules. The bodies are moved back instead (given_back()). A rebound goes
/// no further within the step than its `room`, to the other end.
double JointSet::one_sided(double inwards, double violation, double rate, const Regularisation& row,
                           double restitution, double room, State& state, StopRow& stop) noexcept {
    const double beyond = std::max(0.0, -inwards * violation);
    state.given = state.given < 0.0 ? beyond : std::min(state.given, beyond);
    if (state.given > 0.0) some_given_ = true, violation += inwards * state.given;
    const double gap = inwards * violation, approach = -inwards * rate;
    const bool open = gap > 0.0, hit = approach > 0.0 && state.at_limit * inwards <= 0.0;
    // A far end asks for no more than what is out of reach: solvers take what rows ask for the size of a system's speeds.
    const double closing = std::min(gap / time_step_, OUT_OF_REACH + AS_FAST * std::abs(rate));
    double value = open ? -inwards * closing : row.upsilon * rate - row.violation_gain * violation;
    stop.touching = !open || state.met * inwards > 0.0;
    stop.rebound = 0.0;
    stop.hit = approach > state.rebounds && (open ? time_step_ * approach > gap : hit);
    stop.cut = restitution > 0.0 && stop.hit && restitution * approach > room / time_step_;
    if (stop.cut && stops_fold_ && state.given == 0.0)
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
double JointSet::fold(double inwards, double violation, double approach, double restitution, State& state,
                      StopRow& stop) noexcept {
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
    state.folds = some_given_ = true;
    state.fold_to =
        state.angle - violation + (way == inwards ? inwards * gone : inwards * (stop.range - gone));
    stop.room = unbounded;
    stop.cut = false;
    return stop.rebound = way * speed;
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

void JointSet::bias(int index, std::span<const BodyState> bodies, double* out) const noexcept {
    const JointBlock& block = blocks_[index];
    const Joint& joint = joints_[block.joint];
    const BodyState &first = body(joint.first, bodies), &second = body(joint.second, bodies);
    if (joint.general >= 0) {
        *out = general_bias(generals_[joint.general], bodies);
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
    joint_curvature(joint.constants, body(joint.first, bodies), body(joint.second, bodies),
                    body(joint.first, there), body(joint.second, there), h, out);
}

void JointSet::violation(int index, std::span<const BodyState> bodies, double* out) const noexcept {
    const Joint& joint = joints_[index];
    if (joint.general >= 0) {
        *out = along(generals_[joint.general], bodies, nullptr).violation;
        return;
    }
    if (joint.tyre >= 0) {
        out[0] = stand(joint.constants, tyre_forms_[joint.tyre].radius, body(joint.first, bodies),
                       body(joint.second, bodies))
                     .height;
        out[1] = out[2] = 0.0;
        return;
    }
    joint_violation(joint.constants, body(joint.first, bodies), body(joint.second, bodies), out);
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
    const Axial& axial = axials_[joint.axial];
    if (!axial.has_limit) return;
    const double at = coordinate(block.joint, bodies), low = at - axial.lower, high = at - axial.upper;
    if (states[block.joint].folds) {
        out[axial.has_motor ? 1 : 0] = at - states[block.joint].fold_to;
        return;
    }
    out[axial.has_motor ? 1 : 0] =
        axial.lower == axial.upper ? low : std::min(0.0, low) + std::max(0.0, high);
}

double JointSet::given_back(int index, int& row) const noexcept {
    const JointBlock& block = blocks_[index];
    const Joint& joint = joints_[block.joint];
    const double given = states[block.joint].given;
    row = 0;
    if (!(given > 0.0) || states[block.joint].broken) return 0.0;
    if (!block.axial)
        return joint.general >= 0 && generals_[joint.general].one_sided
                   ? time_step_ * generals_[joint.general].row.violation_gain * given
                   : 0.0;
    const Axial& axial = axials_[joint.axial];
    row = axial.has_motor ? 1 : 0;
    const double angle = states[block.joint].angle;
    const bool low = angle - axial.lower <= axial.upper - angle;
    return (low ? -1.0 : 1.0) * time_step_ * axial.limit.violation_gain * given;
}

double JointSet::coordinate(int index, std::span<const BodyState> bodies) const noexcept {
    const Joint& joint = joints_[index];
    const AxialRow row = axial_row(joint.constants, body(joint.first, bodies), body(joint.second, bodies));
    return joint.tracked ? unwrapped(joint, row.coordinate, states[index].angle) : row.coordinate;
}

void JointSet::follow(std::span<const BodyState> bodies) noexcept {
    for (const int index : some_.followed) {
        const Joint& joint = joints_[index];
        const BodyState &first = body(joint.first, bodies), &second = body(joint.second, bodies);
        const Vec3 spin = second.angular_velocity - first.angular_velocity;
        if (joint.axial >= 0 && time_step_ * time_step_ * dot(spin, spin) < 1.0)
            continue;  // the next rows do
        const AxialRow row = axial_row(joint.constants, first, second);
        double& angle = states[index].angle;
        const State& state = states[index];
        angle = unwrapped(joint, row.coordinate, state.folds ? state.fold_to : angle + time_step_ * row.rate);
    }
}

bool JointSet::set_motor(int joint, double speed, double max_force) {
    Axial& axial = axials_.at(joints_.at(joint).axial);
    if (!axial.has_motor || std::isfinite(axial.impulse) != std::isfinite(max_force))
        throw std::invalid_argument("a motor keeps its kind: with a bound or without");
    const double impulse = time_step_ * max_force;
    const bool other = axial.speed != speed || axial.impulse != impulse;
    axial.speed = speed;
    axial.impulse = impulse;
    return other;
}

bool JointSet::set_rest(int joint, double rest) {
    Axial& axial = axials_.at(joints_.at(joint).axial);
    if (!axial.has_spring) throw std::invalid_argument("the joint has no spring");
    double& rests = springs_[axial.spring_at].rest;
    const bool other = rests != rest;
    rests = rest;
    axial.rest_moves = false;
    return other;
}

void JointSet::set_moving_rest(int joint, double rest, double before, double ahead) {
    set_rest(joint, rest);
    Axial& axial = axials_[joints_[joint].axial];
    axial.rest_moves = true;
    axial.rest_before = before;
    axial.rest_ahead = ahead;
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
    return 0.5 * springs_[axials_[joints_[joint].axial].spring_at].stiffness * turned * turned;
}

double JointSet::spring_energy(std::span<const BodyState> bodies) const noexcept {
    double sum = 0.0;
    for (int joint = 0; joint < count(); ++joint) {
        const int axial = joints_[joint].axial;
        if (axial < 0 || !axials_[axial].has_spring || axials_[axial].rest_moves) continue;
        sum += spring_energy(joint, springs_[axials_[axial].spring_at].rest, bodies);
    }
    return sum;
}

}  // namespace spook

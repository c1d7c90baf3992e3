#include "rigid/locked_tree.hpp"

#include <cmath>

namespace spook {

Twist LockedTree::momentum_of(const Link& link, const BodyState& s, const LockedLoads& loads) const noexcept {
    const double h = loads.time_step;
    Twist momentum{{}, s.angular_momentum};
    Vec3 kick;
    if (loads.acceleration.empty()) {
        kick = h * loads.gravity;
    } else {
        kick = h * loads.acceleration[link.body];
        momentum.angular += h * loads.constants[link.body].torque;
    }
    if (!loads.force.empty()) kick += (h / link.mass) * loads.force[link.body];
    momentum.linear = link.mass * (s.velocity + kick);
    return momentum;
}

/// Where the joint is and what its rows ask for.
void LockedTree::locate(std::size_t k, std::span<const BodyState> bodies, const LockedLoads& loads,
                        Work& work) const noexcept {
    const Hold& hold = holds_[k];
    const Gain& gain = gains_[links_[k].gain];
    const BodyState& child = bodies[links_[k].body];
    const BodyState& other = hold.other < 0 ? still_ : bodies[hold.other];
    const double sign = hold.child_is_first ? -1.0 : 1.0;
    const Vec3 bend = child.turn_less_one * hold.arm, other_bend = other.turn_less_one * hold.other_arm;
    work.arm = hold.arm + bend;
    work.other_arm = hold.other_arm + other_bend;
    const Vec3 gap = child.displacement - other.displacement + bend - other_bend;
    // The reaction acts where the second body holds the joint.
    if (hold.child_is_first) work.arm -= gap;
    else work.other_arm += gap;
    const Twist velocity{child.velocity, child.angular_velocity};
    const Twist others{other.velocity, other.angular_velocity};
    const Twist slip = to_joint(velocity, work.arm) - to_joint(others, work.other_arm);

    const BodyState &first = hold.child_is_first ? child : other,
                    &second = hold.child_is_first ? other : child;
    const Quat q = relative_turn(first, second);
    work.tilt = carried(first, vector_of(q));
    const double over = 1.0 / q.w;
    work.tilt_softness = gain.softness[1] * (over * over);
    work.left.linear = gain.upsilon[0] * slip.linear - gain.violation[0] * gap;
    work.left.angular = gain.upsilon[1] * slip.angular - (sign * 2.0 * gain.violation[1] * over) * work.tilt;
    if (loads.follows_turns) follow_turns(k, bodies, loads, work);
    if (links_[k].parent < 0) work.left += to_joint(others, work.other_arm);
}

/// As JointSet::follow_turns(), of a lock.
void LockedTree::follow_turns(std::size_t k, std::span<const BodyState> bodies, const LockedLoads& loads,
                              Work& work) const noexcept {
    const Hold& hold = holds_[k];
    const Gain& gain = gains_[links_[k].gain];
    const BodyState &child = bodies[links_[k].body], &other = hold.other < 0 ? still_ : bodies[hold.other];
    const double turn = turn_in_step(loads.time_step, child, other);
    if (!(share_of_bend(turn) > 0.0)) return;
    const int bodies_of[2] = {links_[k].body, hold.other};
    BodyState behind[2] = {child, other}, next[2] = {child, other}, ahead[2];
    for (int i = 0; i < 2; ++i) {
        if (const int body = bodies_of[i]; body >= 0)
            look_around(loads.constants[body], loads.time_step, behind[i], next[i], ahead[i]);
        else ahead[i] = next[i];
    }
    const auto tilt = [&](const BodyState* at) {
        const Quat q = conjugate(at[1].turn) * at[0].turn;
        return (2.0 / q.w) * carried(other, vector_of(q));
    };
    const auto bend = [&](const BodyState* from, const BodyState* there, double h) {
        const Vec3 w = from[0].angular_velocity, other_w = from[1].angular_velocity;
        return Twist{there[0].turn_less_one * hold.arm - from[0].turn_less_one * hold.arm -
                         (there[1].turn_less_one * hold.other_arm - from[1].turn_less_one * hold.other_arm) -
                         h * (cross(w, work.arm) - cross(other_w, work.other_arm)),
                     tilt(there) - tilt(from) - h * (w - other_w)};
    };
    const Twist on = bend(next, ahead, loads.time_step);
    const BodyState here[2] = {child, other};
    const Twist back = bend(here, behind, -loads.time_step);
    const auto lead = [&](int i, Vec3 after, Vec3 before) {
        const double relaxation = 0.25 * (1.0 / gain.upsilon[i] - 1.0);
        return gain.violation[i] * (0.25 * (after + before) + relaxation * after);
    };
    const double of_arms = turn_of_arms(loads.time_step, child, work.arm, other, work.other_arm);
    work.left.linear -= share_of_point(turn, of_arms) * lead(0, on.linear, back.linear);
    work.left.angular -= share_of_bend(turn) * share_of_angles(turn) * lead(1, on.angular, back.angular);
}

/// Leaves first. The first time K is found as well; then what the velocities so far leave of rows and momenta.
template <bool FIRST>
void LockedTree::eliminate(std::span<const BodyState> bodies, const LockedLoads& loads, bool again) noexcept {
    Inertia6 mass{};
    Twist momentum{};
    std::size_t waiting = 0;
    double sum = 0.0;
    for (std::size_t k = 0; k < links_.size(); ++k) {
        ask(k + AHEAD, bodies, true);
        const Link& link = links_[k];
        Work& work = works_[k];
        const BodyState& s = bodies[link.body];
        if (link.leaf) mass = {}, momentum = {};
        if (link.takes) {
            const Carried& rest = waiting_[--waiting];
            if (FIRST) add(mass, rest.mass);
            momentum += rest.momentum;
        }
        momentum += momentum_of(link, s, loads);
        if constexpr (FIRST) {
            mass.linear[0] += link.mass, mass.linear[3] += link.mass, mass.linear[5] += link.mass;
            const double* inertia = s.inertia.m;
            const double own[6] = {inertia[0], inertia[1], inertia[2], inertia[4], inertia[5], inertia[8]};
            for (int i = 0; i < 6; ++i) mass.angular[i] += own[i];
        } else {
            momentum -= Twist{link.mass * work.velocity.linear, s.inertia * work.velocity.angular};
        }
        if (link.gain < 0) {
            if (FIRST) factor_whole(work.stiffness = mass);
            work.base = momentum;
            sum += dot(momentum.linear, momentum.linear) + dot(momentum.angular, momentum.angular);
            continue;
        }
        const Gain& gain = gains_[link.gain];
        if constexpr (FIRST) {
            locate(k, bodies, loads, work);
            work.stiffness = shifted(mass, work.arm);
            soften_all(work.stiffness, gain.softness, work.tilt, work.tilt_softness);
        } else {
            momentum += about_centre(work.impulse, work.arm);
            Twist slip = to_joint(work.velocity, work.arm);
            if (link.parent >= 0) slip -= to_joint(works_[link.parent].velocity, work.other_arm);
            if (again) locate(k, bodies, loads, work);  // a refinement before this one is in the place of y
            work.left = work.left - slip - give(work, gain, work.impulse);
        }
        const Twist q = about_joint(momentum, work.arm);
        work.base = work.stiffness * (work.left + give(work, gain, q)) - q;
        if (link.parent < 0) {
            sum += dot(work.base.linear, work.base.linear) + dot(work.base.angular, work.base.angular);
            continue;
        }
        if (FIRST) mass = shifted(work.stiffness, -work.other_arm);
        momentum = Twist{} - about_centre(FIRST ? work.base : work.base + work.impulse, work.other_arm);
        if (link.next == Link::hands_on) continue;
        if (link.next == Link::waits) {
            waiting_[waiting++] = {mass, momentum};
            continue;
        }
        if (FIRST) add(waiting_[waiting - 1].mass, mass);
        waiting_[waiting - 1].momentum += momentum;
    }
    finite_ = std::isfinite(sum);
}

void LockedTree::eliminate(std::span<const BodyState> bodies, const LockedLoads& loads, bool first,
                           bool again) noexcept {
    if (first) eliminate<true>(bodies, loads, again);
    else eliminate<false>(bodies, loads, again);
}

void LockedTree::deliver(std::span<JointSet::State> states) const noexcept {
    for (std::size_t k = 0; k < links_.size(); ++k) {
        const Hold& hold = holds_[k];
        if (hold.joint < 0) continue;
        const Work& work = works_[k];
        JointSet::State& state = states[hold.joint];
        const double sign = hold.child_is_first ? -1.0 : 1.0;
        const Vec3 force = sign * work.impulse.linear, torque = sign * work.impulse.angular;
        state.multiplier = {force.x, force.y, force.z, torque.x, torque.y, torque.z};
        state.first_reach = hold.child_is_first ? work.arm : work.other_arm;
        state.second_reach = hold.child_is_first ? work.other_arm : work.arm;
    }
}

}  // namespace spook

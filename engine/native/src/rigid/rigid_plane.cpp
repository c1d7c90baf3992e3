// Plain and half-step steps by numbers of a plane (plane_step.hpp), where the scene and its state allow it.
//
// A step is left to the rows of the space where those of the plane are too nearly dependent, and where a loop is due a look
// for rows that lock (rigid_locking.cpp): so refusals are found, and worded, in one place.
#include "rigid/plane_path.hpp"

namespace spook {

Refusal PlanePath::take() {
    const Refusal refusal = plane_.analyse(model_.constants, joints_, model_.constrained,
                                           {model_.h, model_.method.refinements, model_.method.corrections,
                                            model_.method.correction_cap, !joints_.turning.empty()});
    begin();
    return refusal ? refusal : used_ ? nullptr : "places, speeds or forces lead out of it";
}

void PlanePath::begin() {
    at_hand_ = false;
    solves_ = 0;
    const LargeArray<BodyState>& bodies = live_.bodies.empty() ? model_.start : live_.bodies;
    used_ = !plane_.empty() && plane_.holds(model_.constants, forces_.accelerations(), bodies);
}

void PlanePath::enter() {
    plane_.read(live_.bodies);
    at_hand_ = true;
    if (model_.method.corrections > 0) plane_.read_violations(live_.last_violation);
    if (!model_.half_step) return;
    for (std::size_t k = 0; k < model_.constrained.size(); ++k) {
        const BodyMomenta& before = live_.before[model_.constrained[k]];
        plane_.read_before(static_cast<int>(k), before.velocity, before.angular_momentum);
    }
}

void PlanePath::write() {
    plane_.write(live_.bodies);
    if (model_.method.corrections > 0) plane_.write_violations(live_.last_violation);
    if (!model_.half_step) return;
    for (std::size_t k = 0; k < model_.constrained.size(); ++k)
        live_.before[model_.constrained[k]] = {plane_.velocity_before(static_cast<int>(k)),
                                               plane_.spin_before(static_cast<int>(k))};
}

/// The bodies as steps in space need them.
void PlanePath::leave() {
    if (at_hand_) write();
    at_hand_ = false;
    for (int i : model_.constrained) refresh(model_.constants[i], live_.bodies[i]);
}

/// False if the step is one for the space.
bool PlanePath::solve() {
    if (!at_hand_) enter();
    if (!plane_.find_velocities() || (!loops_.empty() && loops_.wants_look(plane_))) {
        leave();
        return false;
    }
    plane_.take_velocities();
    live_.last_rows = LastRows::plane;
    ++solves_;
    return true;
}

void PlanePath::deliver() {
    if (!at_hand_) return;
    write();
    if (live_.last_rows == LastRows::plane) plane_.deliver(joints_.states);
}

void PlanePath::give_up() {
    if (used_) leave();
    used_ = false;
}

}  // namespace spook

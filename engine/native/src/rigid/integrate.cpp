// Stage: integrate. q₊ = q + h v₊, and every orientation by the turn h w₊ of its body (rigid_state.hpp). Bodies of an event went with
// v₋ until its time: what that makes of their way is added.
//
// reads: velocities and momenta of bodies, of a step in a plane its own; the contact stage's correction(); sleepers; the step's
// coordinates of joints with rotors; touching_ and scratch_.led_by_joints, which say whether whirling is looked for, and for that
// multipliers of joints. writes: places and orientations of bodies, and what they turn with; rotors of joints; live_.whirling;
// where a body whirls, multipliers of joints.
#include "rigid/rigid_system.hpp"
#include "rigid/rotors.hpp"
#include "rigid/runaway.hpp"

namespace spook {

namespace {

/// Brings a body that was moved to an impact of the step there. What is left of the step then, s.
double begin_at_impact(const RigidModel& model, const StepScratch& scratch, int body, BodyState& s) {
    if (scratch.gone.empty() || scratch.gone[body].time == 0.0) return model.h;
    const auto& [time, there] = scratch.gone[body];
    s.displacement = there.displacement, s.turn = there.turn;
    refresh(model.constants[body], s);
    return model.h - time;
}

}  // namespace

void RigidSystem::integrate() {
    const auto find_whirling = [this](std::span<const int> bodies) {
        if (live_.whirling < 0)
            live_.whirling = spook::find_whirling(model_, live_, joints_, bodies, [this] { deliver(); });
    };
    if (plane_.is_used() && model_.half_step && !plane_.at_hand())
        plane_.enter();  // also where its velocities were found in space
    if (plane_.at_hand()) {
        const int body = plane_.move();
        if (body < 0 || live_.whirling >= 0) return;
        deliver();
        return find_whirling({&body, 1});
    }
    // With contacts an impact can turn a body by a radian in a step as well: then only the joints' work tells tension from it.
    if (!mixed_.touching() || scratch_.led_by_joints) find_whirling(model_.constrained);
    if (!bilateral_.take_moved())
        for (int i : model_.constrained)
            if (!live_.asleep(i)) {
                const double left = begin_at_impact(model_, scratch_, i, live_.bodies[i]);
                spook::integrate(model_.constants[i], left, live_.bodies[i]);
            }
    for (int i : model_.free) spook::integrate(model_.constants[i], model_.h, live_.bodies[i]);
    for (int i : model_.driven) spook::integrate(model_.constants[i], model_.h, live_.bodies[i]);
    if (mixed_.contacts() && !mixed_.contacts()->correction().empty()) {
        const std::vector<Vec6>& extra = mixed_.contacts()->correction();
        for (std::size_t k = 0; k < model_.constrained.size(); ++k)
            if (!live_.asleep(model_.constrained[k]))
                displace(model_.constants[model_.constrained[k]], model_.h,
                         {extra[k][0], extra[k][1], extra[k][2]}, {extra[k][3], extra[k][4], extra[k][5]},
                         live_.bodies[model_.constrained[k]]);
    }
    for (const int k : joints_.rotors()) {
        const JointBlock& block = joints_.blocks()[k];
        JointState& state = joints_.states[block.joint];
        if (rests(block, live_)) state.rotor = state.rotor_lead = 0.0;
        else turn_rotor(joints_, k, live_.bodies, model_.h);
    }
}

}  // namespace spook

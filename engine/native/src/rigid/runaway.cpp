#include "rigid/runaway.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rigid/tolerances.hpp"

namespace spook {

namespace {

using namespace tolerances::runaway;

/// Whether a joint pulls at one of its bodies, of mass m at an arm l, with a tension T of which T h²/(m l) is above `taut`.
bool is_taut(const JointBlock& block, const JointSet::State& state, bool second, double mass,
             double h) noexcept {
    if (block.axial) return false;
    double impulse = 0.0;
    const int linear = std::min(block.size, 3);
    for (int i = 0; i < linear; ++i) impulse = std::max(impulse, std::abs(state.multiplier[i]));
    const double arm = norm(second ? state.second_reach : state.first_reach);
    return arm > 0.0 && h * impulse > taut * mass * arm;
}

}  // namespace

/// A body that a taut joint makes go round by a radian a step: rows that stand still in the step no longer guide its way. −1 if there
/// is none. An arm along the axis, as of a wheel beside its hinge, stays where it is, and so does the ground under a tyre.
int find_whirling(const RigidModel& model, const RigidState& live, const JointSet& joints,
                  std::span<const int> bodies, const std::function<void()>& deliver) {
    if (joints.blocks().empty()) return -1;
    for (const int i : bodies) {
        const BodyConstants& body = model.constants[i];
        const BodyState& s = live.bodies[i];
        const double least = std::min({body.inertia.x, body.inertia.y, body.inertia.z});
        if (body.particle || model.h * model.h * dot(s.angular_momentum, s.angular_momentum) < least * least)
            continue;
        const Vec3 spin = turned_by(body, s, s.angular_momentum);
        if (model.h * norm(spin) < 1.0) continue;
        deliver();
        for (const JointBlock& block : joints.blocks()) {
            if (const JointKind kind = joints.constants(block.joint).kind;
                kind != JointKind::distance && holds_of(kind).rows() == 0)
                continue;
            const JointSet::State& state = joints.states[block.joint];
            for (const bool second : {false, true}) {
                if ((second ? block.second : block.first) != i) continue;
                const Vec3 around = cross(second ? state.second_reach : state.first_reach, spin);
                if (body.mass * dot(around, around) > passing_energy * dot(spin, s.angular_momentum) &&
                    is_taut(block, state, second, body.mass, model.h))
                    return i;
            }
        }
    }
    return -1;
}

/// Why a run ended, if tension did it; `known`: that it did.
const char* cause_of_runaway(const RigidModel& model, const JointSet& joints,
                             const LargeArray<JointState>& early, bool touching, bool known,
                             bool forced) noexcept {
    if (!known && (model.composed || early.size() != joints.states.size())) return "";
    for (const JointBlock& block : joints.blocks())
        for (const bool second : {false, true}) {
            const int body = second ? block.second : block.first;
            if (known || body < 0 || !model.constants[body].moves()) continue;
            known = is_taut(block, early[block.joint], second, model.constants[body].mass, model.h);
        }
    if (!known) return "";
    return forced
               ? "ran away: its joints carry more than so light a body can take in a step (T h²/(m l) is above 0.3); "
                 "where their loop leaves its motor nothing to move, bound the motor, else take a smaller time step"
           : model.stiff
               ? "ran away: its joints carry more than so light a body can take in a step (T h²/(m l) is "
                 "above 0.3), and their load changes within one, while string_stiffness knows that of "
                 "the step before; use composition=\"order4\" without it, or a smaller time step"
           : touching || !model.bilateral
               ? "ran away: its joints carry more tension than so light a body can take in a step "
                 "(T h²/(m l) is above 0.3); use a smaller time step"
               : "ran away: its joints carry more tension than so light a body can take in a step "
                 "(T h²/(m l) is above 0.3); use string_stiffness=True, or a smaller time step";
}

void judge_open_joints(const RigidModel& model, const RigidState& live, const JointSet& joints,
                       RunReport& report) {
    if (report.status != Status::completed) return;
    const auto blocks = joints.blocks();
    for (int k = 0; k < static_cast<int>(blocks.size()); ++k) {
        const JointBlock& block = blocks[k];
        const JointState& state = joints.states[block.joint];
        const int linear = block.axial ? 0 : holds_of(joints.constants(block.joint).kind).linear();
        if (linear == 0 || state.broken) continue;
        if (joints.law(block.joint, 0).gives_way(model.h)) continue;
        double violation[6], open = 0.0;
        joints.violation(block.joint, live.bodies, violation);
        for (int i = 0; i < linear; ++i) open += violation[i] * violation[i];
        open = std::sqrt(open);
        if (!(open > joints.gain(k, 0).extent)) continue;
        const bool second = block.second >= 0 && model.constants[block.second].moves();
        char said[160];
        std::snprintf(
            said, sizeof said,
            "was found %.3g m off its joint, further than the joint's arms reach; take smaller steps or less compliance",
            open);
        report.leave_unsettled(second ? block.second : block.first, said);
        return;
    }
}

}  // namespace spook

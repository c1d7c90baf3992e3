// Joints that carry more tension than light bodies can take in a step: seen, and named.
#pragma once

#include <functional>
#include <span>

#include "rigid/rigid_model.hpp"
#include "rigid/run_state.hpp"
#include "run/report.hpp"

namespace spook {

/// Which of some bodies tension makes go round by a radian a step, −1 if none; `deliver` brings the multipliers of joints up to date.
int find_whirling(const RigidModel& model, const RigidState& live, const JointSet& joints,
                  std::span<const int> bodies, const std::function<void()>& deliver);

/// Why a run ended, if tension did it: what joints carried a few steps before shows it, or it is `known`; and the option that cures
/// it. `touching`: where surfaces may touch; `forced`: where a motor drives bodies that joints close a loop of.
const char* cause_of_runaway(const RigidModel& model, const JointSet& joints,
                             const LargeArray<JointState>& early, bool touching, bool known,
                             bool forced) noexcept;

/// Bodies found further off a rigid joint than its arms reach: unsettled, however quietly they got there.
void judge_open_joints(const RigidModel& model, const RigidState& live, const JointSet& joints,
                       RunReport& report);

}  // namespace spook

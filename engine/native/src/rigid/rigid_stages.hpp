// Which stages a scene with rigid bodies needs, and why.
#pragma once

#include "rigid/rigid_scene.hpp"
#include "run/stages.hpp"

namespace spook {

/// The one place that decides it; `observing` says whether something is read while the loop runs.
StageChoices choose_stages(const RigidScene& scene, bool observing);

}  // namespace spook

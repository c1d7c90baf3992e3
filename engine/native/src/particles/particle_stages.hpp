// Which stages a scene of particles needs, and why.
#pragma once

#include "particles/particle_scene.hpp"
#include "run/stages.hpp"

namespace spook {

/// The one place that decides it; `observing` says whether something is read while the loop runs.
StageChoices choose_stages(const ParticleScene& scene, bool observing);

}  // namespace spook

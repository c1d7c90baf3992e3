"""Scene and time step → Program: check once, choose the pipeline, let it choose its stages."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from types import MappingProxyType

from spook_tracker.engine.bodies import Particle
from spook_tracker.engine.errors import MethodError, SceneError
from spook_tracker.engine.method import PLAIN, Method
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.particle_program import compile_particles
from spook_tracker.engine.program import Program, StageChoice
from spook_tracker.engine.rigid_program import compile_rigid
from spook_tracker.engine.scene import Scene

NOTHING: Mapping[str, Observable] = MappingProxyType({})


def compile(
    scene: Scene,
    *,
    time_step: float,
    method: Method = PLAIN,
    observe: Mapping[str, Observable] = NOTHING,
) -> Program:
    """Compile a scene for a time step [s]: only the stages it needs, nothing else in the loop.

    Raises MethodError for a time step that is not positive and finite, an option that makes no sense for the
    scene or an observable of something unknown.
    """
    if not isinstance(scene, Scene):
        raise SceneError(f"compile needs a Scene, not {scene!r}")
    if not isinstance(method, Method):
        raise MethodError(f"method must be a Method, not {method!r}")
    if isinstance(time_step, bool) or not isinstance(time_step, int | float):
        raise MethodError(f"time_step must be a number of seconds, not {time_step!r}")
    if isinstance(time_step, int) and abs(time_step) > sys.float_info.max:
        raise MethodError("time_step is a number too large for arithmetic")
    if not (math.isfinite(time_step) and time_step > 0.0):
        raise MethodError(f"time_step must be positive and finite, not {time_step!r}")
    if all(isinstance(body, Particle) for body in scene.bodies) and not _forces_rigid_stages(method):
        return compile_particles(scene, float(time_step), method, observe)
    return compile_rigid(scene, float(time_step), method, observe)


def explain(
    scene: Scene,
    *,
    time_step: float,
    method: Method = PLAIN,
    observe: Mapping[str, Observable] = NOTHING,
) -> tuple[StageChoice, ...]:
    """Every stage of the step, kept or left out for this scene, with the reason; nothing is run."""
    return compile(scene, time_step=time_step, method=method, observe=observe).explain()


def _forces_rigid_stages(method: Method) -> bool:
    """Whether a stage only rigid bodies have is to be measured, and nothing is asked that they lack."""
    return not {"rotation", "collision"}.isdisjoint(method.force_stages) and not method.string_stiffness

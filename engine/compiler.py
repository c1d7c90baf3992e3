"""Scene and time step → Program: check once, choose the pipeline, let it choose its stages."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from types import MappingProxyType

from spook_tracker.misuse import explained

from .bodies import Particle
from .errors import MethodError, SceneError
from .forces import Fluid, Load
from .joints import Distance
from .method import DEFAULT, Method
from .observe import Observable
from .particle_program import compile_particles
from .program import Program, StageChoice
from .rigid_program import compile_rigid
from .scene import Scene

NOTHING: Mapping[str, Observable] = MappingProxyType({})


@explained
def compile(
    scene: Scene,
    *,
    time_step: float,
    method: Method = DEFAULT,
    observe: Mapping[str, Observable] = NOTHING,
    held: bool = False,
) -> Program:
    """Compile a scene for a time step [s]: only the stages it needs, nothing else in the loop.

    `held` keeps what can be set from outside while it runs (`start`): every Load, even one of zero.

    Raises MethodError for a time step that is not positive and finite, an option that makes no sense for the
    scene or an observable of something unknown.
    """
    if not isinstance(scene, Scene):
        raise SceneError(f"a Scene is needed, as in Scene(bodies=(…,)), not {type(scene).__name__}")
    if not isinstance(method, Method):
        raise MethodError(f"method must be a Method, not {method!r}")
    if isinstance(time_step, bool) or not isinstance(time_step, int | float):
        raise MethodError(f"time_step must be a number of seconds, not {time_step!r}")
    if isinstance(time_step, int) and abs(time_step) > sys.float_info.max:
        raise MethodError("time_step is a number too large for arithmetic")
    if not (math.isfinite(time_step) and time_step > 0.0):
        raise MethodError(f"time_step must be positive and finite, not {time_step!r}")
    if _only_particles(scene) and not _forces_rigid_stages(method):
        return compile_particles(scene, float(time_step), method, observe, held)
    return compile_rigid(scene, float(time_step), method, observe, held)


def explain(
    scene: Scene,
    *,
    time_step: float,
    method: Method = DEFAULT,
    observe: Mapping[str, Observable] = NOTHING,
) -> tuple[StageChoice, ...]:
    """Every stage of the step, kept or left out for this scene, with the reason; nothing is run."""
    return compile(scene, time_step=time_step, method=method, observe=observe).explain()


def _only_particles(scene: Scene) -> bool:
    """Whether all is in the reach of the particle pipeline: wires and functions of time are not."""
    return (
        all(isinstance(body, Particle) for body in scene.bodies)
        and all(isinstance(constraint, Distance) for constraint in scene.constraints)
        and not any(
            isinstance(f, Fluid) or (isinstance(f, Load) and f.factor is not None) for f in scene.forces
        )
    )


def _forces_rigid_stages(method: Method) -> bool:
    """Whether a method or a stage to be measured is of rigid bodies only, and nothing is asked that they lack."""
    return method.runge_kutta != "none" or (
        not {"rotation", "collision"}.isdisjoint(method.force_stages) and not method.string_stiffness
    )

"""simulate(): compile a scene and run it once."""

from __future__ import annotations

import math
from collections.abc import Mapping

from spook_tracker.engine import check
from spook_tracker.engine.compiler import NOTHING, compile
from spook_tracker.engine.errors import MethodError
from spook_tracker.engine.method import PLAIN, Method
from spook_tracker.engine.model_file import ModelRun
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.engine.result import Result
from spook_tracker.engine.scene import Scene


def simulate(
    scene: Scene,
    *,
    time_step: float,
    duration: float | None = None,
    steps: int | None = None,
    method: Method = PLAIN,
    observe: Mapping[str, Observable] = NOTHING,
    time_limit: float | None = None,
    time_stages: bool = False,
) -> Result:
    """Run a scene for `duration` [s] or a number of `steps`, exactly one of them, wholly in native code.

    A duration that is no whole number of time steps [s] is rounded to the nearest. `time_limit` is wall time
    [s]. Raises SceneError or MethodError with one sentence; a run that diverges is a Result that says so.
    """
    if isinstance(scene, ModelRun):
        raise NotSupported(f"spook reads no {scene.model.format} yet")
    program = compile(scene, time_step=time_step, method=method, observe=observe)
    if (duration is None) == (steps is None):
        raise MethodError("give either a duration or a number of steps")
    if duration is not None:
        try:
            if isinstance(duration, bool | str | bytes):
                raise TypeError
            seconds = float(duration)
        except (TypeError, ValueError):
            raise MethodError(f"duration must be a number of seconds, not {duration!r}") from None
        except OverflowError:
            raise MethodError("duration is a number too large for arithmetic") from None
        if not (math.isfinite(seconds) and seconds >= 0.0):
            raise MethodError(f"duration must be finite and not negative, not {duration!r}")
        steps = round(min(seconds / time_step, 1e300))
    return program.run(check.step_count(steps), time_limit, time_stages)

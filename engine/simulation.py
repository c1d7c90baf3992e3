"""simulate(): compile a scene and run it once; prepare(): compile it, and run it as often as asked."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np

from spook_tracker.misuse import explained

from . import check
from .books import kept, traces
from .compiler import NOTHING, compile
from .errors import MethodError
from .method import DEFAULT, Method
from .model_file import ModelRun
from .observe import Observable, Trace
from .program import Program
from .protocol import NotSupported
from .result import Origin, Result
from .scene import Scene
from .watch import until


@dataclass(frozen=True, slots=True)
class Prepared:
    """A compiled scene and how far to run it; every run starts from the start and gives the same bits."""

    program: Program
    steps: int

    def run(self, time_limit: float | None = None, time_stages: bool = False) -> Result:
        """What `simulate` gives; `time_limit` is wall time [s]."""
        return self.program.run(self.steps, time_limit, time_stages)


@explained
def prepare(
    scene: Scene,
    *,
    time_step: float,
    duration: float | None = None,
    steps: int | None = None,
    method: Method = DEFAULT,
    observe: Mapping[str, Observable] = NOTHING,
) -> Prepared:
    """Compile a scene for `duration` [s] or a number of `steps`, exactly one of them; see `simulate`."""
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
    return Prepared(program, check.step_count(steps))


@explained
def simulate(
    scene: Scene,
    *,
    time_step: float,
    duration: float | None = None,
    steps: int | None = None,
    method: Method = DEFAULT,
    observe: Mapping[str, Observable] = NOTHING,
    time_limit: float | None = None,
    time_stages: bool = False,
    books: bool = False,
) -> Result:
    """Run a scene for `duration` [s] or a number of `steps`, exactly one of them, wholly in native code.

    A duration that is no whole number of time steps [s] is rounded to the nearest. `time_limit` is wall time
    [s], compiling included. With `books` every step is traced for `Result.books`: what energy came in, was dissipated, or is
    explained by neither; a run that makes much of it out of nothing is "unsettled". Raises SceneError or MethodError with one sentence; a run that diverges is a Result that says so.
    """
    if isinstance(scene, ModelRun):
        return _of_model(scene, time_step, duration, method, time_limit)
    limit = check.wall_time(time_limit)
    begun = time.monotonic()
    if books:
        observe = {**observe, **traces(scene)}
    try:
        with until(begun + limit) if limit else nullcontext():
            prepared = prepare(
                scene, time_step=time_step, duration=duration, steps=steps, method=method, observe=observe
            )
    except TimeoutError:
        return _not_compiled(scene, time_step, observe, limit, time.monotonic() - begun)
    result = prepared.program.run(prepared.steps, time_limit, time_stages, since=begun)
    if books:
        result = kept(scene, method, result)
    return replace(result, origin=Origin(scene=scene, method=method, simulate=simulate))


def _not_compiled(
    scene: Scene, time_step: float, observe: Mapping[str, Observable], limit: float, seconds: float
) -> Result:
    """Of a scene whose time was over before anything could run: where its bodies are."""
    places = {
        body.name: np.array(
            [*body.position, *getattr(body, "orientation", (1.0, 0.0, 0.0, 0.0)), *[np.nan] * 6]
        )
        for body in scene.bodies
    }
    nothing = np.empty(0)
    return Result(
        status="timed_out",
        failure=f"the time limit of {limit:g} s was reached before step 1: the scene was still being compiled",
        failed_body=None,
        failed_step=1,
        time_step=time_step,
        steps=0,
        seconds=seconds,
        observables={
            name: nothing if isinstance(what, Trace) else np.array(np.nan) for name, what in observe.items()
        },
        sample_times={name: nothing for name, what in observe.items() if isinstance(what, Trace)},
        final_state=places,
        counters={"steps": 0},
        state_hash="",
        stages=(),
    )


def _of_model(
    asked: ModelRun, time_step: float, duration: float | None, method: Method, time_limit: float | None
) -> Result:
    """A model file as a scene, where MuJoCo is installed to read it."""
    try:
        from .peers.spook_file import READS, run_model
    except ImportError as error:
        raise NotSupported(
            f"spook reads model files by MuJoCo's parser, which is not installed ({error}); "
            "install it with: pip install 'spook-tracker[mujoco]'"
        ) from None
    if asked.model.format not in READS:
        raise NotSupported(f"spook reads {' and '.join(READS)}, no {asked.model.format}")
    return run_model(asked, time_step, duration or 0.0, time_limit, method)

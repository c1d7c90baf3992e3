"""How far a model swings in one engine from where it swings in MuJoCo, with nothing that takes or gives energy.

Contacts, limits, damping, friction, actuation and equality constraints are off in both, joints start with random
speeds, gravity and springs act. Each engine's own step is halved until that changes nothing that matters, so that
what is left between them is how they understand the file.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from spook_tracker.engine.errors import EngineError
from spook_tracker.engine.find import find
from spook_tracker.engine.model_file import ModelFile, ModelRun

REFERENCE = "mujoco"
SWING = 1.0  # rad/s and m/s
LASTS = 1.0  # s
ALIKE = 1e-6  # of the size
STEPS = {REFERENCE: 1e-3}  # s, to begin with
STEP = 1e-2  # s, of an engine that is asked with the highest order it has
FINEST = 1e-5  # s
RESOLVED = 0.1 * ALIKE  # of the size: what halving a step may still change
BUDGET = 60.0  # s of the processor that both engines may take together


class BrokeOff(EngineError):
    """A run did not come to its end."""


class OutOfTime(EngineError):
    """The steps could not be made short enough in the time there is."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Of all watched bodies the largest distance, over the size."""

    apart: float
    own: float  # by which halving the engine's step moved it
    reference: float  # and MuJoCo's

    @property
    def resolved(self) -> bool:
        """Whether both engines' steps are so short that they say nothing."""
        return max(self.own, self.reference) <= RESOLVED


def agreement(model: ModelFile, engine: str, budget: float = BUDGET) -> Agreement:
    """The distance after one second. Raises EngineError where one of both cannot be asked, OutOfTime
    after `budget` [s] of this process."""
    end = time.process_time() + budget
    wanted, reference, size = _resolved(model, REFERENCE, STEPS[REFERENCE], end)
    there, own, _ = _resolved(model, engine, STEP, end)
    return Agreement(_apart(there, wanted) / size, own, reference)


def _resolved(
    model: ModelFile, engine: str, step: float, end: float
) -> tuple[npt.NDArray[np.float64], float, float]:
    """Places of the watched bodies at the end, what halving the step changed of them, and the size of what moves."""
    while True:
        try:
            before, size = _ran(model, engine, step, end)
            break
        except BrokeOff:  # of a step that is too long for it
            step *= 0.5
            if step <= FINEST:
                raise
    last = np.inf
    while True:
        step *= 0.5
        after, _ = _ran(model, engine, step, end)
        changed = _apart(after, before) / size
        if (
            changed == 0.0 and step > FINEST
        ):  # the engine has taken the same parts of both steps, which says nothing
            continue
        if changed <= RESOLVED or step <= FINEST or changed > last:  # what grows again is rounding, or chaos
            return after, changed, size
        before, last = after, changed


def _ran(model: ModelFile, engine: str, step: float, end: float) -> tuple[npt.NDArray[np.float64], float]:
    asked = ModelRun(model=model, samples=(LASTS,), swing=SWING, seed=1, accurate=True)
    left = end - time.process_time()
    done = find(engine).simulate(asked, time_step=step, duration=LASTS, time_limit=max(left, 0.0))
    if done.status == "timed_out":
        raise OutOfTime(f"out of time: {engine} needs steps of {step:.2g} s or less")
    if not done.completed:
        raise BrokeOff(f"{engine}: {done.failure}")
    return np.asarray(done["position"])[-1], float(done["size"])


def _apart(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]) -> float:
    return float(np.linalg.norm(one - other, axis=-1).max())

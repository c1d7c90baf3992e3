"""How far a model swings in one engine from where it swings in MuJoCo, with nothing that takes or gives energy.

Contacts, limits, damping, friction, actuation and equality constraints are off in both, joints start with random
speeds, gravity and springs act. Each engine's own step is halved until that changes nothing that matters, so that
what is left between them is how they understand the file.
"""

from __future__ import annotations

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


def agreement(model: ModelFile, engine: str) -> Agreement:
    """The distance after one second. Raises EngineError where one of both cannot be asked."""
    there, own, _ = _resolved(model, engine, STEP)
    wanted, reference, size = _resolved(model, REFERENCE, STEPS[REFERENCE])
    return Agreement(_apart(there, wanted) / size, own, reference)


def _resolved(model: ModelFile, engine: str, step: float) -> tuple[npt.NDArray[np.float64], float, float]:
    """Places of the watched bodies at the end, what halving the step changed of them, and the size of what moves."""
    before, size = _ran(model, engine, step)
    last = np.inf
    while True:
        step *= 0.5
        after, _ = _ran(model, engine, step)
        changed = _apart(after, before) / size
        if changed <= RESOLVED or step <= FINEST or changed > last:  # what grows again is rounding, or chaos
            return after, changed, size
        before, last = after, changed


def _ran(model: ModelFile, engine: str, step: float) -> tuple[npt.NDArray[np.float64], float]:
    asked = ModelRun(model=model, samples=(LASTS,), swing=SWING, seed=1, accurate=True)
    done = find(engine).simulate(asked, time_step=step, duration=LASTS)
    if not done.completed:
        raise EngineError(f"{engine}: {done.failure}")
    return np.asarray(done["position"])[-1], float(done["size"])


def _apart(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]) -> float:
    return float(np.linalg.norm(one - other, axis=-1).max())

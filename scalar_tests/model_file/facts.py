"""What all measurements of a model share: the model, how long it is watched, what counts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from spook_tracker.engine.model_file import ModelFile, ModelRun
from spook_tracker.engine.result import Result

from .. import case

Array = npt.NDArray[np.float64]
CHECKPOINTS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)  # s: they grow, as what differs does
LONGEST_REST = 10.0  # s after which what moves is called unsettled
PUSH = 1e-15  # of the size, in every step: what another order of sums or another compiler does
PUSHED = 4  # runs, with seeds 1 to 4
BEYOND = 10.0  # times the largest of four: a fifth run exceeds it once in some thousand series
UNPREDICTABLE = (
    0.01  # of the size: where pushes of the last bits have grown to this, places say nothing any more
)
GRID = 50  # times at which the growth of the pushes is read


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A model and for how long [s] it is watched."""

    model: ModelFile
    duration: float

    @property
    def checkpoints(self) -> tuple[float, ...]:
        """Those [s] within the duration; at least its end."""
        return tuple(t for t in CHECKPOINTS if t <= self.duration + 1e-9) or (self.duration,)


def simulated(
    simulate: case.Simulate, asked: Asked, duration: float, refined: float = 1, **run: Any
) -> Result:
    """One run of the model, with its own time step divided by `refined`."""
    step = asked.model.time_step / refined
    return simulate(ModelRun(model=asked.model, **run), time_step=step, duration=duration)  # type: ignore[arg-type]


def times_of(asked: Asked) -> tuple[float, ...]:
    """When [s] the motion is read: at the checkpoints, and often enough to see pushes grow."""
    end = asked.checkpoints[-1]
    return tuple(sorted({*asked.checkpoints, *(end * k / GRID for k in range(GRID + 1))}))


def watched(
    asked: Asked, simulate: case.Simulate, rests: bool = True, refined: float = 1, **push: Any
) -> Result:
    """The model as its file has it, read at all those times; where it `rests` on until it has settled. What is asked of its
    motion and of its rest is read off the same runs: both ask for them in the same words, and where runs are remembered
    they are made once."""
    end = asked.checkpoints[-1]
    lasts = max(end, LONGEST_REST) if rests else end
    return simulated(simulate, asked, lasts, refined, samples=times_of(asked), until_settled=rests, **push)


def pushed(asked: Asked, simulate: case.Simulate, run: Result, seed: int) -> Result:
    """The same with pushes of the last bits in every step; until it has settled where `run` has."""
    return watched(asked, simulate, settles(run), push=PUSH, seed=seed)


def in_time(runs: Iterator[Result]) -> list[Result]:
    """As many of these as a first look has time for; OutOfTime where it is none."""
    found: list[Result] = []
    try:
        found.extend(runs)
    except case.OutOfTime:
        if not found:
            raise
    return found


def settles(run: Result) -> bool:
    """Whether a run that was to go on until all rests did not end without."""
    return math.isfinite(float(run.partial.get("settled", math.nan)))


def turns(orientation: Array, start: Array) -> Array:
    """Angles [rad] between unit quaternions (…, 4) and those at the start; of two that differ by a sign none."""
    scalar = np.abs(np.sum(orientation * start, axis=-1))
    w, x, y, z = (orientation[..., k] for k in range(4))
    a, b, c, d = (start[..., k] for k in range(4))
    vector = np.stack(
        [a * x - b * w - c * z + d * y, a * y + b * z - c * w - d * x, a * z - b * y + c * x - d * w], axis=-1
    )
    angle: Array = 2.0 * np.arctan2(np.linalg.norm(vector, axis=-1), scalar)
    return angle


def apart(one: Result, other: Result, size: float) -> Array:
    """The largest distance [m] of any watched body in two runs, at each sample both reached: of its place, or of its rim
    where it has turned, for a body often begins at its joint and only turns."""
    places, others = (np.asarray(run.partial["position"]) for run in (one, other))
    turned, else_turned = (np.asarray(run.partial["orientation"]) for run in (one, other))
    both = min(len(places), len(others))
    moved = np.linalg.norm(places[:both] - others[:both], axis=-1)
    rim = 0.5 * size * turns(turned[:both], else_turned[:both])
    found: Array = np.maximum(moved, rim).max(axis=-1)
    return found


def spread(value: float, others: Sequence[float]) -> float:
    """How far some others lie from a value at most; infinite if one has none."""
    return max((abs(other - value) if math.isfinite(other) else math.inf for other in others), default=0.0)

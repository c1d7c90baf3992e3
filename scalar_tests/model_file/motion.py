"""Where every watched body is at growing times, how far rounding and the time step move it, and until when that is known."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from spook_tracker.engine.result import Result
from spook_tracker.scalar_tests.case import Estimate, Metric, Simulate
from spook_tracker.scalar_tests.model_file.facts import (
    BEYOND,
    GRID,
    PUSH,
    PUSHED,
    UNPREDICTABLE,
    Array,
    Asked,
    apart,
    simulated,
    turns,
)


def metrics(asked: Asked) -> tuple[Metric, ...]:
    """Place and turn of each watched body at each checkpoint, and the time that can be predicted."""
    found = []
    for at in asked.checkpoints:
        for body in asked.model.watched:
            label = body.label
            found += [
                Metric(
                    name=f"{label}.place@{at:g}s",
                    description=f"how far {label} is from where it started, after {at:g} s",
                    unit="m",
                    role="reported",
                    better="inside",
                ),
                Metric(
                    name=f"{label}.turn@{at:g}s",
                    description=f"how far {label} has turned from its start, after {at:g} s",
                    unit="rad",
                    role="reported",
                    better="inside",
                ),
            ]
    return (
        *found,
        Metric(
            name="predictable_time",
            description=f"when pushes of {PUSH:g} of the size have grown to a hundredth of it; the whole time if they have not",
            unit="s",
            role="reported",
            better="larger",
        ),
    )


def measure(asked: Asked, simulate: Simulate) -> Mapping[str, float]:
    """One run, the same with pushes of the last bits in every step, and one with half the time step."""
    end = asked.checkpoints[-1]
    times = sorted({*asked.checkpoints, *(end * k / GRID for k in range(GRID + 1))})
    run = simulated(simulate, asked, end, samples=tuple(times))
    place, turn, size = _read(run), _turned(run), float(run["size"])
    pushed = [
        simulated(simulate, asked, end, samples=tuple(times), push=PUSH, seed=seed)
        for seed in range(1, PUSHED + 1)
    ]
    halved = simulated(simulate, asked, end, refined=2, samples=tuple(times))
    grown = np.max(
        [_grown(run, other, size) for other in pushed], axis=0
    )  # of any watched body, at each time, m
    lost = np.flatnonzero(grown > UNPREDICTABLE * size)
    known = times[int(lost[0])] if len(lost) else end
    found: dict[str, float] = {"predictable_time": Estimate(known, rounding=end / GRID * 2.0, scale=end)}
    for at in asked.checkpoints:
        row = times.index(at)
        for column, body in enumerate(asked.model.watched):
            for name, values, unit in (("place", place, size), ("turn", turn, 1.0)):
                read = _read if name == "place" else _turned
                value = float(values[row, column])
                moved = max(_apart(read(other), row, column, value) for other in pushed)
                found[f"{body.label}.{name}@{at:g}s"] = Estimate(
                    value,
                    rounding=math.inf if at >= known and len(lost) else BEYOND * max(moved, PUSH * unit),
                    step_error=_apart(read(halved), row, column, value),
                    scale=unit,
                )
    return found


def _read(run: Result) -> Array:
    """Distance [m] of each watched body from its start, at each sample that was reached."""
    there = np.asarray(run.partial["position"])
    moved: Array = np.linalg.norm(there - there[:1], axis=-1)
    return moved


def _turned(run: Result) -> Array:
    there = np.asarray(run.partial["orientation"])
    return turns(there, there[:1])


def _apart(values: Array, row: int, column: int, value: float) -> float:
    """How far another run is from a value; infinite if it broke off before."""
    return abs(float(values[row, column]) - value) if row < len(values) else math.inf


def _grown(run: Result, other: Result, size: float) -> Array:
    """How far two runs are apart at each time; infinite where the other broke off."""
    grown = np.full(len(run.partial["position"]), np.inf)
    reached = apart(run, other, size)
    grown[: len(reached)] = reached
    return grown

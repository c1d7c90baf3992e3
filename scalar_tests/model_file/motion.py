"""Where every watched body is at growing times, how far rounding and the time step move it, and until when that is known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

import numpy as np

from spook_tracker.engine.result import Result

from .. import case
from .facts import (
    BEYOND,
    GRID,
    PUSH,
    PUSHED,
    UNPREDICTABLE,
    Array,
    Asked,
    apart,
    in_time,
    pushed,
    settles,
    simulated,
    times_of,
    turns,
    watched,
)

DRAWN_SAMPLES = 240  # of a replay
DRAWN = 16  # runs with pushes of their own, where these grow to the size
BY_CHANCE = (
    6.0  # standard errors of a difference of two means: beyond them once in some hundred thousand series
)


def metrics(asked: Asked) -> tuple[case.Metric, ...]:
    """Place and turn of each watched body at each checkpoint, and the time that can be predicted."""
    found = []
    for at in asked.checkpoints:
        for body in asked.model.watched:
            label = body.label
            found += [
                case.Metric(
                    name=f"{label}.place@{at:g}s",
                    description=f"how far {label} is from where it started, after {at:g} s",
                    unit="m",
                    role="reported",
                    better="inside",
                ),
                case.Metric(
                    name=f"{label}.turn@{at:g}s",
                    description=f"how far {label} has turned from its start, after {at:g} s",
                    unit="rad",
                    role="reported",
                    better="inside",
                ),
            ]
    found += [
        case.Metric(
            name=f"{body.label}.mean_place",
            description=f"how far {body.label} is from where it started at the end, in the mean over runs with small pushes",
            unit="m",
            role="reported",
            better="inside",
        )
        for body in asked.model.watched
    ]
    return (
        *found,
        case.Metric(
            name="predictable_time",
            description=f"when pushes of {PUSH:g} of the size have grown to a hundredth of it; the whole time if they have not",
            unit="s",
            role="reported",
            better="larger",
        ),
    )


def measure(asked: Asked, simulate: case.Simulate) -> Mapping[str, float]:
    """One run, the same with pushes of the last bits in every step, and one with half the time step; of these what there is
    time for."""
    end, times = asked.checkpoints[-1], times_of(asked)
    run = watched(asked, simulate)
    if not run.completed:  # which may be later than its motion is read
        run = watched(asked, simulate, rests=False)
    place, turn, size = _read(run), _turned(run), float(run["size"])
    others = in_time(pushed(asked, simulate, run, seed) for seed in range(1, PUSHED + 1))
    try:
        halved = watched(asked, simulate, settles(run), refined=2)
    except case.OutOfTime:
        halved = None
    grown = np.max(
        [_grown(run, other, size) for other in others], axis=0
    )  # of any watched body, at each time, m
    lost = np.flatnonzero(grown > UNPREDICTABLE * size)
    known = times[int(lost[0])] if len(lost) else end
    found: dict[str, float] = {"predictable_time": case.Estimate(known, rounding=end / GRID * 2.0, scale=end)}
    for at in asked.checkpoints:
        row = times.index(at)
        for column, body in enumerate(asked.model.watched):
            for name, values, unit in (("place", place, size), ("turn", turn, 1.0)):
                read = _read if name == "place" else _turned
                value = float(values[row, column])
                moved = max(_apart(read(other), row, column, value) for other in others)
                found[f"{body.label}.{name}@{at:g}s"] = case.Estimate(
                    value,
                    rounding=math.inf if at >= known and len(lost) else BEYOND * max(moved, PUSH * unit),
                    step_error=None if halved is None else _apart(read(halved), row, column, value),
                    scale=unit,
                )
    chaotic = len(lost) > 0
    try:
        if chaotic:  # of the end only a distribution says anything: more of it
            others += [
                simulated(simulate, asked, end, samples=(0.0, end), push=PUSH, seed=seed)
                for seed in range(len(others) + 1, DRAWN + 1)
            ]
    except case.OutOfTime:
        return found
    ends = np.array([_read(other)[-1] for other in others if other.completed])
    for column, body in enumerate(asked.model.watched):
        drawn = ends[:, column] if len(ends) else np.zeros(0)
        found[f"{body.label}.mean_place"] = mean_of(drawn, size, chaotic)
    return found


def seen(asked: Asked) -> case.Seen:
    """The model over the whole time, as a replay shows it."""
    steps = max(1, round(asked.duration / asked.model.time_step))
    every = math.ceil(steps / DRAWN_SAMPLES)
    step = every * asked.model.time_step
    times = tuple(step * k for k in range(steps // every + 1))
    return case.Seen(run=partial(_shown, asked, times), step=step, gravity=asked.model.gravity)


def _shown(asked: Asked, times: tuple[float, ...], simulate: case.Simulate) -> Result:
    return simulated(simulate, asked, times[-1], samples=times, shown=True)


def mean_of(drawn: Array, size: float, chaotic: bool) -> case.Estimate:
    """The mean [m] of runs with small pushes. Two such means differ by rounding; of a chaotic model by chance, as their
    standard errors say."""
    if len(drawn) < 2:
        return case.Estimate(0.0, rounding=math.inf, scale=size, unsettled="runs with small pushes broke off")
    least = BEYOND * max(float(np.ptp(drawn)), PUSH * size)
    by_chance = BY_CHANCE * float(np.std(drawn, ddof=1)) * math.sqrt(2.0 / len(drawn))
    return case.Estimate(float(np.mean(drawn)), rounding=by_chance if chaotic else least, scale=size)


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

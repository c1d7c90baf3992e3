"""How a model's error falls with the time step, and how long its steps and how stiff its servos may be."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from spook_tracker.engine.method import PLAIN, Method
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.engine.result import Result, SimulationFailed

from .. import case
from .facts import Asked, apart, simulated

LASTS = 0.5  # s that the runs of the ladder last
RUNGS = (4.0, 2.0, 1.0, 0.5, 0.25)  # times the file's own step
FINE, FINEST = 8, 16  # parts of the file's own step, by the most accurate setting
RESOLVED = 1e-3  # of the size: where the two finest runs are further apart there is no reference
HOLDS = 2.0  # s that a run must hold
LONGEST, STIFFEST = 64.0, 4096.0  # times the file's own
BRACKET = 0.05  # relative width of the last bracket

RESOLVED_TIME = case.Metric(
    name="resolved_time",
    description="until when the two finest runs, an eighth and a sixteenth of the step, agree within a thousandth of the size",
    unit="s",
    role="reported",
    better="larger",
)


def _place(
    asked: Asked, simulate: case.Simulate, time_step: float, accurate: bool, times: tuple[float, ...]
) -> Result:
    refined = asked.model.time_step / time_step
    return simulated(simulate, asked, times[-1], refined, samples=times, accurate=accurate)


def _finest(asked: Asked, simulate: case.Simulate) -> tuple[tuple[float, ...], Result, Result]:
    """The two finest runs, and when [s] both are read, last at the end of the ladder's: asked by all in the same words, so
    that they are made once where runs are remembered."""
    end = _lasts(asked)
    times = (*(t for t in asked.checkpoints if t < end - 1e-9), end)
    fine, finest = (
        _place(asked, simulate, asked.model.time_step / parts, True, times) for parts in (FINE, FINEST)
    )
    return times, fine, finest


def resolved(asked: Asked, simulate: case.Simulate) -> Mapping[str, float]:
    """The first checkpoint at which the two finest runs disagree; the last one if they never do."""
    times, fine, finest = _finest(asked, simulate)
    size = float(finest["size"])
    agree = apart(fine, finest, size) <= RESOLVED * size  # as far as both came
    until = next((t for k, t in enumerate(times) if k >= len(agree) or not agree[k]), times[-1])
    return {"resolved_time": case.Estimate(until, rounding=0.0, scale=asked.duration)}


def _lasts(asked: Asked) -> float:
    return min(LASTS, asked.duration)


def error(asked: Asked, simulate: case.Simulate, time_step: float, method: Method) -> float:
    """Distance [m] from the finest run at the end, of the watched body, or its rim, that is furthest off."""
    times, fine, finest = _finest(asked, simulate)
    fine["position"], finest["position"]  # of a run that broke off: the outcome is that
    size = float(finest["size"])
    if not (off := float(apart(fine, finest, size)[-1])) <= RESOLVED * size:
        raise NotSupported(
            f"the two finest runs are {off:.2g} m apart after {times[-1]:g} s: there is no reference"
        )
    own = _place(asked, simulate, time_step, False, times[-1:])
    own["position"]  # of a run that broke off: the outcome is that
    last = {name: finest[name][-1:] for name in ("position", "orientation")}
    return float(apart(own, replace(finest, observables=last), size)[-1])


def run(asked: Asked, simulate: case.Simulate, time_step: float, method: Method) -> Result:
    """The same, to be timed."""
    return simulated(simulate, asked, _lasts(asked), asked.model.time_step / time_step)


def ladder(asked: Asked) -> case.Ladder:
    """Four times the file's own step to a quarter of it, against a sixteenth of it with Runge-Kutta."""
    return case.Ladder(
        name="finest",
        description=f"distance from the engine's own finest run after {_lasts(asked):g} s",
        unit="m",
        time_steps=tuple(asked.model.time_step * factor for factor in RUNGS),
        configurations=(case.Configuration(name="file", method=PLAIN, expected_order=None),),
        error=partial(error, asked),
        run=partial(run, asked),
    )


def _holds(asked: Asked, simulate: case.Simulate, reach: float, factor: float, **more: Any) -> bool:
    """Whether a run ends with all watched bodies within `reach` [m] of their start."""
    try:
        found = simulated(
            simulate, asked, min(HOLDS, asked.duration), 1.0 / factor, samples=_marks(asked), **more
        )
        there = np.asarray(found["position"])
    except SimulationFailed:
        return False
    return bool(np.linalg.norm(there - there[:1], axis=-1).max() <= reach)


def _marks(asked: Asked) -> tuple[float, ...]:
    end = min(HOLDS, asked.duration)
    return tuple(end * k / 20 for k in range(21))


def _bracket(asked: Asked, simulate: case.Simulate, most: float, name: str) -> case.BreakPoint:
    """Doubled until it breaks, then halved in between, in the ratio."""
    own = np.asarray(
        simulated(simulate, asked, min(HOLDS, asked.duration), samples=_marks(asked))["position"]
    )
    size = float(simulated(simulate, asked, asked.model.time_step)["size"])
    reach = size + 2.0 * float(np.linalg.norm(own - own[:1], axis=-1).max())
    asks = 0

    def holds(factor: float) -> bool:
        nonlocal asks
        asks += 1
        if name == "step":
            return _holds(asked, simulate, reach, factor)
        return _holds(asked, simulate, reach, 1.0, gain=factor)

    low, high = 1.0, 2.0
    while high <= most and holds(high):
        low, high = high, 2.0 * high
    if high > most:
        return case.BreakPoint(value=low, resolution=1.0, evaluations=asks)
    while high / low > 1.0 + BRACKET:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if holds(middle) else (low, middle)
    return case.BreakPoint(value=low, resolution=high / low - 1.0, evaluations=asks)


def longest_step(asked: Asked, simulate: case.Simulate) -> case.BreakPoint:
    """Times the file's own step."""
    return _bracket(asked, simulate, LONGEST, "step")


def stiffest_gain(asked: Asked, simulate: case.Simulate) -> case.BreakPoint:
    """Times the file's own gains."""
    return _bracket(asked, simulate, STIFFEST, "gain")


def studies(asked: Asked, driven: bool) -> tuple[case.StabilityStudy, ...]:
    """How long a step and how stiff a servo may be."""

    def one(
        name: str, title: str, study: Callable[[Asked, case.Simulate], case.BreakPoint]
    ) -> case.StabilityStudy:
        return case.StabilityStudy(
            name=name,
            title=title,
            configuration="file",
            definition=f"for {HOLDS:g} s no body leaves twice the reach of the file's own run by more than the size",
            study=partial(study, asked),
            unit="1",
            expected_source="none: theory has none for a model it does not know",
        )

    found = [one("longest-step", "longest step that holds, times the file's own", longest_step)]
    if driven:
        found.append(one("stiffest-gain", "stiffest gain that holds, times the file's own", stiffest_gain))
    return tuple(found)

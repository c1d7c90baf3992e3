"""Points of a sweep for a figure: a run that fails is a point without a value, not a figure that fails."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from spook_tracker.engine.result import SimulationFailed

from . import case


def sweep(values: Iterable[float], measure: Callable[[float], float]) -> tuple[float, ...]:
    """`measure` at each value; NaN where the simulation did not complete."""
    found = []
    for value in values:
        try:
            found.append(float(measure(value)))
        except SimulationFailed:
            found.append(math.nan)
    return tuple(found)


def line(name: str, x: Iterable[Any], y: Iterable[Any], style: Any = "line") -> case.Curve:
    """A curve from anything that gives numbers."""
    return case.Curve(name=name, x=tuple(map(float, x)), y=tuple(map(float, y)), style=style)


def told(value: float, digits: int = 2) -> str:
    """A measured number for the sentence beside its figure; what is not finite says so."""
    return f"{value:.{digits}g}" if math.isfinite(value) else "no finite value"


def apart(found: Iterable[Any], expected: Iterable[Any]) -> str:
    """The largest distance of two curves, as a sentence tells it."""
    return told(max(abs(float(a) - float(b)) for a, b in zip(found, expected, strict=True)))


def at(x: Iterable[float], y: Iterable[float], place: float) -> float:
    """The y of the point whose x is nearest to `place`."""
    return min(zip(x, y, strict=True), key=lambda point: abs(point[0] - place))[1]

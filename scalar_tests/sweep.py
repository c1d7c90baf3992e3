"""Points of a sweep for a figure: a run that fails is a point without a value, not a figure that fails."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from engine.errors import SimulationFailed
from scalar_tests.case import Curve


def sweep(values: Iterable[float], measure: Callable[[float], float]) -> tuple[float, ...]:
    """`measure` at each value; NaN where the simulation did not complete."""
    found = []
    for value in values:
        try:
            found.append(float(measure(value)))
        except SimulationFailed:
            found.append(math.nan)
    return tuple(found)


def line(name: str, x: Iterable[Any], y: Iterable[Any], style: Any = "line") -> Curve:
    """A curve from anything that gives numbers."""
    return Curve(name=name, x=tuple(map(float, x)), y=tuple(map(float, y)), style=style)


def largest_magnitude(values: Any) -> float:
    """The largest |value| of an array; NaN if any value is, 0 of an empty one."""
    return max((math.nan if math.isnan(v) else abs(v) for v in _flat(values)), key=_nan_last, default=0.0)


def _flat(values: Any) -> list[float]:
    return [float(v) for v in values.ravel()] if hasattr(values, "ravel") else [float(v) for v in values]


def _nan_last(value: float) -> float:
    return math.inf if math.isnan(value) else value

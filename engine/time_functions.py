"""Numbers that change with time, evaluated in the native loop: sinusoids, ramps and tables.

What follows the time is evaluated once a step: a load and the force of a motor at its beginning, where forces that
depend on places are, too; the speed of a motor and the rest of a spring where the step's velocities live (its end;
mid-step with half_step_velocities); the pace of a kinematic body at mid-step; its path and its angle at both ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from . import check
from .errors import SceneError


@dataclass(frozen=True, slots=True, kw_only=True)
class Sinusoid:
    """offset + amplitude sin(2π frequency t + phase)."""

    amplitude: float
    frequency: float  # Hz
    phase: float = 0.0  # rad
    offset: float = 0.0

    def __post_init__(self) -> None:
        for name in ("amplitude", "phase", "offset"):
            object.__setattr__(self, name, check.number("sinusoid", name, getattr(self, name)))
        object.__setattr__(self, "frequency", check.not_negative("sinusoid", "frequency", self.frequency))

    def __call__(self, time: float) -> float:
        return self.offset + self.amplitude * math.sin(2.0 * math.pi * self.frequency * time + self.phase)


@dataclass(frozen=True, slots=True)
class Table:
    """Straight lines through (time, value); before the first and after the last the value stays.

    A table with a gap (a time or value that is missing, NaN or infinite, or times that do not rise) is refused.
    """

    times: tuple[float, ...]  # s
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("times", "values"):
            given: Any = getattr(self, name)
            try:
                entries = list(given)
            except TypeError:
                raise SceneError(f"table: {name} must be a sequence of numbers, not {given!r}") from None
            clean = tuple(check.number("table", f"{name}[{k}]", entry) for k, entry in enumerate(entries))
            object.__setattr__(self, name, clean)
        if len(self.times) != len(self.values):
            raise SceneError(f"table: {len(self.times)} times but {len(self.values)} values")
        if not self.times:
            raise SceneError("table: needs at least one time and value")
        for k, (before, after) in enumerate(zip(self.times, self.times[1:], strict=False)):
            if not after > before:
                raise SceneError(f"table: times must rise, but times[{k + 1}] = {after:g} follows {before:g}")

    def __call__(self, time: float) -> float:
        if time <= self.times[0]:
            return self.values[0]
        for k in range(1, len(self.times)):
            if time < self.times[k]:
                part = (time - self.times[k - 1]) / (self.times[k] - self.times[k - 1])
                return self.values[k - 1] + part * (self.values[k] - self.values[k - 1])
        return self.values[-1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """From `start_value` until `start` in a straight line to `end_value` at `end`, and no further."""

    start: float = 0.0  # s
    end: float  # s
    start_value: float = 0.0
    end_value: float = 1.0

    def __post_init__(self) -> None:
        for name in ("start", "end", "start_value", "end_value"):
            object.__setattr__(self, name, check.number("ramp", name, getattr(self, name)))
        if not self.end > self.start:
            raise SceneError(f"ramp: end {self.end:g} must come after start {self.start:g}")

    def table(self) -> Table:
        """The same as a table of two knots."""
        return Table((self.start, self.end), (self.start_value, self.end_value))

    def __call__(self, time: float) -> float:
        return self.table()(time)


TimeFunction = Sinusoid | Ramp | Table


def number_or_function(owner: str, field: str, value: Any) -> float | TimeFunction:
    """A finite number, or a function of time as it is."""
    if isinstance(value, TimeFunction):
        return value
    if callable(value):
        raise SceneError(
            f"{owner}: {field} must be a number, Sinusoid, Ramp or Table, which the native loop knows, not {value!r}"
        )
    return check.number(owner, field, value)


def least(function: TimeFunction) -> float:
    """The smallest value it has at any time, or less (of a sinusoid)."""
    if isinstance(function, Sinusoid):
        return function.offset - abs(function.amplitude)
    return min((function.table() if isinstance(function, Ramp) else function).values)


def at_start(value: float | TimeFunction) -> float:
    """A number, or what a function of time is at time zero."""
    return value if isinstance(value, float) else value(0.0)

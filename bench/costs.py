"""A bench as a scalar test: costs, as ratios to what is measured beside them in the same run, with limits and a history.

A limit on a cost is a gate judged as run times are. Units are those of `bench/floors.py`, or 1: times what stands beside.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from bench.floors import floor
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests.case import Better, Example, Measurement, Metric, ScalarTest


def cost(
    name: str,
    description: str,
    limit: float | None = None,
    source: str = "",
    *,
    unit: str = "1",
    better: Better = "smaller",
) -> Metric:
    """A cost that other work on the machine moves; without a limit it is followed."""
    return Metric(
        name=name,
        description=description,
        unit=unit,
        role="reported" if limit is None else "gate",
        better=better,
        limit=limit,
        limit_source=source,
        noisy=True,
    )


def exact(
    name: str, description: str, limit: float, source: str, *, unit: str, change: float = 1e-9
) -> Metric:
    """What the clock has no part in; a relative change up to `change` is none."""
    return Metric(
        name=name,
        description=description,
        unit=unit,
        role="gate",
        better="smaller",
        limit=limit,
        limit_source=source,
        relative_tolerance=change,
    )


def asked(
    configuration: str,
    measure: Callable[[], Mapping[str, float]],
    *metrics: Metric,
    time_step: float | None = None,
) -> Measurement:
    """Costs measured together; `time_step` [s] of what steps."""
    return Measurement(
        configuration=configuration, time_step=time_step, metrics=metrics, measure=lambda simulate: measure()
    )


def in_units(seconds: float, unit: str) -> float:
    """A time as so many of a unit, which is measured now."""
    return seconds / floor(unit)


def bench(title: str, question: str, *measurements: Measurement, beside: str) -> ScalarTest:
    """A test of costs; `beside` says what they are measured against."""
    return ScalarTest(
        title=title,
        question=question,
        why="a cost that grows is seen with the commit that did it",
        model="",
        parameters=(),
        theory=(),
        reference=beside,
        conclusion="Red: it costs more than what stands beside it in the same run allows.",
        source="bench",
        measurements=measurements,
        example=_none,
    )


def _none() -> Example:
    raise NotSupported("a bench has no scene of its own")

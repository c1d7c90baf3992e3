"""What was measured, how well it is known, and how far a simulation is from it, in standard deviations."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.special import chdtri

from spook_tracker import engine

from . import case
from .sweep import told as number

BY_CHANCE = 1e-3  # so often a right model lies further off than the limit


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One measured value with its standard deviation, both in the scene's unit."""

    at: str  # which: "30.3°", "the fifth beat"
    value: float
    sigma: float


def deviation(found: Iterable[float], readings: Sequence[Reading]) -> float:
    """Root mean square of (simulated − measured)/σ."""
    off = [(value - one.value) / one.sigma for value, one in zip(found, readings, strict=True)]
    return math.sqrt(math.fsum(x * x for x in off) / len(off))


def farthest(count: int) -> float:
    """The root mean square that `count` independent readings exceed once in 1/BY_CHANCE sets, by χ²."""
    return math.sqrt(float(chdtri(count, BY_CHANCE)) / count)


def table_rows(readings: Sequence[Reading], unit: str) -> tuple[tuple[str, str], ...]:
    """The digits, for a page's table of parameters."""
    return tuple(
        (f"measured, {one.at}", f"{one.value:.6g} ± {one.sigma:.2g}{unit and ' '}{unit}") for one in readings
    )


def distance(off: float) -> str:
    """How far that is, as a sentence beside a figure."""
    return f"The simulation is {number(off, 3)} standard deviations from what was measured, root mean square."


def agreement(readings: Sequence[Reading], source: str) -> case.Metric:
    """How far the simulation is from what was measured, in standard deviations; any engine is held to it."""
    return case.Metric(
        name="deviation",
        description=f"simulated minus measured over its standard deviation, root mean square of {len(readings)}",
        unit="1",
        role="gate",
        limit=farthest(len(readings)),
        limit_source=f"measured: {source}; by χ² a right model is further off once in a thousand such sets",
        limit_kind="physical",
        reference=0.0,
        tolerance=1e-6,
    )


def against_theory(limit: float, why: str, role: case.Role = "companion") -> case.Metric:
    """How well the method solves the model, whatever the world does."""
    return case.Metric(
        name="theory_error",
        description="largest relative distance from the model's closed form",
        unit="1",
        role=role,
        limit=limit,
        limit_source=why,
        reference=0.0,
        tolerance=1e-3 * limit,
    )


def ladder(
    error: Callable[[case.Simulate, float, engine.Method], float],
    time_steps: Iterable[float],
    order: float,
    *,
    better: str,
    method: engine.Method,
    better_order: float | None = None,
    order_range: tuple[float, float] | None = None,
    **rest: Any,
) -> tuple[case.Ladder, ...]:
    """Plain SPOOK and its order, beside one better method.

    `better_order` None: its error ends in rounding, or in how it is read. `rest` is as in any other ladder.
    """

    plain = case.Configuration(
        name="plain", method=engine.PLAIN, expected_order=order, order_range=order_range
    )
    other = case.Configuration(name=better, method=method, expected_order=better_order)
    return (
        case.Ladder(
            time_steps=tuple(time_steps),
            configurations=(plain, other),
            error=error,
            target_seconds=0.01,
            **rest,
        ),
    )


def breaks_at(
    right: float,
    searched: float,
    study: Callable[[case.Simulate], case.BreakPoint],
    source: str,
    configuration: str = "plain",
    **rest: Any,
) -> tuple[case.StabilityStudy, ...]:
    """A break point at `right`, by theory; a search to a relative `searched` ends that far short of it."""
    return (
        case.StabilityStudy(
            configuration=configuration,
            study=study,
            expected=((1.0 - 1.1 * searched) * right, right),
            expected_source=f"{source}; the search ends {100.0 * searched:.1g} % short of it at most",
            **rest,
        ),
    )


def measured_test(
    source: str,
    published: str,
    readings: Sequence[Reading],
    unit: str,
    parameters: tuple[tuple[str, str], ...],
    measure: Callable[[case.Simulate], dict[str, float]],
    *metrics: case.Metric,
    configuration: str,
    time_step: float,
    note: str,
    **rest: Any,
) -> case.ScalarTest:
    """A test that is held to `readings` of a source; `metrics` and `rest` are as in any other test.

    `published` goes on where the sentence "Measured: source" ends: how it was measured, and what stands for σ.
    """
    return case.ScalarTest(
        parameters=(*parameters, *table_rows(readings, unit)),
        reference=f"Measured: {source}{published}",
        source=f"measured: {source}",
        measured=True,
        measurements=(
            case.Measurement(
                configuration=configuration,
                time_step=time_step,
                metrics=(agreement(readings, source), *metrics),
                measure=measure,
                note=note,
            ),
        ),
        **rest,
    )

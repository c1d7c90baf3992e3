"""What was measured, how well it is known, and how far a simulation is from it, in standard deviations."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from scipy.special import chdtri

from spook_tracker.scalar_tests.case import Metric, Role
from spook_tracker.scalar_tests.sweep import told as told_number

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


def told(readings: Sequence[Reading], unit: str) -> tuple[tuple[str, str], ...]:
    """The digits, for a page's table of parameters."""
    return tuple(
        (f"measured, {one.at}", f"{one.value:.6g} ± {one.sigma:.2g}{unit and ' '}{unit}") for one in readings
    )


def said(off: float) -> str:
    """The same as a sentence beside a figure."""
    return f"The simulation is {told_number(off, 3)} standard deviations from what was measured, root mean square."


def agreement(readings: Sequence[Reading], source: str) -> Metric:
    """How far the simulation is from what was measured, in standard deviations; any engine is held to it."""
    return Metric(
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


def against_theory(limit: float, why: str, role: Role = "companion") -> Metric:
    """How well the method solves the model, whatever the world does."""
    return Metric(
        name="theory_error",
        description="largest relative distance from the model's closed form",
        unit="1",
        role=role,
        limit=limit,
        limit_source=why,
        reference=0.0,
        tolerance=1e-3 * limit,
    )

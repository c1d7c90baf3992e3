"""What is read from runs of the pendulum, and the simulations behind each number."""

from __future__ import annotations

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from ... import case
from .scene import (
    CURVED,
    CURVED_TWICE,
    GRAVITY,
    MASS,
    TIME_STEP,
    angle,
    percent_of_energy,
    percent_of_length,
    period,
    swing,
    traced_angle,
)

LADDER_DURATION = 10.0  # s

ORDER_4, ORDER_6 = engine.Method(composition="order4"), engine.Method(composition="order6")

ORDER_8 = engine.Method(composition="order8")

HALF_STEP = engine.Method(half_step_velocities=True)

HALF_STEP_CURVED = engine.Method(half_step_velocities=True, corrections=2)

OBSERVE: dict[str, Observable] = {
    "violation": engine.MaximumAbsolute(quantity=engine.Violation("rod")),
    "energy": engine.Trace(quantity=engine.Energy(), from_start=True),
    "tension": engine.Maximum(quantity=engine.ConstraintForce("rod")),
}


def _answers(simulate: case.Simulate, method: engine.Method) -> dict[str, float]:
    result = swing(simulate, TIME_STEP, method, observe=OBSERVE)
    energy = percent_of_energy(result)
    return {
        "length_deviation": percent_of_length(result),
        "energy_deviation": float(np.abs(energy).max()),
        "energy_at_the_end": float(energy[-1]),
        "tension_at_the_bottom": float(result["tension"]) / (3.0 * MASS * GRAVITY) - 1.0,
        "period_error": _measured_period(simulate, method) / period() - 1.0,
    }


def _measured_period(simulate: case.Simulate, method: engine.Method) -> float:
    """Mean period [s] between upward passages of the bottom, placed by straight lines between samples."""
    time, theta = traced_angle(simulate, TIME_STEP, 22.0, method)
    before = np.flatnonzero((theta[:-1] < 0.0) & (theta[1:] >= 0.0))
    passages = time[before] - theta[before] * TIME_STEP / (theta[before + 1] - theta[before])
    return float(np.diff(passages).mean())


def plain(simulate: case.Simulate) -> dict[str, float]:
    """Plain SPOOK."""
    return _answers(simulate, engine.PLAIN)


def curved(simulate: case.Simulate) -> dict[str, float]:
    """Curved constraints, one correction."""
    return _answers(simulate, CURVED)


def curved_twice(simulate: case.Simulate) -> dict[str, float]:
    """Curved constraints, two corrections."""
    return _answers(simulate, CURVED_TWICE)


def length_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest length deviation over 10 s [%]."""
    observe: dict[str, Observable] = {"violation": engine.MaximumAbsolute(quantity=engine.Violation("rod"))}
    return percent_of_length(swing(simulate, time_step, method, duration=LADDER_DURATION, observe=observe))


def angle_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest |angle − exact angle| over 10 s [rad]."""
    time, theta = traced_angle(simulate, time_step, LADDER_DURATION, method)
    return float(np.abs(theta - angle(time)).max())

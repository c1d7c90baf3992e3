"""Where the pendulum stops being stable: time step, damping, compliance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.theory import one_row_matrix

from ... import case
from ...bracket import break_point, cell, is_stable, table
from ...oscillators.oscillator.scene import growth
from .scene import COMPLIANCE, CURVED, CURVED_TWICE, GRAVITY, LENGTH, MASS, TIME_STEP, swing

BOUND = 0.1  # of the length, and of m g l
RELATIVE_DAMPINGS = tuple(float(value) for value in np.geomspace(1e-5, 10.0, 13))  # τ/h
COMPLIANCES = tuple(float(value) for value in np.geomspace(1e-14, 1e-2, 13))  # m/N
OBSERVE: dict[str, Observable] = {
    "violation": engine.Trace(quantity=engine.Violation("rod")),
    "energy": engine.Trace(quantity=engine.Energy(), from_start=True),
}
DISCRETE = (
    "where the method's own discrete solution breaks: the dense prototype tests/oracles/particles.py, to 1 %"
)
HOLDS = (
    "22 s without the length off by more than 10 % beyond what its compliance yields, or the energy above its start by "
    "more than 10 % of m g l beyond what a velocity half a step old reads, and neither doubling in the last third"
)


def _excess(result: engine.Result, compliance: float) -> Any:
    """Violation and energy gain over their bounds; below a tenth of them nothing is growing, only swinging."""
    yielded = 4.5 * MASS * GRAVITY * compliance / LENGTH
    lag = 1.5 * result.time_step * np.sqrt(GRAVITY / LENGTH)
    stretch = np.abs(result.partial["violation"]) / LENGTH / (BOUND + yielded)
    gain = result.partial["energy"] / (MASS * GRAVITY * LENGTH) / (BOUND + lag)
    return np.maximum(0.1, np.maximum(stretch, gain))


def _kind(
    simulate: case.Simulate,
    time_step: float = TIME_STEP,
    method: engine.Method = engine.PLAIN,
    *,
    relative_damping: float = 1.0,
    compliance: float = COMPLIANCE,
) -> str:
    result = swing(
        simulate,
        time_step,
        method,
        observe=OBSERVE,
        damping=relative_damping * time_step,
        compliance=compliance,
    )
    return cell(result, _excess(result, compliance), bound=1.0)


def _largest_step(method: engine.Method) -> Any:
    def study(simulate: case.Simulate) -> case.BreakPoint:
        return break_point(lambda h: is_stable(_kind(simulate, h, method)), 0.002, 2.0, resolution=0.005)

    return study


def smallest_damping(simulate: case.Simulate) -> case.BreakPoint:
    """Smallest τ/h at compliance 1e-13 m/N and h = 1/60 s."""
    return break_point(lambda theta: is_stable(_kind(simulate, relative_damping=theta)), 1.0, 1e-8, walk=9)


def smallest_compliance(simulate: case.Simulate) -> case.BreakPoint:
    """Smallest compliance [m/N] without any damping, at h = 1/60 s."""
    return break_point(
        lambda c: is_stable(_kind(simulate, relative_damping=0.0, compliance=c)), 1e-3, 1e-13, walk=11
    )


def farthest(simulate: case.Simulate) -> case.BreakPoint:
    """Farthest pivot [m] from the origin at which the length deviation is that at the origin to 1e-3."""

    def worst(away: float) -> float:
        observe: dict[str, Observable] = {
            "violation": engine.MaximumAbsolute(quantity=engine.Violation("rod"))
        }
        result = swing(simulate, TIME_STEP, observe=observe, away=away)
        return float(result["violation"]) if result.completed else math.inf

    home = worst(0.0)
    return break_point(lambda away: abs(worst(away) / home - 1.0) <= 1e-3, 1.0, 1e15, walk=16, resolution=0.1)


def largest_start(simulate: case.Simulate) -> case.BreakPoint:
    """Largest start violation, as a fraction of the length, that is gone within five seconds."""

    def holds(violation: float) -> bool:
        result = swing(simulate, TIME_STEP, observe=OBSERVE, start=LENGTH * (1.0 + violation))
        if not result.completed:
            return False
        late = np.abs(result["violation"][round(5.0 / TIME_STEP) :]).max() / LENGTH
        gain = result["energy"].max() / (MASS * GRAVITY * LENGTH)
        return bool(late <= 0.01 and gain <= BOUND)

    return break_point(holds, 0.001, 1000.0, walk=13, resolution=0.05)


def damping_map(simulate: case.Simulate) -> case.StabilityMap:
    """(τ/h, compliance) at h = 1/60 s beside the eigenvalue of the rod's own motion."""

    def eigenvalue(theta: float, compliance: float) -> float:
        return growth(one_row_matrix(MASS, compliance, theta * TIME_STEP, TIME_STEP))

    def kind(theta: float, compliance: float) -> str:
        return _kind(simulate, relative_damping=theta, compliance=compliance)

    return case.StabilityMap(
        x=RELATIVE_DAMPINGS,
        y=COMPLIANCES,
        cells=table(COMPLIANCES, RELATIVE_DAMPINGS, kind),
        x_label="damping, τ/h",
        y_label="compliance [m/N]",
        prediction=table(COMPLIANCES, RELATIVE_DAMPINGS, eigenvalue),
        note="The linear rod is stable everywhere, but the swing pumps energy into it: where the eigenvalue comes within about "
        "1e-3 of the unit circle and compliance is next to nothing, the pendulum explodes. This is Fig 3.23.",
    )


STUDIES = (
    *(
        case.StabilityStudy(
            name=f"largest-time-step-{name.replace(' ', '-')}",
            title="Largest stable time step",
            configuration=name,
            definition=HOLDS,
            study=_largest_step(method),
            unit="s",
            expected=expected,
            expected_source=source,
        )
        for name, method, expected, source in (
            (
                "plain",
                engine.PLAIN,
                (0.0862, 0.0879),
                DISCRETE + "; to first order 10 % of the length is 3 g h²/(2 l), h = 0.082 s",
            ),
            ("curved", CURVED, (0.1888, 0.1927), DISCRETE),
            ("curved twice", CURVED_TWICE, (0.1897, 0.1936), DISCRETE),
        )
    ),
    case.StabilityStudy(
        name="smallest-damping",
        title="Smallest τ/h that holds at compliance 1e-13 m/N",
        configuration="plain",
        definition=HOLDS,
        study=smallest_damping,
        unit="1",
        better="smaller",
        expected=(2.43e-4, 2.53e-4),
        expected_source=DISCRETE.replace("1 %", "2 %"),
    ),
    case.StabilityStudy(
        name="smallest-compliance",
        title="Smallest compliance that holds without damping",
        configuration="plain",
        definition=HOLDS,
        study=smallest_compliance,
        unit="m/N",
        better="smaller",
        expected=(9.04e-8, 9.41e-8),
        expected_source=DISCRETE.replace("1 %", "2 %"),
    ),
    case.StabilityStudy(
        name="farthest-from-origin",
        title="Farthest from the origin that the pendulum keeps its error",
        configuration="plain",
        definition="22 s with the largest length deviation that of a pivot at the origin, to a part in a thousand",
        study=farthest,
        unit="m",
        expected=(1e6, 1e15),
        expected_source="a place is rounded to 1e-16 of its distance; the deviation is 4e-3 m",
    ),
    case.StabilityStudy(
        name="largest-start-violation",
        title="Largest start violation that the rod takes back",
        configuration="plain",
        definition="after 5 s the length is never off by more than 1 %, and the energy has never risen by more than 10 % "
        "of m g l",
        study=largest_start,
        unit="1",
        expected=(0.0275, 0.0292),
        expected_source="the first step takes the rod back at a g₀, a = 4/(h (1 + 4 τ/h)) = 48 per second: ½ (a g₀)² is "
        "10 % of g l at g₀ = 0.0292, found to 5 %",
    ),
    case.StabilityStudy(
        name="damping-compliance-map",
        title="Damping and compliance",
        configuration="plain",
        definition=HOLDS,
        study=damping_map,
    ),
)

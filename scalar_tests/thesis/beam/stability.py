"""How long a beam, how long a time step, how little damping the locks survive."""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.theory import one_row_matrix

from ... import case
from ...bracket import break_count, break_point, cell, table
from ...oscillators.oscillator.scene import growth
from .scene import COUNT, MASS, SIZE, TIME_STEP, sag_of_compliant_beam, scene

COUNTS = (10, 20, 40, 80, 160, 320, 640, 1000)
SHORT = 20
STEPS = 300
PUSH = 1e-3  # m/s
LIMIT = 1e-12  # % of the length, our set point
AT_REST = 1e-9  # of the length
RELATIVE_DAMPINGS = (0.0, 1e-3, 1e-2, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0)  # τ/h
COMPLIANCES = (0.0, 1e-12, 1e-10, 1e-8, 1e-6, 1e-5)  # m/N and rad/(N m)
OBSERVE: dict[str, Observable] = {"place": engine.Trace(quantity=engine.Position(), from_start=True)}
RIGID = f"{STEPS} steps from rest without any box off by more than 1e-12 % of the beam's length, locks of compliance 0"
PUSHED = f"the middle box starts upwards at {PUSH:g} m/s; "
RESTS = PUSHED + f"in the last third of {STEPS} steps no box is off by more than 1e-9 of the length"
HOLDS = PUSHED + (
    f"{SHORT} boxes, {STEPS} steps: settled if in the last third nothing hangs lower than the static sag by 1e-9 of the "
    "length; growing beyond that sag by more than a thousandth and half as much again, or twice as far as before"
)


def _run(
    simulate: case.Simulate,
    count: int,
    time_step: float,
    *,
    relative_damping: float = 2.0,
    compliance: float = 0.0,
    push: float = PUSH,
) -> tuple[engine.Result, Any]:
    """The run and the largest |height deviation| over the length at every sample."""
    built = scene(
        count, time_step=time_step, compliance=compliance, damping=relative_damping * time_step, push=push
    )
    result = simulate(built, time_step=time_step, steps=STEPS, observe=OBSERVE)
    return result, np.abs(result.partial["place"][:, :count, 2]).max(axis=1) / (count * SIZE[0])


def _rests(simulate: case.Simulate, time_step: float, relative_damping: float = 2.0) -> bool:
    result, height = _run(simulate, COUNT, time_step, relative_damping=relative_damping)
    return result.completed and bool(height[-STEPS // 3 :].max() <= AT_REST)


def longest_beam(simulate: case.Simulate) -> case.BreakPoint:
    """Most boxes that lie still to rounding."""

    def holds(count: int) -> bool:
        result, height = _run(simulate, count, TIME_STEP, push=0.0)
        return result.completed and bool(100.0 * height.max() <= LIMIT)

    return break_count(holds, COUNTS)


def largest_step(simulate: case.Simulate) -> case.BreakPoint:
    """Largest time step [s] with which 80 pushed boxes come to rest."""
    return break_point(lambda h: _rests(simulate, h), 1e-3, 4.0, resolution=0.1, walk=7)


def smallest_damping(simulate: case.Simulate) -> case.BreakPoint:
    """Smallest τ/h with which 80 pushed boxes come to rest."""
    return break_point(lambda theta: _rests(simulate, TIME_STEP, theta), 2.0, 1e-3, resolution=0.05, walk=6)


def damping_map(simulate: case.Simulate) -> case.StabilityMap:
    """(τ/h, compliance) for 20 boxes at h = 1/60 s beside the eigenvalue of one box on one lock row."""

    def kind(theta: float, compliance: float) -> str:
        result, height = _run(simulate, SHORT, TIME_STEP, relative_damping=theta, compliance=compliance)
        sag = 1.001 * sag_of_compliant_beam(SHORT, compliance) / (SHORT * SIZE[0])
        return cell(result, np.maximum(height - sag, 0.0), bound=0.5 * sag + 1e-3, rest=AT_REST)

    def eigenvalue(theta: float, compliance: float) -> float:
        return growth(one_row_matrix(MASS, compliance, theta * TIME_STEP, TIME_STEP))

    return case.StabilityMap(
        x=RELATIVE_DAMPINGS,
        y=COMPLIANCES,
        cells=table(COMPLIANCES, RELATIVE_DAMPINGS, kind),
        x_label="damping, τ/h",
        y_label="compliance [m/N, rad/(N m)]",
        prediction=table(COMPLIANCES, RELATIVE_DAMPINGS, eigenvalue),
        note="Without damping the eigenvalue −1 of a rigid lock is double and undamped modes persist; with soft "
        "locks and next to no damping the beam falls apart.",
    )


STUDIES = (
    case.StabilityStudy(
        name="longest-beam",
        title="Longest beam that lies still to rounding",
        configuration="plain",
        definition=RIGID,
        study=longest_beam,
        unit="boxes",
        expected=(1000.0, 1000.0),
        expected_source="LDLᵀ of the saddle form stays at one unit in the last place to 2000 boxes; ends at 1000",
    ),
    case.StabilityStudy(
        name="largest-time-step",
        title="Largest time step with which 80 pushed boxes come to rest",
        configuration="plain",
        definition=RESTS,
        study=largest_step,
        unit="s",
        expected_source="none: at τ = 2 h the map of a lock row has the double eigenvalue 1/3 for every time step, so the locks set no limit; what ends it are the one-sided contacts on the piles, which the linear map does not hold",
    ),
    case.StabilityStudy(
        name="smallest-damping",
        title="Smallest τ/h with which 80 pushed boxes come to rest",
        configuration="plain",
        definition=RESTS,
        study=smallest_damping,
        unit="1",
        better="smaller",
        expected=(0.0204, 0.0225),
        expected_source="the pushed box follows the powers of the map of one rigid row, |λ| = 1/√(1 + 4θ): at 1e-9 of the length after 200 steps for θ = 0.0208, found to 5 %",
    ),
    case.StabilityStudy(
        name="damping-compliance-map",
        title="Damping and compliance, 20 boxes",
        configuration="plain",
        definition=HOLDS,
        study=damping_map,
    ),
)

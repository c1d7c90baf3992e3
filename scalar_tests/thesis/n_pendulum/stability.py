"""How long a chain, how long a time step, how little damping the N-pendulum survives."""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from ... import case
from ...bracket import break_count, break_point, cell, is_stable, table
from ...ropes.chain import COMPLIANCE, LENGTH, fall_to_hanging, level_chain
from .figures import COUNT, CURVED_TWICE, DURATION, TIME_STEP

FOUR_SUBSTEPS = engine.Method(substeps=4)
EIGHT_SUBSTEPS = engine.Method(substeps=8)
COUNTS = (2, 5, 10, 15, 20, 26, 30, 40, 50, 60, 80, 100, 130, 150, 170, 200, 230, 300, 400)
STRETCH_BOUND, ENERGY_BOUND = 1.0, 0.15  # of a link's length; of the fall to hanging
RELATIVE_DAMPINGS = (0.01, 0.03, 0.1, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0)  # τ/h
COMPLIANCES = tuple(float(value) for value in np.geomspace(1e-13, 1e-3, 11))  # m/N
OBSERVE: dict[str, Observable] = {
    "violation": engine.Trace(quantity=engine.Violation()),
    "energy": engine.Trace(quantity=engine.Energy(), from_start=True),
}
DISCRETE = "where the method's own discrete solution breaks: the prototype tests/oracles/chain.py"
HOLDS = (
    "22 s without any link ever off by more than its own length, or the energy above its start by more than 15 % of the "
    "fall to hanging"
)


def _kind(
    simulate: case.Simulate,
    count: int,
    time_step: float = TIME_STEP,
    method: engine.Method = engine.PLAIN,
    *,
    relative_damping: float = 1.0,
    compliance: float = COMPLIANCE,
) -> str:
    step = time_step / method.substeps
    result = simulate(
        level_chain(count, relative_damping * step, compliance=compliance),
        time_step=time_step,
        duration=DURATION,
        method=method,
        observe=OBSERVE,
    )
    stretch = np.abs(result.partial["violation"]).max(axis=1) / (STRETCH_BOUND * LENGTH)
    gain = result.partial["energy"] / fall_to_hanging(count) / ENERGY_BOUND
    # A whip comes when it comes: only the bounds count, not that the last third has more of it.
    return cell(result, np.maximum(stretch, gain), bound=1.0, rest=1.0).replace("settled", "bounded")


def _longest(method: engine.Method) -> Any:
    def study(simulate: case.Simulate) -> case.BreakPoint:
        return break_count(lambda count: is_stable(_kind(simulate, count, method=method)), COUNTS)

    return study


def _largest_step(method: engine.Method) -> Any:
    def study(simulate: case.Simulate) -> case.BreakPoint:
        return break_point(
            lambda h: is_stable(_kind(simulate, COUNT, h, method)), 0.002, 0.2, resolution=0.02, walk=15
        )

    return study


def smallest_damping(simulate: case.Simulate) -> case.BreakPoint:
    """Smallest τ/h for 26 spheres."""
    return break_point(
        lambda theta: is_stable(_kind(simulate, COUNT, relative_damping=theta)),
        1.0,
        1e-6,
        resolution=0.05,
        walk=13,
    )


def damping_map(simulate: case.Simulate) -> case.StabilityMap:
    """(τ/h, compliance) for 26 spheres at h = 1/60 s."""

    def kind(theta: float, compliance: float) -> str:
        return _kind(simulate, COUNT, relative_damping=theta, compliance=compliance)

    return case.StabilityMap(
        x=RELATIVE_DAMPINGS,
        y=COMPLIANCES,
        cells=table(COMPLIANCES, RELATIVE_DAMPINGS, kind),
        x_label="damping, τ/h",
        y_label="compliance [m/N]",
        note="Too little damping feeds on the whip of the free end; too much stretches every link, since damping "
        "holds on to the linearised row.",
    )


STUDIES = (
    *(
        case.StabilityStudy(
            name=f"longest-chain-{name.replace(' ', '-')}",
            title="Longest chain that swings down from the level",
            configuration=name,
            definition=HOLDS,
            study=_longest(method),
            unit="spheres",
            expected=expected,
            expected_source=source,
        )
        for name, method, expected, source in (
            ("plain", engine.PLAIN, (55.0, 57.0), DISCRETE + ", to one sphere"),
            (
                "curved twice",
                CURVED_TWICE,
                None,
                "none: with curved rows so little energy is lost that the whip is chaotic, and rounding decides which "
                "chain fails first (tests/oracles/chain.py, rounding otherwise, loses one of five spheres)",
            ),
            ("four substeps", FOUR_SUBSTEPS, (196.0, 198.0), DISCRETE + ", to one sphere"),
            ("eight substeps", EIGHT_SUBSTEPS, (400.0, 400.0), DISCRETE + " beyond the end of the search"),
        )
    ),
    *(
        case.StabilityStudy(
            name=f"largest-time-step-{name.replace(' ', '-')}",
            title="Largest time step for 26 spheres",
            configuration=name,
            definition=HOLDS,
            study=_largest_step(method),
            unit="s",
            expected=expected,
            expected_source=source,
        )
        for name, method, expected, source in (
            ("plain", engine.PLAIN, (0.0382, 0.0398), DISCRETE + ", to the search's 2 %"),
            (
                "curved twice",
                CURVED_TWICE,
                None,
                "none: with curved rows the whip is chaotic, so holding and failing alternate near the break (0.029 s "
                "fails, 0.0292 s holds, 0.0295 s fails in tests/oracles/chain.py) and the answer hangs on the search's grid",
            ),
        )
    ),
    case.StabilityStudy(
        name="smallest-damping",
        title="Smallest τ/h that holds 26 spheres",
        configuration="plain",
        definition=HOLDS,
        study=smallest_damping,
        unit="1",
        better="smaller",
        expected=(0.0195, 0.0216),
        expected_source=DISCRETE + ", to the search's 5 %",
    ),
    case.StabilityStudy(
        name="damping-compliance-map",
        title="Damping and compliance, 26 spheres",
        configuration="plain",
        definition=HOLDS,
        study=damping_map,
    ),
)

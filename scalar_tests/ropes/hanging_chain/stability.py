"""How heavy a load, how long a time step, how crooked a start a light chain survives."""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from ... import case
from ...bracket import break_point, cell, is_stable, table
from ..chain import GRAVITY, LENGTH, MASS, sideways_modes
from .scene import COUNT, HEAVY, STEPS, STRING, TILT, TIME_STEP, lift, scene

WIDE_TILT = 1.0  # rad, for the chain that swings far
ZIGZAG = 1e-12  # m: wakes the fastest sideways mode
BOUND = 0.01  # of a link's length, and of the energy above hanging; a tenth for the chain that swings far
WIDE_BOUND = 0.1
MAP_SECONDS = 13.0  # two swings of the load
MAP_RATIOS = tuple(float(r) for r in np.geomspace(1.0, 1e12, 13))
MAP_STEPS = tuple(float(h) for h in np.geomspace(1.0 / 480.0, 0.1, 12))  # s


def _kind(
    simulate: case.Simulate,
    ratio: float,
    time_step: float,
    method: engine.Method,
    *,
    tilt: float = TILT,
    zigzag: float = ZIGZAG,
    seconds: float = STEPS * TIME_STEP,
) -> str:
    observe: dict[str, Observable] = {
        "violation": engine.Trace(quantity=engine.Violation()),
        "energy": engine.Trace(quantity=engine.Energy(), from_start=True),
    }
    result = simulate(
        scene(ratio, time_step, tilt=tilt, zigzag=zigzag),
        time_step=time_step,
        steps=round(seconds / time_step),
        method=method,
        observe=observe,
    )
    return cell(result, _excess(result, ratio, tilt), bound=1.0)


def _excess(result: engine.Result, ratio: float, tilt: float) -> Any:
    """Violation beyond what linearised rows cost, and energy gain beyond half a step's, each over its bound."""
    bound = BOUND if tilt <= TILT else WIDE_BOUND
    speed = COUNT * LENGTH * tilt * np.sqrt(GRAVITY / (COUNT * LENGTH))
    curvature = 3.0 * (result.time_step * speed / COUNT) ** 2 / LENGTH
    stretch = np.abs(result.partial["violation"]).max(axis=1) / (bound * LENGTH + curvature)
    lag = 2.0 * result.time_step * np.sqrt(GRAVITY / (COUNT * LENGTH))
    gain = result.partial["energy"] / lift(ratio, tilt) / (bound + lag)
    # Below a tenth of the bounds nothing is growing, only swinging.
    return np.maximum(0.1, np.maximum(stretch, gain))


def _largest_ratio(method: engine.Method, tilt: float, hard: float, resolution: float = 0.005) -> Any:
    def study(simulate: case.Simulate) -> case.BreakPoint:
        return break_point(
            lambda ratio: is_stable(_kind(simulate, ratio, TIME_STEP, method, tilt=tilt)),
            1.0,
            hard,
            resolution=resolution,
            walk=13,
        )

    return study


def lightest_load(simulate: case.Simulate) -> case.BreakPoint:
    """Smallest mass ratio of the last sphere, plain SPOOK."""
    return break_point(
        lambda ratio: is_stable(_kind(simulate, ratio, TIME_STEP, engine.PLAIN)),
        1.0,
        1e-14,
        walk=15,
        resolution=0.1,
    )


def _largest_offset(simulate: case.Simulate) -> case.BreakPoint:
    """String stiffness at a million to one, started with its spheres pushed left and right in turn."""
    return break_point(
        lambda zigzag: is_stable(_kind(simulate, HEAVY, TIME_STEP, STRING, zigzag=zigzag)),
        1e-12,
        1e-3,
        resolution=0.05,
        walk=10,
    )


def predicted_break(pull: float = 1.0) -> float:
    """Load ratio at which h² ω² = 4 for the fastest sideways mode: where an explicit step breaks.

    `pull` is the tension over the weight.
    """
    low, high = 1.0, 1e6
    for _ in range(60):
        middle = 0.5 * (low + high)
        fastest = pull * TIME_STEP**2 * sideways_modes(COUNT, middle * MASS)[0][-1]
        low, high = (middle, high) if fastest < 4.0 else (low, middle)
    return low


def _map(method: engine.Method) -> Any:
    def study(simulate: case.Simulate) -> case.StabilityMap:
        return case.StabilityMap(
            x=MAP_RATIOS,
            y=MAP_STEPS,
            cells=table(
                MAP_STEPS, MAP_RATIOS, lambda r, h: _kind(simulate, r, h, method, seconds=MAP_SECONDS)
            ),
            x_label="load over a sphere's mass",
            y_label="time step [s]",
            prediction=table(MAP_STEPS, MAP_RATIOS, _explicit_growth),
            note="The prediction is the growth per step of the fastest sideways mode when it is stepped explicitly.",
        )

    return study


def _explicit_growth(ratio: float, time_step: float) -> float:
    """Largest |eigenvalue| of symplectic Euler on the fastest sideways mode."""
    half = 0.5 * time_step**2 * float(sideways_modes(COUNT, ratio * MASS)[0][-1]) - 1.0
    return 1.0 if half <= 1.0 else half + float(np.sqrt(half * half - 1.0))


PREDICTED = predicted_break()
SWINGING = predicted_break(
    3.0 - 2.0 * float(np.cos(WIDE_TILT))
)  # tension at the bottom of a swing from WIDE_TILT
HOLDS = (
    "20 s (13 s in maps) without a link off by more than 1 % of its length, or energy above its start by more than "
    "1 % of the lift, beyond what the step's own reading costs (10 % for the wide swing), and neither doubling in "
    "the last third; spheres start 1e-12 m left and right in turn"
)
STUDIES = (
    case.StabilityStudy(
        name="mass-ratio-plain",
        title="Largest mass ratio of a hanging chain, plain SPOOK",
        configuration="plain",
        definition=HOLDS,
        study=_largest_ratio(engine.PLAIN, TILT, 1e6),
        unit="1",
        expected=(0.98 * PREDICTED, 1.02 * PREDICTED),
        expected_source="h ω = 2 for the fastest sideways mode of ten links",
    ),
    case.StabilityStudy(
        name="mass-ratio-string",
        title="Largest mass ratio of a hanging chain, string stiffness",
        configuration="string",
        definition=HOLDS,
        study=_largest_ratio(STRING, TILT, 1e12, 0.05),
        unit="1",
        expected=(1e9, 1e12),
        expected_source="nothing in the method bounds it; double precision does",
    ),
    case.StabilityStudy(
        name="mass-ratio-swinging-plain",
        title="Largest mass ratio of a chain swinging from 1 rad, plain SPOOK",
        configuration="plain",
        definition=HOLDS,
        study=_largest_ratio(engine.PLAIN, WIDE_TILT, 1e6),
        unit="1",
        expected=(0.97 * SWINGING, 1.03 * SWINGING),
        expected_source="h ω = 2 with the tension at the bottom of the swing, (3 − 2 cos 1) = 1.92 times the weight; "
        "it is passed for moments only, which puts the break a little higher",
    ),
    case.StabilityStudy(
        name="mass-ratio-swinging-string",
        title="Largest mass ratio of a chain swinging from 1 rad, string stiffness",
        configuration="string",
        definition=HOLDS,
        study=_largest_ratio(STRING, WIDE_TILT, 1e12, 0.05),
        unit="1",
        expected=(1e9, 1e12),
        expected_source="nothing in the method bounds it; double precision does",
    ),
    case.StabilityStudy(
        name="lightest-load",
        title="Smallest mass ratio of the last sphere, plain SPOOK",
        configuration="plain",
        definition=HOLDS,
        study=lightest_load,
        unit="1",
        better="smaller",
        expected=(1e-14, 1e-14),
        expected_source="the last link's own mode is √(g/l) however light the load; the search ends at 1e-14",
    ),
    case.StabilityStudy(
        name="start-offset-string",
        title="Largest sideways start offset at a million to one, string stiffness",
        configuration="string",
        definition=HOLDS.replace("1e-12 m ", "the offset "),
        study=_largest_offset,
        unit="m",
        expected=(1e-3, 1e-3),
        expected_source="every sideways mode is stable, so an offset stays as small as it starts; the search ends at 1 mm",
    ),
    case.StabilityStudy(
        name="map-plain",
        title="Mass ratio and time step, plain SPOOK",
        configuration="plain",
        definition=HOLDS,
        study=_map(engine.PLAIN),
    ),
    case.StabilityStudy(
        name="map-string",
        title="Mass ratio and time step, string stiffness",
        configuration="string",
        definition=HOLDS,
        study=_map(STRING),
    ),
)

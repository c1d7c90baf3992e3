"""Where the beam stops being a cantilever: pressed along, it buckles.

Both forces act at the last box's centre, half a piece short of the tip: a column of L = l − d/2. Statics alone, so neither
time step nor damping counts. The slowest mode creeps with τ/(1 − P/P_cr), 2.5 s at 0.80 of Euler's load.
"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

from spook_tracker.engine import Final, Load, Position
from spook_tracker.scalar_tests.bracket import break_point
from spook_tracker.scalar_tests.cantilever.scene import LENGTH, LOAD, SMALL, STIFFNESS, scene
from spook_tracker.scalar_tests.case import BreakPoint, Simulate, StabilityStudy

COUNT = 10
PIECE = LENGTH / COUNT
COLUMN = LENGTH - 0.5 * PIECE  # m
SIDE = SMALL * LOAD  # N, sideways
UNPRESSED = SIDE * COLUMN**3 / (3.0 * STIFFNESS)  # m, how far it goes aside with nothing along
TIMES = 5.0  # what it may be pressed to of that
TIME_STEP, DURATION = 1.0 / 15.0, 25.0  # s


def aside(force: float) -> float:
    """How many times as far a column goes aside under `force` [N] along: 3 (tan u − u)/u³, u = L √(P/(EI))."""
    u = COLUMN * math.sqrt(force / STIFFNESS)
    return 3.0 * (math.tan(u) - u) / u**3


def pressed() -> float:
    """The force [N] that makes it TIMES; halving below Euler's, π² EI/(4 L²)."""
    low, high = 1.0, math.pi**2 * STIFFNESS / (4.0 * COLUMN**2)
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if aside(middle) < TIMES else (low, middle)
    return low


PRESSED = pressed()  # N, 7373


def bears(simulate: Simulate, force: float) -> bool:
    """Whether the beam pressed along by `force` [N] comes to rest less than TIMES as far aside."""
    last = f"box {COUNT}"
    load = Load(name="load", body=last, force=(-force, 0.0, -SIDE))
    built = replace(scene(COUNT), forces=(load,))
    observe = {"last": Final(quantity=Position(last))}
    result = simulate(built, time_step=TIME_STEP, duration=DURATION, observe=observe)
    return result.completed and -float(result["last"][2]) < TIMES * UNPRESSED


def strongest(simulate: Simulate) -> BreakPoint:
    """The largest force [N] along that the beam bears."""
    return break_point(functools.partial(bears, simulate), 100.0, 1e5, resolution=2e-3, walk=6)


STUDIES = (
    StabilityStudy(
        name="strongest-press",
        title="Largest force along a beam of ten pieces that does not buckle it",
        configuration="static",
        definition="a thousandth of the load sideways moves it by less than five times what it does with nothing along, at rest",
        study=strongest,
        unit="N",
        expected=(0.992 * PRESSED, PRESSED),
        expected_source="Euler: 3 (tan u − u)/u³ = 5 with u = L √(P/(EI)), at 0.80 of π² EI/(4 L²). Ten pieces with a turn between "
        "them and a slip buckle earlier by (π/40)²/3 and π²/4/1200, 0.4 %; 0.2 % is the search's, as much to spare",
    ),
)

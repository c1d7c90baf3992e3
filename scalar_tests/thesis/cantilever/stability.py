"""Where the beam stops being a cantilever: pressed along, it buckles; in long steps, it rings.

The press and the push aside act at the last box's centre, half a piece short of the tip: a column of L = l − d/2 at rest,
whatever step and damping. Its slowest mode creeps with τ/(1 − P/P_cr), 2.5 s at 0.80 of Euler's load.
"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.theory import one_row_matrix

from ... import case
from ...bracket import break_point
from .scene import DAMPING, DENSITY, LENGTH, LOAD, SMALL, STIFFNESS, scene
from .statics import chain_tip

COUNT = 10
PIECE = LENGTH / COUNT
COLUMN = LENGTH - 0.5 * PIECE  # m
SIDE = SMALL * LOAD  # N, sideways
UNPRESSED = SIDE * COLUMN**3 / (3.0 * STIFFNESS)  # m, how far it goes aside with nothing along
TIMES = 5.0  # what it may be pressed to of that
TIME_STEP, DURATION = 1.0 / 15.0, 25.0  # s
STEPS, LEFT = 30, 1e-3  # of the search for the longest step, and what may be left of the start
FIRST_RATE = 1.8751**2 * math.sqrt(STIFFNESS / (DENSITY * LENGTH**4))  # rad/s, 3.81


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


def bears(simulate: case.Simulate, force: float) -> bool:
    """Whether the beam pressed along by `force` [N] comes to rest less than TIMES as far aside."""
    last = f"box {COUNT}"
    load = engine.Load(name="load", body=last, force=(-force, 0.0, -SIDE))
    built = replace(scene(COUNT), forces=(load,))
    observe = {"last": engine.Final(quantity=engine.Position(last))}
    result = simulate(built, time_step=TIME_STEP, duration=DURATION, observe=observe)
    return result.completed and -float(result["last"][2]) < TIMES * UNPRESSED


def strongest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest force [N] along that the beam bears."""
    return break_point(functools.partial(bears, simulate), 100.0, 1e5, resolution=2e-3, walk=6)


def rung(time_step: float) -> float:
    """What is left of the start in the last five of STEPS steps: the map of a row as stiff as the beam's first mode."""
    step = one_row_matrix(1.0, 1.0 / FIRST_RATE**2, DAMPING, time_step)
    return max(abs(float(np.linalg.matrix_power(step, n)[0, 0])) for n in range(STEPS - 4, STEPS + 1))


def longest() -> float:
    """The step [s] from which on more than LEFT is left, to a thousandth."""
    step = 0.5
    while rung(step) < LEFT:
        step *= 1.001
    return step


def settles(simulate: case.Simulate, time_step: float) -> bool:
    """Whether the beam under its load lies where its pieces' statics have it, to LEFT, in the last five of STEPS steps."""
    last = f"box {COUNT}"
    observe = {
        "last": engine.Trace(quantity=engine.Position(last), first=STEPS - 4),
        "turn": engine.Trace(quantity=engine.Orientation(last), first=STEPS - 4),
    }
    result = simulate(scene(COUNT), time_step=time_step, steps=STEPS, observe=observe)
    w, x, y, z = result["turn"].T
    tip = -(result["last"][:, 2] + PIECE * (x * z - w * y))
    return result.completed and float(np.abs(tip / chain_tip(COUNT) - 1.0).max()) < LEFT


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which the beam settles."""
    return break_point(functools.partial(settles, simulate), 1.0, 20.0, resolution=5e-3, walk=13)


LONGEST = longest()  # s
STUDIES = (
    case.StabilityStudy(
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
    case.StabilityStudy(
        name="longest-step",
        title="Longest step in which a beam of ten pieces settles",
        configuration="static",
        definition="its tip under the load is where the statics of its pieces have it, to 1e-3, in steps 26 to 30",
        study=longest_step,
        unit="s",
        expected=(0.95 * LONGEST, 1.05 * LONGEST),
        expected_source="the map of one row as stiff as the first mode: each step leaves √α of it, about (1 + 4 τ/h)^(-1/2), so that "
        "steps beyond the damping time ring; 3 % of the load is in other modes, which ring a little less",
    ),
)

"""Library problem A01: is a pendulum still where it belongs after 2000 s?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..thesis.pendulum.scene import GRAVITY, LENGTH, angle, scene
from .library import HIGH, LOW, error_metric, ladders, library_error

DURATION, EVERY = 2000.0, 0.5  # s: 4000 outputs
LADDER_DURATION = 100.0  # s
NUDGE, WIDER, SWINGS = 1e-6, 100.0, 200  # rad; times as wide; steps of the pendulum that hangs
RATE = math.sqrt(GRAVITY / LENGTH)  # rad/s
LONGEST = 10.0  # s, where the search for a composition's longest step ends
HALF_STEP_CURVED = engine.Method(half_step_velocities=True, corrections=2)
OUTPUTS = "4000 outputs of (x, y) in 2000 s"
ORDER_4, ORDER_8 = engine.Method(composition="order4"), engine.Method(composition="order8")


def path_error(
    simulate: case.Simulate, time_step: float, method: engine.Method, duration: float = DURATION
) -> float:
    """The library's error of (x, y) over all outputs."""
    every = round(EVERY / time_step)
    place = {"bob": engine.Trace(quantity=engine.Position("bob"), first=every, every=every)}
    result = simulate(scene(time_step), time_step=time_step, duration=duration, method=method, observe=place)
    theta = angle(result.sample_times["bob"])
    return library_error(result["bob"][:, [0, 2]], np.stack([np.sin(theta), -np.cos(theta)], axis=1))


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """The same over the first 100 s."""
    return path_error(simulate, time_step, method, LADDER_DURATION)


def order_4(simulate: case.Simulate) -> dict[str, float]:
    """Order 4, coarse."""
    return {"library_error": path_error(simulate, 1 / 40, ORDER_4)}


def order_8(simulate: case.Simulate) -> dict[str, float]:
    """Order 8, for the high class."""
    return {"library_error": path_error(simulate, 1 / 20, ORDER_8)}


def hangs(simulate: case.Simulate, method: engine.Method, time_step: float) -> bool:
    """Whether a pendulum let go NUDGE from hanging stays within WIDER times that, for SWINGS steps so long [s]."""
    level = scene(time_step)
    place = (LENGTH * math.sin(NUDGE), 0.0, -LENGTH * math.cos(NUDGE))
    hung = replace(level, bodies=(replace(level.bodies[0], position=place),))
    observe = {"bob": engine.MaximumAbsolute(quantity=engine.Position("bob"))}
    result = simulate(hung, time_step=time_step, steps=SWINGS, method=method, observe=observe)
    return result.completed and float(result["bob"][0]) < WIDER * NUDGE


def longest_step(simulate: case.Simulate, method: engine.Method, hard: float) -> case.BreakPoint:
    """The longest step [s] in which it hangs still, up to `hard`."""
    return break_point(functools.partial(hangs, simulate, method), 0.05, hard, resolution=2e-3, walk=6)


HANGS = "let go 1e-6 rad aside it never swings a hundred times as wide, in 200 steps"
TEST = case.ScalarTest(
    title="Multibody library A01: simple pendulum",
    question="Is a pendulum still where it belongs after 2000 s?",
    why="The first problem of the multibody library: 845 swings, where every error of the period adds up.",
    model="A bob of 1 kg on a rod of 1 m starts level with its pivot, at rest.",
    parameters=(
        ("time step", "1/20 and 1/40 s; ladder 1/10 to 1/640 s over 100 s"),
        ("bob", "1 kg, 1 m, 9.81 m/s²"),
        ("duration", "2000 s, an output every 0.5 s"),
    ),
    theory=("sin(θ/2) = √½ cd(√(g/l) t | ½), period 2.36784194757624 s.",),
    reference="Jacobi's elliptic functions; the library's error measure.",
    conclusion="Green: the period is right to 1e-6. Red: it is not, however well the length is kept.",
    source="Library for computational benchmarking of multibody dynamics, problem A01",
    measurements=(
        case.Measurement(
            configuration="order 8",
            time_step=1 / 20,
            metrics=(error_metric("gate", HIGH, OUTPUTS, kind="method"),),
            measure=order_8,
            note="symmetric composition of order 8",
        ),
        case.Measurement(
            configuration="order 4",
            time_step=1 / 40,
            metrics=(error_metric("companion", LOW, OUTPUTS, kind="method"),),
            measure=order_4,
            note="symmetric composition of order 4",
        ),
    ),
    example=lambda: case.Example(scene=scene(1 / 20), time_step=1 / 20, method=ORDER_8),
    ladders=ladders(
        "position over 100 s",
        {
            "low": (
                (1 / 10, 1 / 20, 1 / 40, 1 / 80, 1 / 160, 1 / 640),
                (
                    case.Configuration(
                        name="half-step, curved twice", method=HALF_STEP_CURVED, expected_order=None
                    ),
                    case.Configuration(
                        name="order 4", method=ORDER_4, expected_order=4.0, order_range=(1 / 160, 1 / 20)
                    ),
                ),
            ),
            "high": (
                (1 / 10, 1 / 20, 1 / 40, 1 / 80, 1 / 160),
                (
                    case.Configuration(
                        name="order 4", method=ORDER_4, expected_order=4.0, order_range=(1 / 160, 1 / 20)
                    ),
                    case.Configuration(name="order 8", method=ORDER_8, expected_order=None),
                ),
            ),
        },
        ladder_error,
    ),
    stability=(
        case.StabilityStudy(
            name="longest-step-curved",
            title="Longest step in which the pendulum hangs still",
            configuration="half-step, curved twice",
            definition=HANGS,
            study=functools.partial(longest_step, method=HALF_STEP_CURVED, hard=3.0 / RATE),
            unit="s",
            expected=(0.996 * 2.0 / RATE, 1.002 * 2.0 / RATE),
            expected_source="gravity is taken where a step begins, rows take none of a small swing: stable while h √(g/l) < 2; to "
            "the resolution of the search, and what 200 steps tell",
        ),
        case.StabilityStudy(
            name="longest-step-order8",
            title="Longest step in which the pendulum hangs still, by a composition",
            configuration="order 8",
            definition=HANGS,
            study=functools.partial(longest_step, method=ORDER_8, hard=LONGEST),
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="a stage that gravity draws 0.3 of l off the circle is halved: ½ g (γ h)² stays below 0.14 l, so h ω below "
            "0.9, and the leapfrogs of a small swing leave the unit circle at h ω = 3.1; the search ends at 10 s",
        ),
    ),
)

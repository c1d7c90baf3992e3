"""Library problem A02: do forty four-bar linkages, pushed over at once, keep together through their singular place?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_count, break_point
from .library import GRAVITY, LOW, PLAIN_CONFIGURATION, error_metric, ladders, library_error, tightly

LENGTH, MASS, PUSH = 1.0, 1.0, 1.0  # m, kg, m/s
THIN = 1e-3  # kg m², about a rod's own axis: nothing turns about it
ACROSS = MASS * LENGTH**2 / 12.0  # kg m²
COMPLIANCE = 1e-13  # m/N and rad/(N m): 1e-11 yields more than the high class allows
EVERY = 0.05  # s: 20 outputs a second
MANY, FEW = 40, 2
NUDGE, HUNG_STEPS = 1e-6, 200  # of PUSH, and steps: linkages that hang
COUNTS = (2, 5, 10, 20, 40)  # linkages that are tried
FALLING_STEPS = tuple(1.0 / n for n in (12, 15, 18, 21, 30, 60, 90, 120))  # s
BEFORE_LEVEL = 2.0 / 3.0  # s; two linkages are level at 0.714
ORDER_RANGES: dict[Literal["order4", "order6", "order8"], tuple[float, float]] = {  # s
    "order4": (1 / 120, 1 / 18),
    "order6": (1 / 60, 1 / 15),
    "order8": (1 / 21, 1 / 12),
}


def scene(count: int, time_step: float) -> engine.Scene:
    """`count` + 1 upright rods on hinges in the ground and `count` level ones on top, moving at PUSH along x."""
    sides = [
        engine.RigidBody(
            name=f"side {k}",
            mass=MASS,
            inertia=(ACROSS, THIN, ACROSS),
            position=(k * LENGTH, 0.5 * LENGTH, 0.0),
            velocity=(0.5 * PUSH, 0.0, 0.0),
            angular_velocity=(0.0, 0.0, -PUSH / LENGTH),
        )
        for k in range(count + 1)
    ]
    tops = [
        engine.RigidBody(
            name=f"top {k}",
            mass=MASS,
            inertia=(THIN, ACROSS, ACROSS),
            position=((k + 0.5) * LENGTH, LENGTH, 0.0),
            velocity=(PUSH, 0.0, 0.0),
        )
        for k in range(count)
    ]

    def hinge(name: str, first: str, second: str, x: float, y: float) -> engine.Hinge:
        return engine.Hinge(
            name=name, between=(first, second), at=(x, y, 0.0), compliance=COMPLIANCE, damping=time_step
        )

    hinges = [hinge(f"foot {k}", engine.WORLD, f"side {k}", k * LENGTH, 0.0) for k in range(count + 1)]
    for k in range(count):
        hinges.append(hinge(f"left {k}", f"side {k}", f"top {k}", k * LENGTH, LENGTH))
        hinges.append(hinge(f"right {k}", f"side {k + 1}", f"top {k}", (k + 1) * LENGTH, LENGTH))
    return engine.Scene(
        bodies=(*sides, *tops), constraints=tuple(hinges), gravity=(0.0, -GRAVITY, 0.0), contacts=False
    )


def _falls_over(count: int) -> float:
    """c of θ̈ = c (g/l) sin θ, θ from upright: weights over inertias of all rods."""
    return ((3 * count + 1) / 2.0) / ((4 * count + 1) / 3.0)


def _few(_: float, state: np.ndarray) -> np.ndarray:
    return np.array([state[1], _falls_over(FEW) * GRAVITY / LENGTH * math.sin(state[0])])


def _many(_: float, state: np.ndarray) -> np.ndarray:
    return np.array([state[1], _falls_over(MANY) * GRAVITY / LENGTH * math.sin(state[0])])


def exact(count: int, times: Any) -> np.ndarray:
    """(time, 2): the upper left corner B0 [m], from the one equation that parallel rods leave."""
    theta = tightly({FEW: _few, MANY: _many}[count], (0.0, PUSH / LENGTH), tuple(map(float, times)))[0]
    return LENGTH * np.stack([np.sin(theta), np.cos(theta)], axis=1)


def answers(
    simulate: case.Simulate, count: int, time_step: float, duration: float, method: engine.Method
) -> dict[str, float]:
    """The library's error of B0 and the largest change of energy over m g l of all rods."""
    every = round(EVERY / time_step)
    result = simulate(
        scene(count, time_step),
        time_step=time_step,
        duration=duration,
        method=method,
        observe={
            "side": engine.Trace(quantity=engine.Position("side 0"), first=every, every=every),
            "energy": engine.MaximumAbsolute(quantity=engine.Energy(), from_start=True),
        },
    )
    corner = 2.0 * result["side"][:, :2]
    return {
        "library_error": library_error(corner, exact(count, result.sample_times["side"])),
        "energy_deviation": float(result["energy"]) / ((3 * count + 1) / 2.0 * MASS * GRAVITY * LENGTH),
    }


def many(simulate: case.Simulate) -> dict[str, float]:
    """The library's own case: 40 linkages, 20 s."""
    return answers(simulate, MANY, 1e-3, 20.0, engine.PLAIN)


def few(simulate: case.Simulate) -> dict[str, float]:
    """Two linkages, 10 s, coarser."""
    return answers(simulate, FEW, 1e-3, 10.0, engine.PLAIN)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Of two linkages over 10 s."""
    return answers(simulate, FEW, time_step, 10.0, method)["library_error"]


def many_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Of forty linkages over 20 s, the library's own case."""
    return answers(simulate, MANY, time_step, 20.0, method)["library_error"]


def falling_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest component [m] of B0 away from the exact place after BEFORE_LEVEL, two linkages."""
    observe = {"side": engine.Final(quantity=engine.Position("side 0"))}
    built = scene(FEW, time_step)
    result = simulate(built, time_step=time_step, duration=BEFORE_LEVEL, method=method, observe=observe)
    return float(np.abs(2.0 * result["side"][:2] - exact(FEW, (BEFORE_LEVEL,))[0]).max())


def hangs(simulate: case.Simulate, count: int, time_step: float) -> bool:
    """Whether linkages that hang, pushed a little, swing together, no wider than a hundred times what that is in a step."""
    upright = scene(count, time_step)
    bodies = tuple(
        replace(
            body,
            velocity=(NUDGE * body.velocity[0], 0.0, 0.0),
            angular_velocity=(0.0, 0.0, NUDGE * body.angular_velocity[2]),
        )
        for body in upright.bodies
        if isinstance(body, engine.RigidBody)
    )
    hanging = replace(upright, bodies=bodies, gravity=(0.0, GRAVITY, 0.0))
    observe = {
        f"side {k}": engine.Trace(quantity=engine.Position(f"side {k}"), from_start=True) for k in (0, count)
    }
    result = simulate(hanging, time_step=time_step, steps=HUNG_STEPS, observe=observe)
    if not result.completed:
        return False
    first, last = (result[f"side {k}"][:, 0] for k in (0, count))
    wide = 100.0 * time_step * NUDGE * PUSH
    return float(np.abs(first).max()) < wide and float(np.abs(first - last).max()) < 1e-3 * wide


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which two hanging linkages swing."""
    return break_point(functools.partial(hangs, simulate, FEW), 0.02, 3.0, resolution=2e-3, walk=6)


def most_linkages(simulate: case.Simulate) -> case.BreakPoint:
    """The most hanging linkages that swing as one at h = 1/60 s."""
    return break_count(lambda count: hangs(simulate, count, 1 / 60), COUNTS)


LONGEST = 2.0 / math.sqrt(_falls_over(FEW) * GRAVITY / LENGTH)  # s, .591: h ω = 2


def _composed(order: Literal["order4", "order6", "order8"], *time_steps: float) -> case.Configuration:
    """A composition that meets a class at its first or second step: too few for a slope."""
    return case.Configuration(
        name=order, method=engine.Method(composition=order), expected_order=None, time_steps=time_steps
    )


ENERGY = case.Metric(
    name="energy_deviation",
    description="largest |E − E₀| over the energy between upright and level, (3 N + 1)/2 m g l",
    unit="1",
    role="reported",
    reference=0.0,
    relative_tolerance=1e-5,
)

HANGS = (
    "under the ground, pushed by 1e-6 m/s, the first and the last rod swing together and no wider than a hundred times what "
    "that is in a step, in 200 steps"
)
TEST = case.ScalarTest(
    title="Multibody library A02: N four-bar linkages",
    question="Do forty four-bar linkages in a row, pushed over at once, stay one motion?",
    why="Level, all rods lie on one line: one freedom becomes 41, and an engine may fall into any of them.",
    model="81 uniform rods of 1 kg and 1 m: 41 upright on the ground, 40 level between their tops, moving at 1 m/s.",
    parameters=(
        (
            "time step",
            "1e-3 s; ladders 1/20 to 1/4000 s for N = 2 over 10 s, 1/20 to 1/1000 s for N = 40 over 20 s",
        ),
        ("rods", "1 kg, 1 m, 9.81 m/s²"),
        ("hinges", "compliance 1e-13, damping one time step"),
        ("duration", "20 s, 400 outputs; N = 2: 10 s, 200 outputs"),
    ),
    theory=(
        "Parallel rods leave one equation: θ̈ = c (g/l) sin θ, c = ((3 N + 1)/2)/((4 N + 1)/3), θ̇(0) = 1.",
        "N = 40: revolution 1.96560192870465 s; N = 2: 1.94251492260708 s.",
    ),
    reference="That equation by DOP853 at 1e-12; the library's error measure.",
    conclusion="Green: redundant and singular linkages are solved as one. Red: they fold, lock or lose their energy.",
    source="Library for computational benchmarking of multibody dynamics, problem A02",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=1e-3,
            parameters={"N": MANY},
            metrics=(error_metric("gate", LOW, "400 outputs of (x, y) of B0 in 20 s"), ENERGY),
            measure=many,
            note="the SPOOK step as it stands",
        ),
        case.Measurement(
            configuration="plain",
            time_step=1e-3,
            parameters={"N": FEW},
            metrics=(error_metric("companion", LOW, "200 outputs of (x, y) of B0 in 10 s"), ENERGY),
            measure=few,
            note="the SPOOK step as it stands",
        ),
    ),
    example=lambda: case.Example(scene=scene(FEW, 1e-3), time_step=1e-3),
    ladders=(
        *ladders(
            "B0 of two linkages over 10 s",
            {
                "low": (
                    (1 / 60, 1 / 120, 1 / 240, 1 / 480, 1 / 1000),
                    (
                        PLAIN_CONFIGURATION,
                        case.Configuration(
                            name="order4",
                            method=engine.Method(composition="order4"),
                            expected_order=4.0,
                            order_range=(1 / 240, 1 / 60),
                            time_steps=(1 / 20, 1 / 40, 1 / 60, 1 / 120, 1 / 240),
                        ),
                        case.Configuration(
                            name="order6",
                            method=engine.Method(composition="order6"),
                            expected_order=None,
                            time_steps=(1 / 20, 1 / 40, 1 / 60),
                        ),
                        case.Configuration(
                            name="order8",
                            method=engine.Method(composition="order8"),
                            expected_order=None,  # rounding is near
                            time_steps=(1 / 20, 1 / 40),
                        ),
                    ),
                ),
                "high": (
                    (1 / 480, 1 / 1000, 1 / 2000, 1 / 4000),
                    (PLAIN_CONFIGURATION, _composed("order4", 1 / 60, 1 / 120, 1 / 240)),
                ),
            },
            ladder_error,
        ),
        *ladders(
            "B0 of forty linkages over 20 s",
            {
                "low": ((1 / 480, 1 / 1000), (PLAIN_CONFIGURATION, _composed("order4", 1 / 20))),
                "high": (
                    (1 / 20, 1 / 40),
                    (
                        _composed("order4", 1 / 20, 1 / 40),
                        _composed("order6", 1 / 20),
                        _composed("order8", 1 / 20),
                    ),
                ),
            },
            many_error,
            of="forty, ",
        ),
        case.Ladder(
            name="before level",
            description="largest component of B0's error after 2/3 s, just before the linkages lie level",
            unit="m",
            time_steps=FALLING_STEPS,
            configurations=(
                case.Configuration(
                    name="plain", method=engine.PLAIN, expected_order=2.0, order_range=(1 / 120, 1 / 30)
                ),
                case.Configuration(
                    name="half step",
                    method=engine.Method(half_step_velocities=True),
                    expected_order=2.0,
                    order_range=(1 / 120, 1 / 30),
                ),
                *(
                    case.Configuration(
                        name=order,
                        method=engine.Method(composition=order),
                        expected_order=float(order[-1]),
                        order_range=span,
                        time_steps=(1 / 3, 1 / 6, *FALLING_STEPS),
                    )
                    for order, span in ORDER_RANGES.items()
                ),
            ),
            error=falling_error,
            target_error=3e-3,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which two linkages hang",
            configuration="plain",
            definition=HANGS,
            study=longest_step,
            unit="s",
            expected=(0.996 * LONGEST, 1.002 * LONGEST),
            expected_source="hanging they are one swing, ω² = c g/l with c = ((3 N + 1)/2)/((4 N + 1)/3), gravity taken where a "
            "step begins: stable while h ω < 2; to the resolution of the search",
        ),
        case.StabilityStudy(
            name="most-linkages",
            title="Most hanging linkages that swing as one at h = 1/60 s",
            configuration="plain",
            definition=HANGS,
            study=most_linkages,
            unit="1",
            expected=(COUNTS[-1], COUNTS[-1]),
            expected_source="off the level place rows fix all but one freedom, whose ω² goes to 9/8 g/l with their number; the "
            "search ends at the library's 40",
        ),
    ),
)

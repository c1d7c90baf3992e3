"""Do bars of toy bricks swing as slowly as two kinds of clock have it?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.special import ellipk

from spook_tracker import engine

from .. import case, readings
from ..bracket import break_point
from ..readings import Reading, deviation
from ..sweep import line

GRAVITY = 9.81  # m/s²
WIDTH, DEPTH, MASS = 0.016, 0.008, 1.0  # m, m, kg: a brick of two by one studs; neither matters
ORDER_4 = engine.Method(composition="order4")
TIME_STEP = 1.0 / 240.0  # s
DURATION = 20.0  # s
SOURCE = "Coramik & İnanç, Physics Education 58 (2023) 055014"
LENGTHS = (0.480, 0.528, 0.576, 0.624, 0.672)  # m
STARTS = (13.8, 15.5, 12.8, 9.4, 9.5)  # degrees from the vertical
BY_VIDEO = (1.139, 1.199, 1.249, 1.300, 1.349)  # s, the mean of five
BY_TELEPHONE = (1.140, 1.199, 1.258, 1.300, 1.340)  # s, the mean of five
APART = math.sqrt(sum((a - b) ** 2 for a, b in zip(BY_VIDEO, BY_TELEPHONE, strict=True)) / len(LENGTHS))  # s
READINGS = tuple(
    Reading(at=f"{length:.3f} m, {start}°", value=0.5 * (a + b), sigma=0.5 * APART)
    for length, start, a, b in zip(LENGTHS, STARTS, BY_VIDEO, BY_TELEPHONE, strict=True)
)
SMALL = 1e-5  # degrees
STEPS = 400  # of a search; at h ω = 2 a swing has grown two times that
RATE = math.sqrt(
    1.5 * GRAVITY / LENGTHS[0] / (1.0 + 0.25 * (DEPTH / LENGTHS[0]) ** 2)
)  # rad/s, of a small swing
SEARCHED = 2e-3


def scene(length: float, start: float) -> engine.Scene:
    """A bar [m] hung by its end, let go `start` [degrees] from the vertical."""
    turn = math.radians(start)
    bar = engine.RigidBody(
        name="bar",
        mass=MASS,
        shape=engine.Box((DEPTH, WIDTH, length)),
        position=(-0.5 * length * math.sin(turn), 0.0, -0.5 * length * math.cos(turn)),
        orientation=(math.cos(0.5 * turn), 0.0, math.sin(0.5 * turn), 0.0),
    )
    pin = engine.Hinge(
        name="pin", between=(engine.WORLD, "bar"), at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), compliance=0.0
    )
    return engine.Scene(bodies=(bar,), constraints=(pin,), gravity=(0.0, 0.0, -GRAVITY), contacts=False)


def right(length: float, start: float) -> float:
    """Period [s]: 4 √(J/(m g l/2)) K(sin(φ₀/2)), J = m (l² + d²)/12 + m l²/4."""
    inertia = (length**2 + DEPTH**2) / 12.0 + 0.25 * length**2
    modulus = math.sin(0.5 * math.radians(start)) ** 2
    return 4.0 * math.sqrt(2.0 * inertia / (GRAVITY * length)) * float(ellipk(modulus))


def period(
    simulate: case.Simulate,
    length: float,
    start: float,
    time_step: float = TIME_STEP,
    method: engine.Method = ORDER_4,
) -> float:
    """Mean period [s] from where the angle goes through zero."""
    observe = {"angle": engine.Trace(quantity=engine.JointCoordinate("pin"))}
    result = simulate(
        scene(length, start), time_step=time_step, duration=DURATION, method=method, observe=observe
    )
    times, angle = result.sample_times["angle"], math.radians(start) + result["angle"]
    place = np.nonzero((angle[:-1] > 0.0) != (angle[1:] > 0.0))[0]
    zero = times[place] - angle[place] * time_step / (angle[place + 1] - angle[place])
    return 2.0 * float(zero[-1] - zero[0]) / (len(zero) - 1) if len(zero) > 1 else math.nan


def measure(simulate: case.Simulate) -> dict[str, float]:
    """Periods of the five bars."""
    bars = tuple(zip(LENGTHS, STARTS, strict=True))
    found = [period(simulate, *bar) for bar in bars]
    return {
        "deviation": deviation(found, READINGS),
        "theory_error": max(abs(a / right(*bar) - 1.0) for a, bar in zip(found, bars, strict=True)),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the shortest bar's period."""
    return period(simulate, LENGTHS[0], STARTS[0], time_step, method) / right(LENGTHS[0], STARTS[0]) - 1.0


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] with which a bar that hardly swings goes on hardly swinging."""

    def holds(time_step: float) -> bool:
        observe = {"angle": engine.Trace(quantity=engine.JointCoordinate("pin"))}
        result = simulate(scene(LENGTHS[0], SMALL), time_step=time_step, steps=STEPS, observe=observe)
        return result.completed and float(np.abs(result["angle"]).max()) < 0.5 * STEPS * math.radians(SMALL)

    return break_point(holds, 0.2, 0.6, resolution=SEARCHED, walk=4)


def hardest_push(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest turn [rad/s] from which a hanging bar does not go over the top."""

    def returns(turn: float) -> bool:
        observe = {"angle": engine.Trace(quantity=engine.JointCoordinate("pin"))}
        hanging = scene(LENGTHS[0], 0.0)
        pushed = tuple(
            replace(bar, velocity=(-0.5 * LENGTHS[0] * turn, 0.0, 0.0), angular_velocity=(0.0, turn, 0.0))
            for bar in hanging.bodies
            if isinstance(bar, engine.RigidBody)
        )
        built = replace(hanging, bodies=pushed)
        result = simulate(built, time_step=TIME_STEP, duration=5.0, method=ORDER_4, observe=observe)
        return result.completed and float(np.abs(result["angle"]).max()) < math.pi

    return break_point(returns, RATE, 4.2 * RATE, resolution=SEARCHED, walk=4)


def _draw(simulate: case.Simulate) -> case.Drawing:
    longer = tuple(float(length) for length in np.linspace(0.46, 0.69, 8))
    return case.Drawing(
        curves=(
            line("simulated, from 12°", longer, (period(simulate, length, 12.0) for length in longer)),
            line("by video", LENGTHS, BY_VIDEO, "points"),
            line("by telephone", LENGTHS, BY_TELEPHONE, "points"),
        ),
        x_label="length [m]",
        y_label="period [s]",
    )


TEST = readings.measured_test(
    SOURCE,
    ", by video and by telephone, five times each; half of what the two clocks differ by is the standard deviation of their mean.",
    READINGS,
    "s",
    (
        ("bars", "0.48 to 0.672 m long, uniform, 8 mm thick"),
        ("gravity", "9.81 m/s²"),
        ("time step", "1/240 s, 20 s"),
    ),
    measure,
    readings.against_theory(1e-8, "fourth order in h; zeros by straight lines between samples"),
    configuration="order 4",
    time_step=TIME_STEP,
    note="five lengths, each from its own angle",
    title="Bar pendulum, measured",
    question="Do bars of toy bricks swing as slowly as two kinds of clock have it?",
    why="A period joins gravity, inertia, a hinge and the clock. Nothing was fitted: a ruler is all that goes in.",
    model="Bars of 50 to 70 bricks hang by their end and are let go some ten degrees from the vertical.",
    theory=(
        "T = 4 √(J/(m g l/2)) K(sin(φ₀/2)), J = m (l² + d²)/12 + m l²/4: √(2 l/(3 g)) 2π for a thin bar and small swings.",
        "Left out: air, the pin's friction, studs and the telephone's own weight, and that the pin is not quite at the end.",
    ),
    conclusion="Green: a hinged body swings as a real one does. Red: gravity, inertia or the clock is wrong.",
    example=lambda: case.Example(scene=scene(LENGTHS[0], STARTS[0]), time_step=TIME_STEP, method=ORDER_4),
    figures=(case.Figure(name="period", title="Period against length", draw=_draw),),
    ladders=readings.ladder(
        ladder_error,
        (1.0 / n for n in (60, 120, 240, 480, 960)),
        2.0,
        better="order 4",
        method=ORDER_4,
        order_range=(1 / 960, 1 / 240),
        name="period",
        description="relative error of the period against the elliptic integral",
        unit="1",
        target_error=1e-6,
    ),
    stability=(
        *readings.breaks_at(
            2.0 / RATE,
            SEARCHED,
            longest_step,
            "h ω = 2 of a small swing, where symplectic Euler's eigenvalues leave the circle and a swing grows by two starts a step",
            name="longest-step",
            title="Longest time step of a small swing",
            definition="400 steps without a two-hundredfold or larger swing",
            unit="s",
        ),
        *readings.breaks_at(
            2.0 * RATE,
            SEARCHED,
            hardest_push,
            "½ J φ'² = m g l at twice the rate of a small swing",
            configuration="order 4",
            name="hardest-push",
            title="Fastest turn from which a hanging bar does not go over the top",
            definition="it never comes by half a turn within 5 s",
            unit="rad/s",
        ),
    ),
)

"""Does a pendulum of Kater's length beat seconds under the gravity of today's gravimeters?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine

from .. import case, readings
from ..bracket import break_point
from ..readings import Reading, deviation
from ..sweep import line

INCH = 0.0254  # m
LENGTH = 39.13929 * INCH  # m
FARTHEST = 0.00028 * INCH  # m, of a trial from the mean of twelve
GRAVITY = (
    9.8119629 - 140e-6
)  # m/s²: 981 196.29 mGal at Teddington on the Potsdam system, which is 14.0 mGal too high
NEARBY = 1e-4  # m/s²: what Teddington and London may differ by, 15 km, 0.1° and some metres apart
SWING = 1e-3  # rad: Kater's figure is for no swing at all; this one takes 6e-8 longer
ORDER_4 = engine.Method(composition="order4")
TIME_STEP = 1.0 / 120.0  # s
DURATION = 40.0  # s
SOURCE = (
    "Kater, Phil. Trans. 108 (1818) 33, with its later correction; gravity: Proc. R. Soc. A 213 (1952) 408"
)
BEAT = math.pi * math.sqrt(LENGTH / GRAVITY) * (1.0 + SWING**2 / 16.0)  # s
READINGS = (
    Reading(
        at="a beat", value=1.0, sigma=0.5 * math.hypot(FARTHEST / LENGTH, NEARBY / GRAVITY)
    ),  # s of mean solar time
)
STEPS = 400  # of a search; at h ω = 2 a swing has grown two times that
SEARCHED = 2e-3


def scene(swing: float = SWING) -> engine.Scene:
    """A bob on a rod without weight, let go `swing` [rad] from the vertical."""
    bob = engine.Particle(
        name="bob", mass=1.0, position=(LENGTH * math.sin(swing), 0.0, -LENGTH * math.cos(swing))
    )
    rod = engine.Distance(name="rod", between=((0.0, 0.0, 0.0), "bob"), compliance=0.0)
    return engine.Scene(bodies=(bob,), constraints=(rod,), gravity=(0.0, 0.0, -GRAVITY))


def beat(simulate: case.Simulate, time_step: float = TIME_STEP, method: engine.Method = ORDER_4) -> float:
    """Mean time [s] from one passage of the lowest place to the next."""
    observe = {"place": engine.Trace(quantity=engine.Position("bob"))}
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    times, x = result.sample_times["place"], result["place"][:, 0]
    place = np.nonzero((x[:-1] > 0.0) != (x[1:] > 0.0))[0]
    zero = times[place] - x[place] * time_step / (x[place + 1] - x[place])
    return float(zero[-1] - zero[0]) / (len(zero) - 1) if len(zero) > 1 else math.nan


def measure(simulate: case.Simulate) -> dict[str, float]:
    """The beat against a second, and against the closed form."""
    found = beat(simulate)
    return {"deviation": deviation((found,), READINGS), "theory_error": abs(found / BEAT - 1.0)}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the beat."""
    return beat(simulate, time_step, method) / BEAT - 1.0


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] with which a pendulum that hardly swings goes on hardly swinging."""

    def holds(time_step: float) -> bool:
        observe = {"place": engine.Trace(quantity=engine.Position("bob"))}
        result = simulate(scene(1e-5), time_step=time_step, steps=STEPS, observe=observe)
        return result.completed and float(np.abs(result["place"][:, 0]).max()) < 1e-3 * LENGTH

    return break_point(holds, 0.3, 1.2, resolution=SEARCHED, walk=4)


def hardest_push(simulate: case.Simulate) -> case.BreakPoint:
    """The greatest speed [m/s] from which the hanging bob does not go over the top."""

    def returns(speed: float) -> bool:
        observe = {"place": engine.Trace(quantity=engine.Position("bob"))}
        hanging = scene(0.0)
        built = replace(hanging, bodies=(replace(hanging.bodies[0], velocity=(speed, 0.0, 0.0)),))
        result = simulate(built, time_step=TIME_STEP, duration=8.0, method=ORDER_4, observe=observe)
        angle = np.unwrap(np.arctan2(result["place"][:, 0], -result["place"][:, 2]))
        return result.completed and float(np.abs(angle).max()) < math.pi

    return break_point(returns, 2.0, 14.0, resolution=SEARCHED, walk=4)


def _draw(simulate: case.Simulate) -> case.Drawing:
    steps = tuple(1.0 / n for n in (30, 60, 120, 240))
    off = tuple(abs(beat(simulate, h, engine.PLAIN) - 1.0) for h in steps)
    return case.Drawing(
        curves=(
            line("plain SPOOK, against a second", steps, off, "both"),
            line("standard deviation", steps, (READINGS[0].sigma,) * len(steps), "reference"),
        ),
        x_label="time step [s]",
        y_label="off [s]",
        x_scale="log",
        y_scale="log",
        note=readings.distance(measure(simulate)["deviation"]),
    )


TEST = readings.measured_test(
    SOURCE,
    " (981 196.29 mGal on the Potsdam system, less its 14.0 mGal).",
    READINGS,
    "s",
    (
        ("length", "39.13929 in; trials at most 0.00028 in from their mean"),
        ("gravity", "9.811823 m/s² at Teddington; London within 1e-4"),
        ("swing", "0.001 rad"),
        ("time step", "1/120 s, 40 s"),
    ),
    measure,
    readings.against_theory(
        1e-9, "fourth order in h: 2e-11 are left; zeros by straight lines between samples"
    ),
    configuration="order 4",
    time_step=TIME_STEP,
    note="40 beats",
    title="Seconds pendulum, measured",
    question="Does a pendulum of Kater's length beat seconds under the gravity of today's gravimeters?",
    why="Two measurements 134 years apart, one with a ruler and one without, meet in a single period, to six digits.",
    model="A bob on a rod of 39.13929 inches, the length that beat seconds in London, swings by a thousandth of a radian.",
    theory=(
        "A beat is π √(l/g) (1 + φ₀²/16).",
        "σ = ½ √((0.00028/39.139)² + (1e-4/9.81)²) s: what Kater's trials differ by, and gravity between the two places.",
        "Left out: air and its drag, the knife edges, the height above the sea: the length is corrected for them by Kater.",
    ),
    conclusion="Green: the engine's second, metre and gravity are those of the world. Red: the pendulum runs fast or slow.",
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, method=ORDER_4),
    figures=(case.Figure(name="beat", title="How far a beat is from a second", draw=_draw),),
    ladders=readings.ladder(
        ladder_error,
        (1.0 / n for n in (30, 60, 120, 240, 480)),
        2.0,
        better="order 4",
        method=ORDER_4,
        name="beat",
        description="relative error of the beat against π √(l/g)",
        unit="1",
        target_error=1e-5,
    ),
    stability=(
        *readings.breaks_at(
            2.0 * math.sqrt(LENGTH / GRAVITY),
            SEARCHED,
            longest_step,
            "h ω = 2 of a small swing, where symplectic Euler's eigenvalues leave the circle",
            name="longest-step",
            title="Longest time step of a small swing",
            definition="400 steps without a hundredfold swing",
            unit="s",
        ),
        *readings.breaks_at(
            2.0 * math.sqrt(GRAVITY * LENGTH),
            SEARCHED,
            hardest_push,
            "½ v² = 2 g l",
            configuration="order 4",
            name="hardest-push",
            title="Greatest speed from which the hanging bob does not go over the top",
            definition="it never comes by half a turn within 8 s",
            unit="m/s",
        ),
    ),
)

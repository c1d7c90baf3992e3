"""Does a ball roll down a slope past Galileo's frets, beat by beat?"""

from __future__ import annotations

import math

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case, readings
from ..bracket import break_point
from ..readings import Reading, deviation
from ..sweep import line

GRAVITY = 9.81  # m/s²
SLOPE = math.radians(1.7)
BEAT = 0.55  # s
POINT = 0.94e-3  # m, Galileo's unit
FRICTION, RADIUS, MASS = 0.3, 0.02, 0.3  # 1, m, kg: none of them matters while the ball rolls
HALF_STEP = engine.Method(half_step_velocities=True)
TIME_STEP = BEAT / 20.0  # s
BEATS = 8
FRETS = (33, 130, 298, 526, 824, 1192, 1620, 2123)  # points from where the ball is let go
EAR = 1.0 / 64.0  # s: how well beats are heard, by Drake
SOURCE = "Galileo, Ms. Gal. 72, folio 107 verso (about 1604), deciphered by Drake"
READINGS = tuple(
    Reading(
        at=f"beat {n} over beat {BEATS}",
        value=fret / FRETS[-1],
        sigma=2.0 * fret / FRETS[-1] * EAR / BEAT * math.hypot(1.0 / n, 1.0 / BEATS),
    )
    for n, fret in enumerate(FRETS[:-1], 1)
)
PULL = 5.0 / 7.0 * GRAVITY * math.sin(SLOPE)  # m/s², of a ball that rolls
SEARCHED = 2e-3
SAME = 1e-13  # of the largest impulse: so well balanced, the velocities of the step before are the answer
LADDER_DURATION = BEAT * BEATS  # s


def scene(slope: float = SLOPE) -> engine.Scene:
    """A ball at rest on a plane under gravity tilted by `slope` [rad] towards +x."""
    rough = Material(friction=FRICTION)
    ramp = engine.RigidBody(
        name="ramp", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    ball = engine.RigidBody(
        name="ball", mass=MASS, shape=engine.Sphere(RADIUS), position=(0.0, 0.0, RADIUS), material=rough
    )
    return engine.Scene(
        bodies=(ramp, ball), gravity=(GRAVITY * math.sin(slope), 0.0, -GRAVITY * math.cos(slope))
    )


def rolled(simulate: case.Simulate) -> tuple[float, ...]:
    """Distance [m] at each beat."""
    observe = {"place": engine.Trace(quantity=engine.Position("ball"), every=round(BEAT / TIME_STEP))}
    steps = round(BEATS * BEAT / TIME_STEP)
    result = simulate(scene(), time_step=TIME_STEP, steps=steps, method=HALF_STEP, observe=observe)
    return tuple(map(float, result["place"][1:, 0]))


def measure(simulate: case.Simulate) -> dict[str, float]:
    """Distances over the last one, against Galileo's and against ½ a t²."""
    found = rolled(simulate)
    right = [0.5 * PULL * (n * BEAT) ** 2 for n in range(1, BEATS + 1)]
    return {
        "deviation": deviation((one / found[-1] for one in found[:-1]), READINGS),
        "theory_error": max(abs(a / b - 1.0) for a, b in zip(found, right, strict=True)),
        "last_fret": found[-1] / POINT / FRETS[-1] - 1.0,
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Distance after eight beats minus ½ a t² [m]."""
    observe = {"place": engine.Final(quantity=engine.Position("ball"), from_start=True)}
    result = simulate(scene(), time_step=time_step, duration=LADDER_DURATION, method=method, observe=observe)
    return float(result["place"][0]) - 0.5 * PULL * LADDER_DURATION**2


def steepest_rolled(simulate: case.Simulate) -> case.BreakPoint:
    """Steepest slope (its tangent) down which the ball rolls without slip."""

    def rolls(tangent: float) -> bool:
        observe = {
            "v": engine.Final(quantity=engine.Velocity("ball")),
            "w": engine.Final(quantity=engine.AngularVelocity("ball")),
        }
        result = simulate(scene(math.atan(tangent)), time_step=TIME_STEP, steps=40, observe=observe)
        speed = float(result["v"][0])
        return abs(speed - RADIUS * float(result["w"][1])) <= 1e-9 * speed

    return break_point(rolls, 0.1, 4.0, resolution=SEARCHED, walk=6)


GENTLEST = 7.0 / 5.0 * SAME  # rad: less changes an impulse of m g h by 5/7 of the slope


def gentlest(simulate: case.Simulate) -> case.BreakPoint:
    """The gentlest slope [rad] down which the ball rolls as it must."""

    def rolls(slope: float) -> bool:
        observe = {"place": engine.Final(quantity=engine.Position("ball"))}
        result = simulate(scene(slope), time_step=TIME_STEP, steps=40, method=HALF_STEP, observe=observe)
        way = 0.5 * 5.0 / 7.0 * GRAVITY * math.sin(slope) * (40.0 * TIME_STEP) ** 2
        return result.completed and abs(float(result["place"][0]) / way - 1.0) < 1e-9

    return break_point(rolls, SLOPE, 1e-16, resolution=1e-3, walk=8)


def _draw(simulate: case.Simulate) -> case.Drawing:
    beats = tuple(float(n) for n in range(1, BEATS + 1))
    found = rolled(simulate)
    return case.Drawing(
        curves=(
            line("simulated", beats, (one / POINT for one in found)),
            line("Galileo's frets", beats, FRETS, "points"),
        ),
        x_label="beat",
        y_label="distance [points of 0.94 mm]",
    )


TEST = readings.measured_test(
    SOURCE,
    ": 33, 130, 298, 526, 824, 1192, 1620, 2123 points.",
    READINGS,
    "",
    (
        ("slope", "1.7°"),
        ("beat", "0.55 s, as Drake has it; ratios do not depend on it"),
        ("friction coefficient", "0.3: it rolls"),
        ("time step", "1/20 beat"),
    ),
    measure,
    readings.against_theory(1e-12, "a steady pull is exact with velocities at mid-step; rounding", "gate"),
    case.Metric(
        name="last_fret",
        description="distance at the eighth beat over the last fret, less 1, with Drake's slope and beat, each known to 2 or 3 %",
        unit="1",
        role="reported",
        tolerance=1e-9,
    ),
    configuration="half-step",
    time_step=TIME_STEP,
    note="velocities live at mid-step",
    title="Galileo's slope, measured",
    question="Does a ball roll down a slope past Galileo's frets, beat by beat?",
    why="The first measurement of an accelerated motion there is; what it found, t², is what every step of ours adds up.",
    model="A ball rolls from rest down a slope of 1.7°; where it is at eight equal beats is compared with eight frets.",
    theory=(
        "x = ½ (5/7) g sin θ t² of a solid ball that rolls; over the last distance (n/8)², whatever slope, beat and ball.",
        "σ: an ear is 1/64 s off (Drake), at this fret and at the last: 2 (1/64 s)/(n · 0.55 s) of the distance.",
        "Left out: the groove, rolling friction, and the knock of the frets.",
    ),
    conclusion="Green: a rolling ball is as far after each beat as the first one measured. Red: motion is not t², or not rolling.",
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, method=HALF_STEP),
    figures=(case.Figure(name="frets", title="Distance at each beat", draw=_draw),),
    ladders=readings.ladder(
        ladder_error,
        (BEAT / n for n in (10, 20, 40, 80, 160)),
        1.0,
        better="half-step",
        method=HALF_STEP,
        name="distance",
        description="distance after eight beats against ½ a t²",
        unit="m",
        target_error=0.01,
    ),
    stability=(
        *readings.breaks_at(
            3.5 * FRICTION,
            SEARCHED,
            steepest_rolled,
            "tan θ = 3.5 µ of a solid ball",
            name="steepest-rolled",
            title="Steepest slope down which the ball rolls",
            definition="speed and spin agree to 1e-9 after 40 steps",
            unit="1",
        ),
        case.StabilityStudy(
            name="gentlest",
            title="Gentlest slope down which the ball rolls",
            configuration="half-step",
            definition="way after 40 steps right to 1e-9",
            study=gentlest,
            unit="rad",
            better="smaller",
            expected=(GENTLEST, 1.002 * GENTLEST),
            expected_source="the method's own: velocities are kept that leave 1e-13 of the largest impulse; a step asks for 5/7 sin θ of "
            "it. The search ends within a thousandth",
        ),
    ),
)

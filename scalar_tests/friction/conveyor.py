"""Does a conveyor take a box along as Coulomb's law says, and how steep may it climb?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 10.0  # m/s²
FRICTION = 0.4
BELT = 1.0  # m/s
MASS = 2.0  # kg
EDGE = (0.4, 0.4, 0.1)  # m
TIME_STEP = 1.0 / 60.0  # s
DURATION = 1.0  # s
AWAY = math.radians(35.0)  # the belt's direction from x
TAKEN = BELT / (FRICTION * GRAVITY)  # s
LAG = 0.5 * BELT**2 / (FRICTION * GRAVITY)  # m
CLIMB = 0.2  # tan of the slope of the climbing belt


def scene(slope: float = 0.0, away: float = AWAY) -> engine.Scene:
    """A box laid at rest on a belt; gravity is tilted by atan(slope) against the belt's way."""
    rough = engine.Material(friction=FRICTION)
    way = (math.cos(away), math.sin(away))
    belt = engine.RigidBody(
        name="belt",
        motion="static",
        shape=engine.Plane(),
        position=(0.0, 0.0, 0.0),
        material=rough,
        surface_velocity=(BELT * way[0], BELT * way[1], 0.0),
    )
    box = engine.RigidBody(
        name="box", mass=MASS, shape=engine.Box(EDGE), position=(0.0, 0.0, 0.5 * EDGE[2]), material=rough
    )
    tilt = math.atan(slope)
    down = -GRAVITY * math.sin(tilt)
    return engine.Scene(bodies=(belt, box), gravity=(down * way[0], down * way[1], -GRAVITY * math.cos(tilt)))


def gain(slope: float) -> float:
    """How fast the belt speeds a box up along its way, m/s²."""
    tilt = math.atan(slope)
    return GRAVITY * (FRICTION * math.cos(tilt) - math.sin(tilt))


def ride(simulate: case.Simulate, slope: float) -> dict[str, float]:
    """Speeds along and across the belt, against the recursion of one step, and the force that is left."""
    observe = {
        "v": engine.Trace(quantity=engine.Velocity("box")),
        "force": engine.Final(quantity=engine.ContactForce("box", "belt")),
    }
    result = simulate(scene(slope), time_step=TIME_STEP, duration=DURATION, observe=observe)
    along = result["v"][:, 0] * math.cos(AWAY) + result["v"][:, 1] * math.sin(AWAY)
    across = result["v"][:, 1] * math.cos(AWAY) - result["v"][:, 0] * math.sin(AWAY)
    exact = np.minimum(BELT, gain(slope) * TIME_STEP * np.arange(len(along)))
    held = MASS * GRAVITY * math.sin(math.atan(slope))
    push = result["force"][0] * math.cos(AWAY) + result["force"][1] * math.sin(AWAY)
    return {
        "speed_error": float(np.abs(along - exact).max()),
        "sideways": float(np.abs(across).max()),
        "force_error": float(push) - held,
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """How far the box stays behind the belt, against v²/(2 µ g) [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("box"))}
    result = simulate(scene(), time_step=time_step, duration=0.5, method=method, observe=observe)
    way = float(result["x"][0]) * math.cos(AWAY) + float(result["x"][1]) * math.sin(AWAY)
    return (BELT * 0.5 - way) - LAG


def climbs(simulate: case.Simulate, slope: float) -> bool:
    """Whether the belt carries the box up after half a second."""
    observe = {"v": engine.Final(quantity=engine.Velocity("box"))}
    result = simulate(scene(slope, 0.0), time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and float(result["v"][0]) > 0.0


def steepest(simulate: case.Simulate) -> case.BreakPoint:
    """The steepest slope that is climbed, walking from a fifth of µ to three times µ."""
    return break_point(lambda slope: climbs(simulate, slope), 0.2 * FRICTION, 3.0 * FRICTION, resolution=1e-3)


def taken_along(simulate: case.Simulate, speed: float) -> bool:
    """Whether a belt of that speed [m/s] gives the box µ g, no more, in ten steps."""
    observe = {"v": engine.Final(quantity=engine.Velocity("box"))}
    asked = scene(away=0.0)
    faster = tuple(
        replace(body, surface_velocity=(speed, 0.0, 0.0)) if body.name == "belt" else body
        for body in asked.bodies
        if isinstance(body, engine.RigidBody)
    )
    result = simulate(replace(asked, bodies=faster), time_step=TIME_STEP, steps=10, observe=observe)
    return result.completed and abs(float(result["v"][0]) / (10.0 * TIME_STEP * gain(0.0)) - 1.0) < 1e-9


def draw(simulate: case.Simulate) -> case.Drawing:
    """Speed along the belt against time, level and climbing."""
    curves, apart = [], 0.0
    for slope in (0.0, CLIMB):
        observe = {"v": engine.Trace(quantity=engine.Velocity("box"))}
        result = simulate(scene(slope, 0.0), time_step=TIME_STEP, duration=DURATION, observe=observe)
        time, along = result.sample_times["v"], result["v"][:, 0]
        exact = np.minimum(BELT, gain(slope) * time)
        apart = max(apart, float(np.abs(along - exact).max()))
        curves += [
            line(f"tan θ = {slope:g}", time, along, "points"),
            line(f"closed form, tan θ = {slope:g}", time, exact, "reference"),
        ]
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="speed along the belt [m/s]",
        note=f"The runs are at most {told(apart)} m/s off the closed form.",
    )


ROUNDED = "constant friction is exact in a step; the solver stops at 1e-10 of the load"

TEST = case.ScalarTest(
    title="Conveyor",
    question="Does a conveyor take a box along as Coulomb's law says, in any direction and uphill?",
    why="Belts sort and move most of what factories make. A surface that moves along itself is friction against a "
    "slip that is not the body's own.",
    model="A box of 2 kg is laid at rest on a belt that runs at 1 m/s, 35° from x, level and up a slope of tan θ = 0.2.",
    parameters=(
        ("time step", "1/60 s"),
        ("box", "0.4 × 0.4 × 0.1 m, 2 kg"),
        ("belt", "1 m/s, µ = 0.4"),
        ("gravity", "10 m/s²"),
    ),
    theory=(
        "While it slips, v = (µ cos θ − sin θ) g t; the belt's speed is reached after v_b/(µ g) = 0.25 s on the level.",
        "Friction is constant until then, so each step's speed is exact. Then it holds m g sin θ, no more.",
        "The box stays v_b²/(2 µ g) behind the belt; summed at the ends of steps it is v_b h/2 less.",
        "Beyond tan θ = µ no belt carries anything up.",
    ),
    reference="Closed forms.",
    conclusion="Green: friction acts against the slip on the moving surface, and lets go of what moves with it. Red: the "
    "surface's speed is lost, turned, or still felt when nothing slips.",
    source="ours; a wish of the thesis, section 5.4 (vehicles and robots need belts)",
    measurements=(
        ask(
            lambda simulate: ride(simulate, 0.0),
            (
                error(
                    "speed_error",
                    "largest difference of the speed along the belt to min(v_b, µ g t)",
                    "m/s",
                    1e-9,
                    ROUNDED,
                ),
                error("sideways", "largest speed across the belt", "m/s", 1e-9, ROUNDED, "companion"),
                error(
                    "force_error",
                    "friction that is left once the box moves along",
                    "N",
                    1e-7,
                    ROUNDED,
                    "companion",
                ),
            ),
            "level, 35° from x",
            TIME_STEP,
        ),
        ask(
            lambda simulate: ride(simulate, CLIMB),
            (
                error(
                    "speed_error",
                    "largest difference of the speed uphill to its closed form",
                    "m/s",
                    1e-9,
                    ROUNDED,
                ),
                error("sideways", "largest speed across the belt", "m/s", 1e-9, ROUNDED, "companion"),
                error("force_error", "friction at the end less m g sin θ", "N", 1e-7, ROUNDED, "companion"),
            ),
            "uphill, tan θ = 0.2",
            TIME_STEP,
            "uphill",
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, duration=DURATION),
    stability=(
        case.StabilityStudy(
            name="slope",
            title="Steepest belt that carries a box up",
            configuration="plain",
            definition="after half a second the box moves uphill",
            study=steepest,
            unit="1",
            expected=(0.998 * FRICTION, FRICTION),
            expected_source="tan θ = µ, to the resolution of the search",
        ),
        unbroken(
            taken_along,
            BELT,
            1e6,
            name="fastest",
            title="Fastest belt that takes a box along by µ g",
            definition="the box's speed after ten steps is µ g t to 1e-9",
            source="Coulomb's friction knows no speed",
            unit="m/s",
        ),
    ),
    figures=(case.Figure(name="speed", title="Speed against time", draw=draw),),
    ladders=(
        case.Ladder(
            name="lag",
            description="way the box stays behind the belt, against v²/(2 µ g)",
            unit="m",
            time_steps=tuple(1.0 / n for n in (20, 40, 80, 160, 320)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=0.01,
            target_seconds=0.01,
        ),
    ),
)

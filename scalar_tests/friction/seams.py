"""Does what slides or rolls over a surface of triangles feel the seams between them?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line

GRAVITY = 9.81  # m/s²
FRICTION = 0.3
CELL, CELLS = 0.23, 16  # m: the corners and sides of the triangles lie askew to every way taken
TIME_STEP = 1.0 / 60.0  # s
STEPS = 60
SPEED = (2.1, 0.9)  # m/s, of the box
RADIUS = 0.1  # m, of the ball
SLOPE = 0.2  # tan θ: the ball rolls, as tan θ < 3.5 µ
TILT = math.atan(SLOPE)
LONGEST = 1.2  # s, where the search for the longest step ends: 11 cells further is the end of the floor
PLACE = (0.5, 0.4)  # m, of both at the start


def floor(friction: float, slope: float) -> engine.RigidBody:
    """A plane of 512 triangles that falls towards +x."""
    rows = tuple(tuple(-slope * CELL * i for _ in range(CELLS + 1)) for i in range(CELLS + 1))
    return engine.RigidBody(
        name="floor",
        motion="static",
        shape=engine.HeightField((CELL, CELL), rows),
        position=(0, 0, 0),
        material=engine.Material(friction=friction),
    )


@functools.cache
def sliding(friction: float) -> engine.Scene:
    """A box that slides over the level floor."""
    box = engine.RigidBody(
        name="body",
        mass=2.0,
        shape=engine.Box((0.3, 0.2, 0.1)),
        position=(*PLACE, 0.05),
        velocity=(*SPEED, 0.0),
        material=engine.Material(friction=friction),
    )
    return engine.Scene(bodies=(floor(friction, 0.0), box), gravity=(0.0, 0.0, -GRAVITY))


@functools.cache
def rolling() -> engine.Scene:
    """A ball let go on the slope."""
    c, s = math.cos(TILT), math.sin(TILT)
    ball = engine.RigidBody(
        name="body",
        mass=2.0,
        shape=engine.Sphere(RADIUS),
        position=(PLACE[0] + RADIUS * s, PLACE[1], -SLOPE * PLACE[0] + RADIUS * c),
        material=engine.Material(friction=FRICTION),
    )
    return engine.Scene(bodies=(floor(FRICTION, SLOPE), ball), gravity=(0.0, 0.0, -GRAVITY))


def measure(simulate: case.Simulate) -> dict[str, float]:
    """A second each: without friction, with it, and rolling."""
    observe = {"v": engine.Trace(quantity=engine.Velocity("body"))}
    smooth, rough, ball = (
        simulate(scene, time_step=TIME_STEP, steps=STEPS, observe=observe)["v"]
        for scene in (sliding(0.0), sliding(0.05), rolling())
    )
    start, whole = math.hypot(*SPEED), STEPS * TIME_STEP
    along = np.array((math.cos(TILT), 0.0, -math.sin(TILT)))
    reached = 5.0 / 7.0 * GRAVITY * math.sin(TILT) * whole
    slowed = (1.0 - 0.05 * GRAVITY * whole / start) * np.array((*SPEED, 0.0))
    return {
        "smooth_error": float(np.abs(smooth - (*SPEED, 0.0)).max()) / start,
        "rough_error": float(np.abs(rough[-1] - slowed).max()) / start,
        "rolling_error": float(np.abs(ball[-1] - reached * along).max()) / reached,
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Where the ball is after a second, less ½ a t² [m]: of first order, as everywhere."""
    observe = {"x": engine.Final(quantity=engine.Position("body"), from_start=True)}
    x = simulate(rolling(), time_step=time_step, duration=1.0, method=method, observe=observe)["x"]
    return math.hypot(float(x[0]), float(x[2])) - 2.5 / 7.0 * GRAVITY * math.sin(TILT)


def rolls(simulate: case.Simulate, slope: float) -> bool:
    """Whether the ball rolls down triangles so steep (tan θ) without slip, for half a second."""
    tilt = math.atan(slope)
    place = (PLACE[0] + RADIUS * math.sin(tilt), PLACE[1], -slope * PLACE[0] + RADIUS * math.cos(tilt))
    ball = replace(rolling().bodies[1], position=place)
    built = replace(rolling(), bodies=(floor(FRICTION, slope), ball))
    observe = {
        "v": engine.Final(quantity=engine.Velocity("body")),
        "w": engine.Final(quantity=engine.AngularVelocity("body")),
    }
    result = simulate(built, time_step=TIME_STEP, duration=0.5, observe=observe)
    speed = math.hypot(*map(float, result["v"]))
    return result.completed and abs(speed - RADIUS * float(result["w"][1])) < 1e-9 * speed


def crosses(simulate: case.Simulate, time_step: float) -> bool:
    """Whether the box keeps its velocity on the smooth floor in steps so long [s], as far as the floor reaches."""
    observe = {"v": engine.Final(quantity=engine.Velocity("body"))}
    steps = math.floor(LONGEST / time_step)
    result = simulate(sliding(0.0), time_step=time_step, steps=steps, observe=observe)
    return result.completed and float(np.abs(result["v"] - (*SPEED, 0.0)).max()) < 1e-12 * math.hypot(*SPEED)


def steepest(simulate: case.Simulate) -> case.BreakPoint:
    """The steepest slope (its tangent) of triangles down which the ball rolls."""
    return break_point(functools.partial(rolls, simulate), 0.2, 3.0, resolution=1e-3, walk=5)


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which the box feels no seam."""
    return break_point(functools.partial(crosses, simulate), TIME_STEP, LONGEST, walk=5)


def draw(simulate: case.Simulate) -> case.Drawing:
    """The box's speed with and without friction."""
    times = [k * TIME_STEP for k in range(STEPS + 1)]
    curves = []
    for friction in (0.0, 0.05, 0.2):
        observe = {"v": engine.Trace(quantity=engine.Velocity("body"))}
        v = simulate(sliding(friction), time_step=TIME_STEP, steps=STEPS, observe=observe)["v"]
        curves.append(line(f"µ = {friction:g}", times, np.hypot(v[:, 0], v[:, 1]), "points"))
        speeds = [max(0.0, math.hypot(*SPEED) - friction * GRAVITY * t) for t in times]
        curves.append(line(f"v − µ g t, µ = {friction:g}", times, speeds, "reference"))
    return case.Drawing(curves=tuple(curves), x_label="time [s]", y_label="speed of the box [m/s]")


TEST = case.ScalarTest(
    title="Seams",
    question="Does what slides or rolls over a surface of triangles feel the seams between them?",
    why="Floors, roads and terrains are triangles. An engine that meets each triangle alone trips over sides that are "
    "no edges: balls hop, boxes stop and cars shake on a level floor.",
    model="A plane of 512 triangles, fixed. A box slides over it without and with friction; a ball rolls down it.",
    parameters=(
        ("cells", "16 × 16 of 0.23 m, two triangles each"),
        ("box", "0.3 × 0.2 × 0.1 m, 2 kg, at 2.28 m/s across the cells"),
        ("ball", "radius 0.1 m, 2 kg, on a slope of tan θ = 0.2"),
        ("friction coefficient", "0 and 0.05 (box), 0.3 (ball)"),
        ("gravity", "9.81 m/s²"),
        ("time step", "1/60 s, 60 steps"),
    ),
    theory=(
        "In one plane a seam is nothing: without friction the velocity stays, with it v − µ g t.",
        "The ball rolls: a = (5/7) g sin θ.",
    ),
    reference="Newton's law on a plane (closed form).",
    conclusion="Green: inner edges are no obstacles. Red: seams push, stop or lift what passes.",
    source="ours",
    measurements=(
        ask(
            measure,
            (
                error(
                    "smooth_error",
                    "largest change of the box's velocity without friction, over its speed",
                    "1",
                    1e-12,
                ),
                error(
                    "rough_error",
                    "error of its velocity after a second with friction, over its first speed",
                    "1",
                    1e-9,
                    role="companion",
                ),
                error(
                    "rolling_error",
                    "relative error of the ball's velocity after a second",
                    "1",
                    1e-9,
                    role="companion",
                ),
            ),
            "a level floor and a slope",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=rolling(), time_step=TIME_STEP, duration=1.5),
    figures=(case.Figure(name="speed", title="A box over seams", draw=draw),),
    ladders=(
        case.Ladder(
            name="rolled",
            description="distance rolled in a second less ½ a t²",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=configured({"direct": 1.0, "iterative": None}),
            error=ladder_error,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="steepest",
            title="Steepest slope of triangles down which the ball rolls",
            configuration="plain",
            definition="no slip after half a second, to 1e-9 of the speed",
            study=steepest,
            unit="1",
            expected=(0.999 * 3.5 * FRICTION, 3.5 * FRICTION),
            expected_source="rolling takes 2/7 of m g sin θ from friction, at most µ m g cos θ: tan θ = 7/2 µ, as on a plane; to "
            "the resolution of the search",
        ),
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which the box feels no seam",
            configuration="plain",
            definition="its velocity on the smooth floor stays, to 1e-12",
            study=longest_step,
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="in one plane a seam is nothing, whatever the number of them in a step; the search ends at 1.2 s, "
            "eleven cells further, before the floor does",
        ),
    ),
)

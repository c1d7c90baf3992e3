"""Does a coin with rolling friction run down a height field, stop on a level one and stand where it may, as if it were smooth?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine

from .. import case, overlap
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..robots.robot_arm import quaternion
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
RADIUS, THICKNESS, MASS = 0.05, 0.02, 0.3  # m, kg
FRICTION, ROLLING = 0.5, 0.002  # 1, m
SPEED, ASKEW = 0.5, 0.6  # m/s, rad: of its way against the cells
CELLS, ACROSS, ALONG = 21, 0.11, 0.13  # m
SLOPE = 0.1
TIME_STEP = 1.0 / 60.0  # s
LONGEST = 1e3  # s
RATIO = 1.0 / (1.0 + 0.5)  # of what acts, what is left for the way: I = ½ m r²


def acceleration(slope: float) -> float:
    """Down a slope of that tan θ [m/s²]: m a = m g sin θ − F, F r − ρ N = ½ m r² a/r."""
    tilt = math.atan(slope)
    return RATIO * GRAVITY * (math.sin(tilt) - ROLLING / RADIUS * math.cos(tilt))


STOPPED = SPEED / -acceleration(0.0)  # s


@functools.cache
def scene(slope: float = 0.0, askew: float = ASKEW, speed: float = SPEED) -> engine.Scene:
    """A coin on its rim that rolls at an angle to the cells' rows, on a height field that is a plane, level or falling along x."""
    tilt = math.atan(slope)
    normal = np.array((math.sin(tilt), 0.0, math.cos(tilt)))
    way = math.cos(askew) * np.array((math.cos(tilt), 0.0, -math.sin(tilt))) + (0.0, math.sin(askew), 0.0)
    axis = np.cross(normal, way)
    low, aside = -0.3 * ACROSS * CELLS, -0.5 * ALONG * CELLS
    heights = tuple((-slope * (low + ACROSS * i),) * CELLS for i in range(CELLS))
    ground = engine.RigidBody(
        name="ground",
        motion="static",
        shape=engine.HeightField((ACROSS, ALONG), heights),
        position=(low, aside, 0.0),
        material=engine.Material(friction=FRICTION),
    )
    coin = engine.RigidBody(
        name="coin",
        mass=MASS,
        shape=engine.Cylinder(RADIUS, THICKNESS),
        position=_triple(RADIUS * normal),
        orientation=quaternion(np.column_stack([way, normal, axis]) * (1.0, -1.0, 1.0)),
        velocity=_triple(speed * way),
        angular_velocity=_triple(speed / RADIUS * axis),
        material=engine.Material(friction=FRICTION, rolling_friction=ROLLING),
    )
    return engine.Scene(bodies=(ground, coin), gravity=(0.0, 0.0, -GRAVITY))


def _triple(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(one) for one in vector)
    return x, y, z


def gone(slope: float, times: np.ndarray) -> np.ndarray:
    """Speed along its way [m/s]."""
    return np.maximum(0.0, SPEED + acceleration(slope) * times)


def rolls(simulate: case.Simulate, slope: float, askew: float, duration: float) -> dict[str, float]:
    """Its speed along and across its way."""
    observe = {
        "v": engine.Trace(quantity=engine.Velocity("coin")),
        "deep": engine.MaximumAbsolute(quantity=engine.Penetration()),
    }
    asked = scene(slope, askew)
    result = simulate(asked, time_step=TIME_STEP, duration=duration, observe=observe)
    way = result["v"][0] / SPEED
    along = result["v"] @ way
    return {
        "speed_error": float(np.abs(along - gone(slope, result.sample_times["v"])).max()),
        "sideways": float(np.abs(result["v"] - np.outer(along, way)).max()),
        "overlap": float(result["deep"]),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Way until it stands against v²/(2 a) [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("coin"), from_start=True)}
    result = simulate(scene(), time_step=time_step, duration=2.0, method=method, observe=observe)
    return float(np.hypot(result["x"][0], result["x"][1])) - 0.5 * SPEED * STOPPED


def stays(simulate: case.Simulate, slope: float) -> bool:
    """Whether a coin put down on the slope still stands after half a second."""
    observe = {"v": engine.Final(quantity=engine.Velocity("coin"))}
    result = simulate(scene(slope, 0.0, 0.0), time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and float(np.abs(result["v"]).max()) < 1e-6


def steepest(simulate: case.Simulate) -> case.BreakPoint:
    """The steepest slope it stands on."""
    top = ROLLING / RADIUS
    return break_point(functools.partial(stays, simulate), 0.2 * top, 5.0 * top, resolution=1e-3, walk=5)


def slows(simulate: case.Simulate, time_step: float) -> bool:
    """Whether it is as fast as it should be in each of three steps so long [s], on the level."""
    observe = {"v": engine.Trace(quantity=engine.Velocity("coin"))}
    result = simulate(scene(), time_step=time_step, steps=3, observe=observe)
    off = np.hypot(result["v"][:, 0], result["v"][:, 1]) - gone(0.0, time_step * np.arange(4))
    return result.completed and float(np.abs(off).max()) < 1e-9


def draw(simulate: case.Simulate) -> case.Drawing:
    """Speed over time, level and down."""
    curves, worst = [], 0.0
    for name, slope, askew in (("level", 0.0, ASKEW), ("down", SLOPE, 0.0)):
        observe = {"v": engine.Trace(quantity=engine.Velocity("coin"))}
        result = simulate(scene(slope, askew), time_step=TIME_STEP, duration=1.0, observe=observe)
        times, speed = result.sample_times["v"], np.linalg.norm(result["v"], axis=1)
        worst = max(worst, float(np.abs(speed - gone(slope, times)).max()))
        curves += [
            line(name, times, speed, "points"),
            line(f"{name}, v + a t", times, gone(slope, times), "reference"),
        ]
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="speed [m/s]",
        note=f"The largest difference is {told(worst)} m/s.",
    )


ROUNDED = "constant torque is exact in a step, and edges between coplanar triangles are none; the solver stops at 1e-10 of the load"
TEST = case.ScalarTest(
    title="Coin on a height field",
    question="Does a coin with rolling friction roll over the triangles of a height field as it would on a plane?",
    why="A wheel on terrain crosses an edge between triangles in every other step. Each one that it feels costs speed, and "
    "rolling friction at four points at once is what solvers take longest for.",
    model="A coin on its rim rolls askew over the cells of a level height field until it stands, and down one that falls.",
    parameters=(
        ("time step", "1/60 s"),
        ("coin", f"{MASS:g} kg, radius {RADIUS:g} m, {THICKNESS:g} m thick"),
        ("friction", f"µ = {FRICTION:g}, ρ = {1e3 * ROLLING:g} mm"),
        ("start", f"{SPEED:g} m/s; {ASKEW:g} rad from the rows of cells, or down a slope of {SLOPE:g}"),
        ("height field", f"cells of {ACROSS:g} × {ALONG:g} m"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "F r − ρ N = ½ m r² a/r and m a = m g sin θ − F: a = (2/3) g (sin θ − (ρ/r) cos θ).",
        "On the level it stands after v²/(2 a). On a slope it stands while tan θ ≤ ρ/r.",
        "Torque and force are constant: each step's speed is exact.",
    ),
    reference="Closed forms.",
    conclusion="Green: edges within the ground are none, and rolling friction is what it says. Red: a coin that is slowed or "
    "lifted by edges, or never stops.",
    source="ours; rolling friction is a wish of the thesis, section 5.4",
    measurements=tuple(
        ask(
            functools.partial(rolls, slope=slope, askew=askew, duration=duration),
            (
                error(
                    "speed_error",
                    "largest difference of the speed to v + a t, then zero",
                    "m/s",
                    1e-9,
                    ROUNDED,
                ),
                error("sideways", "largest speed across", "m/s", 1e-9, ROUNDED, "companion"),
                error("overlap", "deepest overlap", "m", 1e-9, "contacts are rigid", "companion"),
            ),
            note,
            TIME_STEP,
            configuration,
        )
        for configuration, slope, askew, duration, note in (
            ("plain", 0.0, ASKEW, 1.5 * STOPPED, "level, until it stands"),
            ("down", SLOPE, 0.0, 1.0, "down a slope"),
        )
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, duration=1.5 * STOPPED),
    figures=(case.Figure(name="speed", title="Speed over time", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="slope",
            title="Steepest slope on which a coin stands on its rim",
            configuration="plain",
            definition="put down at rest, it moves slower than 1e-6 m/s after half a second",
            study=steepest,
            unit="1",
            expected=(0.998 * ROLLING / RADIUS, 1.0005 * ROLLING / RADIUS),
            expected_source="tan θ = ρ/r = 0.04; the search ends within a thousandth",
        ),
        unbroken(
            slows,
            TIME_STEP,
            LONGEST,
            name="longest-step",
            title="Longest step in which rolling friction slows it down",
            definition="speed as by a constant torque until there is none, to 1e-9 m/s, in three steps",
            source="a torque's impulse has the factor h, and no more is taken than there is",
            unit="s",
        ),
    ),
    ladders=(
        case.Ladder(
            name="way",
            description="way until it stands, against v²/(2 a)",
            unit="m",
            time_steps=tuple(1.0 / n for n in (32, 64, 128, 256)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=0.004,
            target_seconds=0.01,
        ),
        overlap.ladder(scene, 1.0, of="coin and ground"),
    ),
)

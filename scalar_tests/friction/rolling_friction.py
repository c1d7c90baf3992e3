"""Does a ball with rolling friction stop where it must, stand on the slope it may, and spin down in time?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 10.0  # m/s²
FRICTION = 0.5
ROLLING, TORSIONAL = 0.004, 0.002  # m
RADIUS, MASS = 0.1, 2.0  # m, kg
SPEED, SPIN = 0.5, 6.0  # m/s, rad/s
LONGEST = 1e3  # s, where the search for the longest step ends
TIME_STEP = 1.0 / 60.0  # s
AWAY = math.radians(35.0)  # direction of the ball's way
BRAKE = 5.0 / 7.0 * ROLLING / RADIUS * GRAVITY  # m/s²
SLOWING = TORSIONAL * GRAVITY / (0.4 * RADIUS**2)  # rad/s²
STOPPED = SPEED / BRAKE  # s


def scene(speed: float = SPEED, spin: float = 0.0, slope: float = 0.0) -> engine.Scene:
    """A ball that rolls, or spins on the spot; gravity is tilted by atan(slope) towards the ball's way."""
    way = (math.cos(AWAY), math.sin(AWAY))
    ground = engine.RigidBody(
        name="ground",
        motion="static",
        shape=engine.Plane(),
        position=(0.0, 0.0, 0.0),
        material=engine.Material(friction=FRICTION),
    )
    ball = engine.RigidBody(
        name="ball",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, RADIUS),
        velocity=(speed * way[0], speed * way[1], 0.0),
        angular_velocity=(-speed * way[1] / RADIUS, speed * way[0] / RADIUS, spin),
        material=engine.Material(friction=FRICTION, rolling_friction=ROLLING, torsional_friction=TORSIONAL),
    )
    tilt = math.atan(slope)
    pull = GRAVITY * math.sin(tilt)
    return engine.Scene(
        bodies=(ground, ball), gravity=(pull * way[0], pull * way[1], -GRAVITY * math.cos(tilt))
    )


def roll(simulate: case.Simulate) -> dict[str, float]:
    """A ball that rolls until it stands."""
    observe = {"v": engine.Trace(quantity=engine.Velocity("ball"))}
    result = simulate(scene(), time_step=TIME_STEP, duration=1.5 * STOPPED, observe=observe)
    along = result["v"][:, 0] * math.cos(AWAY) + result["v"][:, 1] * math.sin(AWAY)
    across = result["v"][:, 1] * math.cos(AWAY) - result["v"][:, 0] * math.sin(AWAY)
    exact = np.maximum(0.0, SPEED - BRAKE * TIME_STEP * np.arange(len(along)))
    return {"speed_error": float(np.abs(along - exact).max()), "sideways": float(np.abs(across).max())}


def turn(simulate: case.Simulate) -> dict[str, float]:
    """A ball that spins on the spot until it stands."""
    observe = {
        "w": engine.Trace(quantity=engine.AngularVelocity("ball")),
        "x": engine.Final(quantity=engine.Position("ball")),
    }
    result = simulate(scene(0.0, SPIN), time_step=TIME_STEP, duration=2.0, observe=observe)
    exact = np.maximum(0.0, SPIN - SLOWING * TIME_STEP * np.arange(len(result["w"])))
    return {
        "spin_error": float(np.abs(result["w"][:, 2] - exact).max()),
        "walked": float(np.hypot(result["x"][0], result["x"][1])),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Way until it stands against v²/(2 a) [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("ball"))}
    result = simulate(scene(), time_step=time_step, duration=2.0, method=method, observe=observe)
    return float(np.hypot(result["x"][0], result["x"][1])) - 0.5 * SPEED**2 / BRAKE


def stands(simulate: case.Simulate, slope: float) -> bool:
    """Whether a ball put down on the slope still stands after a second."""
    observe = {"v": engine.Final(quantity=engine.Velocity("ball"))}
    result = simulate(scene(0.0, 0.0, slope), time_step=TIME_STEP, steps=60, observe=observe)
    return result.completed and float(np.abs(result["v"]).max()) < 1e-6


def steepest(simulate: case.Simulate) -> case.BreakPoint:
    """The steepest slope it stands on."""
    top = ROLLING / RADIUS
    return break_point(lambda slope: stands(simulate, slope), 0.2 * top, 5.0 * top, resolution=1e-3)


def slows(simulate: case.Simulate, time_step: float) -> bool:
    """Whether a ball loses its speed by (5/7) ρ g t/r, and spins no more, in three steps so long [s]."""
    observe = {
        "v": engine.Trace(quantity=engine.Velocity("ball")),
        "w": engine.Trace(quantity=engine.AngularVelocity("ball")),
    }
    result = simulate(scene(spin=SPIN), time_step=time_step, steps=3, observe=observe)
    times = time_step * np.arange(4)
    slow = np.hypot(result["v"][:, 0], result["v"][:, 1]) - np.maximum(0.0, SPEED - BRAKE * times)
    spun = RADIUS * (result["w"][:, 2] - np.maximum(0.0, SPIN - SLOWING * times))
    return result.completed and float(np.abs((slow, spun)).max()) < 1e-9


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which it slows down as it should."""
    return break_point(functools.partial(slows, simulate), TIME_STEP, LONGEST, walk=6)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Speed of the ball against time."""
    observe = {"v": engine.Trace(quantity=engine.Velocity("ball"))}
    result = simulate(scene(), time_step=TIME_STEP, duration=1.5 * STOPPED, observe=observe)
    time, speed = result.sample_times["v"], np.hypot(result["v"][:, 0], result["v"][:, 1])
    exact = np.maximum(0.0, SPEED - BRAKE * time)
    return case.Drawing(
        curves=(line("ball", time, speed, "points"), line("v − (5/7) ρ g t/r", time, exact, "reference")),
        x_label="time [s]",
        y_label="speed [m/s]",
        note=f"It is at {told(float(speed[-1]))} m/s at the end; the run is at most {told(float(np.abs(speed - exact).max()))} m/s off.",
    )


ROUNDED = "constant torque is exact in a step; the solver stops at 1e-10 of the load"

TEST = case.ScalarTest(
    title="Rolling friction",
    question="Is a ball stopped by rolling friction as its coefficients say?",
    why="Without rolling friction a ball on the floor never stops, and no heap of balls has a slope.",
    model="A ball of 2 kg rolls, or spins on the spot, on a rough level floor, and is put down on slopes. The torque "
    "against rolling is at most ρ N, against turning on the spot at most σ N.",
    parameters=(
        ("time step", "1/60 s"),
        ("ball", "radius 0.1 m, 2 kg"),
        ("friction", "µ = 0.5, ρ = 4 mm, σ = 2 mm"),
        ("start", "0.5 m/s, 35° from x; or 6 rad/s on the spot"),
        ("gravity", "10 m/s²"),
    ),
    theory=(
        "Rolling: F r − ρ N = I a/r and −F = m a, so a = −(5/7) ρ g/r; the way is v²/(2 a).",
        "On the spot: I w' = −σ m g. On a slope it stands while tan θ ≤ ρ/r.",
        "Both torques are constant until they hold: each step's speed is exact, the way is v h/2 short.",
    ),
    reference="Closed forms.",
    conclusion="Green: the contact takes torques up to their bounds, in any direction, and no further. Red: a ball that "
    "never stops, creeps down a slope, or stops too soon.",
    source="ours; a wish of the thesis, section 5.4",
    measurements=(
        ask(
            roll,
            (
                error(
                    "speed_error",
                    "largest difference of the speed to v − (5/7) ρ g t/r, then zero",
                    "m/s",
                    1e-9,
                    ROUNDED,
                ),
                error("sideways", "largest speed across", "m/s", 1e-9, ROUNDED, "companion"),
            ),
            "rolling until it stands",
            TIME_STEP,
        ),
        ask(
            turn,
            (
                error(
                    "spin_error",
                    "largest difference of the spin to w − σ m g t/I, then zero",
                    "rad/s",
                    1e-8,
                    ROUNDED,
                ),
                error("walked", "way of a ball that only spins", "m", 1e-9, ROUNDED, "companion"),
            ),
            "spinning on the spot",
            TIME_STEP,
            "spin",
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, duration=1.5 * STOPPED),
    stability=(
        case.StabilityStudy(
            name="slope",
            title="Steepest slope on which a ball stands",
            configuration="plain",
            definition="put down at rest, it moves slower than 1e-6 m/s after a second",
            study=steepest,
            unit="1",
            expected=(0.998 * ROLLING / RADIUS, 1.002 * ROLLING / RADIUS),
            expected_source="tan θ = ρ/r = 0.04, to the resolution of the search",
        ),
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which a ball is slowed by rolling and torsional friction",
            configuration="plain",
            definition="speed and r ω about the normal as by constant torques until they are none, to 1e-9 m/s, in three steps",
            study=longest_step,
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="a torque's impulse has the factor h, and no more is taken than there is; the search ends at 1000 s",
        ),
    ),
    figures=(case.Figure(name="speed", title="Speed against time", draw=draw),),
    ladders=(
        case.Ladder(
            name="way",
            description="way until it stands, against v²/(2 a)",
            unit="m",
            time_steps=tuple(1.0 / n for n in (32, 64, 128, 256, 512)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=0.002,
            target_seconds=0.01,
        ),
    ),
)

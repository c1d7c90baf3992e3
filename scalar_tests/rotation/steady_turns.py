"""Does what spins steadily turn by its rate times the time: on a motor, in the air, and rolling?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..sweep import line, told

RATE = 20.0  # rad/s
FAST = 600.0  # rad/s: ten radians in a step
TIME_STEP = 1.0 / 60.0  # s
DURATION = 3.0  # s
RADIUS, SPEED = 0.1, 1.0  # m, m/s of the ball that rolls
MOMENTS = (0.1, 0.15, 0.2)  # kg m²
STEPS = (60, 120, 240, 480)  # a second
Z = (0.0, 0.0, 1.0)
RIGHT, FASTEST = 1e-4, 1e9  # rad, and where the search ends, rad/s: 2.7 million turns in a step
NUDGE, GROWN = 1e-6, 10.0  # rad/s, and how many times as far off its momentum an axis is no longer steady


def driven(rate: float = RATE) -> engine.Scene:
    """A wheel whose motor holds a rate [rad/s] from the start."""
    wheel = engine.RigidBody(
        name="wheel",
        mass=1.0,
        inertia=MOMENTS,
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, rate),
    )
    axle = engine.Hinge(name="axle", between=(engine.WORLD, "wheel"), axis=Z, motor=engine.Motor(speed=rate))
    return engine.Scene(bodies=(wheel,), constraints=(axle,))


def free(rate: float = RATE) -> engine.Scene:
    """A body of three moments that spins about its axis of largest inertia, touched by nothing."""
    body = engine.RigidBody(
        name="body", mass=1.0, inertia=MOMENTS, position=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, rate)
    )
    return engine.Scene(bodies=(body,))


def rolling() -> engine.Scene:
    """A ball that rolls on a rough floor from the start."""
    rough = engine.Material(friction=0.5)
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    ball = engine.RigidBody(
        name="ball",
        mass=1.0,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, RADIUS),
        velocity=(SPEED, 0.0, 0.0),
        angular_velocity=(0.0, SPEED / RADIUS, 0.0),
        material=rough,
    )
    return engine.Scene(bodies=(floor, ball), gravity=(0.0, 0.0, -9.81))


def motor_error(
    simulate: case.Simulate, time_step: float = TIME_STEP, method: engine.Method = engine.PLAIN
) -> float:
    """Angle of the axle after DURATION less rate times time [rad]."""
    observe = {"angle": engine.Final(quantity=engine.JointCoordinate("axle"))}
    result = simulate(driven(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return float(result["angle"]) - RATE * DURATION


def turned(orientation: np.ndarray, axis: int) -> np.ndarray:
    """Angles [rad] about an axis of the world, from orientations a step apart; less than half a turn between."""
    return np.unwrap(2.0 * np.arctan2(orientation[:, 1 + axis], orientation[:, 0]))


def free_error(simulate: case.Simulate, rate: float) -> float:
    """Angle in DURATION less rate times time, whole turns aside [rad]."""
    observe = {"q": engine.Final(quantity=engine.Orientation("body"))}
    q = simulate(free(rate), time_step=TIME_STEP, duration=DURATION, observe=observe)["q"]
    half = 0.5 * rate * DURATION
    return float(
        2.0
        * np.arctan2(
            q[3] * np.cos(half) - q[0] * np.sin(half), abs(q[0] * np.cos(half) + q[3] * np.sin(half))
        )
    )


def measure(simulate: case.Simulate) -> dict[str, float]:
    """All four."""
    observe = {
        "q": engine.Trace(quantity=engine.Orientation("ball")),
        "x": engine.Final(quantity=engine.Position("ball")),
    }
    rolled = simulate(rolling(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    return {
        "motor_error": motor_error(simulate),
        "free_error": free_error(simulate, RATE),
        "fast_error": free_error(simulate, FAST),
        "rolling_error": float(turned(rolled["q"], 1)[-1]) * RADIUS - float(rolled["x"][0]),
    }


def grows(moment: float) -> float:
    """How many times as far an axis comes off its momentum in DURATION: cosh of √((B − C)(C − A)/(A B)) ω t, C the axis' moment."""
    a, b, _ = MOMENTS
    return math.cosh(math.sqrt(max(0.0, (b - moment) * (moment - a) / (a * b))) * RATE * DURATION)


def tenfold() -> float:
    """The moment [kg m²] below that of the next axis with which a nudge grows tenfold; halving."""
    low, high = 0.5 * (MOMENTS[0] + MOMENTS[1]), MOMENTS[1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if grows(middle) > GROWN else (low, middle)
    return low


def steady(simulate: case.Simulate, moment: float) -> bool:
    """Whether a body of that third moment [kg m²], nudged about its second axis, keeps its third one by its momentum."""
    nudged = engine.RigidBody(
        name="body",
        mass=1.0,
        inertia=(*MOMENTS[:2], moment),
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, NUDGE, RATE),
    )
    observe = {"q": engine.Trace(quantity=engine.Orientation("body"))}
    result = simulate(
        replace(free(), bodies=(nudged,)), time_step=TIME_STEP, duration=DURATION, observe=observe
    )
    w, x, y, z = result["q"].T
    start = MOMENTS[1] * NUDGE / (moment * RATE)  # rad, of the momentum from the axis, along y
    off = np.hypot(2.0 * (x * z + w * y), 2.0 * (y * z - w * x) - start)
    return result.completed and float(off.max()) < GROWN * start


def smallest_moment(simulate: case.Simulate) -> case.BreakPoint:
    """The smallest moment [kg m²] of an axis about which a body spins on."""
    return break_point(functools.partial(steady, simulate), MOMENTS[2], 0.12, resolution=2e-4, walk=5)


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest spin [rad/s] whose angle is right."""
    return break_point(lambda rate: abs(free_error(simulate, rate)) < RIGHT, RATE, FASTEST, walk=9)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Angle of the ball against the way it rolled."""
    observe = {
        "q": engine.Trace(quantity=engine.Orientation("ball")),
        "x": engine.Trace(quantity=engine.Position("ball")),
    }
    result = simulate(rolling(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    way, angle = result["x"][::6, 0], turned(result["q"], 1)[::6]
    off = float(np.abs(angle * RADIUS - way).max())
    return case.Drawing(
        curves=(line("ball", way, angle, "points"), line("way over radius", way, way / RADIUS, "reference")),
        x_label="way [m]",
        y_label="angle [rad]",
        note=f"Angle times radius is at most {told(off)} m from the way.",
    )


EXACT = "a steady spin turns by h ω a step: rounding of the angle, and of its sum, remains"

TEST = case.ScalarTest(
    title="Steady turns",
    question="Does what spins steadily turn by its rate times the time?",
    why="A step that turns by tan or asin of h ω has the right rate and the wrong angle: motors overrun, gears slip a tooth, "
    "and a ball turns more often than its way allows.",
    model="A wheel whose motor holds 20 rad/s, a free body of three moments at 20 and at 600 rad/s, and a ball that rolls, each for "
    "3 s.",
    parameters=(
        ("time step", "1/60 s"),
        ("rates", "20 rad/s; 600 rad/s, ten radians a step"),
        ("moments", "0.1, 0.15, 0.2 kg m²"),
        ("ball", "radius 0.1 m, 1 m/s"),
    ),
    theory=(
        "φ = ω t about a principal axis, whatever the step.",
        "A ball that rolls turns by its way over its radius.",
    ),
    reference="Closed form.",
    conclusion="Green: angles are those of the rates. Red: the turn of a step is not h ω.",
    source="ours",
    measurements=(
        ask(
            measure,
            (
                error("motor_error", "angle of the motor's axle after 3 s less ω t", "rad", 1e-10, EXACT),
                error("free_error", "angle of the free body after 3 s less ω t", "rad", 1e-10, EXACT),
                error("fast_error", "the same at ten radians a step, whole turns aside", "rad", 1e-9, EXACT),
                error(
                    "rolling_error",
                    "angle of the ball times its radius after 3 s less its way",
                    "m",
                    1e-8,
                    "what rolls without slipping has v = ω r in every step, to the solver's tolerance",
                ),
            ),
            "a motor, a free body and a ball",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=rolling(), time_step=TIME_STEP, duration=DURATION),
    figures=(case.Figure(name="rolling", title="Angle against way", draw=draw),),
    ladders=(
        case.Ladder(
            name="motor",
            description="angle of the motor's axle after 3 s against ω t",
            unit="rad",
            time_steps=tuple(1.0 / n for n in STEPS),
            configurations=(
                case.Configuration(name="plain", method=engine.PLAIN, expected_order=None),  # no step errs
                case.Configuration(
                    name="iterative", method=engine.Method(solver="iterative"), expected_order=None
                ),
            ),
            error=motor_error,
            target_error=1e-3,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="smallest-moment",
            title="Smallest third moment about which a free body spins on",
            configuration="plain",
            definition="nudged about the axis of 0.15 kg m², its third axis is never ten times as far from its momentum within 3 s",
            study=smallest_moment,
            unit="kg m²",
            better="smaller",
            expected=(tenfold(), MOMENTS[1]),
            expected_source="Euler: steady unless the axis is that of the middle moment, below 0.15 kg m²; there a nudge grows by "
            "cosh(√((B − C)(C − A)/(A B)) ω t), tenfold at 0.1493 kg m²",
        ),
        case.StabilityStudy(
            name="fastest",
            title="Fastest spin of a free body whose angle is right at h = 1/60 s",
            configuration="plain",
            definition="angle after 3 s less ω t, whole turns aside, below 1e-4 rad",
            study=fastest,
            unit="rad/s",
            expected=(FASTEST, FASTEST),
            expected_source="a step turns by h ω, whatever its size; 180 of them are rounded by 2^-53 of h ω each, 1e-6 rad in all "
            "where the search ends, at 1e9 rad/s",
        ),
    ),
)

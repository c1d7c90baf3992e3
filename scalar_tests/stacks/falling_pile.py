"""Do boxes and balls that fall on each other stay apart on the way down?"""

from __future__ import annotations

import functools
import random
from dataclasses import dataclass

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.method import PLAIN

from .. import case
from ..bracket import break_point
from ..configurations import configured
from ..sweep import line
from .pile import energy_rise

RADIUS = 0.3  # m, of balls
EDGES = (0.6, 0.5, 0.4)  # m, of boxes
SPIN = 0.5  # rad/s, of boxes, about the vertical
APART = 0.75  # m, from one body to the next above it
JITTER = 0.02  # m, sideways
FRICTIONS = (0.4, 0.0)
GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
STEPS = 120  # 2 s
PILES = range(10)  # seeds
RESTITUTIONS = (0.0, 0.1)
SWEEPS = engine.Method(solver="iterative", iterations=200)
TALLEST = 3  # seed of the ladder's pile
LADDER_DURATION = 2.0  # s
FASTEST = 1e4  # m/s, where the search ends: 167 m in a step
REACH = 0.5 * float(np.linalg.norm(EDGES))  # m, of a box's corners


def scene(seed: int, restitution: float, friction: float = FRICTIONS[0]) -> engine.Scene:
    """Six to fourteen bodies one above the other, a little aside: two boxes, a ball, two boxes, ..."""
    draw = random.Random(seed)
    count = draw.randint(6, 14)
    material = engine.Material(friction=friction, restitution=restitution)
    bodies = [
        engine.RigidBody(
            name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=material
        )
    ]
    for k in range(count):
        x, y = (0.15 * (turn % 5 - 2) + draw.uniform(-JITTER, JITTER) for turn in (7 * k, 3 * k))
        ball = k % 3 == 2
        bodies.append(
            engine.RigidBody(
                name=f"b{k}",
                mass=1.0,
                shape=engine.Sphere(RADIUS) if ball else engine.Box(EDGES),
                position=(x, y, 0.6 + APART * k),
                angular_velocity=(0.0, 0.0, 0.0 if ball else SPIN),
                material=material,
            )
        )
    return engine.Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -GRAVITY))


@dataclass(frozen=True, slots=True)
class Fall:
    """What is read from one pile."""

    depth: np.ndarray  # (steps + 1,) deepest overlap where a step begins, m
    bent: np.ndarray  # (steps + 1,) what turning may have added in the step before, m
    energy_rise: float  # 1, largest rise of the total energy in a step, over the energy lost in all


def bend(turned: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """How far corners of two bodies leave the tangents of their paths in a step [m], for turns (steps, bodies) [rad].

    A point at r that turns by t goes r |exp(i t) - 1 - i t| <= r t²/2 aside. A ball's turn moves none of its surface.
    """
    aside = 0.5 * REACH * turned**2 * boxes
    most: np.ndarray = np.sort(aside, axis=1)[:, -2:].sum(axis=1)
    return most


def read(
    simulate: case.Simulate, seed: int, restitution: float, friction: float, method: engine.Method = PLAIN
) -> Fall:
    falling = scene(seed, restitution, friction)
    observe = {
        "depth": engine.Trace(quantity=engine.Penetration()),
        "spin": engine.Trace(quantity=engine.AngularVelocity()),
        "energy": engine.Trace(quantity=engine.Energy()),
    }
    result = simulate(falling, time_step=TIME_STEP, steps=STEPS, method=method, observe=observe)
    boxes = np.array(
        [isinstance(body, engine.RigidBody) and isinstance(body.shape, engine.Box) for body in falling.bodies]
    )
    depth, energy = result["depth"].ravel(), result["energy"].ravel()
    bent = bend(TIME_STEP * np.linalg.norm(result["spin"], axis=2), boxes)
    return Fall(
        depth=depth[1:],  # of the points a step began with
        bent=bent[:-1],
        energy_rise=energy_rise(energy),
    )


def measure(
    simulate: case.Simulate, restitution: float, friction: float, method: engine.Method
) -> dict[str, float]:
    falls = [read(simulate, seed, restitution, friction, method) for seed in PILES]
    return {
        "unexplained": max(float((fall.depth - fall.bent).max()) for fall in falls),
        "deepest": max(float(fall.depth.max()) for fall in falls),
        "energy_rise": max(fall.energy_rise for fall in falls),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Deepest overlap [m] at any sample of the pile with most bodies, frictional and without restitution."""
    result = simulate(
        scene(TALLEST, 0.0),
        time_step=time_step,
        duration=LADDER_DURATION,
        method=method,
        observe={"depth": engine.Maximum(quantity=engine.Penetration())},
    )
    return float(result["depth"].max())


def column(places: tuple[tuple[float, float, float], ...], speed: float) -> engine.Scene:
    """Boxes at rest but for `speed` [m/s] downwards, their centres at places [m] over the floor; plastic, frictional."""
    material = engine.Material(friction=FRICTIONS[0])
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=material
    )
    boxes = (
        engine.RigidBody(
            name=f"b{k}",
            mass=1.0,
            shape=engine.Box(EDGES),
            position=place,
            velocity=(0.0, 0.0, -speed),
            material=material,
        )
        for k, place in enumerate(places)
    )
    return engine.Scene(bodies=(floor, *boxes), gravity=(0.0, 0.0, -GRAVITY))


def stays_on(simulate: case.Simulate, aside: float) -> bool:
    """Whether a box that falls onto another, so far aside [m], lies there: nothing has turned after half a second."""
    built = column(((0.0, 0.0, 0.5 * EDGES[2]), (aside, 0.0, 0.5 * EDGES[2] + APART)), 0.0)
    observe = {"w": engine.Final(quantity=engine.AngularVelocity())}
    result = simulate(built, time_step=TIME_STEP, duration=0.5, observe=observe)
    return result.completed and float(np.abs(result["w"]).max()) < 1e-9


def stays_apart(simulate: case.Simulate, speed: float) -> bool:
    """Whether three boxes thrown down one above the other [m/s] overlap no more than the gate allows, in ten steps."""
    built = column(tuple((0.0, 0.0, 0.6 + APART * k) for k in range(3)), speed)
    observe = {"depth": engine.Maximum(quantity=engine.Penetration())}
    result = simulate(built, time_step=TIME_STEP, steps=10, observe=observe)
    return result.completed and float(result["depth"].max()) < 1e-7


def farthest(simulate: case.Simulate) -> case.BreakPoint:
    """How far aside [m] a box may fall onto another."""
    return break_point(functools.partial(stays_on, simulate), 0.1, 0.5, resolution=1e-3, walk=5)


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest fall [m/s] on which nothing overlaps."""
    return break_point(functools.partial(stays_apart, simulate), 1.0, FASTEST, walk=5)


def _draw(simulate: case.Simulate) -> case.Drawing:
    fall = read(simulate, PILES[-1], RESTITUTIONS[0], FRICTIONS[0])
    times = tuple(TIME_STEP * k for k in range(len(fall.depth)))
    curves = (("deepest overlap", fall.depth, "line"), ("what turning may add in a step", fall.bent, "limit"))
    return case.Drawing(
        curves=tuple(
            line(name, times, (1e3 * float(d) for d in depths), style) for name, depths, style in curves
        ),
        x_label="time [s]",
        y_label="overlap [mm]",
    )


METRICS = (
    case.Metric(
        name="unexplained",
        description="deepest overlap on the way, beyond what the turns of two boxes may add in a step",
        unit="m",
        role="gate",
        better="smaller",
        limit=1e-7,
        limit_source="rounding: all is foreseen, or parted, but what leaves the tangents of its path, r t²/2 at a turn by t",
        reference=0.0,
        tolerance=1e-7,
    ),
    case.Metric(
        name="deepest",
        description="deepest overlap of any two bodies on the way",
        unit="m",
        role="reported",
        better="smaller",
        reference=0.0,
        relative_tolerance=0.1,
    ),
    case.Metric(
        name="energy_rise",
        description="largest rise of the total energy in a step, over the energy lost in all",
        unit="1",
        role="companion",
        better="smaller",
        limit=1e-9,
        limit_source="rounding: blows and friction take energy, and contacts pay for what they lift",
        reference=0.0,
        tolerance=1e-9,
    ),
)
TEST = case.ScalarTest(
    title="Falling pile",
    question="Do boxes and balls that fall on each other stay apart on the way down?",
    why="A pile at rest is easily right. While it falls, what is hit in one step is pushed into others in the same one, and an "
    "overlap that is let in may breed the next.",
    model="Six to fourteen boxes and balls fall one upon the other, a little aside, turn, topple and come to rest: the same ten "
    "piles with and without restitution and friction.",
    parameters=(
        ("bodies", "1 kg; boxes of 0.6 m × 0.5 m × 0.4 m, every third a ball of radius 0.3 m"),
        ("spin of the boxes", "0.5 rad/s about the vertical"),
        ("spacing", "0.75 m upwards, up to 0.32 m aside"),
        ("friction coefficient", "0.4 and 0"),
        ("restitution", "0 and 0.1"),
        ("gravity", "9.81 m/s²"),
        ("time step", "1/60 s, 120 steps"),
    ),
    theory=(
        "What a step has brought together is parted where it ends, so that only what turned into each other unforeseen overlaps.",
        "A point at r that turns by t goes r |exp(i t) − 1 − i t| ≤ r t²/2 off its tangent, and less off where its spin would lead, "
        "which Euler's equations change by less than t²/h² per second: the two boxes that turn most give the most that any two may overlap.",
        "Contacts take energy and never give any.",
    ),
    reference="No overlap but for the bend of the paths in one step.",
    conclusion="Green: nothing sinks into what it meets. Red: a pair was met too late, or not at all.",
    source="ours",
    measurements=tuple(
        case.Measurement(
            configuration=configuration,
            time_step=TIME_STEP,
            parameters={"mu": friction, "e": restitution},
            metrics=METRICS,
            measure=functools.partial(measure, restitution=restitution, friction=friction, method=method),
            note=note,
        )
        for configuration, method, note in (
            ("plain", PLAIN, "Plain SPOOK, directly solved."),
            ("iterative", SWEEPS, "Plain SPOOK, by two hundred sweeps."),
        )
        for friction in FRICTIONS
        for restitution in RESTITUTIONS
    ),
    example=lambda: case.Example(scene=scene(PILES[-1], RESTITUTIONS[0]), time_step=TIME_STEP, duration=2.0),
    figures=(case.Figure(name="overlap", title="Deepest overlap of a falling pile", draw=_draw),),
    ladders=(
        case.Ladder(
            name="overlap",
            description="deepest overlap of any two bodies in two seconds",
            unit="m",
            time_steps=(1.0 / 30.0, 1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0),
            configurations=configured({"direct": None, "iterative, 200 iterations": None}),
            error=ladder_error,
            target_error=1e-6,
            target_seconds=0.1,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="farthest-aside",
            title="How far aside a box may fall onto another",
            configuration="plain",
            definition="nothing has turned by 1e-9 rad/s half a second later",
            study=farthest,
            unit="m",
            expected=(0.999 * 0.5 * EDGES[0], 0.5 * EDGES[0]),
            expected_source="a plastic blow stops a box whose centre lies over the one below, whose edge is 0.3 m aside; to the "
            "resolution of the search",
        ),
        case.StabilityStudy(
            name="fastest",
            title="Fastest fall of three boxes that stay apart at h = 1/60 s",
            configuration="plain",
            definition="no overlap beyond 1e-7 m in ten steps",
            study=fastest,
            unit="m/s",
            expected=(FASTEST, FASTEST),
            expected_source="what will meet is foreseen for the whole way of a step, however long; the search ends at 1e4 m/s",
        ),
    ),
)

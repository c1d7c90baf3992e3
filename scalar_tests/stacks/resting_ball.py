"""Is the force under one ball at rest its weight?"""

from __future__ import annotations

import math
from dataclasses import replace

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point
from ..configurations import configured

RADIUS = 0.5  # m
MASS = 1.0  # kg
GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
DURATION = 2.0  # s, long after whatever gives has come to rest
WEIGHT = MASS * GRAVITY  # N
LONGEST = 1e4  # s, where the search for the longest step ends


def scene() -> engine.Scene:
    """The ball on a smooth plane, touching from the start."""
    smooth = Material(friction=0.0)
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=smooth
    )
    ball = engine.RigidBody(
        name="ball", mass=MASS, shape=engine.Sphere(RADIUS), position=(0.0, 0.0, RADIUS), material=smooth
    )
    return engine.Scene(bodies=(floor, ball), gravity=(0.0, 0.0, -GRAVITY))


def force(
    simulate: case.Simulate, time_step: float = TIME_STEP, method: engine.Method = engine.PLAIN
) -> dict[str, float]:
    """What the plane does to the ball, over its weight: upwards, less one, and sideways."""
    observe = {"force": engine.Final(quantity=engine.ContactForce("ball", "floor"))}
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    x, y, z = (float(part) / WEIGHT for part in result["force"])
    return {"weight_error": z - 1.0, "sideways": math.hypot(x, y)}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """How far the force is from the weight, over the weight."""
    return abs(force(simulate, time_step, method)["weight_error"])


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """Largest mass [kg] whose weight the plane is told to carry."""

    def carries(mass: float) -> bool:
        floor, ball = scene().bodies
        built = replace(scene(), bodies=(floor, replace(ball, mass=mass)))
        observe = {"force": engine.Final(quantity=engine.ContactForce("ball", "floor"))}
        result = simulate(built, time_step=TIME_STEP, duration=DURATION, observe=observe)
        return abs(float(result["force"][2]) / (mass * GRAVITY) - 1.0) < 1e-9

    return break_point(carries, MASS, 1e12, walk=13)


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] after ten of which the plane is told to carry the weight."""

    def carries(time_step: float) -> bool:
        observe = {"force": engine.Final(quantity=engine.ContactForce("ball", "floor"))}
        result = simulate(scene(), time_step=time_step, steps=10, observe=observe)
        return result.completed and abs(float(result["force"][2]) / WEIGHT - 1.0) < 1e-9

    return break_point(carries, TIME_STEP, LONGEST, walk=8)


TEST = case.ScalarTest(
    title="Resting ball",
    question="Is the force under one ball at rest its weight?",
    why="What an engine says of contact forces is read by games, robots and scales; one ball at rest shows whether it is so.",
    model="A ball lies on a smooth plane, touching from the start, for two seconds.",
    parameters=(
        ("ball", "radius 0.5 m, 1 kg"),
        ("gravity", "9.81 m/s²"),
        ("friction coefficient", "0"),
        ("time step", "1/60 s, 120 steps"),
    ),
    theory=("F = m g, along the normal.",),
    reference="Statics (closed form).",
    conclusion="Green: the force that is told is the one that acts. Red: it is another one, or the ball is not at rest.",
    source="ours; users of Rapier 0.12 found a quarter of the weight (dimforge/rapier.js#261)",
    measurements=(
        case.Measurement(
            configuration="direct",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="weight_error",
                    description="upward force of the plane on the ball over its weight, less one, after 2 s",
                    unit="1",
                    role="gate",
                    limit=1e-9,
                    limit_source="statics, to rounding",
                    reference=0.0,
                    tolerance=1e-12,
                ),
                case.Metric(
                    name="sideways",
                    description="sideways force of the plane on the ball over its weight, after 2 s",
                    unit="1",
                    role="companion",
                    limit=1e-9,
                    limit_source="a smooth plane pushes along its normal alone",
                    reference=0.0,
                    tolerance=1e-12,
                ),
            ),
            measure=force,
            note="Direct solver.",
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP),
    ladders=(
        case.Ladder(
            name="force",
            description="how far the force under the ball is from its weight, over its weight, after 2 s",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=configured({"direct": None, "iterative, 50 iterations": None}),
            error=ladder_error,
            target_error=1e-3,
            target_seconds=0.1,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="heaviest",
            title="Heaviest ball whose weight is told",
            configuration="plain",
            definition="the force is the weight to 1e-9 of it after two seconds",
            study=heaviest,
            unit="kg",
            expected=(1e12, 1e12),
            expected_source="one contact, one row: mass scales out of it; the search ends at 1e12 kg",
        ),
        case.StabilityStudy(
            name="longest-step",
            title="Longest step after which the weight is told",
            configuration="direct",
            definition="the force is the weight to 1e-9 of it after ten steps",
            study=longest_step,
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="an impulse of h m g over h: the step scales out of it; the search ends at 10 000 s",
        ),
    ),
)

"""Does a ball come back as high as its restitution says, whatever its value or the step?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point
from ..configurations import configured

RADIUS = 0.1  # m
HEIGHT = 1.0  # m, gap at the start
GRAVITY = 9.81  # m/s²
RESTITUTIONS = (0.3, 0.5, 0.8, 1.0)
STEPS_A_SECOND = (60, 240, 1000)
BOUNCES = 2
RIGHT = 0.02  # of the height
HIGHEST = 1e4  # m, where the search for the highest drop ends
MIDDLE, TIME_STEP = 0.5, 1.0 / 240.0  # restitution and step [s] of the ladder and of the search


def scene(restitution: float, height: float = HEIGHT) -> engine.Scene:
    """A ball so high [m] above a plane."""
    springy = Material(restitution=restitution)
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=springy
    )
    ball = engine.RigidBody(
        name="ball",
        mass=1.0,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, RADIUS + height),
        material=springy,
    )
    return engine.Scene(bodies=(floor, ball), gravity=(0.0, 0.0, -GRAVITY))


def flight(restitution: float, height: float = HEIGHT) -> tuple[float, float]:
    """When the flight after the last bounce is a fifth and four fifths over [s]: its height is sought in between."""
    fall = math.sqrt(2.0 * height / GRAVITY)
    begins = fall * (1.0 + 2.0 * sum(restitution**k for k in range(1, BOUNCES)))
    lasts = 2.0 * fall * restitution**BOUNCES
    return begins + 0.2 * lasts, begins + 0.8 * lasts


def height_error(
    simulate: case.Simulate,
    restitution: float,
    time_step: float,
    method: engine.Method = engine.PLAIN,
    height: float = HEIGHT,
) -> float:
    """How far the height after the second bounce is from e⁴ h, over that."""
    first, last = (round(when / time_step) for when in flight(restitution, height))
    lasts = last * time_step
    observe = {"place": engine.Trace(quantity=engine.Position("ball"), first=first)}
    built = scene(restitution, height)
    place = simulate(built, time_step=time_step, duration=lasts, method=method, observe=observe)["place"]
    return float(np.max(place[:, 2]) - RADIUS) / (height * restitution ** (2 * BOUNCES)) - 1.0


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    return abs(height_error(simulate, MIDDLE, time_step, method))


def comes_back(simulate: case.Simulate, height: float) -> bool:
    """Whether the second bounce of a drop from so high [m] is right."""
    return abs(height_error(simulate, MIDDLE, TIME_STEP, height=height)) <= RIGHT


def lowest(simulate: case.Simulate) -> case.BreakPoint:
    """The lowest drop [m] whose second bounce is right."""
    return break_point(functools.partial(comes_back, simulate), HEIGHT, 1e-6, resolution=0.05, walk=12)


def highest(simulate: case.Simulate) -> case.BreakPoint:
    """The highest one [m]."""
    return break_point(functools.partial(comes_back, simulate), HEIGHT, HIGHEST, resolution=0.05, walk=4)


def _at(restitution: float, per_second: int) -> case.Measurement:
    time_step = 1.0 / per_second
    return case.Measurement(
        configuration="plain",
        time_step=time_step,
        parameters={"e": restitution},
        metrics=(
            case.Metric(
                name="height_error",
                description="height after the second bounce against e⁴ h, over that",
                unit="1",
                role="gate",
                limit=RIGHT,
                limit_source="Newton's law of impact, and free fall; to two hundredths of the height",
                limit_kind="physical",
                reference=0.0,
                tolerance=1e-9,
            ),
        ),
        measure=lambda simulate: {"height_error": height_error(simulate, restitution, time_step)},
        note="Direct solver.",
    )


TEST = case.ScalarTest(
    title="Grid of bounces",
    question="Does a ball come back as high as its restitution says, whatever its value or the step?",
    why="A restitution that is a spring's damping, or is lost where a step ends beside the impact, is right at one step only.",
    model="A ball is dropped on a plane, with four restitutions at three steps; its height after the second bounce is read.",
    parameters=(
        ("ball", "radius 0.1 m, 1 kg, 1 m above the plane"),
        ("restitution", "e = 0.3, 0.5, 0.8, 1"),
        ("gravity", "9.81 m/s²"),
        ("time step", "1/60, 1/240, 1/1000 s"),
    ),
    theory=("Height after n bounces: e²ⁿ h.",),
    reference="Newton's law of impact (closed form).",
    conclusion="Green: a ball bounces by its restitution. Red: by its step, or not at all.",
    source="ours; asked for by users of several engines (newton-physics/newton#2549)",
    measurements=tuple(_at(e, n) for e in RESTITUTIONS for n in STEPS_A_SECOND),
    example=lambda: case.Example(scene=scene(MIDDLE), time_step=TIME_STEP, duration=3.0),
    ladders=(
        case.Ladder(
            name="second",
            description="height after the second bounce against e⁴ h, over that, e = 0.5",
            unit="1",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480, 960)),
            configurations=configured({"plain": None, "iterative": None}),
            error=ladder_error,
            target_error=1e-2,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="lowest",
            title="Lowest drop that comes back to its height",
            configuration="plain",
            definition="height after the second bounce is e⁴ h to two hundredths, e = 0.5, 1/240 s",
            study=lowest,
            unit="m",
            better="smaller",
            expected_source="none: how much of a flight of a few steps is seen hangs on where in a step it begins",
        ),
        case.StabilityStudy(
            name="highest",
            title="Highest drop that comes back to its height",
            configuration="plain",
            definition="height after the second bounce is e⁴ h to two hundredths, e = 0.5, 1/240 s",
            study=highest,
            unit="m",
            expected=(HIGHEST, HIGHEST),
            expected_source="a higher drop takes more steps of the same length, and less of it is lost between two of them; the "
            "search ends at 10 000 m",
        ),
    ),
)

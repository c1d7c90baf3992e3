"""How deep does one box sink into what it stands on?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

from spook_tracker import engine
from spook_tracker.engine.bodies import Material
from spook_tracker.engine.shapes import Shape

from .. import case
from ..bracket import break_point
from ..configurations import configured

EDGE = 0.5  # m
MASS = 1.0  # kg
GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 500.0  # s
DEEP = 1e-9  # m
STEPS, LONGEST = 10, 1e4  # steps of the search for the longest, and where it ends, s
# The speed that a step leaves is a few roundings of g h, and a few of h times it are what the box sinks
ROUNDED = math.sqrt(DEEP / (4.0 * STEPS * 2.0**-53 * GRAVITY))  # s, 151: no shorter step sinks it by DEEP
DURATION = 2.0  # s, long after whatever gives has come to rest
FLOORS: dict[str, Shape] = {"plane": engine.Plane(), "box": engine.Box((EDGE, EDGE, EDGE))}


def scene(floor: str) -> engine.Scene:
    """The box, touching from the start, on a fixed `floor`: a plane or an equal box."""
    rough = Material(friction=0.5)
    top = 0.5 * EDGE if floor == "box" else 0.0
    under = engine.RigidBody(
        name="floor", motion="static", shape=FLOORS[floor], position=(0.0, 0.0, 0.0), material=rough
    )
    box = engine.RigidBody(
        name="box",
        mass=MASS,
        shape=engine.Box((EDGE, EDGE, EDGE)),
        position=(0.0, 0.0, top + 0.5 * EDGE),
        material=rough,
    )
    return engine.Scene(bodies=(under, box), gravity=(0.0, 0.0, -GRAVITY))


def depth(
    simulate: case.Simulate, floor: str, time_step: float = TIME_STEP, method: engine.Method = engine.PLAIN
) -> float:
    """How far the box lies below where it was put [m], once it rests."""
    observe = {"moved": engine.Final(quantity=engine.Position("box"), from_start=True)}
    result = simulate(scene(floor), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return -float(result["moved"][2])


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """The depth on a box [m]."""
    return abs(depth(simulate, "box", time_step, method))


def stays(simulate: case.Simulate, aside: float) -> bool:
    """Whether the box, set down so far aside [m] of the one below, has not moved after a quarter of a second."""
    built = scene("box")
    under, box = built.bodies
    moved = replace(built, bodies=(under, replace(box, position=(aside, 0.0, EDGE))))
    observe = {"moved": engine.Final(quantity=engine.Position("box"), from_start=True)}
    result = simulate(moved, time_step=TIME_STEP, duration=0.25, observe=observe)
    return result.completed and max(map(abs, map(float, result["moved"]))) < DEEP


def lies(simulate: case.Simulate, time_step: float) -> bool:
    """Whether the box lies no deeper than DEEP after ten steps so long [s]."""
    observe = {"moved": engine.Final(quantity=engine.Position("box"), from_start=True)}
    result = simulate(scene("box"), time_step=time_step, steps=STEPS, observe=observe)
    return result.completed and abs(float(result["moved"][2])) < DEEP


def farthest(simulate: case.Simulate) -> case.BreakPoint:
    """How far aside [m] a box may be set down."""
    return break_point(functools.partial(stays, simulate), 0.1, 0.4, resolution=5e-4, walk=5)


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which the box does not sink."""
    return break_point(functools.partial(lies, simulate), TIME_STEP, LONGEST, resolution=0.05, walk=7)


def _on(floor: str) -> case.Measurement:
    return case.Measurement(
        configuration="direct",
        time_step=TIME_STEP,
        metrics=(
            case.Metric(
                name=f"depth_on_{floor}",
                description=f"how deep the box lies in the {floor} it stands on, after 2 s",
                unit="m",
                role="gate",
                limit=1e-9,
                limit_source="rigid bodies that only touch at the start stay so, to rounding",
                reference=0.0,
                tolerance=1e-12,
            ),
        ),
        measure=lambda simulate: {f"depth_on_{floor}": depth(simulate, floor)},
        note="Direct solver.",
    )


TEST = case.ScalarTest(
    title="Resting box",
    question="How deep does one box sink into the plane or the box it stands on?",
    why="The most direct question about contact: one body, one depth. What changes here changes in every heap.",
    model="A box stands on a plane, and one on an equal box that is fixed, touching from the start, for two seconds.",
    parameters=(
        ("box", "0.5 × 0.5 × 0.5 m, 1 kg"),
        ("gravity", "9.81 m/s²"),
        ("friction coefficient", "0.5"),
        ("time step", "1/500 s, 1000 steps"),
    ),
    theory=("Rigid bodies at rest that touch have the depth 0.",),
    reference="Rigid bodies (closed form); engines of soft contacts have a depth of their own, which must not change.",
    conclusion="Green: contact holds bodies where they are. Red: it lets them sink.",
    source="ours; the depth of a box on a box halved from MuJoCo 3.3.7 to 3.4.0",
    measurements=(_on("plane"), _on("box")),
    example=lambda: case.Example(scene=scene("box"), time_step=TIME_STEP),
    ladders=(
        case.Ladder(
            name="depth",
            description="how deep the box lies in the box it stands on after 2 s",
            unit="m",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 500)),
            configurations=configured({"direct": None, "iterative, 50 iterations": None}),
            error=ladder_error,
            target_error=1e-3,
            target_seconds=0.1,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="farthest-aside",
            title="How far aside a box may be set down on an equal one",
            configuration="direct",
            definition="it has not moved by 1e-9 m after a quarter of a second",
            study=farthest,
            unit="m",
            expected=(0.9995 * 0.5 * EDGE, 0.5 * EDGE),
            expected_source="its centre over the edge of the box below, half an edge aside, and it falls; to the resolution of "
            "the search",
        ),
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which a box does not sink into another",
            configuration="direct",
            definition="no deeper than 1e-9 m after ten steps",
            study=longest_step,
            unit="s",
            expected=(ROUNDED, LONGEST),
            expected_source="contact takes g h to rounding, four of them a step; ten times h of that is 1e-9 m at 151 s at the "
            "earliest, and the search ends at 10 000 s",
        ),
    ),
)

"""Does a box stand or slide by Coulomb's law, whatever its friction, slope, direction, mass and step?"""

from __future__ import annotations

import functools
import math
from itertools import product

import numpy as np

from spook_tracker import engine

from ... import case
from ...bracket import break_point
from ...configurations import configured
from .scene import FRICTION, GRAVITY, scene

FRICTIONS = (0.2, 0.5, 0.8)
DIRECTIONS = (0.0, math.pi / 8.0, math.pi / 4.0)  # rad, of the slope: along an edge, askew, along a diagonal
MASSES = (1.0, 1e4)  # kg
GENTLE, STEEP = 0.9, 1.2  # times µ: the slopes on which it stands and slides
STEPS_A_SECOND = (30, 60, 240)
SETTLED, STOOD, SLID = 0.5, 1.5, 1.0  # s: at rest from, looked at until; how long it slides
ASKEW = DIRECTIONS[1]
LONGEST, HEAVIEST = 100.0, 1e12  # s, kg, where the searches end
STANDING, SLIDING = 1e-4, 1e-3  # m in a second; of the speed


def downhill(friction: float, direction: float, time: float) -> np.ndarray:
    """(3,) velocity [m/s] after so long on the steep slope, by what Coulomb's law leaves of gravity."""
    tilt = math.atan(STEEP * friction)
    speed = GRAVITY * (math.sin(tilt) - friction * math.cos(tilt)) * time
    return np.array([-speed * math.cos(direction), -speed * math.sin(direction), 0.0])


def creep(simulate: case.Simulate, time_step: float, friction: float, direction: float, mass: float) -> float:
    """How far the box has moved in the second after it has settled on the gentle slope [m]."""
    first, count = round(SETTLED / time_step), round(STOOD / time_step)
    observe = {"place": engine.Trace(quantity=engine.Position("box"), first=first, every=count - first)}
    built = scene(GENTLE * friction, direction, friction, mass)
    place = simulate(built, time_step=time_step, steps=count, observe=observe)["place"]
    return float(np.linalg.norm(place[-1] - place[0]))


def speed_error(
    simulate: case.Simulate,
    time_step: float,
    friction: float,
    direction: float,
    mass: float,
    method: engine.Method = engine.PLAIN,
) -> float:
    """How far the velocity on the steep slope is from the closed form's after a second, over its size."""
    observe = {"velocity": engine.Final(quantity=engine.Velocity("box"))}
    built = scene(STEEP * friction, direction, friction, mass)
    found = simulate(built, time_step=time_step, duration=SLID, method=method, observe=observe)["velocity"]
    right = downhill(friction, direction, SLID)
    return float(np.linalg.norm(found - right) / np.linalg.norm(right))


def _stands(simulate: case.Simulate, time_step: float) -> dict[str, float]:
    grid = product(FRICTIONS, DIRECTIONS, MASSES)
    return {"creep": max(creep(simulate, time_step, *cell) for cell in grid)}


def _slides(simulate: case.Simulate, time_step: float) -> dict[str, float]:
    grid = product(FRICTIONS, DIRECTIONS, MASSES)
    return {"slide_error": max(speed_error(simulate, time_step, *cell) for cell in grid)}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """The error of the velocity [m/s] of a box that slides askew."""
    size = float(np.linalg.norm(downhill(FRICTION, ASKEW, SLID)))
    return size * speed_error(simulate, time_step, FRICTION, ASKEW, 1.0, method)


def tells_apart(simulate: case.Simulate, time_step: float = 1.0 / 60.0, mass: float = 1.0) -> bool:
    """Whether the box stands on the gentle slope and slides as it should down the steep one, askew, for ten such steps."""
    observe = {"velocity": engine.Final(quantity=engine.Velocity("box"))}
    found = [
        simulate(
            scene(times * FRICTION, ASKEW, FRICTION, mass), time_step=time_step, steps=10, observe=observe
        )["velocity"]
        for times in (GENTLE, STEEP)
    ]
    right = downhill(FRICTION, ASKEW, 10.0 * time_step)
    off = max(float(np.linalg.norm(found[0])), float(np.linalg.norm(found[1] - right)))
    return off < 1e-9 * float(np.linalg.norm(right))


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which the box knows its slope and its way."""
    return break_point(functools.partial(tells_apart, simulate), 1.0 / 60.0, LONGEST, walk=6)


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest box [kg] that knows them."""
    return break_point(lambda mass: tells_apart(simulate, mass=mass), 1.0, HEAVIEST, walk=5)


def _at(per_second: int) -> tuple[case.Measurement, ...]:
    time_step = 1.0 / per_second
    stands = case.Metric(
        name="creep",
        description="how far a box moves in a second where its friction holds it, the farthest of 18: tan θ = 0.9 µ",
        unit="m",
        role="gate",
        limit=STANDING,
        limit_source="Coulomb's law: what stands does not move; a tenth of a millimetre in a second still counts as standing",
        limit_kind="physical",
        reference=0.0,
        tolerance=1e-12,
    )
    slides = case.Metric(
        name="slide_error",
        description="velocity after 1 s down a slope of tan θ = 1.2 µ against g (sin θ − µ cos θ) t, of its size, worst of 18",
        unit="1",
        role="gate",
        limit=SLIDING,
        limit_source="Coulomb's law, to a thousandth of the speed",
        limit_kind="physical",
        reference=0.0,
        tolerance=1e-12,
    )
    return tuple(
        case.Measurement(
            configuration="cone",
            time_step=time_step,
            metrics=(metric,),
            measure=functools.partial(measure, time_step=time_step),
            note="Cone friction, direct solver.",
        )
        for metric, measure in ((stands, _stands), (slides, _slides))
    )


TEST = case.ScalarTest(
    title="Grid of slopes",
    question="Does a box stand or slide by Coulomb's law, whatever its friction, slope, direction, mass and step?",
    why="A friction that is regularised, split along two axes or bounded by a guess holds at one point of this grid and "
    "fails at another; users meet all of them.",
    model=(
        "A box on a plane under tilted gravity: three frictions, three directions of the slope against its edges, two "
        "masses, three steps; on a slope of 0.9 µ it is looked at for a second once it has settled, on one of 1.2 µ it "
        "slides for a second. The worst of the grid counts."
    ),
    parameters=(
        ("box", "1 × 1 × 1 m, 1 kg and 1e4 kg"),
        ("friction coefficient", "µ = 0.2, 0.5, 0.8"),
        ("slope", "tan θ = 0.9 µ and 1.2 µ, along an edge, at 22.5° and at 45° to it"),
        ("gravity", "10 m/s²"),
        ("time step", "1/30, 1/60, 1/240 s"),
    ),
    theory=("tan θ < µ: v = 0.", "tan θ > µ: v = g (sin θ − µ cos θ) t, straight down the slope."),
    reference="Coulomb's law (closed form).",
    conclusion="Green: friction is Coulomb's everywhere on the grid. Red: it creeps, drags, or knows a direction, a mass or a step.",
    source="ours; asked for by users of several engines (newton-physics/newton#2549, erincatto/solver2d#17)",
    measurements=tuple(one for n in STEPS_A_SECOND for one in _at(n)),
    example=lambda: case.Example(scene=scene(STEEP * FRICTION, ASKEW), time_step=1.0 / 60.0),
    ladders=(
        case.Ladder(
            name="askew",
            description="velocity after 1 s at tan θ = 0.6 and 22.5° to an edge against g (sin θ − µ cos θ) t, µ = 0.5",
            unit="m/s",
            time_steps=tuple(1.0 / n for n in (15, 30, 60, 120, 240)),
            configurations=configured({"direct": None, "iterative": None}),
            error=ladder_error,
            target_error=1e-3,
            target_seconds=0.01,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which a box stands, and slides straight down",
            configuration="cone",
            definition="askew to its edges it stands at 0.9 µ and goes by g (sin θ − µ cos θ) t at 1.2 µ, to 1e-9 of that",
            study=longest_step,
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="gravity and the impulses that answer it have the factor h alike; the search ends at 100 s",
        ),
        case.StabilityStudy(
            name="heaviest",
            title="Heaviest box that stands, and slides straight down",
            configuration="cone",
            definition="the same at 1/60 s",
            study=heaviest,
            unit="kg",
            expected=(HEAVIEST, HEAVIEST),
            expected_source="mass scales out of Coulomb's law; the search ends at 1e12 kg",
        ),
    ),
)

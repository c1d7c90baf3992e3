"""How rough must a table be for two cards to lean on each other?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker.engine import (
    Capsule,
    Compound,
    ContactForce,
    Final,
    Material,
    MaximumAbsolute,
    Method,
    Part,
    Plane,
    Position,
    RigidBody,
    Scene,
)
from spook_tracker.engine.observe import Observable

from ..bracket import break_point
from ..case import BreakPoint, Drawing, Example, Figure, Ladder, ScalarTest, Simulate, StabilityStudy
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
LENGTH, THICK, WIDE, CARD = 0.9, 0.02, 0.6, 2.0  # m, m, m, kg: a board with two round rails
LEAN = math.radians(25.0)  # from upright
INERTIA = (CARD * (LENGTH**2 + WIDE**2) / 12.0, CARD * LENGTH**2 / 12.0, CARD * WIDE**2 / 12.0)  # kg m²
FRICTION = 0.5
TIME_STEP = 1.0 / 60.0  # s
DURATION = 0.5  # s
SIDES = {"left": -1.0, "right": 1.0}


def need(lean: float = LEAN) -> float:
    """The friction they need: thrust over weight, by moments about a foot."""
    return 0.5 * LENGTH * math.sin(lean) / (0.5 * THICK + LENGTH * math.cos(lean))


def scene(lean: float = LEAN, friction: float = FRICTION, times: float = 1.0) -> Scene:
    """Two boards that stand on the round ends of their rails and touch with the upper ones, the right one `times` as heavy."""
    rough = Material(friction=friction)
    table = RigidBody(name="table", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough)
    rails = tuple(
        Part(shape=Capsule(0.5 * THICK, LENGTH), position=(0.0, side * 0.5 * WIDE, 0.0))
        for side in SIDES.values()
    )
    boards = [
        RigidBody(
            name=name,
            mass=heavier * CARD,
            shape=Compound(rails),
            inertia=tuple(heavier * moment for moment in INERTIA),
            position=(
                side * (0.5 * THICK + 0.5 * LENGTH * math.sin(lean)),
                0.0,
                0.5 * THICK + 0.5 * LENGTH * math.cos(lean),
            ),
            orientation=(math.cos(0.5 * lean), 0.0, -side * math.sin(0.5 * lean), 0.0),
            material=rough,
        )
        for (name, side), heavier in zip(SIDES.items(), (1.0, times), strict=True)
    ]
    return Scene(bodies=(table, *boards), gravity=(0.0, 0.0, -GRAVITY))


def measure(simulate: Simulate) -> dict[str, float]:
    """Half a second at rest, and what their feet carry."""
    observe: dict[str, Observable] = {
        "x": MaximumAbsolute(quantity=Position(), from_start=True),
        "left": Final(quantity=ContactForce("left", other="table")),
        "between": Final(quantity=ContactForce("left", other="right")),
    }
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    weight = CARD * GRAVITY
    return {
        "thrust_error": float(result["left"][0]) / (need() * weight) - 1.0,
        "carried_error": float(result["left"][2]) / weight - 1.0,
        "between_error": -float(result["between"][0]) / (need() * weight) - 1.0,
        "moved": float(np.abs(result["x"]).max()),
    }


def most_unequal() -> float:
    """The heaviest right board, over the left one, by moments about the feet: the push between the tops is
    H = (W + W') ℓ sin θ/(4 z), the friction that the heavier one hangs on V = (W' − W) ℓ sin θ/(4 x), of at most µ H."""
    share = FRICTION * (0.5 * THICK + LENGTH * math.sin(LEAN)) / (0.5 * THICK + LENGTH * math.cos(LEAN))
    return (1.0 + share) / (1.0 - share)


UNEQUAL = most_unequal()


def stands(simulate: Simulate, friction: float = FRICTION, times: float = 1.0) -> bool:
    """Whether they have not slipped by a tenth of a millimetre in half a second."""
    observe = {"x": MaximumAbsolute(quantity=Position("left"), from_start=True)}
    asked = scene(friction=friction, times=times)
    result = simulate(asked, time_step=TIME_STEP, duration=DURATION, observe=observe)
    return result.completed and float(np.abs(result["x"]).max()) < 1e-4


def least(simulate: Simulate) -> BreakPoint:
    """The least friction on which they stand."""
    return break_point(functools.partial(stands, simulate), 1.5 * need(), 0.5 * need(), resolution=0.002)


def heaviest(simulate: Simulate) -> BreakPoint:
    """How many times as heavy as the left board the right one may be."""
    return break_point(lambda times: stands(simulate, times=times), 1.0, 4.0, resolution=0.002, walk=5)


def ladder_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Relative error of the thrust after a second."""
    observe = {"left": Final(quantity=ContactForce("left", other="table"))}
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return float(result["left"][0]) / (need() * CARD * GRAVITY) - 1.0


def draw(simulate: Simulate) -> Drawing:
    """Thrust over weight against the lean."""
    leans = [5.0, 15.0, 25.0, 35.0, 45.0]
    thrusts = []
    for lean in leans:
        observe = {"left": Final(quantity=ContactForce("left", other="table"))}
        asked = scene(math.radians(lean), friction=1.0)
        result = simulate(asked, time_step=TIME_STEP, duration=0.2, observe=observe)
        thrusts.append(float(result["left"][0]) / (CARD * GRAVITY))
    smooth = np.linspace(2.0, 50.0, 60)
    return Drawing(
        curves=(
            line("feet", leans, thrusts, "points"),
            line("statics", smooth, [need(math.radians(float(lean))) for lean in smooth], "reference"),
        ),
        x_label="lean from upright [°]",
        y_label="thrust over weight",
        note=f"At 25° the thrust is {told(thrusts[2], 3)} of the weight, {told(need(), 3)} by statics.",
    )


RESTING = "forces at rest are exact; rounding of the places where they touch remains"

TEST = ScalarTest(
    title="Leaning cards",
    question="How rough must a table be for two cards to lean on each other?",
    why="Each card stands only by the other's push, and all of that is friction of its foot: a contact that creeps, or a "
    "friction that is not bounded by its load, brings a house of cards down or holds what must fall.",
    model="Two boards with round rails lean against each other: points of contact at feet and tops, so that statics knows "
    "every force.",
    parameters=(
        ("time step", "1/60 s"),
        ("boards", "2 kg, rails of 0.9 m between the middles of their round ends, 2 cm thick"),
        ("lean", "25° from upright"),
        ("friction", "µ = 0.5"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Moments about a foot: H (ρ + ℓ cos θ) = W (ℓ/2) sin θ; H is the thrust at the top and the friction of the foot.",
        f"They stand if and only if µ ≥ H/W, here {told(need(), 4)}.",
    ),
    reference="Statics.",
    conclusion="Green: friction holds as much as it must and no more. Red: it creeps, or it does not know its load.",
    source="ours; a house of cards is a classic of statics",
    measurements=(
        ask(
            measure,
            (
                error("thrust_error", "relative error of a foot's friction", "1", 1e-10, RESTING),
                error(
                    "carried_error",
                    "relative error of the load of a foot",
                    "1",
                    1e-10,
                    RESTING,
                    "companion",
                ),
                error(
                    "between_error",
                    "relative error of the push between the tops",
                    "1",
                    1e-10,
                    RESTING,
                    "companion",
                ),
                error("moved", "how far anything moves in half a second", "m", 1e-9, RESTING, "companion"),
            ),
            "at rest",
            TIME_STEP,
        ),
    ),
    example=lambda: Example(scene=scene(friction=0.2), time_step=TIME_STEP, duration=1.5),
    stability=(
        StabilityStudy(
            name="least-friction",
            title="Least friction on which two cards stand",
            configuration="plain",
            definition="nothing slips by a tenth of a millimetre in half a second",
            study=least,
            unit="1",
            expected=(0.997 * need(), 1.003 * need()),
            expected_source=f"statics: {told(need(), 4)}; the search ends within 0.2 %, and what lacks 0.1 % slips a millimetre",
        ),
        StabilityStudy(
            name="most-unequal",
            title="How many times as heavy one of two cards may be",
            configuration="plain",
            definition="nothing slips by a tenth of a millimetre in half a second",
            study=heaviest,
            unit="1",
            expected=(0.997 * UNEQUAL, 1.002 * UNEQUAL),
            expected_source=f"the heavier card hangs on friction of the tops: {told(UNEQUAL, 4)} by statics; the search ends within 0.2 %",
        ),
    ),
    figures=(Figure(name="thrust", title="Thrust of leaning cards", draw=draw),),
    ladders=(
        Ladder(
            name="thrust",
            description="relative error of a foot's friction after half a second",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120)),
            configurations=configured({"direct": None, "iterative": None}),
            error=ladder_error,
        ),
    ),
)

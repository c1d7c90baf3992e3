"""How high may a house of cards be built on a table of given roughness?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_count, break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told
from . import leaning_cards as cards

DECK, DECK_MASS = 0.02, 1.0  # m thick, kg: a board between two storeys
STOREYS = 5
FRICTION = 0.5
SMOOTHER = 0.4  # µ that does not hold every house
TIME_STEP = 1.0 / 60.0  # s
DURATION = 0.25  # s
ARM, RISE = cards.LENGTH * math.sin(cards.LEAN), cards.LENGTH * math.cos(cards.LEAN)  # m, from foot to top
STOREY = cards.THICK + RISE + DECK  # m


def load(storeys: int) -> float:
    """What lies on each of the lowest two boards, N."""
    return 0.5 * (storeys - 1) * (2.0 * cards.CARD + DECK_MASS) * cards.GRAVITY


def need(storeys: int) -> float:
    """The least friction, by statics of the lowest storey: the others carry less."""
    weight, above, end = cards.CARD * cards.GRAVITY, load(storeys), 0.5 * cards.THICK
    return (0.5 * weight + above) * ARM / ((weight + above) * (end + RISE) + above * end)


def scene(storeys: int = STOREYS, friction: float = FRICTION) -> engine.Scene:
    """Pairs of leaning boards, a deck on each pair but the highest."""
    rough = engine.Material(friction=friction)
    ground = cards.scene(friction=friction)
    table, *pair = ground.bodies
    deck = engine.RigidBody(
        name="deck",
        mass=DECK_MASS,
        shape=engine.Box((2.0 * (cards.THICK + ARM), 1.2 * cards.WIDE, DECK)),
        position=(0.0, 0.0, STOREY - 0.5 * DECK),
        material=rough,
    )
    raised = [
        replace(
            body, name=f"{body.name} {k}", position=(body.position[0], 0.0, body.position[2] + k * STOREY)
        )
        for k in range(storeys)
        for body in (*pair, deck)
    ]
    return replace(ground, bodies=(table, *raised[:-1]))


def measure(simulate: case.Simulate) -> dict[str, float]:
    """A quarter of a second at rest, and what the lowest feet carry."""
    observe: dict[str, Observable] = {
        "x": engine.MaximumAbsolute(quantity=engine.Position(), from_start=True),
        "left": engine.Final(quantity=engine.ContactForce("left 0", other="table")),
        "right": engine.Final(quantity=engine.ContactForce("right 0", other="table")),
    }
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    carried = cards.CARD * cards.GRAVITY + load(STOREYS)
    return {
        "carried_error": float(max(abs(result[side][2] / carried - 1.0) for side in ("left", "right"))),
        "balance": float(abs(result["left"][0] + result["right"][0]) / carried),
        "moved": float(np.abs(result["x"]).max()),
        "least_error": abs(least(simulate).value / need(3) - 1.0),
    }


def stands(simulate: case.Simulate, storeys: int, friction: float) -> bool:
    """Whether nothing has moved by a tenth of a millimetre in a quarter of a second."""
    observe = {"x": engine.MaximumAbsolute(quantity=engine.Position(), from_start=True)}
    result = simulate(scene(storeys, friction), time_step=TIME_STEP, duration=DURATION, observe=observe)
    return result.completed and float(np.abs(result["x"]).max()) < 1e-4


def least(simulate: case.Simulate, storeys: int = 3, resolution: float = 0.002) -> case.BreakPoint:
    """The least friction on which so many storeys stand."""
    asked = functools.partial(stands, simulate, storeys)
    return break_point(asked, 1.2 * need(storeys), 0.8 * need(storeys), resolution=resolution)


def tallest(simulate: case.Simulate) -> case.BreakPoint:
    """The most storeys that stand with SMOOTHER."""
    return break_count(functools.partial(stands, simulate, friction=SMOOTHER), (1, 2, 3, 4, 5))


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Relative error of the load of a lowest foot."""
    observe = {"left": engine.Final(quantity=engine.ContactForce("left 0", other="table"))}
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return float(result["left"][2]) / (cards.CARD * cards.GRAVITY + load(STOREYS)) - 1.0


def draw(simulate: case.Simulate) -> case.Drawing:
    """The least friction against the number of storeys."""
    storeys = [1, 2, 3, 4]
    found = [least(simulate, n, 0.01).value for n in storeys]
    every = list(range(1, 13))
    return case.Drawing(
        curves=(
            line("found", storeys, found, "points"),
            line("statics", every, [need(n) for n in every], "reference"),
        ),
        x_label="storeys",
        y_label="least friction",
        note=f"{told(found[-1], 3)} with {storeys[-1]} storeys, {told(need(storeys[-1]), 3)} by statics, which grows towards "
        f"{told(ARM / (cards.THICK + RISE), 3)}: beyond that friction a house has no highest storey.",
    )


RESTING = "forces at rest are exact; rounding of the places where they touch remains"

TEST = case.ScalarTest(
    title="House of cards",
    question="How high may a house of cards be built on a table of given roughness?",
    why="Every storey leans on the friction of the one below, and what lies on top decides what the lowest feet need. A "
    "solver that shares friction wrongly among contacts lets a house stand that must fall, or fall that must stand.",
    model="Pairs of leaning boards with round rails, one above the other, a deck on each pair. The deck holds the tops "
    "together by friction, as far as friction goes: statics alone does not say how far, only whether it can suffice.",
    parameters=(
        ("time step", "1/60 s"),
        (
            "boards",
            "2 kg, rails of 0.9 m between the middles of their round ends, 2 cm thick, 25° from upright",
        ),
        ("decks", "1 kg, 2 cm thick"),
        ("storeys", "5, and 3 for the least friction"),
        ("friction", "µ = 0.5"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "A top of the lowest storey carries V, half of all that is above. Moments about its foot: "
        "H (ρ + ℓ cos θ) + F (2 ρ + ℓ cos θ) = (W/2 + V) ℓ sin θ, with the push H of the other top and the friction F ≤ µ V "
        "of the deck; the foot needs H + F ≤ µ (W + V).",
        "The deck helps most at F = µ V, so the house stands if and only if "
        "µ ≥ (W/2 + V) ℓ sin θ / ((W + V)(ρ + ℓ cos θ) + V ρ): "
        f"{told(need(1), 4)} for one storey, {told(need(3), 4)} for three, {told(need(5), 4)} for five.",
    ),
    reference="Statics: limit analysis of the lowest storey.",
    conclusion="Green: the house stands on as little friction as statics allows. Red: friction is shared wrongly, or creeps.",
    source="ours; a house of cards is a classic of statics",
    measurements=(
        ask(
            measure,
            (
                error(
                    "least_error",
                    "least friction for three storeys, relative to statics",
                    "1",
                    0.002,
                    "the search ends within 0.2 %; what lacks 0.1 % slides a millimetre",
                ),
                error(
                    "carried_error",
                    "relative error of the load of a lowest foot",
                    "1",
                    1e-10,
                    RESTING,
                    "companion",
                ),
                error(
                    "balance",
                    "sum of the lowest feet's frictions, over the load of one",
                    "1",
                    1e-10,
                    RESTING,
                    "companion",
                ),
                error(
                    "moved",
                    "how far anything moves in a quarter of a second",
                    "m",
                    1e-9,
                    RESTING,
                    "companion",
                ),
            ),
            "at rest",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(4, 0.97 * need(4)), time_step=TIME_STEP, duration=1.2),
    stability=(
        case.StabilityStudy(
            name="least-friction",
            title="Least friction on which five storeys stand",
            configuration="plain",
            definition="nothing moves by a tenth of a millimetre in a quarter of a second",
            study=functools.partial(least, storeys=5),
            unit="1",
            expected=(0.997 * need(5), 1.003 * need(5)),
            expected_source=f"statics: {told(need(5), 4)}; the search ends within 0.2 %",
        ),
        case.StabilityStudy(
            name="tallest",
            title="Most storeys that stand with µ = 0.4",
            configuration="plain",
            definition="nothing moves by a tenth of a millimetre in a quarter of a second",
            study=tallest,
            unit="1",
            expected=(3.0, 3.0),
            expected_source=f"statics: three need {told(need(3), 4)}, four {told(need(4), 4)}",
        ),
    ),
    ladders=(
        case.Ladder(
            name="load",
            description="relative error of the load of a lowest foot after a quarter of a second",
            unit="1",
            time_steps=tuple(1.0 / n for n in (40, 60, 120)),
            configurations=configured({"direct": None, "half-step": None}),
            error=ladder_error,
            target_error=1e-9,
            target_seconds=0.1,
        ),
    ),
    figures=(case.Figure(name="storeys", title="Friction a house of cards needs", draw=draw),),
)

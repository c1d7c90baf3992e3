"""Does a closed ring of locks keep its shape in every direction?

A ring closes a loop: one lock more than a tree needs, with its constraint forces in every direction. It hangs on
one box that is locked to the world.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_count, break_point
from ..configurations import configured
from ..sweep import line, told

COUNT = 24
PIECE = 0.5  # m, length of a box along the ring
MASS = 2.5  # kg
GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
STEPS = 600
LADDER_COUNT = 12
SAGGED = 1e-3  # of the diameter: what a ring of soft locks may sink
RINGS = (12, 25, 50, 100)  # boxes that are tried


def radius(count: int) -> float:
    """Radius [m] of the circle through the box centres, the pieces meeting end to end."""
    return 0.5 * PIECE / math.tan(math.pi / count)


def scene(count: int = COUNT, compliance: float = 0.0) -> engine.Scene:
    """A vertical ring of locked boxes; box 1, at the top, is locked to the world."""
    size = radius(count)
    angles = [2.0 * math.pi * i / count for i in range(count)]
    boxes = tuple(
        engine.RigidBody(
            name=f"box {i + 1}",
            mass=MASS,
            shape=engine.Box((PIECE, 0.1, 0.1)),
            position=(size * math.sin(angle), 0.0, size * math.cos(angle)),
            orientation=(math.cos(0.5 * angle), 0.0, math.sin(0.5 * angle), 0.0),
        )
        for i, angle in enumerate(angles)
    )
    corner = math.hypot(size, 0.5 * PIECE)

    def lock(i: int) -> engine.Lock:
        angle = 2.0 * math.pi * (i + 0.5) / count
        return engine.Lock(
            name=f"lock {i + 1}",
            between=(f"box {i + 1}", f"box {(i + 1) % count + 1}"),
            at=(corner * math.sin(angle), 0.0, corner * math.cos(angle)),
            compliance=compliance,
        )

    hanger = engine.Lock(name="hanger", between=(engine.WORLD, "box 1"), compliance=0.0)
    return engine.Scene(
        bodies=boxes,
        constraints=(hanger, *(lock(i) for i in range(count))),
        gravity=(0.0, 0.0, -GRAVITY),
        contacts=False,
    )


def displacements(simulate: case.Simulate, count: int) -> tuple[np.ndarray, float]:
    """(count, 3) largest displacement [m] over the second half of the run, and the hanger's last force [N]."""
    observe = {
        "place": engine.Trace(quantity=engine.Position(), first=STEPS // 2, every=10, from_start=True),
        "hanger": engine.Trace(quantity=engine.ConstraintForce("hanger"), first=STEPS),
    }
    result = simulate(scene(count), time_step=TIME_STEP, steps=STEPS, observe=observe)
    return np.abs(result["place"]).max(axis=0), float(result["hanger"][-1, 2])


def _measure(count: int) -> object:
    def measure(simulate: case.Simulate) -> dict[str, float]:
        moved, held = displacements(simulate, count)
        return {
            "shape_error": 100.0 * float(moved.max()) / (2.0 * radius(count)),
            "weight_error": held / (count * MASS * GRAVITY) - 1.0,
        }

    return measure


def _draw(simulate: case.Simulate) -> case.Drawing:
    moved, _ = displacements(simulate, COUNT)
    boxes = tuple(float(i + 1) for i in range(COUNT))
    return case.Drawing(
        curves=tuple(
            line(f"along {axis}", boxes, 1e12 * moved[:, i], "both") for i, axis in enumerate("xyz")
        ),
        x_label="box",
        y_label="largest displacement [pm]",
        note=f"At most {told(1e12 * float(moved.max()))} pm.",
    )


def _metrics(role: str) -> tuple[case.Metric, ...]:
    return (
        case.Metric(
            name="shape_error",
            description="largest displacement of a box over the ring's diameter, second half of the run",
            unit="%",
            role=role,  # type: ignore[arg-type]
            limit=1e-10,
            limit_source="rigid locks leave rounding only",
            reference=0.0,
            tolerance=1e-12,
        ),
        case.Metric(
            name="weight_error",
            description="force of the hanger over the ring's weight, minus one",
            unit="1",
            role="companion",
            limit=1e-9,
            limit_source="statics, to rounding",
            reference=0.0,
            tolerance=1e-12,
        ),
    )


def sinks(count: int) -> float:
    """How far the lowest box sinks, over the locks' compliance [N]: statics of rigid boxes and springs, in the ring's plane.

    A lock of compliance ε gives way by ε F along and ε M in turn; box 1 is held. Coordinates are x, z and the turn about y.
    """
    size = radius(count)
    corner = math.hypot(size, 0.5 * PIECE)
    stiff, load = np.zeros((3 * count, 3 * count)), np.zeros(3 * count)
    load[1::3] = -MASS * GRAVITY
    for i in range(count):
        angle = 2.0 * math.pi * (i + 0.5) / count
        gap = np.zeros((3, 3 * count))
        for sign, box in ((1.0, (i + 1) % count), (-1.0, i)):
            centre = 2.0 * math.pi * box / count
            x = corner * math.sin(angle) - size * math.sin(centre)
            z = corner * math.cos(angle) - size * math.cos(centre)
            gap[:, 3 * box : 3 * box + 3] = sign * np.array([[1.0, 0.0, z], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
        stiff += gap.T @ gap
    moved = np.linalg.solve(stiff[3:, 3:], load[3:])
    return -float(moved[3 * (count // 2) - 2])


def keeps_round(simulate: case.Simulate, compliance: float) -> bool:
    """Whether the lowest box of a ring of soft locks has sunk by less than SAGGED when it rests."""
    lowest = f"box {LADDER_COUNT // 2 + 1}"
    observe = {"moved": engine.Final(quantity=engine.Position(lowest), from_start=True)}
    result = simulate(scene(LADDER_COUNT, compliance), time_step=TIME_STEP, duration=2.0, observe=observe)
    return result.completed and -float(result["moved"][2]) < SAGGED * 2.0 * radius(LADDER_COUNT)


def closes(simulate: case.Simulate, count: int) -> bool:
    """Whether a ring of so many rigid locks keeps its shape to 1e-6 % of its diameter, over a second."""
    observe = {"place": engine.MaximumAbsolute(quantity=engine.Position(), from_start=True)}
    result = simulate(scene(count), time_step=TIME_STEP, duration=1.0, observe=observe)
    return result.completed and float(result["place"].max()) < 1e-8 * 2.0 * radius(count)


def softest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest compliance [m/N, rad/(N m)] of locks with which the ring keeps its shape."""
    return break_point(functools.partial(keeps_round, simulate), 1e-8, 1e-3, resolution=1e-3, walk=6)


def most_boxes(simulate: case.Simulate) -> case.BreakPoint:
    """The most boxes of a rigid ring that keeps its shape."""
    return break_count(functools.partial(closes, simulate), RINGS)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest displacement of any box over 1 s, of the ring's diameter [%]."""
    observe = {"place": engine.MaximumAbsolute(quantity=engine.Position(), from_start=True)}
    result = simulate(scene(LADDER_COUNT), time_step=time_step, duration=1.0, method=method, observe=observe)
    return 100.0 * float(result["place"].max()) / (2.0 * radius(LADDER_COUNT))


SOFTEST = SAGGED * 2.0 * radius(LADDER_COUNT) / sinks(LADDER_COUNT)  # m/N, rad/(N m)
TEST = case.ScalarTest(
    title="Closed ring of locks",
    question="Does a closed ring of locks keep its shape in every direction?",
    why="A loop has one joint too many: solvers made for trees cut it open, and singular ones let it creep.",
    model="24 boxes in a vertical ring, each locked to the next and the last to the first, hang on the top box.",
    parameters=(
        ("boxes", "24 (and 200), 0.5 × 0.1 × 0.1 m, 2.5 kg"),
        ("gravity", "9.81 m/s²"),
        ("locks", "compliance 0, damping 2 h"),
        ("time step", "1/60 s, 600 steps"),
    ),
    theory=("With compliance 0 every lock stays closed.", "The hanger carries N m g."),
    reference="Statics (closed form).",
    conclusion="Green: loops are solved like trees. Red: the loop opens, or redundancy is regularised away.",
    source="thesis, section 3.2.1 (asked for)",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            parameters={"N": COUNT},
            metrics=_metrics("gate"),
            measure=_measure(COUNT),  # type: ignore[arg-type]
            note="Direct solver.",
        ),
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            parameters={"N": 200},
            metrics=_metrics("companion"),
            measure=_measure(200),  # type: ignore[arg-type]
            note="A ring of 200 boxes, 100 m around.",
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP),
    figures=(case.Figure(name="displacements", title="Displacement of every box", draw=_draw),),
    ladders=(
        case.Ladder(
            name="shape",
            description="largest displacement of a ring of 12 over 1 s, of its diameter",
            unit="%",
            time_steps=tuple(1.0 / n for n in (30, 60, 120)),
            configurations=configured(
                {"direct": None, "direct, no refinement": None, "iterative, 50 iterations": None}
            ),
            error=ladder_error,
            target_error=None,
            target_seconds=None,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="softest",
            title="Softest locks with which a ring of 12 keeps its shape",
            configuration="plain",
            definition="the lowest box sinks by less than a thousandth of the diameter, at rest",
            study=softest,
            unit="m/N",
            expected=(0.997 * SOFTEST, 1.003 * SOFTEST),
            expected_source="at rest g = −ε F: statics of rigid boxes on springs, small displacements; a thousandth for what "
            "bends with them, another for the search, one to spare",
        ),
        case.StabilityStudy(
            name="most-boxes",
            title="Most boxes of a rigid ring that keeps its shape",
            configuration="plain",
            definition="no box has moved by 1e-6 % of the diameter within a second",
            study=most_boxes,
            unit="1",
            expected=(RINGS[-1], RINGS[-1]),
            expected_source="rigid locks leave rounding, which the cube of the number makes 1e6 times as large at 100: 1e-10 of "
            "the diameter; the search ends there",
        ),
    ),
)

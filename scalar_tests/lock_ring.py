"""Does a closed ring of locks keep its shape in every direction?

A ring closes a loop: one lock more than a tree needs, with its constraint forces in every direction. It hangs on
one box that is locked to the world.
"""

from __future__ import annotations

import math

import numpy as np

from spook_tracker.engine import (
    PLAIN,
    WORLD,
    Box,
    ConstraintForce,
    Lock,
    MaximumAbsolute,
    Method,
    Position,
    Result,
    RigidBody,
    Scene,
    Trace,
)
from spook_tracker.scalar_tests.case import (
    Configuration,
    Curve,
    Drawing,
    Example,
    Figure,
    Ladder,
    Measurement,
    Metric,
    ScalarTest,
    Simulate,
)
from spook_tracker.scalar_tests.sweep import told

COUNT = 24
PIECE = 0.5  # m, length of a box along the ring
MASS = 2.5  # kg
GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
STEPS = 600
LADDER_COUNT = 12


def radius(count: int) -> float:
    """Radius [m] of the circle through the box centres, the pieces meeting end to end."""
    return 0.5 * PIECE / math.tan(math.pi / count)


def scene(count: int = COUNT, compliance: float = 0.0) -> Scene:
    """A vertical ring of locked boxes; box 1, at the top, is locked to the world."""
    size = radius(count)
    angles = [2.0 * math.pi * i / count for i in range(count)]
    boxes = tuple(
        RigidBody(
            name=f"box {i + 1}",
            mass=MASS,
            shape=Box((PIECE, 0.1, 0.1)),
            position=(size * math.sin(angle), 0.0, size * math.cos(angle)),
            orientation=(math.cos(0.5 * angle), 0.0, math.sin(0.5 * angle), 0.0),
        )
        for i, angle in enumerate(angles)
    )
    corner = math.hypot(size, 0.5 * PIECE)

    def lock(i: int) -> Lock:
        angle = 2.0 * math.pi * (i + 0.5) / count
        return Lock(
            name=f"lock {i + 1}",
            between=(f"box {i + 1}", f"box {(i + 1) % count + 1}"),
            at=(corner * math.sin(angle), 0.0, corner * math.cos(angle)),
            compliance=compliance,
        )

    hanger = Lock(name="hanger", between=(WORLD, "box 1"), compliance=0.0)
    return Scene(
        bodies=boxes,
        constraints=(hanger, *(lock(i) for i in range(count))),
        gravity=(0.0, 0.0, -GRAVITY),
        contacts=False,
    )


def displacements(simulate: Simulate, count: int) -> tuple[np.ndarray, float]:
    """(count, 3) largest displacement [m] over the second half of the run, and the hanger's last force [N]."""
    observe = {
        "place": Trace(quantity=Position(), first=STEPS // 2, every=10, from_start=True),
        "hanger": Trace(quantity=ConstraintForce("hanger"), first=STEPS),
    }
    result = simulate(scene(count), time_step=TIME_STEP, steps=STEPS, observe=observe)
    return np.abs(result["place"]).max(axis=0), float(result["hanger"][-1, 2])


def _measure(count: int) -> object:
    def measure(simulate: Simulate) -> dict[str, float]:
        moved, held = displacements(simulate, count)
        return {
            "shape_error": 100.0 * float(moved.max()) / (2.0 * radius(count)),
            "weight_error": held / (count * MASS * GRAVITY) - 1.0,
        }

    return measure


def _draw(simulate: Simulate) -> Drawing:
    moved, _ = displacements(simulate, COUNT)
    boxes = tuple(float(i + 1) for i in range(COUNT))
    return Drawing(
        curves=tuple(
            Curve(name=f"along {axis}", x=boxes, y=tuple(map(float, 1e12 * moved[:, i])))
            for i, axis in enumerate("xyz")
        ),
        x_label="box",
        y_label="largest displacement [pm]",
        note=f"At most {told(1e12 * float(moved.max()))} pm.",
    )


def _metrics(role: str) -> tuple[Metric, ...]:
    return (
        Metric(
            name="shape_error",
            description="largest displacement of a box over the ring's diameter, second half of the run",
            unit="%",
            role=role,  # type: ignore[arg-type]
            limit=1e-10,
            limit_source="rigid locks leave rounding only",
            reference=0.0,
            tolerance=1e-12,
        ),
        Metric(
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


def ladder_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Largest displacement of any box over 1 s, of the ring's diameter [%]."""
    observe = {"place": MaximumAbsolute(quantity=Position(), from_start=True)}
    result = simulate(scene(LADDER_COUNT), time_step=time_step, duration=1.0, method=method, observe=observe)
    return 100.0 * float(result["place"].max()) / (2.0 * radius(LADDER_COUNT))


def ladder_run(simulate: Simulate, time_step: float, method: Method) -> Result:
    """The same ring with nothing observed."""
    return simulate(scene(LADDER_COUNT), time_step=time_step, duration=1.0, method=method)


TEST = ScalarTest(
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
        Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            parameters={"N": COUNT},
            metrics=_metrics("gate"),
            measure=_measure(COUNT),  # type: ignore[arg-type]
            note="Direct solver.",
        ),
        Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            parameters={"N": 200},
            metrics=_metrics("companion"),
            measure=_measure(200),  # type: ignore[arg-type]
            note="A ring of 200 boxes, 100 m around.",
        ),
    ),
    example=lambda: Example(scene=scene(), time_step=TIME_STEP),
    figures=(Figure(name="displacements", title="Displacement of every box", draw=_draw),),
    ladders=(
        Ladder(
            name="shape",
            description="largest displacement of a ring of 12 over 1 s, of its diameter",
            unit="%",
            time_steps=tuple(1.0 / n for n in (30, 60, 120)),
            configurations=(
                Configuration(name="direct", method=PLAIN, expected_order=None),
                Configuration(
                    name="direct, no refinement", method=Method(refinements=0), expected_order=None
                ),
                Configuration(
                    name="iterative, 50 sweeps", method=Method(solver="iterative"), expected_order=None
                ),
            ),
            error=ladder_error,
            run=ladder_run,
            target_error=None,
            target_seconds=None,
        ),
    ),
)

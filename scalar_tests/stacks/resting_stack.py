"""Does every contact of a stack carry exactly what lies above it?"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_count, break_point
from ..configurations import configured
from ..sweep import line

COUNT = 20
EDGE = 1.0  # m
MASS = 1.0  # kg
GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
STEPS = 600  # 10 s
HEIGHTS, TALLEST = (2, 5, 10, 20, 40, 80, 160, 320), 1280  # boxes
SWEPT = engine.Method(solver="iterative", iterations=50)
NEARLY = 0.01  # relative, of loads by sweeps, which are never right to 1e-6
LADDER_COUNT = 8
LADDER_DURATION = 2.0  # s


def scene(count: int = COUNT, masses: tuple[float, ...] = ()) -> engine.Scene:
    """`count` boxes on top of each other, at rest, on a plane; of 1 kg, or of `masses` [kg] from below."""
    smooth = Material(friction=0.5)
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=smooth
    )
    boxes = (
        engine.RigidBody(
            name=f"box {i + 1}",
            mass=masses[i] if masses else MASS,
            shape=engine.Box((EDGE, EDGE, EDGE)),
            position=(0.0, 0.0, (i + 0.5) * EDGE),
            material=smooth,
        )
        for i in range(count)
    )
    return engine.Scene(bodies=(floor, *boxes), gravity=(0.0, 0.0, -GRAVITY))


def loads(simulate: case.Simulate, count: int = COUNT) -> np.ndarray:
    """(count,) upward force [N] on each box from what lies under it, after STEPS steps."""
    below = ["floor", *(f"box {i}" for i in range(1, count))]
    observe = {
        f"box {i + 1}": engine.Trace(quantity=engine.ContactForce(f"box {i + 1}", below[i]), first=STEPS)
        for i in range(count)
    }
    result = simulate(scene(count), time_step=TIME_STEP, steps=STEPS, observe=observe)
    return np.array([result[name][-1, 2] for name in observe])


def expected(count: int = COUNT) -> np.ndarray:
    """(count,) weight [N] of each box and all above it."""
    return MASS * GRAVITY * np.arange(count, 0, -1.0)


def _measure_loads(simulate: case.Simulate) -> dict[str, float]:
    return {"load_error": float(np.abs(loads(simulate) / expected() - 1.0).max())}


def _measure_energy(simulate: case.Simulate) -> dict[str, float]:
    observe = {
        "energy": engine.Maximum(quantity=engine.Energy(), from_start=True),
        "drift": engine.Trace(quantity=engine.Position(), first=STEPS, from_start=True),
    }
    result = simulate(scene(), time_step=TIME_STEP, steps=STEPS, observe=observe)
    scale = MASS * GRAVITY * EDGE
    moved = result["drift"][-1]
    return {
        "energy_gain": float(result["energy"]) / scale,
        "drift": float(np.abs(moved).max()),
        "overlap": deepest(moved),
    }


def deepest(moved: np.ndarray) -> float:
    """How far a box is sunk into the one under it at most [m], for the (1 + count, 3) displacements of floor and boxes.

    Seen from where the bodies are, which every engine tells, and not from what it takes for the depth of a contact. The
    floor is left out: boxes rest on boxes. Those that no longer stand on each other have no such depth: not a number.
    """
    if np.abs(moved[1:, :2]).max() >= 0.5 * EDGE:
        return math.nan
    return float(-np.diff(moved[1:, 2]).min())


def _draw_loads(simulate: case.Simulate) -> case.Drawing:
    contacts = tuple(float(i + 1) for i in range(COUNT))
    return case.Drawing(
        curves=(
            line("simulation", contacts, loads(simulate), "points"),
            line("(N − i + 1) m g", contacts, expected(), "reference"),
        ),
        x_label="contact, from the floor up",
        y_label="force [N]",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest relative error of the force under each of eight boxes after 2 s."""
    below = ["floor", *(f"box {i}" for i in range(1, LADDER_COUNT))]
    observe = {
        f"box {i + 1}": engine.Final(quantity=engine.ContactForce(f"box {i + 1}", below[i]))
        for i in range(LADDER_COUNT)
    }
    result = simulate(
        scene(LADDER_COUNT), time_step=time_step, duration=LADDER_DURATION, method=method, observe=observe
    )
    held = np.array([result[name][2] for name in observe])
    return float(np.abs(held / expected(LADDER_COUNT) - 1.0).max())


def _stands(simulate: case.Simulate, masses: tuple[float, ...], tolerance: float = 1e-6) -> bool:
    """Whether boxes of these masses [kg], bottom first, stand still for two seconds with the right loads."""
    built = scene(len(masses), masses)
    names = [box.name for box in built.bodies]
    observe: dict[str, Observable] = {
        name: engine.Final(quantity=engine.ContactForce(name, below)) for below, name in pairwise(names)
    }
    observe["sink"] = engine.MaximumAbsolute(quantity=engine.Position(), from_start=True)
    result = simulate(built, time_step=TIME_STEP, steps=120, observe=observe)
    if not result.completed:
        return False
    right = GRAVITY * np.cumsum(masses[::-1])[::-1]
    held = np.array([result[name][2] for name in names[1:]])
    return bool(np.abs(held / right - 1.0).max() <= tolerance and result["sink"].max() <= tolerance * EDGE)


def heaviest_on_light(simulate: case.Simulate) -> case.BreakPoint:
    """Largest mass ratio of a box standing on a box of 1 kg."""
    return break_point(
        lambda ratio: _stands(simulate, (MASS, ratio * MASS)), 1.0, 1e12, resolution=0.1, walk=13
    )


def heaviest_neighbour(simulate: case.Simulate) -> case.BreakPoint:
    """Largest mass ratio of neighbours in a stack of six, light and heavy in turn."""
    return break_point(
        lambda ratio: _stands(simulate, (MASS, ratio * MASS) * 3), 1.0, 1e12, resolution=0.1, walk=13
    )


def tallest_stack(simulate: case.Simulate) -> case.BreakPoint:
    """Most equal boxes that stand on each other."""
    return break_count(lambda count: _stands(simulate, (MASS,) * count), (*HEIGHTS, TALLEST))


def tallest_swept(simulate: case.Simulate) -> case.BreakPoint:
    """Most equal boxes that stand on each other by fifty sweeps."""

    def swept(scene: engine.Scene, **options: Any) -> engine.Result:
        return simulate(scene, **(options | {"method": SWEPT}))

    return break_count(lambda count: _stands(swept, (MASS,) * count, NEARLY), HEIGHTS)


TEST = case.ScalarTest(
    title="Resting stack",
    question="Does every contact of a stack of 20 boxes carry exactly what lies above it?",
    why="Iterative solvers pass the weight down one contact per sweep; a tall stack shows what is still missing.",
    model="20 equal boxes stand on each other on a plane, at rest, for ten seconds.",
    parameters=(
        ("boxes", "20, 1 × 1 × 1 m, 1 kg"),
        ("gravity", "9.81 m/s²"),
        ("friction coefficient", "0.5"),
        ("time step", "1/60 s, 600 steps"),
    ),
    theory=("Contact i carries F_i = (N − i + 1) m g.", "Nothing moves, so no energy is gained."),
    reference="Statics (closed form).",
    conclusion="Green: contacts are solved, not approached. Red: the solver stops early or lets the stack breathe.",
    source="ours; the thesis asks for larger contact scenes in section 5.4",
    measurements=(
        case.Measurement(
            configuration="direct",
            time_step=TIME_STEP,
            parameters={"N": COUNT},
            metrics=(
                case.Metric(
                    name="load_error",
                    description="largest relative error of a contact's force after 10 s",
                    unit="1",
                    role="gate",
                    limit=1e-9,
                    limit_source="statics, to rounding",
                    reference=0.0,
                    tolerance=1e-12,
                ),
            ),
            measure=_measure_loads,
            note="Direct solver.",
        ),
        case.Measurement(
            configuration="direct",
            time_step=TIME_STEP,
            parameters={"N": COUNT},
            metrics=(
                case.Metric(
                    name="energy_gain",
                    description="largest energy above the start in 10 s, over m g times one edge",
                    unit="1",
                    role="companion",
                    better="smaller",
                    limit=1e-9,
                    limit_source="a stack at rest gains nothing",
                    reference=0.0,
                    tolerance=1e-12,
                ),
                case.Metric(
                    name="drift",
                    description="largest displacement of any box in 10 s",
                    unit="m",
                    role="companion",
                    limit=1e-9,
                    limit_source="a stack at rest stays where it is",
                    reference=0.0,
                    tolerance=1e-12,
                ),
                case.Metric(
                    name="overlap",
                    description="how far a box is sunk into the box under it at most, after 10 s",
                    unit="m",
                    role="companion",
                    better="smaller",
                    limit=1e-9,
                    limit_source="rigid boxes that only touch at the start stay so",
                    reference=0.0,
                    tolerance=1e-12,
                ),
            ),
            measure=_measure_energy,
            note="Direct solver.",
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP),
    figures=(case.Figure(name="loads", title="Force of every contact", draw=_draw_loads),),
    ladders=(
        case.Ladder(
            name="loads",
            description="largest relative error of a contact's load in a stack of eight after 2 s",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=configured(
                {"direct": None, "iterative, 50 iterations": None, "iterative, 200 iterations": None}
            ),
            error=ladder_error,
            target_error=0.1,
            target_seconds=1.0,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="heavy-on-light",
            title="Largest mass ratio of a box on a lighter box",
            configuration="plain",
            definition="2 s with every load right to 1e-6 and nothing moved by more than 1e-6 of an edge",
            study=heaviest_on_light,
            unit="1",
            expected=(1e9, 1e12),
            expected_source="the contact solve is refined against the true equations; the search ends at 1e12",
        ),
        case.StabilityStudy(
            name="heavy-neighbours",
            title="Largest mass ratio of neighbours in a stack of six",
            configuration="plain",
            definition="2 s with every load right to 1e-6 and nothing moved by more than 1e-6 of an edge",
            study=heaviest_neighbour,
            unit="1",
            expected=(1e9, 1e12),
            expected_source="the contact solve is refined against the true equations; the search ends at 1e12",
        ),
        case.StabilityStudy(
            name="tallest-stack",
            title="Tallest stack of equal boxes",
            configuration="plain",
            definition="2 s with every load right to 1e-6 and nothing moved by more than 1e-6 of an edge",
            study=tallest_stack,
            unit="boxes",
            expected=(float(TALLEST), float(TALLEST)),
            expected_source="statics: a direct solve carries any number; the search ends at 1280",
        ),
        case.StabilityStudy(
            name="tallest-stack-swept",
            title="Tallest stack of equal boxes by fifty sweeps",
            configuration="iterative",
            definition="2 s with every load right to a hundredth and nothing moved by more than a hundredth of an edge",
            study=tallest_swept,
            unit="boxes",
            expected_source="none: how near to its loads fifty sweeps bring a stack has no closed form",
        ),
    ),
)

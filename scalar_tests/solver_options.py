"""Do options that shall only save work, or only report, leave the answer alone?"""

from __future__ import annotations

import random

import numpy as np

from spook_tracker.engine import (
    Box,
    ConstraintForce,
    Energy,
    Final,
    Material,
    Method,
    Plane,
    Position,
    RigidBody,
    Scene,
    Trace,
    Velocity,
)
from spook_tracker.scalar_tests.bracket import break_point, unbroken
from spook_tracker.scalar_tests.case import (
    BreakPoint,
    Drawing,
    Example,
    Figure,
    Metric,
    ScalarTest,
    Simulate,
    StabilityStudy,
)
from spook_tracker.scalar_tests.closed_form import ask, error
from spook_tracker.scalar_tests.door.scene import least_norm_forces
from spook_tracker.scalar_tests.door.scene import scene as hung
from spook_tracker.scalar_tests.pendulum.scene import LENGTH
from spook_tracker.scalar_tests.pendulum.scene import scene as pendulum
from spook_tracker.scalar_tests.sweep import line

GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
EDGE = 0.5  # m, of boxes of the heap
HEAPED, FEW = 30, 8
MANY, SIDE = 216, 6  # so many that threads share them: more than 512 contacts
FALLING = 0.25  # s: while the heap falls together
THREADS = (2, 4)
BEND = GRAVITY * TIME_STEP**2 / LENGTH  # of its length, by which the pendulum bends in a step at its fastest
CAPS = (0.03, 0.1, 1.0)  # beside the default
DRAWN = (1e-4, 3e-4, 1e-3, 2e-3, 2.5e-3, 3e-3, 1e-2, 1e-1)
SEARCHED = 1e-3
FLOORS = (1e-16, 1e-14, 1e-10, 1e-8)  # from 1e-6 on the hinges share the door as they like
THRESHOLDS = (0.3, 0.1, 0.03, 0.01)  # m/s, below what ten sweeps leave by themselves, 0.17, but for the first
ROUGH = Material(friction=0.5)
FLOOR = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=ROUGH)


def heap(count: int = HEAPED, side: int = 2) -> Scene:
    """Boxes dropped in square layers, a little aside."""
    draw = random.Random(5)
    boxes = tuple(
        RigidBody(
            name=f"box {k}",
            mass=1.0 + k % 3,
            shape=Box((EDGE, EDGE, EDGE)),
            position=(
                0.55 * (k % side) + draw.uniform(-0.02, 0.02),
                0.55 * (k // side % side) + draw.uniform(-0.02, 0.02),
                0.26 + 0.51 * (k // side**2),
            ),
            material=ROUGH,
        )
        for k in range(count)
    )
    return Scene(bodies=(FLOOR, *boxes), gravity=(0.0, 0.0, -GRAVITY))


def _threads(simulate: Simulate) -> dict[str, float]:
    def fallen(threads: int) -> np.ndarray:
        result = simulate(
            heap(MANY, SIDE),
            time_step=TIME_STEP,
            duration=FALLING,
            method=Method(solver="iterative", iterations=20, threads=threads),
            observe={"x": Final(quantity=Position()), "v": Final(quantity=Velocity())},
        )
        return np.hstack((result.partial["x"], result.partial["v"]))

    alone = fallen(1)
    return {"bits_of_threads": float(sum((fallen(threads) != alone).sum() for threads in THREADS))}


def _reported(simulate: Simulate) -> dict[str, float]:
    """Thresholds that ten sweeps and those they call for reach: runs that left more, or are not called completed."""
    wrong = 0
    for threshold in THRESHOLDS:
        method = Method(solver="iterative", iterations=10, unsettled_residual=threshold)
        result = simulate(heap(), time_step=TIME_STEP, duration=FALLING, method=method)
        wrong += result.residual > threshold or not result.completed
    return {"misreported": float(wrong)}


def _swung(simulate: Simulate, cap: float) -> np.ndarray:
    method = Method(corrections=2, correction_cap=cap)
    observe = {"x": Trace(quantity=Position()), "energy": Trace(quantity=Energy())}
    result = simulate(pendulum(TIME_STEP), time_step=TIME_STEP, duration=5.0, method=method, observe=observe)
    return np.hstack((result["x"].reshape(len(result["energy"]), -1), result["energy"][:, None]))


def _capped(simulate: Simulate) -> dict[str, float]:
    usual = _swung(simulate, Method().correction_cap)
    return {"bits_of_the_cap": float(sum((_swung(simulate, cap) != usual).sum() for cap in CAPS))}


def _floored(simulate: Simulate) -> dict[str, float]:
    """How five hinges of compliance 0, which repeat each other, share a door as the pivots' floor is raised."""
    door, right = hung(5, damping=2.0 * TIME_STEP, compliance=0.0), least_norm_forces(5)
    observe = {name: Final(quantity=ConstraintForce(name)) for name in (f"hinge {k + 1}" for k in range(5))}
    worst = 0.0
    for floor in FLOORS:
        result = simulate(
            door, time_step=TIME_STEP, duration=1.0, method=Method(floor=floor), observe=observe
        )
        held = np.stack([result[name] for name in observe])
        worst = max(worst, float(np.abs(held - right).max() / np.abs(right).max()))
    return {"split_of_floors": worst}


def tightest(simulate: Simulate) -> BreakPoint:
    """The smallest cap of a correction that leaves the pendulum alone, to the bit."""
    usual = _swung(simulate, Method().correction_cap)
    return break_point(
        lambda cap: bool((_swung(simulate, cap) == usual).all()), 1.0, 1e-5, resolution=SEARCHED, walk=6
    )


def told(simulate: Simulate, threshold: float) -> bool:
    """Whether a run of few boxes is called unsettled if it has left more than its threshold [m/s], and only then."""
    method = Method(solver="iterative", iterations=10, unsettled_residual=threshold)
    result = simulate(heap(FEW), time_step=TIME_STEP, duration=FALLING, method=method)
    return result.completed == (result.residual <= threshold)


def _draw(simulate: Simulate) -> Drawing:
    usual = _swung(simulate, Method().correction_cap)
    moved = [float(np.abs(_swung(simulate, cap) - usual).max()) for cap in DRAWN]
    return Drawing(
        curves=(line("largest move of the bob or change of its energy", DRAWN, moved, "both"),),
        x_label="correction_cap",
        y_label="difference from the default's [m, J]",
        x_scale="log",
    )


def _none(name: str, description: str, unit: str, source: str) -> Metric:
    return Metric(
        name=name,
        description=description,
        unit=unit,
        role="gate",
        limit=0.0,
        limit_source=source,
        reference=0.0,
    )


TEST = ScalarTest(
    title="Options of the solver",
    question="Do options that shall only save work, or only report, leave the answer alone?",
    why="Threads and guards are set once and trusted. One that changes an answer a little is never suspected.",
    model="A heap of boxes, a pendulum and a door, with one option turned at a time.",
    parameters=(
        ("threads", "1 against 2 and 4: 216 boxes fall together, more than 512 contacts, 20 sweeps"),
        ("unsettled_residual", "0.3 to 0.01 m/s, 30 boxes fall together, 10 sweeps"),
        ("correction_cap", "0.03 to 1, a pendulum that bends 0.003 a step"),
        ("floor", "1e-16 to 1e-8, a door of 45 kg on five hinges of compliance 0"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "Work shared among threads is the same work. A cap that nothing reaches caps nothing: a pendulum let go level departs "
        "from its chord by (v h)²/(2 l), g h² where it is fastest.",
        "A threshold is kept by more sweeps where that can be; a run within it is settled.",
    ),
    reference="The same scene without the option, to the bit; statics.",
    conclusion="Green: they may be turned freely. Red: one of them is part of the answer.",
    source="ours",
    lacks={"ladder": "exact at every step"},
    measurements=(
        ask(
            _threads,
            (
                _none(
                    "bits_of_threads",
                    "numbers of places and velocities that differ from one thread's",
                    "1",
                    "the same sums in the same order",
                ),
            ),
            "A heap falls together.",
            TIME_STEP,
            "threads",
        ),
        ask(
            _reported,
            (
                _none(
                    "misreported",
                    "runs that left more than their threshold or are called unsettled, of four",
                    "1",
                    "a run that left no more than the threshold is settled; sweeps go on until then",
                ),
            ),
            "A heap with too few sweeps.",
            TIME_STEP,
            "thresholds",
        ),
        ask(
            _capped,
            (
                _none(
                    "bits_of_the_cap",
                    "numbers that differ from the default's",
                    "1",
                    "nothing reaches the cap",
                ),
            ),
            "A pendulum, curved twice.",
            TIME_STEP,
            "caps",
        ),
        ask(
            _floored,
            (
                error(
                    "split_of_floors",
                    "largest error of a hinge's force or torque, of the largest, four floors",
                    "1",
                    1e-8,
                    "the split of least norm; a floor is in the factor only, and refinement is against the true equations",
                ),
            ),
            "A door on hinges that repeat each other.",
            TIME_STEP,
            "floors",
        ),
    ),
    example=lambda: Example(scene=heap(), time_step=TIME_STEP),
    figures=(Figure(name="cap", title="From g h² on, 0.0027, a cap leaves the pendulum alone", draw=_draw),),
    stability=(
        StabilityStudy(
            name="tightest",
            title="Smallest cap of a correction that leaves the pendulum alone",
            configuration="caps",
            definition="every bit of places and energies over 5 s is the default's",
            study=tightest,
            unit="1",
            better="smaller",
            expected=((1.0 - BEND) * BEND, (1.0 + BEND + 1.1 * SEARCHED) * BEND),
            expected_source="(v h)²/(2 l) with v² = 2 g l at the bottom, more or less by what is left of its next order, g h²/l of it; "
            "the search ends 0.1 % above it at most",
        ),
        unbroken(
            told,
            0.3,
            1e-9,
            name="strictest",
            title="Smallest threshold by which a run is judged",
            definition="eight boxes are called unsettled where they have left more, and only there",
            source="a comparison of two numbers, whatever they are",
            unit="m/s",
            configuration="thresholds",
        ),
    ),
)

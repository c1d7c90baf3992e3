"""Do options that shall only save work, or only report, leave the answer alone?"""

from __future__ import annotations

import math
import random

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..sweep import line
from ..thesis.door.scene import least_norm_forces
from ..thesis.door.scene import scene as hung
from ..thesis.pendulum.scene import LENGTH
from ..thesis.pendulum.scene import scene as pendulum

GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
EDGE = 0.5  # m, of boxes of the heap
HEAPED, FEW = 30, 8
FALLING = 0.25  # s: while the heap falls together
BEND = GRAVITY * TIME_STEP**2 / LENGTH  # of its length, by which the pendulum bends in a step at its fastest
CAPS = (0.03, 0.1, 1.0)  # beside the default
DRAWN = (1e-4, 3e-4, 1e-3, 2e-3, 2.5e-3, 3e-3, 1e-2, 1e-1)
SEARCHED = 1e-3
FLOORS = (1e-16, 1e-14, 1e-10, 1e-8)  # from 1e-6 on the hinges share the door as they like
THRESHOLDS = (0.3, 0.1, 0.03, 0.01)  # m/s, below what ten sweeps leave by themselves, 0.17, but for the first
STACKED, LYING = 5, 3.0  # boxes, s
SLEEPY = engine.Method(sleep_speed=0.02)
AFTER = SLEEPY.sleep_after  # s
RADIUS = 0.1  # m, of the ball
SLOPE = math.radians(30.0)
PULL = GRAVITY * math.sin(SLOPE)  # m/s², along it
FINE = TIME_STEP / 4.0  # s, on the slope
ROUGH = engine.Material(friction=0.5)
FLOOR = engine.RigidBody(
    name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=ROUGH
)


def heap(count: int = HEAPED, side: int = 2) -> engine.Scene:
    """Boxes dropped in square layers, a little aside."""
    draw = random.Random(5)
    boxes = tuple(
        engine.RigidBody(
            name=f"box {k}",
            mass=1.0 + k % 3,
            shape=engine.Box((EDGE, EDGE, EDGE)),
            position=(
                0.55 * (k % side) + draw.uniform(-0.02, 0.02),
                0.55 * (k // side % side) + draw.uniform(-0.02, 0.02),
                0.26 + 0.51 * (k // side**2),
            ),
            material=ROUGH,
        )
        for k in range(count)
    )
    return engine.Scene(bodies=(FLOOR, *boxes), gravity=(0.0, 0.0, -GRAVITY))


def _reported(simulate: case.Simulate) -> dict[str, float]:
    """Thresholds that ten sweeps and those they call for reach: runs that left more, or are not called completed."""
    wrong = 0
    for threshold in THRESHOLDS:
        method = engine.Method(solver="iterative", iterations=10, unsettled_residual=threshold)
        result = simulate(heap(), time_step=TIME_STEP, duration=FALLING, method=method)
        wrong += result.residual > threshold or not result.completed
    return {"misreported": float(wrong)}


def _swung(simulate: case.Simulate, cap: float) -> np.ndarray:
    method = engine.Method(corrections=2, correction_cap=cap)
    observe = {
        "x": engine.Trace(quantity=engine.Position()),
        "energy": engine.Trace(quantity=engine.Energy()),
    }
    result = simulate(pendulum(TIME_STEP), time_step=TIME_STEP, duration=5.0, method=method, observe=observe)
    return np.hstack((result["x"].reshape(len(result["energy"]), -1), result["energy"][:, None]))


def _capped(simulate: case.Simulate) -> dict[str, float]:
    usual = _swung(simulate, engine.Method().correction_cap)
    return {"bits_of_the_cap": float(sum((_swung(simulate, cap) != usual).sum() for cap in CAPS))}


def _floored(simulate: case.Simulate) -> dict[str, float]:
    """How five hinges of compliance 0, which repeat each other, share a door as the pivots' floor is raised."""
    door, right = hung(5, damping=2.0 * TIME_STEP, compliance=0.0), least_norm_forces(5)
    observe = {
        name: engine.Final(quantity=engine.ConstraintForce(name))
        for name in (f"hinge {k + 1}" for k in range(5))
    }
    worst = 0.0
    for floor in FLOORS:
        result = simulate(
            door, time_step=TIME_STEP, duration=1.0, method=engine.Method(floor=floor), observe=observe
        )
        held = np.stack([result[name] for name in observe])
        worst = max(worst, float(np.abs(held - right).max() / np.abs(right).max()))
    return {"split_of_floors": worst}


def stack() -> engine.Scene:
    """Boxes of 1 kg one on the other, at rest."""
    boxes = tuple(
        engine.RigidBody(
            name=f"box {k}",
            mass=1.0,
            shape=engine.Box((1.0,) * 3),
            position=(0.0, 0.0, 0.5 + k),
            material=ROUGH,
        )
        for k in range(STACKED)
    )
    return engine.Scene(bodies=(FLOOR, *boxes), gravity=(0.0, 0.0, -GRAVITY))


def thrown(speed: float, slope: float = 0.5 * math.pi) -> engine.Scene:
    """A ball on its way straight up, or up a smooth slope [rad]; x is up the slope."""
    ball = engine.RigidBody(
        name="ball",
        mass=1.0,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, RADIUS),
        velocity=(speed, 0.0, 0.0),
    )
    ground = engine.RigidBody(name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0))
    return engine.Scene(
        bodies=(ground, ball), gravity=(-GRAVITY * math.sin(slope), 0.0, -GRAVITY * math.cos(slope))
    )


def _asleep(simulate: case.Simulate) -> dict[str, float]:
    """What lies keeps its place and its weight, and what flies is left alone."""
    observe = {
        "x": engine.Trace(quantity=engine.Position()),
        "load": engine.Final(quantity=engine.ContactForce("floor")),
    }
    result = simulate(stack(), time_step=TIME_STEP, duration=LYING, method=SLEEPY, observe=observe)
    late = result["x"][result.sample_times["x"] > AFTER + 2.0 * TIME_STEP]
    flight = {"x": engine.Trace(quantity=engine.Position("ball"))}
    flown, free = (
        simulate(thrown(4.0), time_step=TIME_STEP, duration=1.0, method=method, observe=flight)["x"]
        for method in (engine.Method(sleep_speed=3.0), engine.Method())
    )
    return {
        "awake": STACKED - float(result.counters.get("asleep", 0)),
        "moved_asleep": float(np.abs(late - late[-1]).max()),
        "load_asleep": float(abs(result["load"][2]) / (STACKED * GRAVITY) - 1.0),
        "held_in_flight": float(np.abs(flown - free).max()),
    }


def comes_down(simulate: case.Simulate, slow: float) -> bool:
    """Whether a ball thrown up the slope at twice the speed at which bodies sleep [m/s] comes down again."""
    result = simulate(
        thrown(2.0 * slow, SLOPE),
        time_step=FINE,
        duration=2.0 * slow / PULL + AFTER,
        method=engine.Method(sleep_speed=slow),
        observe={"v": engine.Final(quantity=engine.Velocity("ball"))},
    )
    return bool(result["v"][0] < 0.0)


def laziest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest sleep speed [m/s] with which a ball is not put to sleep where it turns back on a smooth slope."""
    return break_point(lambda slow: comes_down(simulate, slow), 0.1, 20.0, resolution=1e-3, walk=9)


def tightest(simulate: case.Simulate) -> case.BreakPoint:
    """The smallest cap of a correction that leaves the pendulum alone, to the bit."""
    usual = _swung(simulate, engine.Method().correction_cap)
    return break_point(
        lambda cap: bool((_swung(simulate, cap) == usual).all()), 1.0, 1e-5, resolution=SEARCHED, walk=6
    )


def told(simulate: case.Simulate, threshold: float) -> bool:
    """Whether a run of few boxes is called unsettled if it has left more than its threshold [m/s], and only then."""
    method = engine.Method(solver="iterative", iterations=10, unsettled_residual=threshold)
    result = simulate(heap(FEW), time_step=TIME_STEP, duration=FALLING, method=method)
    return result.completed == (result.residual <= threshold)


def _draw(simulate: case.Simulate) -> case.Drawing:
    usual = _swung(simulate, engine.Method().correction_cap)
    moved = [float(np.abs(_swung(simulate, cap) - usual).max()) for cap in DRAWN]
    return case.Drawing(
        curves=(line("largest move of the bob or change of its energy", DRAWN, moved, "both"),),
        x_label="correction_cap",
        y_label="difference from the default's [m, J]",
        x_scale="log",
    )


def _none(name: str, description: str, unit: str, source: str) -> case.Metric:
    return case.Metric(
        name=name,
        description=description,
        unit=unit,
        role="gate",
        limit=0.0,
        limit_source=source,
        reference=0.0,
    )


TEST = case.ScalarTest(
    title="Options of the solver",
    question="Do options that shall only save work, or only report, leave the answer alone?",
    why="Sleeping and guards are set once and trusted. One that changes an answer a little is never suspected.",
    model="A heap of boxes, a stack, a thrown ball, a pendulum and a door, with one option turned at a time.",
    parameters=(
        ("unsettled_residual", "0.3 to 0.01 m/s, 30 boxes fall together, 10 sweeps"),
        ("correction_cap", "0.03 to 1, a pendulum that bends 0.003 a step"),
        (
            "sleep_speed",
            f"{SLEEPY.sleep_speed} m/s for {AFTER} s: five boxes; 3 m/s: a ball thrown up at 4 m/s; up a smooth slope of 30°",
        ),
        ("floor", "1e-16 to 1e-8, a door of 45 kg on five hinges of compliance 0"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "A cap that nothing reaches caps nothing: a pendulum let go level departs "
        "from its chord by (v h)²/(2 l), g h² where it is fastest.",
        "What falls freely is not at rest at the top. On a smooth slope it is slower than s for 2 s/(g sin α): with s below half "
        "of g sin α times sleep_after it does not sleep.",
        "A threshold is kept by more sweeps where that can be; a run within it is settled.",
    ),
    reference="The same scene without the option, to the bit; statics.",
    conclusion="Green: they may be turned freely. Red: one of them is part of the answer.",
    source="ours",
    lacks={"ladder": "exact at every step"},
    measurements=(
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
            _asleep,
            (
                _none("awake", "boxes of the stack awake after 3 s", "1", "they lie still from the start"),
                _none(
                    "moved_asleep",
                    "largest move of a box of the stack once asleep",
                    "m",
                    "a sleeping body keeps every bit",
                ),
                error(
                    "load_asleep",
                    "relative error of the floor's load",
                    "1",
                    1e-9,
                    "the weight, as it was last",
                ),
                _none(
                    "held_in_flight",
                    "largest change of a ball's path by sleeping",
                    "m",
                    "what nothing holds is not at rest, however slow it is at its top",
                ),
            ),
            "A stack lies, a ball flies.",
            TIME_STEP,
            "sleeping",
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
    example=lambda: case.Example(scene=heap(), time_step=TIME_STEP),
    figures=(
        case.Figure(name="cap", title="From g h² on, 0.0027, a cap leaves the pendulum alone", draw=_draw),
    ),
    stability=(
        case.StabilityStudy(
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
        case.StabilityStudy(
            name="laziest",
            title="Largest sleep speed with which a ball is not put to sleep where it turns back on a slope",
            configuration="sleeping",
            definition="thrown up a smooth slope of 30° at twice that speed, it comes down again",
            study=laziest,
            unit="m/s",
            expected=(0.5 * PULL * (AFTER - 2.0 * FINE), 0.5 * PULL * (AFTER + 2.0 * FINE)),
            expected_source="2 s/(g sin α) = sleep_after, counted in steps of 1/240 s, two at most more or less",
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

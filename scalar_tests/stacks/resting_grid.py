"""Is whatever lies on something in equilibrium?"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.shapes import Shape

from .. import case
from ..bracket import break_point
from ..configurations import configured
from ..heavier import heavier

EDGE, RADIUS = 1.0, 0.5  # m
MASS = 1.0  # kg
GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
DURATION = 2.0  # s
LYING = (0.5**0.5, 0.5**0.5, 0.0, 0.0)  # turned about x, so that an axis along z lies level
SHAPES: Mapping[str, tuple[Shape, tuple[float, float, float, float]]] = {
    "box": (engine.Box((EDGE, EDGE, EDGE)), (1.0, 0.0, 0.0, 0.0)),
    "ball": (engine.Sphere(RADIUS), (1.0, 0.0, 0.0, 0.0)),
    "cylinder": (engine.Cylinder(RADIUS, EDGE), (1.0, 0.0, 0.0, 0.0)),
    "capsule": (engine.Capsule(RADIUS, EDGE), LYING),
}
STACKS = (2, 5, 10, 20)  # boxes
RATIOS = (1.0, 1e2, 1e4)  # of the upper box's mass
RATIO = 100.0  # of the ladders
DEEP, ASIDE, OFF = 1e-3, 1e-4, 0.01  # m, m, of the load
LONGEST, HEAVIEST = 1e4, 1e12  # s, kg, where the searches end
ROUGH = Material(friction=0.5)


def on_plane(shape: str) -> engine.Scene:
    """A body of that shape on a plane, touching from the start: half a metre up its centre, all of them."""
    form, turn = SHAPES[shape]
    body = engine.RigidBody(
        name="body 1", mass=MASS, shape=form, position=(0.0, 0.0, RADIUS), orientation=turn, material=ROUGH
    )
    return engine.Scene(bodies=(_floor(), body), gravity=(0.0, 0.0, -GRAVITY))


def stack(*masses: float) -> engine.Scene:
    """Boxes of those masses [kg] on each other, from below."""
    boxes = (
        engine.RigidBody(
            name=f"body {k + 1}",
            mass=mass,
            shape=engine.Box((EDGE, EDGE, EDGE)),
            position=(0.0, 0.0, (k + 0.5) * EDGE),
            material=ROUGH,
        )
        for k, mass in enumerate(masses)
    )
    return engine.Scene(bodies=(_floor(), *boxes), gravity=(0.0, 0.0, -GRAVITY))


def _floor() -> engine.RigidBody:
    return engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=ROUGH
    )


def moved(
    simulate: case.Simulate,
    built: engine.Scene,
    time_step: float = TIME_STEP,
    method: engine.Method = engine.PLAIN,
) -> tuple[float, float]:
    """How far any body is after two seconds up or down, and aside, from where it was put [m]."""
    observe = {"way": engine.Final(quantity=engine.Position(), from_start=True)}
    way = simulate(built, time_step=time_step, duration=DURATION, method=method, observe=observe)["way"]
    return float(np.abs(way[:, 2]).max()), float(np.abs(way[:, :2]).max())


def load_error(
    simulate: case.Simulate,
    built: engine.Scene,
    time_step: float = TIME_STEP,
    method: engine.Method = engine.PLAIN,
) -> float:
    """How far the force under any body is from the weight of it and all above after two seconds, over that."""
    names = [body.name for body in built.bodies]
    observe: dict[str, Observable] = {
        above: engine.Final(quantity=engine.ContactForce(above, below)) for below, above in pairwise(names)
    }
    found = simulate(built, time_step=time_step, duration=DURATION, method=method, observe=observe)
    held = np.array([found[name] for name in names[1:]])
    masses = [body.mass or 0.0 for body in built.bodies[1:]]
    right = np.zeros_like(held)
    right[:, 2] = GRAVITY * np.cumsum(masses[::-1])[::-1]
    return float((np.linalg.norm(held - right, axis=1) / right[:, 2]).max())


def heavy_on_light() -> engine.Scene:
    return stack(MASS, RATIO * MASS)


def ladder_load(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    return load_error(simulate, heavy_on_light(), time_step, method)


def ladder_depth(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    return moved(simulate, heavy_on_light(), time_step, method)[0]


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] after ten of which a capsule that lies is told to press with its weight."""

    def presses(time_step: float) -> bool:
        observe = {"force": engine.Final(quantity=engine.ContactForce("body 1", "floor"))}
        result = simulate(on_plane("capsule"), time_step=time_step, steps=10, observe=observe)
        return result.completed and abs(float(result["force"][2]) / (MASS * GRAVITY) - 1.0) < 1e-9

    return break_point(presses, TIME_STEP, LONGEST, walk=8)


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest standing cylinder [kg] that is told to press with its weight."""

    def presses(mass: float) -> bool:
        built = heavier(on_plane("cylinder"), mass / MASS, "body 1")
        return load_error(simulate, built) < 1e-9

    return break_point(presses, MASS, HEAVIEST, walk=5)


def _lies(what: str, built: engine.Scene, parameters: Mapping[str, float]) -> case.Measurement:
    def measure(simulate: case.Simulate) -> dict[str, float]:
        deep, aside = moved(simulate, built)
        return {f"{what}_depth": deep, f"{what}_creep": aside}

    told = (
        ("depth", "up or down", DEEP, "a millimetre in a metre"),
        ("creep", "aside", ASIDE, "a tenth of one"),
    )
    return case.Measurement(
        configuration="direct",
        time_step=TIME_STEP,
        parameters=parameters,
        metrics=tuple(
            case.Metric(
                name=f"{what}_{name}",
                description=f"how far a resting {what} is {way} from where it was put, after 2 s",
                unit="m",
                role="gate",
                limit=limit,
                limit_source=f"rigid bodies that touch at the start stay there; {much} still counts",
                limit_kind="physical",
                reference=0.0,
                tolerance=1e-12,
            )
            for name, way, limit, much in told
        ),
        measure=measure,
        note="Direct solver.",
    )


def _presses(what: str, built: engine.Scene, parameters: Mapping[str, float]) -> case.Measurement:
    return case.Measurement(
        configuration="direct",
        time_step=TIME_STEP,
        parameters=parameters,
        metrics=(
            case.Metric(
                name=f"{what}_load_error",
                description=f"how far the force under a resting {what} is from the weight it carries, over that, after 2 s",
                unit="1",
                role="gate",
                limit=OFF,
                limit_source="statics, to a hundredth of the weight",
                limit_kind="physical",
                reference=0.0,
                tolerance=1e-12,
            ),
        ),
        measure=lambda simulate: {f"{what}_load_error": load_error(simulate, built)},
        note="Direct solver.",
    )


SCENES: tuple[tuple[str, engine.Scene, Mapping[str, float]], ...] = (
    *((shape, on_plane(shape), {}) for shape in SHAPES),
    *(("stack", stack(*(MASS,) * count), {"N": float(count)}) for count in STACKS),
    *(("pair", stack(MASS, ratio * MASS), {"mass ratio": ratio}) for ratio in RATIOS),
)

TEST = case.ScalarTest(
    title="Grid of what rests",
    question="Is whatever lies on something in equilibrium?",
    why="A box, a ball, a cylinder, a capsule, boxes on boxes, a heavy one on a light one: the first scenes that are tried, "
    "and each is touched at other points.",
    model="Each of them lies on a plane, touching from the start, for two seconds; then its place and the force under it are read.",
    parameters=(
        ("bodies", "1 kg: a cube of 1 m, a ball, a standing cylinder and a lying capsule of radius 0.5 m"),
        ("stacks", "2, 5, 10 and 20 such cubes"),
        ("pairs", "a cube of 1, 100 and 1e4 kg on one of 1 kg"),
        ("friction coefficient", "0.5"),
        ("gravity", "9.81 m/s²"),
        ("time step", "1/60 s, 120 steps"),
    ),
    theory=("Nothing moves.", "The force under a body is (m + what lies on it) g, upwards."),
    reference="Statics (closed form).",
    conclusion="Green: what rests is at rest and weighs what it weighs. Red: it sinks, creeps, or its load is another.",
    source="ours; asked for by users of several engines (newton-physics/newton#2549, leggedrobotics/SimBenchmark#11)",
    measurements=tuple(make(*one) for one in SCENES for make in (_lies, _presses)),
    example=lambda: case.Example(scene=stack(MASS, RATIO * MASS), time_step=TIME_STEP),
    ladders=tuple(
        case.Ladder(
            name=name,
            description=description,
            unit=unit,
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=configured({"direct": None, "iterative, 50 iterations": None}),
            error=error,
            run=case.Unobserved(ladder_load),
            target_error=target,
            target_seconds=0.1,
        )
        for name, description, unit, error, target in (
            (
                "load",
                "force under 1 kg that carries 100 kg, and under these, against their weight, of it, after 2 s",
                "1",
                ladder_load,
                1e-3,
            ),
            (
                "sunk",
                "how far 1 kg under 100 kg, or these, are from where they were put after 2 s",
                "m",
                ladder_depth,
                1e-3,
            ),
        )
    ),
    stability=(
        case.StabilityStudy(
            name="longest-step",
            title="Longest step after which a lying capsule presses with its weight",
            configuration="direct",
            definition="the force is the weight to 1e-9 of it after ten steps",
            study=longest_step,
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="an impulse of h m g over h, shared by two contacts alike: the step scales out of it; the search ends at 10 000 s",
        ),
        case.StabilityStudy(
            name="heaviest",
            title="Heaviest standing cylinder that presses with its weight",
            configuration="direct",
            definition="the force is the weight to 1e-9 of it after two seconds",
            study=heaviest,
            unit="kg",
            expected=(HEAVIEST, HEAVIEST),
            expected_source="mass scales out of statics; the search ends at 1e12 kg",
        ),
    ),
)

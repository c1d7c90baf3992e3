"""Does a pile of dropped spheres carry its weight without sinking into itself?"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_point
from ..sweep import line

COUNT = 1000
EXAMPLE = 40  # spheres of the page's replay
RADIUS = 0.25  # m
MASS = 1.0  # kg
SPACING = 0.55  # m
JITTER = 0.02  # m
FRICTION = 0.5
GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
STEPS = 240  # 4 s
LAST = 60  # steps of the last second
SWEEPS = engine.Method(solver="iterative", iterations=50)
MISSING_LOAD = -0.006  # 1, of the last second: the pile still sinks, and is slowed down
SPREAD = 0.0012  # 1, of it from start to start
STARTS = 4.0  # spreads that a start may be off
LADDER_COUNT = 300
LEAN = math.asin(
    SPACING / math.sqrt(3.0) / (2.0 * RADIUS)
)  # of the line from a lower centre to the upper one
LEAST_FRICTION = math.tan(0.5 * LEAN)  # .358, of a pile of four
LADDER_MISSING_LOAD, LADDER_SPREAD = -0.0025, 0.0012  # 1, of so many


def scene(count: int = COUNT) -> engine.Scene:
    """`count` spheres above a plane in ten layers of a square grid, each moved a little to the side."""
    rng = np.random.default_rng(1)
    rough = Material(friction=FRICTION)
    side = math.ceil(math.sqrt(count / 10))
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    spheres = []
    for k in range(count):
        dx, dy = rng.uniform(-JITTER, JITTER, 2)
        place = (
            SPACING * (k % side) + dx,
            SPACING * (k // side % side) + dy,
            2 * RADIUS + SPACING * (k // side**2),
        )
        spheres.append(
            engine.RigidBody(
                name=f"s{k}", mass=MASS, shape=engine.Sphere(RADIUS), position=place, material=rough
            )
        )
    return engine.Scene(bodies=(floor, *spheres), gravity=(0.0, 0.0, -GRAVITY))


@dataclass(frozen=True, slots=True)
class Pile:
    """What is read from one run."""

    overlap: float  # m, the deepest of the last second
    balance_error: float  # 1, of the floor's impulse over the last second
    missing_load: float  # 1, part of the weight the floor does not carry, mean over the last second
    slowed: float  # 1, the same by the momentum: a force is read where a step ends, of several substeps that of the last
    energy_rise: float  # 1, largest rise of the total energy in a step, over the energy lost in all
    load: np.ndarray  # (steps,) upward force of the floor, N
    depth: np.ndarray  # (steps,) deepest overlap, m
    status: str  # of the run: completed or unsettled


def energy_rise(energy: np.ndarray) -> float:
    """The largest rise in a step, over what is lost in all."""
    return float(np.diff(energy).max() / (energy[0] - energy[-1]))


def read(
    simulate: case.Simulate,
    count: int,
    method: engine.Method,
    steps: int = STEPS,
    last: int = LAST,
    time_step: float = TIME_STEP,
    time_limit: float | None = 3600.0,
) -> Pile:
    """Runs the pile; the floor's impulse is compared with the weight and the change of momentum, by Newton's law."""
    observe = {
        "load": engine.Trace(quantity=engine.ContactForce("floor")),
        "momentum": engine.Trace(quantity=engine.Momentum()),
        "energy": engine.Trace(quantity=engine.Energy()),
        "depth": engine.Trace(quantity=engine.Penetration()),
    }
    result: engine.Result = simulate(
        scene(count),
        time_step=time_step,
        duration=steps * time_step,
        method=method,
        observe=observe,
        time_limit=time_limit,
    )
    weight = count * MASS * GRAVITY
    load, momentum = -result["load"][:, 2], result["momentum"][:, 2]
    carried = float(load[-last:].mean())
    gained = float(momentum[-1] - momentum[-1 - last]) / (last * time_step)
    energy, depth = result["energy"], result["depth"]
    return Pile(
        overlap=float(depth[-last:].max()),
        balance_error=(carried - gained) / weight - 1.0,
        missing_load=1.0 - carried / weight,
        slowed=-gained / weight,
        energy_rise=energy_rise(energy),
        load=load,
        depth=depth,
        status=result.status,
    )


def measure(simulate: case.Simulate, count: int = COUNT, method: engine.Method = SWEEPS) -> dict[str, float]:
    pile = read(simulate, count, method)
    return {
        "overlap": pile.overlap,
        "balance_error": pile.balance_error,
        "missing_load": pile.missing_load,
        "energy_rise": pile.energy_rise,
    }


def _draw(simulate: case.Simulate) -> case.Drawing:
    pile = read(simulate, COUNT, SWEEPS)
    times = tuple(TIME_STEP * k for k in range(len(pile.depth)))
    return case.Drawing(
        curves=(line("deepest overlap", times, (1e3 * float(d) for d in pile.depth)),),
        x_label="time [s]",
        y_label="overlap [mm]",
    )


def ladder_read(simulate: case.Simulate, time_step: float, method: engine.Method) -> Pile:
    """Four seconds of a smaller pile, so that a night can bear it."""
    second = round(1.0 / time_step)
    steps = round(STEPS * TIME_STEP / time_step)
    return read(simulate, LADDER_COUNT, method, steps, second, time_step, time_limit=None)


def ladder_overlap(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Deepest overlap [m], in the mean over all steps: the deepest of all is one blow's luck."""
    return float(ladder_read(simulate, time_step, method).depth.mean())


def ladder_load(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """How far the missing load of the last second is from that on springs, over the weight.

    No less than what starts differ by: nearer is luck.
    """
    found = ladder_read(simulate, time_step, method)
    return max(STARTS * LADDER_SPREAD, abs(found.slowed - LADDER_MISSING_LOAD))


def pyramid(friction: float) -> engine.Scene:
    """The least pile: three spheres on the floor, SPACING apart, and one on all of them."""
    rough = Material(friction=friction)
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    aside = SPACING / math.sqrt(3.0)  # of the lower centres from the middle
    turns = [2.0 * math.pi * k / 3.0 for k in range(3)]
    places = [(aside * math.cos(turn), aside * math.sin(turn), RADIUS) for turn in turns]
    places.append((0.0, 0.0, RADIUS + math.sqrt(4.0 * RADIUS**2 - aside**2)))
    spheres = (
        engine.RigidBody(name=f"s{k}", mass=MASS, shape=engine.Sphere(RADIUS), position=place, material=rough)
        for k, place in enumerate(places)
    )
    return engine.Scene(bodies=(floor, *spheres), gravity=(0.0, 0.0, -GRAVITY))


def holds_together(simulate: case.Simulate, method: engine.Method, friction: float) -> bool:
    """Whether four spheres stand on each other: slower than 1e-6 m/s after half a second."""
    observe = {"v": engine.Final(quantity=engine.Velocity())}
    result = simulate(pyramid(friction), time_step=TIME_STEP, steps=30, method=method, observe=observe)
    return result.completed and float(np.abs(result["v"]).max()) < 1e-6


def smoothest(simulate: case.Simulate, method: engine.Method) -> case.BreakPoint:
    """The least friction with which four spheres stand."""
    holds = functools.partial(holds_together, simulate, method)
    return break_point(holds, 1.0, 0.1, resolution=1e-3, walk=5)


def _by_sweeps(sweeps: int, substeps: int = 1) -> case.Configuration:
    name = f"{sweeps} sweeps" + (f", {substeps} substeps" if substeps > 1 else "")
    method = engine.Method(solver="iterative", iterations=sweeps, substeps=substeps)
    return case.Configuration(name=name, method=method, expected_order=None)


def _ladder(
    name: str, description: str, unit: str, error: Callable[[case.Simulate, float, engine.Method], float]
) -> case.Ladder:
    """Solvers, sweeps and substeps against each other."""
    return case.Ladder(
        name=name,
        description=description,
        unit=unit,
        time_steps=(1.0 / 30.0, 1.0 / 60.0),
        configurations=(
            _by_sweeps(5),
            _by_sweeps(20),
            _by_sweeps(100),
            _by_sweeps(5, substeps=4),
            case.Configuration(name="direct", method=engine.PLAIN, expected_order=None),
        ),
        error=error,
        run=case.Unobserved(ladder_overlap),
    )


def metrics(missing_load: float = MISSING_LOAD, spread: float = SPREAD) -> tuple[case.Metric, ...]:
    """What is asked of a pile of any size; the load that is missing, and its spread from start to start, go with it."""
    off = STARTS * spread
    return (
        case.Metric(
            name="overlap",
            description="deepest overlap of any two bodies in the last second",
            unit="m",
            role="gate",
            better="smaller",
            limit=2e-3,
            limit_source="a choice: a 250th of a sphere; other engines leave 3 to 26 mm at their usual settings",
            reference=0.0,
            tolerance=2e-3,
        ),
        case.Metric(
            name="balance_error",
            description="impulse of the floor over the last second against weight and change of momentum",
            unit="1",
            role="companion",
            limit=1e-9,
            limit_source="Newton: whatever the contacts do, they push both bodies alike",
            reference=0.0,
            tolerance=1e-9,
        ),
        case.Metric(
            name="missing_load",
            description="part of the weight that the floor does not carry, mean over the last second; less than none: what "
            "still falls is slowed down",
            unit="1",
            role="companion",
            better="inside",
            limit=(missing_load - off, missing_load + off),
            limit_source="the same pile on springs and dashpots, integrated in small steps; four spreads of its starts",
            reference=missing_load,
            tolerance=spread,
        ),
        case.Metric(
            name="energy_rise",
            description="largest rise of the total energy in a step, over the energy lost in all",
            unit="1",
            role="gate",
            better="smaller",
            limit=1e-9,
            limit_source="rounding: plastic contacts with friction take energy, and pay for what their parting lifts",
            reference=0.0,
            tolerance=1e-9,
        ),
    )


TEST = case.ScalarTest(
    title="Pile of spheres",
    question="Does a pile of 1000 dropped spheres carry its weight without sinking into itself?",
    why="Thousands of contacts are out of reach of a direct solve; a few sweeps must come near enough.",
    model="1000 equal spheres fall from a grid onto a plane, with friction, and pile up for four seconds.",
    parameters=(
        ("spheres", "1000, radius 0.25 m, 1 kg"),
        ("spacing", "0.55 m, each moved sideways by up to 0.02 m"),
        ("friction coefficient", "0.5"),
        ("gravity", "9.81 m/s²"),
        ("time step", "1/60 s, 240 steps"),
    ),
    theory=(
        "The floor's impulse is weight times time plus the change of momentum.",
        "Plastic contacts with friction take energy and never give any.",
    ),
    reference="Newton's law for the whole pile, and its load by springs and dashpots instead of contacts; no overlap.",
    conclusion="Green: sweeps carry a pile. Red: pairs that are pushed together are found too late, or sweeps stall.",
    source="ours; the thesis asks for larger contact scenes in section 5.4",
    measurements=(
        case.Measurement(
            configuration="iterative",
            time_step=TIME_STEP,
            parameters={"N": COUNT},
            metrics=metrics(),
            measure=measure,
            note="Fifty sweeps, more where the rows are still far off.",
        ),
    ),
    example=lambda: case.Example(scene=scene(EXAMPLE), time_step=TIME_STEP, method=SWEEPS, duration=4.0),
    figures=(case.Figure(name="overlap", title="Deepest overlap on the way", draw=_draw),),
    ladders=(
        _ladder(
            "overlap",
            f"deepest overlap of {LADDER_COUNT} spheres, mean over the steps of four seconds",
            "m",
            ladder_overlap,
        ),
        _ladder(
            "load",
            f"load of {LADDER_COUNT} spheres on the floor in the last of four seconds, against that on springs",
            "1",
            ladder_load,
        ),
    ),
    stability=tuple(
        case.StabilityStudy(
            name=f"smoothest-{name}",
            title="Least friction with which a pile of four spheres stands",
            configuration=name,
            definition="three on the floor 0.55 m apart and one on top: slower than 1e-6 m/s after half a second",
            study=functools.partial(smoothest, method=method),
            unit="1",
            better="smaller",
            expected=(LEAST_FRICTION, 1.001 * LEAST_FRICTION),
            expected_source="moments about a lower centre make friction above and below alike, and level forces balance with "
            "T (1 + cos φ) = N sin φ: µ = tan(φ/2), φ from the vertical to the upper centre; to the resolution of the search",
        )
        for name, method in (("direct", engine.PLAIN), ("iterative", SWEEPS))
    ),
)

"""Is half the harmonic series the farthest that a stack of plates can hang over?"""

from __future__ import annotations

import functools

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_count, break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line

TIME_STEP = 1.0 / 60.0  # s
LENGTH, THICKNESS = 1.0, 0.1  # m
MASS = 1.0  # kg
GRAVITY = 9.81  # m/s²
FRICTION = 0.5
COUNT = 10
FALLEN = 3  # plates of the heap
INSIDE, OUTSIDE = 0.99, 1.01  # of the limit
STANDING = 0.5  # s: what tips at 1.01 has moved by a centimetre then
FALLING = 4.0  # s
LADDER_DURATION = 2.0  # s
STILL = 1e-9  # m
TALL = (2, 5, 10, 20, 40)  # plates that are tried


def scene(count: int, share: float) -> engine.Scene:
    """`count` plates, the k-th from above reaching `share` L/(2 k) beyond the next, on a floor."""
    rough = Material(friction=FRICTION)
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    plates, x = [], 0.0
    for level in range(count):
        if level:
            x += share * LENGTH / (2.0 * (count - level))
        plates.append(
            engine.RigidBody(
                name=f"plate {level + 1}",
                mass=MASS,
                shape=engine.Box((LENGTH, LENGTH, THICKNESS)),
                position=(x, 0.0, THICKNESS * (level + 0.5)),
                material=rough,
            )
        )
    return engine.Scene(bodies=(floor, *plates), gravity=(0.0, 0.0, -GRAVITY))


def tipping_rate(share: float = OUTSIDE) -> float:
    """Angular acceleration [rad/s²] of one plate whose centre is beyond the edge below it."""
    beyond = 0.5 * (share - 1.0) * LENGTH
    inertia = (LENGTH**2 + THICKNESS**2) / 12.0 + beyond**2 + 0.25 * THICKNESS**2  # m², about the edge
    return GRAVITY * beyond / inertia


def _measure_standing(simulate: case.Simulate) -> dict[str, float]:
    observe = {"moved": engine.Final(quantity=engine.Position(), from_start=True)}
    result = simulate(scene(COUNT, INSIDE), time_step=TIME_STEP, duration=STANDING, observe=observe)
    return {"standing_moved": float(np.abs(result["moved"]).max())}


def _measure_tipping(simulate: case.Simulate) -> dict[str, float]:
    observe = {"w": engine.Final(quantity=engine.AngularVelocity("plate 2"))}
    result = simulate(scene(2, OUTSIDE), time_step=TIME_STEP, steps=1, observe=observe)
    return {"tipping_error": float(result["w"][1]) / (TIME_STEP * tipping_rate()) - 1.0}


def _measure_heap(simulate: case.Simulate) -> dict[str, float]:
    observe = {
        "depth": engine.Maximum(quantity=engine.Penetration()),
        "energy": engine.Trace(quantity=engine.Energy()),
    }
    result = simulate(scene(FALLEN, OUTSIDE), time_step=TIME_STEP, duration=FALLING, observe=observe)
    energy = result["energy"]
    return {
        "heap_overlap": float(result["depth"]),
        "heap_energy_rise": float(np.diff(energy).max() / energy[0]),
    }


def stands(simulate: case.Simulate, count: int, share: float) -> bool:
    """Whether no plate of a stack has moved by STILL in a quarter of a second."""
    observe = {"moved": engine.Final(quantity=engine.Position(), from_start=True)}
    result = simulate(scene(count, share), time_step=TIME_STEP, duration=0.25, observe=observe)
    return result.completed and float(np.abs(result["moved"]).max()) < STILL


def farthest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest overhang, over its limit, at which five plates stand."""
    return break_point(functools.partial(stands, simulate, 5), 0.6, 2.0, resolution=5e-4, walk=5)


def tallest(simulate: case.Simulate) -> case.BreakPoint:
    """The most plates that stand inside the limit."""
    return break_count(lambda count: stands(simulate, count, INSIDE), TALL)


def _draw(simulate: case.Simulate) -> case.Drawing:
    shares = tuple(0.97 + 0.005 * k for k in range(13))
    rates = []
    for share in shares:
        observe = {"w": engine.Final(quantity=engine.AngularVelocity("plate 2"))}
        result = simulate(scene(2, share), time_step=TIME_STEP, steps=1, observe=observe)
        rates.append(float(result["w"][1]) / TIME_STEP)
    return case.Drawing(
        curves=(
            case.Curve(name="simulation", x=shares, y=tuple(rates), style="points"),
            line("g d/i²", shares, (max(0.0, tipping_rate(s)) for s in shares), "reference"),
        ),
        x_label="overhang over its limit",
        y_label="angular acceleration of the upper plate [rad/s²]",
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Deepest overlap [m] while three plates fall and lie."""
    observe = {"depth": engine.Maximum(quantity=engine.Penetration())}
    result = simulate(
        scene(FALLEN, OUTSIDE), time_step=time_step, duration=LADDER_DURATION, method=method, observe=observe
    )
    return float(result["depth"])


def _at_most(name: str, description: str, unit: str, limit: float, source: str) -> case.Metric:
    return case.Metric(
        name=name,
        description=description,
        unit=unit,
        role="gate",
        better="smaller",
        limit=limit,
        limit_source=source,
        reference=0.0,
        tolerance=limit,
    )


TEST = case.ScalarTest(
    title="Leaning plates",
    question="Is half the harmonic series the farthest that a stack of plates can hang over?",
    why="At its limit every interface is about to open: a solver that leaves a part of the load out, or softens it, "
    "falls early or stands when it must not.",
    model="Ten plates hang over each other at 0.99 of the limit; one plate tips at 1.01 of it; three plates at 1.01 "
    "fall and lie in a heap.",
    parameters=(
        ("plates", "1 × 1 × 0.1 m, 1 kg"),
        ("overhang", "0.99 and 1.01 of L/(2 k) over the k-th plate from above"),
        ("friction coefficient", "0.5"),
        ("gravity", "9.81 m/s²"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "The plates above an interface have their centre at its edge if the k-th reaches L/(2 k) further.",
        "Inside, nothing moves. Outside, a plate starts to turn at g d/((L² + t²)/12 + d² + t²/4).",
        "A fallen heap rests: no energy is gained, nothing sinks in.",
    ),
    reference="Statics, and the torque about an edge (closed form).",
    conclusion="Green: loads are found where faces barely hold. Red: plates fall early, stick, or sink.",
    source="ours; the harmonic stack is a classic of statics",
    measurements=(
        ask(
            _measure_standing,
            (
                error(
                    "standing_moved",
                    f"how far any of ten plates has moved in {STANDING:g} s, at 0.99 of the limit",
                    "m",
                    1e-9,
                    "statics: it stands; rounding and the solver's tolerance remain",
                ),
            ),
            "Ten plates inside the limit.",
            TIME_STEP,
        ),
        ask(
            _measure_tipping,
            (
                error(
                    "tipping_error",
                    "relative error of the angular velocity after the first step, at 1.01 of the limit",
                    "1",
                    1e-9,
                    "velocities of the first step are exact: h times the closed form",
                ),
            ),
            "One plate outside the limit.",
            TIME_STEP,
        ),
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            parameters={"N": FALLEN},
            metrics=(
                _at_most(
                    "heap_overlap",
                    "deepest overlap while three plates fall and lie, 4 s",
                    "m",
                    1e-7,
                    "rounding, as of a falling pile: what a step brings together is parted where it ends, whatever turned",
                ),
                _at_most(
                    "heap_energy_rise",
                    "largest rise of the energy in a step, over the energy at the start",
                    "1",
                    1e-9,
                    "rounding: plastic contacts with friction give none, and pay for what their parting lifts",
                ),
            ),
            measure=_measure_heap,
            note="Three plates fall and lie. What a step of it costs is followed as its work, and as the run time of the ladder.",
        ),
    ),
    example=lambda: case.Example(scene=scene(FALLEN, OUTSIDE), time_step=TIME_STEP, duration=LADDER_DURATION),
    figures=(case.Figure(name="tipping", title="Where the upper plate begins to tip", draw=_draw),),
    ladders=(
        case.Ladder(
            name="heap",
            description="deepest overlap while three plates fall and lie",
            unit="m",
            time_steps=(1.0 / 30.0, 1.0 / 60.0),
            configurations=configured({"direct": None, "iterative": None}),
            error=ladder_error,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="farthest",
            title="Largest overhang of five plates, over its limit",
            configuration="plain",
            definition="no plate has moved by 1e-9 m in a quarter of a second",
            study=farthest,
            unit="1",
            expected=(0.9995, 1.0),
            expected_source="the plates above an edge have their centre on it at L/(2 k), and fall beyond; to the resolution of "
            "the search",
        ),
        case.StabilityStudy(
            name="tallest",
            title="Most plates that stand at 0.99 of the limit",
            configuration="plain",
            definition="no plate has moved by 1e-9 m in a quarter of a second",
            study=tallest,
            unit="1",
            expected=(TALL[-1], TALL[-1]),
            expected_source="every edge has its load on its own side, however many lie above; the search ends at 40 plates",
        ),
    ),
)

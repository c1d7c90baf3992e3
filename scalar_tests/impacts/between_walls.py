"""Does a ball thrown between floor and ceiling leave each impact with the velocity it must have?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.bodies import Material

from .. import case
from ..bracket import break_count, break_point
from ..closed_form import ask, error
from ..sweep import line

TIME_STEP = 1.0 / 60.0  # s
RADIUS = 0.1  # m
ROOM = 1.0  # m, from floor to ceiling
UP, ALONG = 4.0, 3.0  # m/s
FLIGHT = (ROOM - 2.0 * RADIUS) / UP  # s, elastic
BLOWS = 6
COUNTS = (1, 2, 4, 8, 16, 32, 64)  # blows within a step that are tried
GRIP = ALONG / (3.5 * 2.0 * UP)  # µ (1 + e) u = v/3.5: what turns sliding into rolling, at the bound
CASES = {"sliding": (0.05, 0.0), "gripping": (5.0, 0.0), "returning": (5.0, 1.0)}  # friction, psi_t


def scene(friction: float, restitution: float = 1.0, tangential: float = 0.0) -> engine.Scene:
    """A ball without spin half-way between floor and ceiling, without gravity."""
    rubber = Material(friction=friction, restitution=restitution, tangential_restitution=tangential)
    walls = [
        engine.RigidBody(
            name=name,
            motion="static",
            shape=engine.Plane((0.0, 0.0, up)),
            position=(0.0, 0.0, z),
            material=rubber,
        )
        for name, up, z in (("floor", 1.0, 0.0), ("ceiling", -1.0, ROOM))
    ]
    ball = engine.RigidBody(
        name="ball",
        mass=1.0,
        shape=engine.Sphere(RADIUS),
        position=(0.0, 0.0, 0.5 * ROOM),
        velocity=(ALONG, 0.0, -UP),
        material=rubber,
    )
    return engine.Scene(bodies=(*walls, ball))


def expected(
    friction: float, restitution: float = 1.0, tangential: float = 0.0
) -> list[tuple[float, float, float]]:
    """Speed along the walls, r ω and speed upwards [m/s] after each blow, floor first."""
    v, spin, across, found = ALONG, 0.0, UP, []
    for blow in range(BLOWS):
        side = 1.0 if blow % 2 == 0 else -1.0
        slip = v - side * spin  # of the point that meets floor or ceiling
        held = (1.0 + tangential) * abs(slip) / 3.5  # what turns the slip round
        taken = math.copysign(min(friction * (1.0 + restitution) * across, held), slip)
        v, spin, across = v - taken, spin + side * 2.5 * taken, restitution * across
        found.append((v, spin, side * across))
    return found


def _measure(simulate: case.Simulate) -> dict[str, float]:
    values = {}
    for name, (friction, tangential) in CASES.items():
        observe = {
            "v": engine.Final(quantity=engine.Velocity("ball")),
            "w": engine.Final(quantity=engine.AngularVelocity("ball")),
        }
        result = simulate(
            scene(friction, tangential=tangential),
            time_step=TIME_STEP,
            duration=(BLOWS - 0.25) * FLIGHT,
            observe=observe,
        )
        v, spin, up = expected(friction, tangential=tangential)[-1]
        values[f"{name}_speed_error"] = float(np.abs(result["v"] - (v, 0.0, up)).max())
        values[f"{name}_spin_error"] = float(np.abs(result["w"] - (0.0, spin / RADIUS, 0.0)).max())
    return values


def grips(simulate: case.Simulate, friction: float) -> bool:
    """Whether the ball leaves the floor rolling: speed along and r ω are alike after the first blow."""
    observe = {
        "v": engine.Final(quantity=engine.Velocity("ball")),
        "w": engine.Final(quantity=engine.AngularVelocity("ball")),
    }
    result = simulate(scene(friction), time_step=TIME_STEP, duration=FLIGHT, observe=observe)
    return result.completed and abs(float(result["v"][0]) - RADIUS * float(result["w"][1])) < 1e-9 * ALONG


def bounces(simulate: case.Simulate, count: int) -> bool:
    """Whether a gripping ball is right after so many blows between floor and ceiling, all within one step."""
    observe = {
        "v": engine.Final(quantity=engine.Velocity("ball")),
        "w": engine.Final(quantity=engine.AngularVelocity("ball")),
    }
    result = simulate(scene(CASES["gripping"][0]), time_step=count * FLIGHT, steps=1, observe=observe)
    along, side = ALONG * 5.0 / 7.0 * (3.0 / 7.0) ** (count - 1), 1.0 if count % 2 else -1.0
    off = (*(result["v"] - (along, 0.0, side * UP)), RADIUS * float(result["w"][1]) - side * along)
    return result.completed and max(map(abs, map(float, off))) < 1e-9 * UP


def smoothest(simulate: case.Simulate) -> case.BreakPoint:
    """The smallest friction with which the first blow grips."""
    return break_point(functools.partial(grips, simulate), 1.0, 0.01, resolution=1e-3, walk=5)


def most_blows(simulate: case.Simulate) -> case.BreakPoint:
    """The most blows in one step."""
    return break_count(functools.partial(bounces, simulate), COUNTS)


def _draw(simulate: case.Simulate) -> case.Drawing:
    curves = []
    for name, (friction, tangential) in CASES.items():
        observe = {"v": engine.Trace(quantity=engine.Velocity("ball"))}
        result = simulate(
            scene(friction, tangential=tangential),
            time_step=TIME_STEP,
            duration=BLOWS * FLIGHT,
            observe=observe,
        )
        curves.append(line(f"{name}, μ = {friction:g}", result.sample_times["v"], result["v"][:, 0]))
        curves.append(
            line(
                f"{name}, closed form",
                ((blow + 1.0) * FLIGHT for blow in range(BLOWS)),
                (v for v, _, _ in expected(friction, tangential=tangential)),
                "reference",
            )
        )
    return case.Drawing(curves=tuple(curves), x_label="time [s]", y_label="speed along the walls [m/s]")


TEST = case.ScalarTest(
    title="Ball between walls",
    question="Does a ball thrown between floor and ceiling leave each impact with the velocity it must have?",
    why="From the second blow on the ball comes with spin: a wrong lever or sign that one blow hides adds up.",
    model="A ball flies between floor and ceiling without gravity, elastic, rough; six blows.",
    parameters=(
        ("ball", "radius 0.1 m, 1 kg, 4 m/s across and 3 m/s along"),
        ("room", "1 m high"),
        ("coefficient of friction", "0.05; 5; 5"),
        ("restitution", "1"),
        ("restitution of the slip", "0; 0; 1, a superball"),
        ("time step", "1/60 s"),
    ),
    theory=(
        "Sliding: each blow takes 2 μ u of the speed along and gives 5/2 of that to r ω.",
        "Gripping: the first blow leaves 5/7 of the speed, every later one 3/7, with the spin turned round.",
        "A superball turns its slip round: 3/7 of the speed after the floor, -31/49 after the ceiling: it comes back.",
    ),
    reference="Impulse balance of each blow (closed form).",
    conclusion="Green: friction at a blow sees speed and spin. Red: a blow forgets the spin, or its sign.",
    source="ours; R. L. Garwin, Kinematics of an ultraelastic rough ball, Am. J. Phys. 37, 1969",
    lacks={"ladder": "exact at every step"},
    measurements=(
        ask(
            _measure,
            tuple(
                error(f"{name}_speed_error", f"error of the velocity after six blows, {name}", "m/s", 1e-9)
                for name in CASES
            )
            + tuple(
                error(
                    f"{name}_spin_error",
                    f"error of the spin after six blows, {name}",
                    "rad/s",
                    1e-7,
                    role="companion",
                )
                for name in CASES
            ),
            "Six blows.",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(0.05), time_step=TIME_STEP, duration=1.5),
    figures=(case.Figure(name="speed", title="Speed along the walls", draw=_draw),),
    stability=(
        case.StabilityStudy(
            name="smoothest",
            title="Smallest friction with which the first blow grips",
            configuration="plain",
            definition="after the first blow the speed along is r ω, to 1e-9",
            study=smoothest,
            unit="1",
            better="smaller",
            expected=(GRIP, 1.001 * GRIP),
            expected_source="gripping takes v/3.5 of speed, friction can take µ (1 + e) u: µ = 3/28 at 3 m/s along and 4 m/s "
            "across; to the resolution of the search",
        ),
        case.StabilityStudy(
            name="most-blows",
            title="Most blows between floor and ceiling within one step",
            configuration="plain",
            definition="velocity and r ω of a gripping ball right to 1e-9 after one step of so many flights",
            study=most_blows,
            unit="1",
            expected=(COUNTS[-1], COUNTS[-1]),
            expected_source="each blow sees the speeds the one before has left, about the ball's own radius, however many follow in a "
            "step: 5/7 of the speed along after the first, 3/7 of it after every other; the search ends at 64",
        ),
    ),
)

"""Does a robot arm that pushes a box over the floor need the torques of friction and inverse dynamics?"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case, overlap
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import apart, line, told

GRAVITY = 9.81  # m/s²
LENGTH, RADIUS = 0.4, 0.03  # m, of both links
UPPER, LOWER = 3.0, 2.0  # kg
EDGE, MASS = 0.3, 4.0  # m, kg: the box
FRICTION = 0.6
HEIGHT = 0.1  # m, of the shoulder and of the push
BENT, RATE = math.radians(60.0), 0.5  # rad, rad/s: of both links from the line of the push, and back to it
TIME_STEP = 1.0 / 60.0  # s
DURATION = 1.0  # s
BEGUN = (
    12  # samples until rows know the motion: their double root 1/3 has left 2e-5 of what they did not know
)
SLOW = 0.01  # rad/s, of a push in which inertia counts 1e-5
FLAT = 1e-6  # rad/s, of a box that does not topple
HIGHEST = 0.5 * EDGE / FRICTION  # m


@functools.cache
def scene(height: float = HEIGHT, rate: float = RATE, bound: float | None = None) -> engine.Scene:
    """An arm whose hand touches the box at the height of its shoulder; all moves as the drives want it to, that of the elbow
    with at most `bound` [N m]."""
    x, up = LENGTH * math.cos(BENT), LENGTH * math.sin(BENT)
    rough = engine.Material(friction=FRICTION)
    bodies: list[engine.RigidBody] = [
        engine.RigidBody(
            name="floor", motion="static", shape=engine.Plane(), position=(0, 0, 0), material=rough
        )
    ]
    for name, mass, side, middle in (("upper", UPPER, -1.0, 0.5 * x), ("lower", LOWER, 1.0, 1.5 * x)):
        turn = 0.5 * (0.5 * math.pi + side * BENT)
        bodies.append(
            engine.RigidBody(
                name=name,
                mass=mass,
                shape=engine.Capsule(RADIUS, LENGTH),
                position=(middle, 0.0, height + 0.5 * up),
                orientation=(math.cos(turn), 0.0, math.sin(turn), 0.0),
                velocity=(middle / x * rate * up, 0.0, -0.5 * rate * x),
                angular_velocity=(0.0, -side * rate, 0.0),
            )
        )
    bodies.append(
        engine.RigidBody(
            name="box",
            mass=MASS,
            shape=engine.Box((EDGE, EDGE, EDGE)),
            position=(2.0 * x + RADIUS + 0.5 * EDGE, 0.0, 0.5 * EDGE),
            velocity=(2.0 * rate * up, 0.0, 0.0),
            material=rough,
        )
    )
    joints = (
        engine.Hinge(
            name="shoulder",
            between=(engine.WORLD, "upper"),
            at=(0.0, 0.0, height),
            axis=(0, 1, 0),
            compliance=0.0,
            motor=engine.Motor(speed=rate),
        ),
        engine.Hinge(
            name="elbow",
            between=("upper", "lower"),
            at=(x, 0.0, height + up),
            axis=(0, 1, 0),
            compliance=0.0,
            motor=engine.Motor(speed=-2.0 * rate, max_force=bound),
        ),
    )
    return engine.Scene(
        bodies=tuple(bodies),
        constraints=joints,
        gravity=(0.0, 0.0, -GRAVITY),
        no_contact=(("upper", "lower"), ("upper", "floor"), ("lower", "floor"), ("upper", "box")),
    )


def pushed(time: Any) -> tuple[Any, Any, Any]:
    """Place of the box [m], push [N] and torques of shoulder and elbow [N m] at times [s]."""
    bent = BENT - RATE * np.asarray(time)
    c, s = np.cos(bent), np.sin(bent)
    slowing = 2.0 * LENGTH * RATE**2 * c
    push = MASS * (FRICTION * GRAVITY - slowing)
    shoulder = -(0.5 * UPPER + 1.5 * LOWER) * GRAVITY * LENGTH * c
    elbow = LOWER * LENGTH * c * (LENGTH * RATE**2 * s - 0.5 * GRAVITY) - push * LENGTH * s
    return 2.0 * LENGTH * c + RADIUS + 0.5 * EDGE, push, np.stack([shoulder, elbow], axis=-1)


def torques(result: engine.Result) -> Any:
    """Of shoulder and elbow at every sample [N m]."""
    return np.stack([result["shoulder"][:, 4], result["elbow"][:, 4]], axis=1)


OBSERVED: dict[str, Observable] = {
    name: engine.Trace(quantity=engine.ConstraintForce(name)) for name in ("shoulder", "elbow")
}


def torque_error(simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN) -> float:
    """Largest error of a drive's torque at the end, over the largest torque."""
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=OBSERVED)
    _, _, right = pushed(result.sample_times["elbow"])
    return float(np.abs(torques(result)[-1] - right[-1]).max() / np.abs(right).max())


def measure(simulate: case.Simulate) -> dict[str, float]:
    """A second of the push."""
    observe: dict[str, Observable] = {
        **OBSERVED,
        "x": engine.Trace(quantity=engine.Position("box")),
        "w": engine.MaximumAbsolute(quantity=engine.AngularVelocity("box")),
        "push": engine.Trace(quantity=engine.ContactForce("box", "lower")),
        "deep": engine.MaximumAbsolute(quantity=engine.Penetration()),
    }
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    place, push, right = pushed(result.sample_times["x"])
    found = (torques(result) - right)[BEGUN:]
    return {
        "torque_error": float(np.abs(found).max() / np.abs(right).max()),
        "push_error": float(np.abs(result["push"][:, 0] / push - 1.0)[BEGUN:].max()),
        "place_error": float(np.abs(result["x"][:, 0] - place).max()),
        "turning": float(result["w"].max()),
        "overlap": float(result["deep"]),
    }


def late() -> tuple[float, float]:
    """Two steps' largest change of the torques over the largest torque, and of the push over the push."""
    times = np.linspace(0.0, DURATION, 1001)
    (_, push, torque), (_, before, earlier) = pushed(times), pushed(times - 2.0 * TIME_STEP)
    return (
        float(np.abs(torque - earlier).max() / np.abs(torque).max()),
        float(np.abs(before / push - 1.0).max()),
    )


def stays_flat(simulate: case.Simulate, height: float) -> bool:
    """Whether a box that is pushed so high up [m] does not turn in ten steps."""
    observe = {"w": engine.MaximumAbsolute(quantity=engine.AngularVelocity("box"))}
    result = simulate(scene(height, SLOW), time_step=TIME_STEP, steps=10, observe=observe)
    return result.completed and float(result["w"].max()) < FLAT


def highest(simulate: case.Simulate) -> case.BreakPoint:
    """How high up the box may be pushed before it topples."""
    return break_point(
        functools.partial(stays_flat, simulate), 0.4 * HIGHEST, 0.98 * EDGE, resolution=1e-3, walk=5
    )


def keeps_pushing(simulate: case.Simulate, share: float) -> bool:
    """Whether ten steps of an elbow with so much of the torque of a slow push leave the box as fast as the hand is to be."""
    bent = BENT - 10.0 * TIME_STEP * SLOW
    needed = LENGTH * (0.5 * LOWER * GRAVITY * math.cos(BENT) + MASS * FRICTION * GRAVITY * math.sin(BENT))
    observe = {"v": engine.Final(quantity=engine.Velocity("box"))}
    result = simulate(scene(HEIGHT, SLOW, share * needed), time_step=TIME_STEP, steps=10, observe=observe)
    wanted = 2.0 * LENGTH * SLOW * math.sin(bent)
    return result.completed and abs(float(result["v"][0]) / wanted - 1.0) < 1e-3


def weakest(simulate: case.Simulate) -> case.BreakPoint:
    """The weakest elbow that pushes the box."""
    return break_point(functools.partial(keeps_pushing, simulate), 2.0, 0.5, resolution=1e-3, walk=4)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Torques over time."""
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=OBSERVED)
    times = result.sample_times["elbow"][1:]
    _, _, right = pushed(times)
    found = torques(result)[1:]
    return case.Drawing(
        curves=tuple(
            one
            for k, name in enumerate(OBSERVED)
            for one in (
                line(name, times, found[:, k], "points"),
                line(f"{name}, Newton–Euler", times, right[:, k], "reference"),
            )
        ),
        x_label="time [s]",
        y_label="torque of a drive [N m]",
        note=f"From sample {BEGUN} on the elbow is at most {apart(found[BEGUN:, 1], right[BEGUN:, 1])} N m off, of up to "
        f"{told(float(np.abs(found[BEGUN:, 1]).max()), 3)} N m.",
    )


LATE = "rows learn of the motion a step late: two steps' change"
TEST = case.ScalarTest(
    title="Robot arm that pushes a box",
    question="Does a robot arm that pushes a box over the floor need the torques of friction and inverse dynamics?",
    why="Most that robots do is to push. What the floor takes from the box goes through the hand into every drive: joints, "
    "contact and friction are solved together or the arm is stronger than it is.",
    model="Two links of equal length push a box by a smooth hand along a line through their shoulder; the elbow turns twice as "
    "fast as the shoulder, so that the hand stays on that line.",
    parameters=(
        ("time step", "1/60 s"),
        ("links", f"{LENGTH:g} m each, {UPPER:g} and {LOWER:g} kg"),
        ("drives", f"{RATE:g} rad/s and −{2.0 * RATE:g} rad/s, from 60° on"),
        ("box", f"{MASS:g} kg, edge {EDGE:g} m, µ = {FRICTION:g}, pushed {HEIGHT:g} m above the floor"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "The hand is at x = 2 l cos α, α' = −ω; the push is F = µ m g + m x''.",
        "Moments about the shoulder: its drive carries the links alone, (m₁/2 + 3 m₂/2) g l cos α: the push goes through it.",
        "About the elbow: m₂ l² ω² sin α cos α = τ + m₂ g (l/2) cos α + F l sin α.",
        "A box that is pushed slowly at a height z bears on its front edge when µ z = b/2.",
    ),
    reference="Statics and Newton–Euler (closed form).",
    conclusion="Green: what the floor takes is what the drives give. Red: a push is lost between them, or the box topples.",
    source="ours; robots are asked for in the thesis, section 5.4",
    measurements=(
        ask(
            measure,
            (
                error(
                    "torque_error",
                    "largest error of a drive's torque over the largest torque",
                    "1",
                    late()[0],
                    f"{LATE} of the torques",
                ),
                error(
                    "push_error", "largest relative error of the push", "1", late()[1], f"{LATE} of the push"
                ),
                error(
                    "place_error",
                    "largest distance of the box from where the hand takes it",
                    "m",
                    2.5 * LENGTH * (RATE * TIME_STEP) ** 2,
                    "rows of hinges lag by (1 + 2 τ/h)/4 h² times the acceleration of the hand, at most 2 l ω²",
                    "companion",
                ),
                error(
                    "turning",
                    "fastest turn of the box",
                    "rad/s",
                    1e-9,
                    "statics: its floor bears inside its edges",
                    "companion",
                ),
                error("overlap", "deepest overlap", "m", 1e-9, "contacts are rigid", "companion"),
            ),
            "pushed for a second",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, duration=DURATION),
    figures=(case.Figure(name="torques", title="Torques of the drives", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="highest",
            title="How high up a box may be pushed before it topples",
            configuration="plain",
            definition="pushed slowly, it turns by less than 1e-6 rad/s in ten steps",
            study=highest,
            unit="m",
            expected=(0.998 * HIGHEST, 1.0005 * HIGHEST),
            expected_source="statics: b/(2 µ) = 0.25 m; the search ends within a thousandth",
        ),
        case.StabilityStudy(
            name="weakest",
            title="Weakest elbow that pushes the box, over the torque of statics",
            configuration="plain",
            definition="after ten slow steps the box is as fast as the hand is to be, to a thousandth",
            study=weakest,
            unit="1",
            better="smaller",
            expected=(0.9995, 1.0015),
            expected_source="statics: 1, largest at the start; the search ends within a thousandth",
        ),
    ),
    ladders=(
        case.Ladder(
            name="torque",
            description="error of a drive's torque after a second, over the largest torque",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=configured({"direct": 1.0, "iterative": None}),
            error=torque_error,
            target_error=0.01,
            target_seconds=0.05,
        ),
        overlap.ladder(scene, DURATION, of="hand, box and floor"),
    ),
)

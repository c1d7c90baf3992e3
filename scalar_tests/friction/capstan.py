"""How hard does a wire hold on a drum that does not turn, and how much does a winch lift?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
FRICTION, TURNS = 0.3, 1.0  # µ; whole turns beyond the half one by which the wire bends
WRAP = math.pi + 2.0 * math.pi * TURNS  # rad
HOLDS = math.exp(FRICTION * WRAP)  # ratio of the pulls
LIGHT, HEAVY = 1.0, 40.0  # kg: more than it holds
TIME_STEP = 1.0 / 60.0  # s
DURATION = 0.5  # s
SLIPS = (HEAVY - HOLDS * LIGHT) * GRAVITY / (HEAVY + HOLDS * LIGHT)  # m/s²
DRUM, MOMENT, LOAD = 0.2, 0.08, 10.0  # m, kg m², kg: of the winch
SPEED, TORQUE = 2.0, 15.0  # rad/s, N m: less than holds the load
SINKS = (LOAD * GRAVITY * DRUM - TORQUE) / (LOAD * DRUM + MOMENT / DRUM)  # m/s²


def bollard(heavy: float = HEAVY, turns: float = TURNS) -> engine.Scene:
    """Two weights on a wire round a fixed bar."""
    ends = {"light": (0.0, 0.0, -1.0), "heavy": (0.1, 0.0, -0.5)}
    wire = engine.Wire(
        name="wire",
        through=(
            ("light", ends["light"]),
            (engine.WORLD, (0.0, 0.0, 5.0)),
            (engine.WORLD, (0.1, 0.0, 5.0)),
            ("heavy", ends["heavy"]),
        ),
        friction=FRICTION,
        turns=(turns, 0.0),
        compliance=0.0,
    )
    weights = (
        engine.Particle(name="light", mass=LIGHT, position=ends["light"]),
        engine.Particle(name="heavy", mass=heavy, position=ends["heavy"]),
    )
    return engine.Scene(bodies=weights, constraints=(wire,), gravity=(0.0, 0.0, -GRAVITY))


def winch(max_force: float | None = None) -> engine.Scene:
    """A load on a drum with a motor."""
    top = (DRUM, 0.0, 5.0)
    drum = engine.RigidBody(
        name="drum",
        mass=4.0,
        inertia=(MOMENT, MOMENT, MOMENT),
        shape=engine.Cylinder(DRUM, 0.3),
        orientation=(math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0),
        position=(0.0, 0.0, 5.0),
    )
    load = engine.Particle(name="load", mass=LOAD, position=(DRUM, 0.0, 0.0))
    axle = engine.Hinge(
        name="axle",
        between=(engine.WORLD, "drum"),
        axis=(0.0, 1.0, 0.0),
        compliance=0.0,
        motor=engine.Motor(speed=SPEED, max_force=max_force),
    )
    wire = engine.Wire(
        name="wire",
        through=(("load", load.position), (engine.WORLD, top)),
        wound=(("axle", DRUM),),
        compliance=0.0,
    )
    return engine.Scene(
        bodies=(drum, load), constraints=(axle, wire), gravity=(0.0, 0.0, -GRAVITY), contacts=False
    )


def slip(simulate: case.Simulate) -> dict[str, float]:
    """The heavy weight slips down, and the two pulls."""
    observe: dict[str, Observable] = {
        "v": engine.Trace(quantity=engine.Velocity("heavy")),
        "pull": engine.Final(quantity=engine.ConstraintForce("wire")),
        "energy": engine.Trace(quantity=engine.Energy()),
    }
    result = simulate(bollard(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    fallen = -np.diff(result["v"][:, 2]) / TIME_STEP
    behind = HEAVY * (GRAVITY - fallen[-1])
    held: dict[str, Observable] = {"v": engine.MaximumAbsolute(quantity=engine.Velocity())}
    rests = simulate(bollard(0.99 * HOLDS * LIGHT), time_step=TIME_STEP, duration=DURATION, observe=held)
    return {
        "acceleration_error": float(np.abs(fallen / SLIPS - 1.0).max()),
        "ratio_error": float(behind / float(result["pull"]) / HOLDS - 1.0),
        "held_motion": float(rests["v"].max()),
        "gain": max(0.0, float(np.diff(result["energy"]).max())),
    }


def lift(simulate: case.Simulate) -> dict[str, float]:
    """The winch at its speed, and with less torque than holds the load."""
    observe: dict[str, Observable] = {
        "v": engine.Final(quantity=engine.Velocity("load")),
        "pull": engine.Final(quantity=engine.ConstraintForce("wire")),
    }
    lifts = simulate(winch(), time_step=TIME_STEP, duration=1.0, observe=observe)
    sinks = simulate(winch(TORQUE), time_step=TIME_STEP, duration=1.0, observe=observe)
    return {
        "speed_error": float(lifts["v"][2]) / (DRUM * SPEED) - 1.0,
        "pull_error": float(lifts["pull"]) / (LOAD * GRAVITY) - 1.0,
        "sinking_error": -float(sinks["v"][2]) / SINKS - 1.0,
        "sinking_pull": float(sinks["pull"]) / (LOAD * (GRAVITY - SINKS)) - 1.0,
    }


def holds(simulate: case.Simulate, heavy: float) -> bool:
    """Whether a weight of `heavy` [kg] is held."""
    observe = {"v": engine.Maximum(quantity=engine.Velocity("light"))}
    result = simulate(bollard(heavy), time_step=TIME_STEP, duration=0.1, observe=observe)
    return result.completed and float(result["v"][2]) < 1e-9


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest weight that one kilogram holds."""
    return break_point(
        functools.partial(holds, simulate), 0.5 * HOLDS * LIGHT, 2.0 * HOLDS * LIGHT, resolution=1e-4
    )


LIFTS = LOAD * GRAVITY * DRUM  # N m


def lifted(simulate: case.Simulate, torque: float) -> bool:
    """Whether a motor of that torque [N m] has its load on the way up after half a second."""
    observe = {"v": engine.Final(quantity=engine.Velocity("load"))}
    result = simulate(winch(torque), time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and float(result["v"][2]) > 0.0


def weakest(simulate: case.Simulate) -> case.BreakPoint:
    """The least torque that lifts the load."""
    return break_point(
        functools.partial(lifted, simulate), 3.0 * LIFTS, 0.25 * LIFTS, resolution=1e-4, walk=5
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Place of the heavy weight after half a second against ½ a t² [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("heavy"))}
    result = simulate(bollard(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return -0.5 - float(result["x"][2]) - 0.5 * SLIPS * DURATION**2


def draw(simulate: case.Simulate) -> case.Drawing:
    """Pull behind over pull before while the wire slips, against the angle round the bar."""
    turns = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5]
    found = []
    for turn in turns:
        heavy = 1.2 * math.exp(FRICTION * (math.pi + 2.0 * math.pi * turn)) * LIGHT
        observe: dict[str, Observable] = {
            "v": engine.Trace(quantity=engine.Velocity("heavy")),
            "pull": engine.Final(quantity=engine.ConstraintForce("wire")),
        }
        result = simulate(bollard(heavy, turn), time_step=TIME_STEP, duration=0.1, observe=observe)
        fallen = -float(result["v"][-1, 2] - result["v"][-2, 2]) / TIME_STEP
        found.append(heavy * (GRAVITY - fallen) / float(result["pull"]))
    angle = np.linspace(1.0, 13.0, 61)
    return case.Drawing(
        curves=(
            line("slipping wire", (math.pi + 2.0 * math.pi * turn for turn in turns), found, "points"),
            line("e^(µφ)", angle, np.exp(FRICTION * angle), "reference"),
        ),
        x_label="angle round the bar [rad]",
        y_label="ratio of the pulls",
        y_scale="log",
        note=f"One and a half turns with µ = {told(FRICTION)} hold {told(found[-1], 4)} times the pull in front, {told(HOLDS, 4)} "
        "by Euler and Eytelwein.",
    )


STEADY = (
    "a steady force is exact in the velocities of the discrete step; the bound is found to 1e-11 of the pull"
)

TEST = case.ScalarTest(
    title="Capstan and winch",
    question="Does a wire round a bar or a drum hold what its friction, e^(µφ), and the torque allow?",
    why="Ships are moored and loads are lowered by a few turns of rope. The pull grows exponentially along the wrap: a friction "
    "bound that is a step late, or taken from one side alone, lets go far too early or never.",
    model="A wire runs one and a half times round a fixed bar without size, with a kilogram on one end and a heavier weight on "
    "the other. A drum with a motor winds in a wire with a load.",
    parameters=(
        ("time step", "1/60 s"),
        ("bar", "µ = 0.3, half a turn by the bend and a whole one more"),
        ("weights", "1 kg and 40 kg"),
        ("winch", "10 kg on a drum of 0.2 m and 0.08 kg m²; 2 rad/s, or at most 15 N m"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "A wire about to slip: dT/dφ = µ T, so T₂ = T₁ e^(µφ); T₂/T₁ lies between e^(−µφ) and e^(µφ).",
        "Slipping: a = (M − e^(µφ) m) g/(M + e^(µφ) m).",
        "Winch: v = r ω and T = m g; with less torque, a = (m g r − τ)/(m r + I/r) downwards.",
        "In the step: one row per bar keeps the wire from passing, with |T₂ − T₁| ≤ tanh(µφ/2) (T₁ + T₂).",
    ),
    reference="L. Euler 1762, J. A. Eytelwein 1808; mechanics in closed form.",
    conclusion="Green: the wire holds what it must and slips where it must. Red: friction of wires is lost or made up.",
    source="ours; wires are asked for in the thesis, section 5.4",
    measurements=(
        ask(
            slip,
            (
                error("acceleration_error", "largest relative error of the acceleration", "1", 1e-9, STEADY),
                error(
                    "ratio_error",
                    "relative error of the ratio of the pulls while it slips",
                    "1",
                    1e-9,
                    STEADY,
                    "companion",
                ),
                error(
                    "held_motion",
                    "largest speed of 99 % of what it holds",
                    "m/s",
                    1e-9,
                    "nothing moves",
                    "companion",
                ),
                error(
                    "gain",
                    "largest gain of energy in a step",
                    "J",
                    1e-9,
                    "friction takes energy",
                    "companion",
                ),
            ),
            "round a bar",
            TIME_STEP,
        ),
        ask(
            lift,
            (
                error(
                    "speed_error",
                    "relative error of the speed of the load",
                    "1",
                    1e-9,
                    STEADY,
                ),
                error("pull_error", "relative error of the wire's pull", "1", 1e-9, STEADY, "companion"),
                error(
                    "sinking_error",
                    "relative error of the speed after a second with too little torque",
                    "1",
                    1e-9,
                    STEADY,
                    "companion",
                ),
                error(
                    "sinking_pull",
                    "relative error of the pull then",
                    "1",
                    1e-9,
                    STEADY,
                    "companion",
                ),
            ),
            "winch",
            TIME_STEP,
            "winch",
        ),
    ),
    example=lambda: case.Example(scene=winch(), time_step=TIME_STEP, duration=2.0),
    stability=(
        case.StabilityStudy(
            name="holding",
            title="Heaviest weight that a kilogram holds",
            configuration="plain",
            definition="nothing moves in a tenth of a second",
            study=heaviest,
            unit="kg",
            expected=(0.9999 * HOLDS * LIGHT, 1.0001 * HOLDS * LIGHT),
            expected_source="e^(0.3 · 3π) = 16.90 kg; the search ends within a part in ten thousand",
        ),
        case.StabilityStudy(
            name="weakest",
            title="Least torque of a winch that lifts its load",
            configuration="winch",
            definition="after half a second the load moves up",
            study=weakest,
            unit="N m",
            better="smaller",
            expected=(LIFTS, 1.0002 * LIFTS),
            expected_source="m g r = 19.62 N m; the search ends within a part in ten thousand",
        ),
    ),
    figures=(case.Figure(name="ratio", title="Pull behind over pull in front", draw=draw),),
    ladders=(
        case.Ladder(
            name="slip",
            description="way of the heavy weight in half a second against ½ a t²",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480)),
            configurations=configured({"plain": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=1e-2,
            target_seconds=0.01,
        ),
    ),
)

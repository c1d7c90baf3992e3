"""Does a flywheel off its axle keep its energy?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import unbroken
from ..sweep import line, told

RATE = 20.0  # rad/s
OFF = 0.1  # m, from the axle to the flywheel's centre
MASS, DISC = 2.0, (0.02, 0.02, 0.04)  # kg, kg m²: a disc of 0.2 m
SHAFT, SLENDER = 1.0, (0.01, 0.01, 0.001)  # kg, kg m²
TIME_STEP, DURATION = 1.0 / 60.0, 10.0  # s
BEHIND = 4.0 / (
    RATE * DURATION
)  # a loss of this share, steady over the whole time, leaves it a radian behind
Z = (0.0, 0.0, 1.0)
ORDER_4 = engine.Method(composition="order4")
KEPT = 1e-10  # of the energy: rounding over a search's runs
FASTEST, HEAVIEST = 1e4, 1e6  # rad/s, times; where the searches end
METHODS = (("default", engine.Method()), ("plain", engine.PLAIN), ("order4", ORDER_4))


def scene(locked: bool = False, rate: float = RATE, times: float = 1.0) -> engine.Scene:
    """A flywheel, `times` as heavy, that turns OFF from its axle: hinged there itself, or locked to a shaft that is."""
    x, y, z = DISC
    wheel = engine.RigidBody(
        name="wheel",
        mass=times * MASS,
        inertia=(times * x, times * y, times * z),
        position=(OFF, 0.0, 0.0),
        velocity=(0.0, rate * OFF, 0.0),
        angular_velocity=(0.0, 0.0, rate),
    )
    turning = "shaft" if locked else "wheel"
    axle = engine.Hinge(name="axle", between=(engine.WORLD, turning), at=(0.0, 0.0, 0.0), axis=Z)
    if not locked:
        return engine.Scene(bodies=(wheel,), constraints=(axle,))
    shaft = engine.RigidBody(
        name="shaft", mass=SHAFT, inertia=SLENDER, position=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, rate)
    )
    weld = engine.Lock(name="weld", between=("shaft", "wheel"), at=(0.0, 0.0, 0.0))
    return engine.Scene(bodies=(shaft, wheel), constraints=(axle, weld))


def changed(simulate: case.Simulate, asked: engine.Scene, time_step: float, method: engine.Method) -> float:
    """Largest change of the energy in DURATION, over what it was."""
    observe = {"e": engine.Trace(quantity=engine.Energy())}
    energy = simulate(asked, time_step=time_step, duration=DURATION, method=method, observe=observe)["e"]
    return float(np.abs(energy / energy[0] - 1.0).max())


def measure(simulate: case.Simulate, method: engine.Method) -> dict[str, float]:
    """Both, and by how much the hinged one has turned wrongly."""
    observe = {"turned": engine.Trace(quantity=engine.JointCoordinate("axle"))}
    run = simulate(scene(), time_step=TIME_STEP, duration=DURATION, method=method, observe=observe)
    return {
        "hinged_energy": changed(simulate, scene(), TIME_STEP, method),
        "locked_energy": changed(simulate, scene(locked=True), TIME_STEP, method),
        "turn_error": float(run["turned"][-1]) - RATE * DURATION,
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Of the energy of the one that is hinged."""
    return changed(simulate, scene(), time_step, method)


def keeps_fast(simulate: case.Simulate, rate: float) -> bool:
    """Whether both keep their energy at `rate` [rad/s]."""
    return all(changed(simulate, scene(locked, rate), TIME_STEP, ORDER_4) < KEPT for locked in (False, True))


def keeps_heavy(simulate: case.Simulate, times: float) -> bool:
    """Whether the one that is locked keeps its energy when it is so many times as heavy."""
    return changed(simulate, scene(locked=True, times=times), TIME_STEP, ORDER_4) < KEPT


def draw(simulate: case.Simulate) -> case.Drawing:
    """Energy over time."""
    curves = []
    for name, method in METHODS:
        observe = {"e": engine.Trace(quantity=engine.Energy(), every=6)}
        run = simulate(scene(), time_step=TIME_STEP, duration=DURATION, method=method, observe=observe)
        curves.append(line(name, run.sample_times["e"], run["e"] / run["e"][0]))
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="energy over that at the start",
        note="After 10 s "
        + ", ".join(f"{told(curve.y[-1], 4)} ({curve.name})" for curve in curves)
        + " of it is left.",
    )


def _physical(name: str, description: str, unit: str, limit: float, source: str) -> case.Metric:
    return case.Metric(
        name=name,
        description=description,
        unit=unit,
        role="gate",
        limit=limit,
        limit_source=source,
        limit_kind="physical",
        reference=0.0,
        tolerance=1e-9,
    )


METRICS = (
    _physical(
        "hinged_energy",
        "largest change of the energy in 10 s over what it was, hinged 0.1 m off its centre",
        "1",
        BEHIND,
        "nothing takes energy: for ever; a steady loss of 4/(Ω T) would leave it a radian behind by the end",
    ),
    _physical(
        "locked_energy",
        "the same, locked to a shaft 0.1 m aside",
        "1",
        BEHIND,
        "nothing takes energy: for ever; a steady loss of 4/(Ω T) would leave it a radian behind by the end",
    ),
    _physical(
        "turn_error",
        "angle of the hinged one after 10 s less Ω t",
        "rad",
        math.pi,
        "Ω t is known: half a turn in 32 is the most at which whole turns are counted rightly",
    ),
)
REPORTED = tuple(
    replace(metric, role="reported", limit=None, limit_source="", limit_kind="method") for metric in METRICS
)
ROUNDED = "the axle's angle is the coordinate, and nothing pulls at it: rounding over 600 steps remains"
EXACT = tuple(
    replace(metric, limit=1e-12, limit_source=ROUNDED, limit_kind="method", tolerance=1e-13)
    if metric.unit == "1"
    else reported
    for metric, reported in zip(METRICS, REPORTED, strict=True)
)

TEST = case.ScalarTest(
    title="Flywheel off its axle",
    question="Does a flywheel off its axle keep its energy?",
    why="What turns beside its axle is pulled inwards by rows that are straight within a step, while its way is round: cams, "
    "crankshafts and fans lose their speed in engines that leave this out, and nothing says so.",
    model="A disc turns at 20 rad/s about an axle 0.1 m from its centre for 10 s without gravity: hinged there itself, and locked "
    "to a shaft on the axle.",
    parameters=(
        ("time step", "1/60 s, a third of a radian"),
        ("flywheel", "2 kg, 0.04 kg m² about its own axis, centre 0.1 m from the axle"),
        ("shaft", "1 kg, 0.001 kg m²"),
        ("speed", "20 rad/s"),
        ("duration", "10 s, 31.8 turns"),
    ),
    theory=(
        "The axle's force has no moment about it: Ω stays, φ = Ω t and E = ½ (I + m r²) Ω².",
        "Straight rows take energy in every step, in proportion to (Ω h)²: three quarters in 10 s by plain SPOOK. Rows that "
        "follow the turn leave an error that is bounded, of second order in h; in joint coordinates there is none.",
    ),
    reference="Closed form.",
    conclusion="Green: what turns off its axle goes on turning. Red: joints take energy, or give it, as bodies turn.",
    source="ours; google-deepmind/mujoco#3553 asks it of locked boxes",
    measurements=tuple(
        case.Measurement(
            configuration=name,
            time_step=TIME_STEP,
            metrics=metrics,
            measure=functools.partial(measure, method=method),
            note=note,
        )
        for (name, method), metrics, note in zip(
            METHODS,
            (METRICS, REPORTED, EXACT),
            ("joints follow turns, as by default", "straight rows", "in joint coordinates"),
            strict=True,
        )
    ),
    example=lambda: case.Example(
        scene=scene(locked=True), time_step=TIME_STEP, method=engine.Method(), duration=DURATION
    ),
    figures=(case.Figure(name="energy", title="Energy over time, hinged", draw=draw),),
    ladders=(
        case.Ladder(
            name="energy",
            description="largest change of the energy of the hinged one in 10 s, over what it was",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480, 960)),
            configurations=(
                case.Configuration(
                    name="default", method=engine.Method(), expected_order=2.0, order_range=(1 / 480, 1 / 60)
                ),
                case.Configuration(
                    name="plain", method=engine.PLAIN, expected_order=None
                ),  # not yet in its range
                case.Configuration(name="order4", method=ORDER_4, expected_order=None),  # no step errs
            ),
            error=ladder_error,
            target_error=1e-2,
            target_seconds=0.01,
        ),
    ),
    stability=(
        unbroken(
            keeps_fast,
            RATE,
            FASTEST,
            name="fastest",
            title="Fastest flywheels that keep their energy",
            definition="both to 1e-10 over 10 s",
            source="the axle's angle is the coordinate: it turns by h Ω, however far that is",
            unit="rad/s",
            configuration="order4",
            walk=4,
        ),
        unbroken(
            keeps_heavy,
            1.0,
            HEAVIEST,
            name="heaviest",
            title="How many times as heavy a flywheel may be on its shaft",
            definition="the locked one keeps its energy to 1e-10 over 10 s",
            source="what is locked is one body: its mass scales out",
            unit="1",
            configuration="order4",
            walk=3,
        ),
    ),
)

"""Does a vehicle that its rear wheels drive climb as mechanics says, up to where they slip?"""

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
from ..sweep import apart, line, told
from .vehicle import (
    FRICTION,
    FRONT,
    GRAVITY,
    INERTIA,
    MASS,
    RADIUS,
    REAR,
    SINK,
    SLOPE,
    STATICS,
    WHEELS,
    front_load,
    scene,
)

TORQUE = 300.0  # N m, of each rear wheel's drive
TIME_STEP = 1.0 / 60.0  # s
DURATION = 1.0  # s
TILT = math.atan(SLOPE)


def climbing(torque: float = TORQUE) -> float:
    """Acceleration up the slope [m/s²] while no wheel slips: Σ T/r − M g sin θ over M + 4 I/r²."""
    return (2.0 * torque / RADIUS - MASS * GRAVITY * math.sin(TILT)) / (MASS + 4.0 * INERTIA / RADIUS**2)


def climb(simulate: case.Simulate) -> dict[str, float]:
    """Driven up the slope by its rear wheels."""
    observe: dict[str, Observable] = {
        "v": engine.Trace(quantity=engine.Velocity("chassis")),
        "w": engine.Trace(quantity=engine.AngularVelocity("front left")),
    }
    observe |= {name: engine.Final(quantity=engine.ContactForce(name, "road")) for name in WHEELS}
    asked = scene(-SLOPE, torque=TORQUE)
    result = simulate(asked, time_step=TIME_STEP, duration=DURATION, observe=observe)
    exact = climbing() * result.sample_times["v"]
    front = float(result["front left"][2] + result["front right"][2])
    return {
        "speed_error": float(np.abs(result["v"][:, 0] - exact).max()),
        "spin_error": float(np.abs(RADIUS * result["w"][:, 1] - exact).max()),
        "transfer_error": front / climbing_load() - 1.0,
    }


def climbing_load(torque: float = TORQUE) -> float:
    """What the front wheels carry [N]: gravity pulls back at the height of each weight, and spinning the wheels up takes
    4 I a/r of moment."""
    gain = climbing(torque)
    held = front_load(gain + GRAVITY * math.sin(TILT), GRAVITY * math.cos(TILT))
    return held - 4.0 * INERTIA * gain / RADIUS / (FRONT + REAR)


def slack(torque: float) -> float:
    """Friction that the rear wheels have left [N]: µ times what they carry, less T/r and more what spins themselves up."""
    carried = MASS * GRAVITY * math.cos(TILT) - climbing_load(torque)
    return FRICTION * carried - 2.0 * torque / RADIUS + 2.0 * INERTIA * climbing(torque) / RADIUS**2


# All of it is linear in the torque: where nothing is left.
SLIPS = TORQUE * slack(0.0) / (slack(0.0) - slack(TORQUE))  # N m


def rolls(simulate: case.Simulate, torque: float) -> bool:
    """Whether a rear wheel rolls for half a second."""
    observe: dict[str, Observable] = {
        "v": engine.Final(quantity=engine.Velocity("rear left")),
        "w": engine.Final(quantity=engine.AngularVelocity("rear left")),
    }
    result = simulate(scene(-SLOPE, torque=torque), time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and abs(float(result["v"][0]) - RADIUS * float(result["w"][1])) < 1e-3


def hardest(simulate: case.Simulate) -> case.BreakPoint:
    """The hardest drive of wheels that roll."""
    return break_point(functools.partial(rolls, simulate), 0.4 * SLIPS, 2.0 * SLIPS, resolution=1e-3)


# tan θ at which the torques carry the weight's part along the slope and no more: 2 T/r = M g sin θ
STALLS = math.tan(math.asin(2.0 * TORQUE / RADIUS / (MASS * GRAVITY)))


def goes_up(simulate: case.Simulate, slope: float) -> bool:
    """Whether the vehicle has moved up a slope of that tan θ after half a second."""
    observe = {"v": engine.Final(quantity=engine.Velocity("chassis"))}
    result = simulate(scene(-slope, torque=TORQUE), time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and float(result["v"][0]) > 0.0


def steepest(simulate: case.Simulate) -> case.BreakPoint:
    """The steepest slope that the drives climb."""
    return break_point(
        functools.partial(goes_up, simulate), 0.5 * STALLS, 2.0 * STALLS, resolution=1e-3, walk=5
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Way up the slope in a second against ½ a t² [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("chassis"))}
    asked = scene(-SLOPE, torque=TORQUE)
    result = simulate(asked, time_step=time_step, duration=DURATION, method=method, observe=observe)
    return float(result["x"][0]) - 0.5 * climbing() * DURATION**2


def draw(simulate: case.Simulate) -> case.Drawing:
    """Acceleration against the torque."""
    torques = tuple(SLIPS * k / 10.0 for k in range(2, 15))
    observe = {"v": engine.Final(quantity=engine.Velocity("chassis"))}
    found = [
        float(simulate(scene(-SLOPE, torque=one), time_step=TIME_STEP, steps=30, observe=observe)["v"][0])
        / (30.0 * TIME_STEP)
        for one in torques
    ]
    held = tuple(one for one in torques if one <= SLIPS)
    return case.Drawing(
        curves=(
            line("simulation", torques, found, "points"),
            line("(Σ T/r − M g sin θ)/(M + 4 I/r²)", held, map(climbing, held), "reference"),
        ),
        x_label="torque of each rear wheel [N m]",
        y_label="acceleration up the slope [m/s²]",
        note=f"Up to {told(SLIPS, 4)} N m, where the rear wheels must slip, the largest distance from the closed form is "
        f"{apart(found[: len(held)], map(climbing, held))} m/s².",
    )


# What the road gives way by under one of a wheel's two points, as a part of its radius, of what drives it.
DRIVEN = SINK / RADIUS * 2.0 * TORQUE / RADIUS / MASS * DURATION  # m/s

TEST = case.ScalarTest(
    title="Climbing vehicle",
    question="Does a vehicle that its rear wheels drive climb as mechanics says, up to where they slip?",
    why="Drive, rolling inertia, friction and load act in one chain: torque lost on the way, or load that does not move to the "
    "rear, shows in the acceleration or in the torque at which wheels slip.",
    model="The vehicle of the other question at rest on a slope; bounded drives turn its rear wheels.",
    parameters=(
        ("time step", "1/60 s"),
        ("vehicle", "1100 kg with its wheels of 25 kg, radius 0.3 m"),
        ("drive", "300 N m on each rear wheel"),
        ("road", "µ = 0.7, slope 0.1"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "a = (Σ T/r − M g sin(θ))/(M + 4 I/r²) while no wheel slips.",
        "Moments about the rear footprints, with m (a + g sin θ) at each height and 4 I a/r, give the loads.",
        "Rear wheels slip when Σ T/r − 2 I a/r² is more than µ times what they carry.",
    ),
    reference="Closed forms.",
    conclusion="Green: torque reaches the road and load moves to the rear. Red: one of them is lost between motor and road.",
    source="ours; vehicles are asked for in the thesis, section 5.4",
    measurements=(
        ask(
            climb,
            (
                error(
                    "speed_error",
                    "largest difference of the speed to a t",
                    "m/s",
                    DRIVEN,
                    "a wheel that has sunk by ε F drives with that part of its radius more force",
                ),
                error(
                    "spin_error",
                    "largest difference of r w of a front wheel to a t",
                    "m/s",
                    DRIVEN + SINK / RADIUS * climbing() * DURATION,
                    "the same, and that part of the radius",
                    "companion",
                ),
                error(
                    "transfer_error",
                    "load of the front wheels over moments, minus one",
                    "1",
                    SINK / RADIUS,
                    STATICS,
                    "companion",
                ),
            ),
            "driven up a slope",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(-SLOPE, torque=TORQUE), time_step=TIME_STEP, duration=3.0),
    figures=(case.Figure(name="torque", title="Acceleration against torque", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="hardest",
            title="Hardest drive of rear wheels that roll",
            configuration="plain",
            definition="after half a second a rear wheel goes as fast as it rolls, to 1 mm/s",
            study=hardest,
            unit="N m",
            expected=(0.998 * SLIPS, 1.002 * SLIPS),
            expected_source="friction of the rear wheels, µ times what they carry; all is linear in the torque. The search ends "
            "within a thousandth",
        ),
        case.StabilityStudy(
            name="steepest",
            title="Steepest slope that the drives climb",
            configuration="plain",
            definition="after half a second the vehicle moves up",
            study=steepest,
            unit="1",
            expected=(0.998 * STALLS, 1.0005 * STALLS),
            expected_source="2 T/r = M g sin(θ): tan θ = 0.1886. The search ends within a thousandth",
        ),
    ),
    ladders=(
        case.Ladder(
            name="way",
            description="way up the slope in a second against ½ a t²",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=0.01,
            target_seconds=0.05,
        ),
    ),
)

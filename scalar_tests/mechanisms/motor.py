"""Does a motor reach its set speed with no more than the torque it is allowed?"""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point
from ..configurations import configured
from ..sweep import apart, line

INERTIA = 2.0  # kg m², about the axle
SPEED = 10.0  # rad/s, set point
TORQUE = 4.0  # N m, at most
TIME_STEP = 1.0 / 60.0  # s
DURATION = 10.0  # s
RISE = SPEED * INERTIA / TORQUE  # s, 5
LEAD = 0.5 * TIME_STEP * SPEED  # rad
HEAVIEST = 1e12  # kg m², where the search for the largest wheel ends
OBSERVE: dict[str, Observable] = {
    "spin": engine.Trace(quantity=engine.AngularVelocity("wheel")),
    "turned": engine.Trace(quantity=engine.JointCoordinate("axle")),
}


def scene(torque: float | None = TORQUE) -> engine.Scene:
    """A wheel at rest on an axle that a motor drives with at most `torque` [N m]; None is unbounded."""
    wheel = engine.RigidBody(name="wheel", mass=5.0, inertia=(1.5, 1.5, INERTIA), position=(0.0, 0.0, 0.0))
    axle = engine.Hinge(
        name="axle",
        between=(engine.WORLD, "wheel"),
        axis=(0.0, 0.0, 1.0),
        motor=engine.Motor(speed=SPEED, max_force=torque),
    )
    return engine.Scene(bodies=(wheel,), constraints=(axle,))


def exact_speed(time: Any) -> Any:
    """min(T t/J, set speed) [rad/s]."""
    return np.minimum(TORQUE / INERTIA * np.asarray(time), SPEED)


def exact_angle(time: Any) -> Any:
    """Its integral [rad]."""
    time = np.asarray(time)
    rising = np.minimum(time, RISE)
    return 0.5 * TORQUE / INERTIA * rising**2 + SPEED * np.maximum(time - RISE, 0.0)


def bounded(simulate: case.Simulate) -> dict[str, float]:
    """Speed against the closed form at every step."""
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=OBSERVE)
    time, spin = result.sample_times["spin"], result["spin"]
    return {
        "speed_error": float(np.abs(spin[:, 2] - exact_speed(time)).max()),
        "angle_lead": float(result["turned"][-1] - exact_angle(DURATION)) / LEAD - 1.0,
        "wobble": float(np.abs(spin[:, :2]).max()),
    }


def unbounded(simulate: case.Simulate) -> dict[str, float]:
    """The speed after one step."""
    observe = {"spin": engine.Final(quantity=engine.AngularVelocity("wheel"))}
    result = simulate(scene(None), time_step=TIME_STEP, steps=1, observe=observe)
    return {"speed_error": float(result["spin"][2]) - SPEED}


def wheel(inertia: float, spin: float) -> engine.RigidBody:
    """A wheel of that moment [kg m²] about its axle, spinning [rad/s]."""
    return engine.RigidBody(
        name="wheel",
        mass=5.0,
        inertia=(inertia,) * 3,
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, spin),
    )


def bears(simulate: case.Simulate, torque: float) -> bool:
    """Whether the motor keeps its set speed for a second against a load of `torque` [N m]."""
    turning = wheel(INERTIA, SPEED)
    load = engine.Load(name="load", body="wheel", torque=(0.0, 0.0, -torque))
    observe = {"spin": engine.Final(quantity=engine.AngularVelocity("wheel"))}
    built = replace(scene(), bodies=(turning,), forces=(load,))
    spin = simulate(built, time_step=TIME_STEP, duration=1.0, observe=observe)["spin"]
    return abs(float(spin[2]) - SPEED) < 1e-9


def starts(simulate: case.Simulate, inertia: float) -> bool:
    """Whether an unbounded motor has a wheel of `inertia` [kg m²] at its speed after one step."""
    built = replace(scene(None), bodies=(wheel(inertia, 0.0),))
    observe = {"spin": engine.Final(quantity=engine.AngularVelocity("wheel"))}
    spin = simulate(built, time_step=TIME_STEP, steps=1, observe=observe)["spin"]
    return abs(float(spin[2]) - SPEED) < 1e-9


def heaviest_load(simulate: case.Simulate) -> case.BreakPoint:
    """The largest load [N m] against which the motor keeps its speed."""
    return break_point(functools.partial(bears, simulate), 1.0, 9.0, resolution=1e-3, walk=5)


def largest_wheel(simulate: case.Simulate) -> case.BreakPoint:
    """The largest wheel [kg m²] that an unbounded motor starts in one step."""
    return break_point(functools.partial(starts, simulate), INERTIA, HEAVIEST, walk=5)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Angle after 10 s minus the closed form [rad]."""
    observe = {"turned": engine.Trace(quantity=engine.JointCoordinate("axle"))}
    result = simulate(scene(), time_step=time_step, duration=DURATION, method=method, observe=observe)
    return float(result["turned"][-1] - exact_angle(DURATION))


def draw(simulate: case.Simulate) -> case.Drawing:
    """Speed against time."""
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=OBSERVE)
    time = result.sample_times["spin"][::6]
    return case.Drawing(
        curves=(
            line("simulation", time, result["spin"][::6, 2]),
            line("min(T t/J, set speed)", time, exact_speed(time), "reference"),
        ),
        x_label="time [s]",
        y_label="speed of the wheel [rad/s]",
        note=f"At most {apart(result['spin'][::6, 2], exact_speed(time))} rad/s apart.",
    )


SPEED_ERROR = case.Metric(
    name="speed_error",
    description="largest difference to min(T t/J, set speed) in 10 s",
    unit="rad/s",
    role="gate",
    limit=1e-9,
    limit_source="exact in the discrete step; rounding remains",
    reference=0.0,
    tolerance=1e-12,
)

TEST = case.ScalarTest(
    title="Motor",
    question="Does a motor reach its set speed with no more than the torque it is allowed?",
    why="Winches, wheels and robots are motors with a bound. One that is too strong, or that takes its bound for an "
    "impulse, drives a different machine at every time step.",
    model="A wheel of 2 kg m² at rest on a hinge to the world; a motor drives it to 10 rad/s with at most 4 N m, for "
    "10 s. Once more without a bound.",
    parameters=(
        ("time step", "1/60 s"),
        ("wheel", "2 kg m² about its axle"),
        ("set speed", "10 rad/s"),
        ("torque", "at most 4 N m; or unbounded"),
    ),
    theory=(
        "ω = min(T t/J, set speed); the set speed is reached after J ω/T = 5 s.",
        "A motor is a velocity row: no violation term, no damping; unbounded it is there in one step.",
        "Bounds of multipliers are impulses: h T. Taking T itself would be 1/h too strong.",
        "A step turns the wheel by h ω, with the speed at its end: while that rises the angle gains ½ h ω on the closed form, "
        "the offset of the symplectic step.",
    ),
    reference="Closed form.",
    conclusion="Green: motors and their bounds are right. Red: the bound is a force where an impulse is meant, or the "
    "row is damped.",
    source="ours; torques are asked for in the thesis, section 5.4",
    measurements=(
        case.Measurement(
            configuration="bounded",
            time_step=TIME_STEP,
            metrics=(
                SPEED_ERROR,
                case.Metric(
                    name="angle_lead",
                    description="angle beyond the closed form after 10 s over ½ h ω, minus one",
                    unit="1",
                    role="companion",
                    limit=1e-9,
                    limit_source="the sum of h ω over the steps in closed form; rounding of 75 rad over ½ h ω remains",
                    reference=0.0,
                    tolerance=1e-12,
                ),
                case.Metric(
                    name="wobble",
                    description="largest spin across the axle",
                    unit="rad/s",
                    role="companion",
                    limit=1e-12,
                    limit_source="nothing turns the wheel about another axis",
                    reference=0.0,
                    tolerance=1e-14,
                ),
            ),
            measure=bounded,
            note="at most 4 N m",
        ),
        case.Measurement(
            configuration="unbounded",
            time_step=TIME_STEP,
            metrics=(SPEED_ERROR,),
            measure=unbounded,
            note="no bound: the set speed after one step",
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, observe=OBSERVE),
    figures=(case.Figure(name="speed", title="Speed of the wheel", draw=draw),),
    ladders=(
        case.Ladder(
            name="angle",
            description="angle after 10 s against the closed form",
            unit="rad",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480, 960, 1920, 3840, 7680)),
            configurations=configured({"plain": 1.0, "iterative": 1.0}, (1 / 7680, 1 / 1920)),
            error=ladder_error,
            target_error=0.1,
            target_seconds=0.1,
        ),
    ),
    stability=(
        case.StabilityStudy(
            name="heaviest-load",
            title="Largest load against which the motor keeps its speed",
            configuration="bounded",
            definition="10 rad/s after a second, to 1e-9",
            study=heaviest_load,
            unit="N m",
            expected=(0.999 * TORQUE, TORQUE),
            expected_source="the torque it is allowed, 4 N m; to the resolution of the search",
        ),
        case.StabilityStudy(
            name="largest-wheel",
            title="Largest wheel that an unbounded motor starts in one step",
            configuration="unbounded",
            definition="10 rad/s after one step, to 1e-9",
            study=largest_wheel,
            unit="kg m²",
            expected=(HEAVIEST, HEAVIEST),
            expected_source="one row that asks for a speed: inertia scales out of it; the search ends at 1e12 kg m²",
        ),
    ),
)

"""Does a slider-crank move as its geometry says, and does its motor carry what inverse dynamics asks?"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from spook_tracker.engine import (
    PLAIN,
    WORLD,
    Ball,
    ConstraintForce,
    Hinge,
    Method,
    Motor,
    Position,
    Prismatic,
    Result,
    RigidBody,
    Scene,
    Trace,
)
from spook_tracker.scalar_tests.case import (
    Configuration,
    Drawing,
    Example,
    Figure,
    Ladder,
    ScalarTest,
    Simulate,
)
from spook_tracker.scalar_tests.closed_form import ask, error
from spook_tracker.scalar_tests.sweep import line, told

CRANK, ROD = 0.15, 0.45  # m
TURNING, ROD_MASS, SLIDER = 0.01, 1.0, 2.0  # kg m², kg, kg
SPEED = 2.0 * math.pi  # rad/s, a turn a second
TIME_STEP = 1.0 / 240.0  # s
START = 1.0  # rad
SETTLED = 0.5  # s: what the start stirs up is gone
DURATION = 1.5  # s
RELAXATION = 2.0  # damping of the joints over the time step


def pin(theta: Any) -> tuple[Any, Any, Any]:
    """Place of the slider [m], angle of the rod [rad], both by the crank's angle, and the pin's height [m]."""
    height = CRANK * np.sin(theta)
    return CRANK * np.cos(theta) + np.sqrt(ROD**2 - height**2), np.arcsin(height / ROD), height


def slope(function: Any, theta: Any, width: float = 1e-4) -> Any:
    """d/dθ by five points."""
    one = function(theta + width) - function(theta - width)
    two = function(theta + 2.0 * width) - function(theta - 2.0 * width)
    return (8.0 * one - two) / (12.0 * width)


def kinetic(theta: Any) -> Any:
    """Energy of rod and slider [J] while the crank turns steadily."""
    slider = slope(lambda t: pin(t)[0], theta)
    middle = slope(lambda t: CRANK * np.cos(t) + 0.5 * ROD * np.cos(pin(t)[1]), theta)
    across, turn = 0.5 * CRANK * np.cos(theta), slope(lambda t: pin(t)[1], theta)
    rod = ROD_MASS * (middle**2 + across**2 + ROD**2 / 12.0 * turn**2)
    return 0.5 * SPEED**2 * (SLIDER * slider**2 + rod)


def torque(theta: Any) -> Any:
    """What the motor carries [N m]: power is the change of energy, τ = dE/dθ."""
    return slope(kinetic, theta, 1e-3)


@functools.cache
def scene(time_step: float) -> Scene:
    """Crank, rod and slider in the xy plane, moving as the motor wants."""
    x, lean, _ = (float(value) for value in pin(START))
    rates = [SPEED * float(slope(lambda t, i=i: pin(t)[i], START)) for i in (0, 1)]
    c, s = CRANK * math.cos(START), CRANK * math.sin(START)
    joint: dict[str, Any] = {"compliance": 0.0, "damping": RELAXATION * time_step}
    bodies = (
        RigidBody(
            name="crank", mass=1.0, inertia=(TURNING,) * 3, position=(0, 0, 0), angular_velocity=(0, 0, SPEED)
        ),
        RigidBody(
            name="rod",
            mass=ROD_MASS,
            inertia=(1e-4, ROD_MASS * ROD**2 / 12.0, ROD_MASS * ROD**2 / 12.0),
            position=(0.5 * (c + x), 0.5 * s, 0.0),
            orientation=(math.cos(0.5 * lean), 0.0, 0.0, -math.sin(0.5 * lean)),
            velocity=(0.5 * (rates[0] - SPEED * s), 0.5 * SPEED * c, 0.0),
            angular_velocity=(0.0, 0.0, -rates[1]),
        ),
        RigidBody(
            name="slider", mass=SLIDER, inertia=(0.01,) * 3, position=(x, 0, 0), velocity=(rates[0], 0, 0)
        ),
    )
    joints = (
        Hinge(
            name="drive",
            between=(WORLD, "crank"),
            at=(0, 0, 0),
            axis=(0, 0, 1),
            motor=Motor(speed=SPEED),
            **joint,
        ),
        Hinge(name="pin", between=("crank", "rod"), at=(c, s, 0.0), axis=(0, 0, 1), **joint),
        Ball(name="wrist", between=("rod", "slider"), at=(x, 0.0, 0.0), **joint),
        Prismatic(name="guide", between=(WORLD, "slider"), axis=(1, 0, 0), **joint),
    )
    return Scene(bodies=bodies, constraints=joints, gravity=(0, 0, 0), contacts=False)


def errors(simulate: Simulate, time_step: float, method: Method = PLAIN) -> tuple[float, float]:
    """Largest errors of the slider's place [m] and of the motor's torque [N m] in a turn, after half a second."""
    observe = {"x": Trace(quantity=Position("slider")), "f": Trace(quantity=ConstraintForce("drive"))}
    result = simulate(
        scene(time_step), time_step=time_step, duration=DURATION, method=method, observe=observe
    )
    first = round(SETTLED / time_step)
    times = time_step * np.arange(len(result["x"]))
    place = result["x"][:, 0] - pin(START + SPEED * times)[0]
    # The force of a step acts between its two ends.
    carried = result["f"][:, 5] - torque(START + SPEED * (times - 0.5 * time_step))
    return float(np.abs(place[first:]).max()), float(np.abs(carried[first:]).max())


def measure(simulate: Simulate) -> dict[str, float]:
    """One turn."""
    place, carried = errors(simulate, TIME_STEP)
    return {"place_error": place, "torque_error": carried / float(np.abs(torque(TURN)).max())}


TURN = np.linspace(0.0, 2.0 * math.pi, 721)


def lag(time_step: float) -> float:
    """A joint that turns lags by (1 + 2 τ/h)/4 h² times the acceleration across it [m]: of the pin on the crank, and of the
    rod's two ends about its middle; a rod that leans passes it on to the slider by no more than 1/cos of its lean."""
    lean = float(np.abs(pin(TURN)[1]).max())
    turning = SPEED**2 * float(np.abs(slope(lambda t: pin(t)[1], TURN)).max() ** 2)
    across = CRANK * SPEED**2 + ROD * turning
    return (1.0 + 2.0 * RELAXATION) / 4.0 * time_step**2 * across / math.cos(lean)


def ahead(time_step: float, duration: float) -> float:
    """A step turns the crank by 2 arcsin(h ω/2): it runs ahead by (h ω)²/24 of its angle; so much of the slider's way [m]."""
    along = float(np.abs(slope(lambda t: pin(t)[0], TURN)).max())
    return (SPEED * time_step) ** 2 / 24.0 * SPEED * duration * along


def place_limit(time_step: float) -> float:
    """Both together, of the turn and a half that are run [m]."""
    return lag(time_step) + ahead(time_step, DURATION)


def torque_limit(time_step: float) -> float:
    """A step's force is that of some moment within it: half a step before or after its middle, of the largest torque."""
    carried = torque(TURN)
    return 0.5 * SPEED * time_step * float(np.abs(slope(torque, TURN, 1e-2)).max() / np.abs(carried).max())


def ladder_error(simulate: Simulate, time_step: float, method: Method) -> float:
    """Largest error of the slider's place in a turn [m]."""
    return errors(simulate, time_step, method)[0]


def run(simulate: Simulate, time_step: float, method: Method) -> Result:
    """The same turns with nothing observed."""
    return simulate(scene(time_step), time_step=time_step, duration=DURATION, method=method)


def draw(simulate: Simulate) -> Drawing:
    """The motor's torque over a turn."""
    observe = {"f": Trace(quantity=ConstraintForce("drive"))}
    result = simulate(scene(TIME_STEP), time_step=TIME_STEP, duration=DURATION, observe=observe)
    first = round(SETTLED / TIME_STEP)
    times = TIME_STEP * (np.arange(len(result["f"])) - 0.5)
    angles = np.degrees(SPEED * times) + math.degrees(START)
    return Drawing(
        curves=(
            line("simulation", angles[first::4], result["f"][first::4, 5], "points"),
            line("dE/dθ", angles[first:], torque(np.radians(angles[first:])), "reference"),
        ),
        x_label="angle of the crank [°]",
        y_label="torque of the motor [N m]",
    )


TEST = ScalarTest(
    title="Slider-crank",
    question="Does a slider-crank move as its geometry says, and does its motor carry what inverse dynamics asks?",
    why="Engines, pumps and presses are slider-cranks. A loop of joints closes over a turning and a sliding body, with a "
    "row too many; the motor feels every mass behind it.",
    model="A motor turns a crank steadily; a uniform rod drives a slider along its guide. No gravity, no clearance.",
    parameters=(
        ("crank and rod", "0.15 m and 0.45 m"),
        ("rod and slider", "1 kg and 2 kg"),
        ("speed", "a turn a second"),
        ("joints", "rigid, τ = 2 h"),
        (
            "time step",
            f"1/240 s, at which joints and steps cost the slider {told(1e3 * place_limit(TIME_STEP))} mm and the motor "
            f"{told(100.0 * torque_limit(TIME_STEP))} % of its torque; {told(1e3 * place_limit(1.0 / 60.0))} mm and "
            f"{told(100.0 * torque_limit(1.0 / 60.0))} % at 1/60 s would pass wrong masses",
        ),
    ),
    theory=(
        "x = r cos θ + √(l² − r² sin²θ).",
        "The motor's power is the change of kinetic energy: τ = dE/dθ.",
        "Nothing can run away: the motor holds the one coordinate there is, and rigid rows the rest.",
    ),
    reference="Geometry, and the energy of the moving parts (closed form, differentiated by five points).",
    conclusion="Green: loops of joints and motors carry inertia rightly. Red: the loop drifts, or forces are wrong.",
    source="ours; any textbook of machine dynamics",
    measurements=(
        ask(
            measure,
            (
                error(
                    "place_error",
                    "largest error of the slider's place in a turn",
                    "m",
                    place_limit(TIME_STEP),
                    "a turning joint lags by (1 + 2 τ/h)/4 h² times the acceleration across it, and a step turns the crank by 2 arcsin(h ω/2)",
                ),
                error(
                    "torque_error",
                    "largest error of the motor's torque in a turn, over the largest torque",
                    "1",
                    torque_limit(TIME_STEP),
                    "a step's force is that of some moment within the step",
                    "companion",
                ),
            ),
            "rigid joints, a motor that holds its speed",
            TIME_STEP,
        ),
    ),
    example=lambda: Example(scene=scene(1.0 / 60.0), time_step=1.0 / 60.0, duration=4.0),
    figures=(Figure(name="torque", title="Torque of the motor over a turn", draw=draw),),
    ladders=(
        Ladder(
            name="place",
            description="largest error of the slider's place in a turn",
            unit="m",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480)),
            configurations=(Configuration(name="direct", method=PLAIN, expected_order=2.0),),
            error=ladder_error,
            run=run,
            target_error=2e-4,
            target_seconds=0.02,
        ),
    ),
)

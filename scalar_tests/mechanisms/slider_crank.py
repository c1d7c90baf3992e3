"""Does a driven slider-crank follow geometry and inverse dynamics?"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

CRANK, ROD = 0.15, 0.45  # m
TURNING, ROD_MASS, SLIDER = 0.01, 1.0, 2.0  # kg m², kg, kg
SPEED = 2.0 * math.pi  # rad/s, a turn a second
TIME_STEP = 1.0 / 240.0  # s
START = 1.0  # rad
SETTLED = 0.5  # s: what the start stirs up is gone
DURATION = 1.5  # s
RELAXATION = 2.0  # damping of the joints over the time step


def pin(theta: Any, crank: float = CRANK) -> tuple[Any, Any, Any]:
    """Place of the slider [m], angle of the rod [rad], both by the crank's angle, and the pin's height [m]."""
    height = crank * np.sin(theta)
    return crank * np.cos(theta) + np.sqrt(ROD**2 - height**2), np.arcsin(height / ROD), height


def slope(function: Any, theta: Any, width: float = 1e-4) -> Any:
    """d/dθ by five points."""
    one = function(theta + width) - function(theta - width)
    two = function(theta + 2.0 * width) - function(theta - 2.0 * width)
    return (8.0 * one - two) / (12.0 * width)


def kinetic(theta: Any, mass: float = SLIDER) -> Any:
    """Energy of rod and slider [J] while the crank turns steadily."""
    slider = slope(lambda t: pin(t)[0], theta)
    middle = slope(lambda t: CRANK * np.cos(t) + 0.5 * ROD * np.cos(pin(t)[1]), theta)
    across, turn = 0.5 * CRANK * np.cos(theta), slope(lambda t: pin(t)[1], theta)
    rod = ROD_MASS * (middle**2 + across**2 + ROD**2 / 12.0 * turn**2)
    return 0.5 * SPEED**2 * (mass * slider**2 + rod)


def torque(theta: Any, mass: float = SLIDER) -> Any:
    """What the motor carries [N m]: power is the change of energy, τ = dE/dθ."""
    return slope(functools.partial(kinetic, mass=mass), theta, 1e-3)


@functools.cache
def scene(time_step: float, speed: float = SPEED, crank: float = CRANK, mass: float = SLIDER) -> engine.Scene:
    """Crank, rod and a slider of a mass [kg] in the xy plane, moving as the motor wants."""
    x, lean, _ = (float(value) for value in pin(START, crank))
    rates = [speed * float(slope(lambda t, i=i: pin(t, crank)[i], START)) for i in (0, 1)]
    c, s = crank * math.cos(START), crank * math.sin(START)
    joint: dict[str, Any] = {"compliance": 0.0, "damping": RELAXATION * time_step}
    bodies = (
        engine.RigidBody(
            name="crank", mass=1.0, inertia=(TURNING,) * 3, position=(0, 0, 0), angular_velocity=(0, 0, speed)
        ),
        engine.RigidBody(
            name="rod",
            mass=ROD_MASS,
            inertia=(1e-4, ROD_MASS * ROD**2 / 12.0, ROD_MASS * ROD**2 / 12.0),
            position=(0.5 * (c + x), 0.5 * s, 0.0),
            orientation=(math.cos(0.5 * lean), 0.0, 0.0, -math.sin(0.5 * lean)),
            velocity=(0.5 * (rates[0] - speed * s), 0.5 * speed * c, 0.0),
            angular_velocity=(0.0, 0.0, -rates[1]),
        ),
        engine.RigidBody(
            name="slider", mass=mass, inertia=(0.01,) * 3, position=(x, 0, 0), velocity=(rates[0], 0, 0)
        ),
    )
    joints = (
        engine.Hinge(
            name="drive",
            between=(engine.WORLD, "crank"),
            at=(0, 0, 0),
            axis=(0, 0, 1),
            motor=engine.Motor(speed=speed),
            **joint,
        ),
        engine.Hinge(name="pin", between=("crank", "rod"), at=(c, s, 0.0), axis=(0, 0, 1), **joint),
        engine.Ball(name="wrist", between=("rod", "slider"), at=(x, 0.0, 0.0), **joint),
        engine.Prismatic(name="guide", between=(engine.WORLD, "slider"), axis=(1, 0, 0), **joint),
    )
    return engine.Scene(bodies=bodies, constraints=joints, gravity=(0, 0, 0), contacts=False)


def errors(
    simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN, mass: float = SLIDER
) -> tuple[float, float]:
    """Largest errors of the slider's place [m] and of the motor's torque [N m] in a turn, after half a second."""
    observe = {
        "x": engine.Trace(quantity=engine.Position("slider")),
        "f": engine.Trace(quantity=engine.ConstraintForce("drive")),
    }
    asked = scene(time_step, mass=mass)
    result = simulate(asked, time_step=time_step, duration=DURATION, method=method, observe=observe)
    first = round(SETTLED / time_step)
    times = time_step * np.arange(len(result["x"]))
    place = result["x"][:, 0] - pin(START + SPEED * times)[0]
    # The force of a step acts between its two ends.
    carried = result["f"][:, 5] - torque(START + SPEED * (times - 0.5 * time_step), mass)
    return float(np.abs(place[first:]).max()), float(np.abs(carried[first:]).max())


def measure(simulate: case.Simulate) -> dict[str, float]:
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


def strayed(time_step: float, duration: float, guided: bool = False) -> Any:
    """How far ahead of where a steady crank has it the slider is [m], a value a step from SETTLED on.

    Rows of a joint that turns let its ends part by (1 + 2 τ/h)/4 h² times the acceleration across it: at the pin outwards of
    the crank and, as at the wrist, along the rod; `guided`, the wrist does so across the guide alone. Rod and slider make up
    for it.
    """
    times = np.arange(round(SETTLED / time_step), round(duration / time_step) + 1) * time_step
    theta = START + SPEED * times
    lean, part = pin(theta)[1], (1.0 + 2.0 * RELAXATION) / 4.0 * time_step**2
    outwards = CRANK * SPEED**2
    along = ROD * (SPEED * slope(lambda t: pin(t)[1], theta)) ** 2
    x = outwards * np.cos(theta) + (0.5 if guided else 1.0) * along * np.cos(lean)
    y = outwards * np.sin(theta) - along * np.sin(lean)
    return part * (x - np.tan(lean) * y)


def next_order(time_step: float) -> float:
    """By what part more the next order of the step may make it."""
    return 1.0 + SPEED * time_step


def place_limit(time_step: float) -> float:
    """Of the turn and a half that are run [m]."""
    return float(np.abs(strayed(time_step, DURATION)).max()) * next_order(time_step)


def lagging(theta: Any, time_step: float) -> tuple[Any, Any, Any]:
    """Places of the rod's middle [m], its angle [rad] and the slider's place [m] where joints lag as in `strayed`."""
    part, lean = (1.0 + 2.0 * RELAXATION) / 4.0 * time_step**2, -pin(theta)[1]
    out = CRANK * (1.0 + part * SPEED**2)
    half = part * 0.5 * ROD * (SPEED * slope(lambda t: pin(t)[1], theta)) ** 2  # of either end of the rod
    x, y = out * np.cos(theta) + half * np.cos(lean), out * np.sin(theta) + half * np.sin(lean)
    turned = -np.arcsin((y + half * np.sin(lean)) / ROD)
    middle = np.stack((x + 0.5 * ROD * np.cos(turned), y + 0.5 * ROD * np.sin(turned)))
    return middle, turned, x + half * np.cos(lean) + ROD * np.cos(turned)


def torque_of_steps(theta: Any, time_step: float, mass: float = SLIDER) -> Any:
    """What the motor carries [N m] in a step that begins at theta: by second differences of places that lag, in the directions
    that pin and wrist allow there, where reactions act on both bodies at the second one's point."""
    turn = SPEED * time_step
    back, here, on = (lagging(theta + turned, time_step) for turned in (-turn, 0.0, turn))
    moved, leant, slid = ((b - 2.0 * a + c) / time_step**2 for a, b, c in zip(here, back, on, strict=True))
    middle, lean, x = here
    arm = 0.5 * ROD * np.stack((np.cos(lean), np.sin(lean)))
    near, far = middle - arm, np.stack((x - middle[0], -middle[1]))
    leans = -near[0] / (arm[0] + far[0])  # of a turn of the crank
    slides = -near[1] - (arm[1] + far[1]) * leans
    moves = np.stack((slides + far[1] * leans, -far[0] * leans))
    return ROD_MASS * ((moved * moves).sum(axis=0) + ROD**2 / 12.0 * leant * leans) + mass * slid * slides


def torque_limit(time_step: float, mass: float = SLIDER) -> float:
    """A step's force is that of where it begins, by places that lag: beside that of its middle, over the largest torque."""
    exact = torque(TURN + 0.5 * SPEED * time_step, mass)
    off = float(np.abs(torque_of_steps(TURN, time_step, mass) - exact).max())
    return off / float(np.abs(torque(TURN, mass)).max())


FASTEST = 179.8795  # rad/s, h ω = 0.749: by the planar step of the test
TURNS_RUN, OFF, NARROWEST = 3, 0.01 * ROD, 2.52098e-3  # turns, m, and 1 − r/l of the fold, by the same step
# kg: the crank's inertia is 1e-12 of what the slider's comes to at the crank, the floor of pivots
HEAVIEST = TURNING / engine.PLAIN.floor / float(np.abs(slope(lambda t: pin(t)[0], TURN)).max()) ** 2


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest crank that runs."""

    def runs(speed: float) -> bool:
        return simulate(scene(TIME_STEP, speed), time_step=TIME_STEP, steps=200).completed

    return break_point(runs, 0.3 * FASTEST, 2.0 * FASTEST, resolution=2e-3)


def narrowest(simulate: case.Simulate) -> case.BreakPoint:
    """The least that a rod may be longer than its crank, over the rod."""
    observe = {"x": engine.Trace(quantity=engine.Position("slider"))}
    turn = TIME_STEP * SPEED  # of a step
    steps = round(TURNS_RUN * math.tau / turn)

    def folds(gap: float) -> bool:
        crank = (1.0 - gap) * ROD
        result = simulate(scene(TIME_STEP, crank=crank), time_step=TIME_STEP, steps=steps, observe=observe)
        exact = pin(START + turn * np.arange(steps + 1), crank)[0]
        return result.completed and float(np.abs(result["x"][:, 0] - exact).max()) < OFF

    return break_point(folds, 0.1, 1e-4, resolution=0.01)


def heaviest(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest slider that the motor moves and feels as it must."""

    def carries(mass: float) -> bool:
        try:
            place, carried = errors(simulate, TIME_STEP, mass=mass)
        except engine.SimulationFailed:
            return False
        most = torque_limit(TIME_STEP, mass) * float(np.abs(torque(TURN, mass)).max())
        return place < place_limit(TIME_STEP) and carried < most

    return break_point(carries, SLIDER, 1e4 * HEAVIEST, resolution=0.05)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest error of the slider's place in a turn [m]."""
    return errors(simulate, time_step, method)[0]


def draw(simulate: case.Simulate) -> case.Drawing:
    """The motor's torque over a turn."""
    observe = {"f": engine.Trace(quantity=engine.ConstraintForce("drive"))}
    result = simulate(scene(TIME_STEP), time_step=TIME_STEP, duration=DURATION, observe=observe)
    first = round(SETTLED / TIME_STEP)
    times = TIME_STEP * (np.arange(len(result["f"])) - 0.5)
    angles = np.degrees(SPEED * times) + math.degrees(START)
    return case.Drawing(
        curves=(
            line("simulation", angles[first::4], result["f"][first::4, 5], "points"),
            line("dE/dθ", angles[first:], torque(np.radians(angles[first:])), "reference"),
        ),
        x_label="angle of the crank [°]",
        y_label="torque of the motor [N m]",
    )


TEST = case.ScalarTest(
    title="Slider-crank",
    question="Does a driven slider-crank follow geometry and inverse dynamics?",
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
        "The motor holds the one coordinate there is, and rigid rows the rest, so that no mass has a say in the motion. What a step "
        "can lose is the turn of the crank, h ω, and the fold where crank and rod are nearly as long and stand upright: there the "
        "rod turns back within √(2 (1 − r/l)) of the crank's turn.",
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
                    "a turning joint lags by (1 + 2 τ/h)/4 h² times the acceleration across it; a part h ω more for the next "
                    "order",
                ),
                error(
                    "torque_error",
                    "largest error of the motor's torque in a turn, over the largest torque",
                    "1",
                    torque_limit(TIME_STEP),
                    "a step's force is that of where the step begins, half a step before its middle, and its places lag",
                    "companion",
                ),
            ),
            "rigid joints, a motor that holds its speed",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(1.0 / 60.0), time_step=1.0 / 60.0, duration=4.0),
    figures=(case.Figure(name="torque", title="Torque of the motor over a turn", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="fastest",
            title="Fastest crank that runs at 1/240 s",
            configuration="plain",
            definition="200 steps run to their end",
            study=fastest,
            unit="rad/s",
            expected=(0.997 * FASTEST, 1.001 * FASTEST),
            expected_source="five rows of the step in the plane for five speeds, run by themselves: h ω = 0.749; beyond it the rod "
            "lags until h w of its own reaches 1",
        ),
        case.StabilityStudy(
            name="narrowest-fold",
            title="Least that the rod may be longer than the crank, over the rod, for the slider to come through right",
            configuration="plain",
            definition="in three turns at 1/240 s the slider is never further off than a hundredth of the rod",
            study=narrowest,
            unit="1",
            better="smaller",
            expected=(0.999 * NARROWEST, 1.011 * NARROWEST),
            expected_source="the step in the plane, run by itself; the search ends 1 % short of it at most",
        ),
        case.StabilityStudy(
            name="heaviest-slider",
            title="Heaviest slider that the motor moves and feels as it must",
            configuration="plain",
            definition="the errors of its place and of the motor's torque keep their limits",
            study=heaviest,
            unit="kg",
            expected=(0.5 * HEAVIEST, 4.0 * HEAVIEST),
            expected_source="masses have no say but by rounding: the crank's inertia is lost under the floor of pivots, 1e-12, when "
            "M (dx/dθ)² is 1e12 times as much; at the largest dx/dθ, which of the bodies is eliminated first left open",
        ),
    ),
    ladders=(
        case.Ladder(
            name="place",
            description="largest error of the slider's place in a turn",
            unit="m",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480)),
            configurations=configured({"direct": 2.0, "half-step, curved twice": 4.0}),
            error=ladder_error,
            target_error=2e-4,
            target_seconds=0.02,
        ),
    ),
)

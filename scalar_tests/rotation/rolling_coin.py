"""Does a coin roll steadily on its circle, and does Euler's disk stand on one point while it turns?"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
RADIUS, THICKNESS, MASS = 0.1, 0.004, 0.5  # m, m, kg
FRICTION = 0.9


@dataclass(frozen=True)
class Steady:
    """Steady rolling: the axis leans from the vertical, the centre goes round a circle."""

    lean: float  # rad, of the axis from the vertical
    circle: float  # m, radius of the centre's circle

    @property
    def reach(self) -> float:
        """How far outside of its centre the coin touches the floor [m]."""
        return RADIUS * math.cos(self.lean) - 0.5 * THICKNESS * math.sin(self.lean)

    @property
    def height(self) -> float:
        """Of the centre over the floor [m]."""
        return RADIUS * math.sin(self.lean) + 0.5 * THICKNESS * math.cos(self.lean)

    @property
    def rate(self) -> float:
        """Ω [rad/s], from the moments about the centre; see the page."""
        across, along = engine.Cylinder(RADIUS, THICKNESS).inertia(1.0)[1:]
        c, s = math.cos(self.lean), math.sin(self.lean)
        contact = self.circle + self.reach
        turning = s * ((across - along) * c + along * contact / RADIUS)
        return math.sqrt(GRAVITY * self.reach / (self.circle * self.height + turning))

    @property
    def spin(self) -> float:
        """About its own axis, beside the turn about the vertical [rad/s]: it rolls."""
        return -self.rate * (self.circle + self.reach) / RADIUS


COIN, DISK = Steady(math.radians(60.0), 0.5), Steady(math.radians(20.0), 0.0)
STEPS_A_TURN = 600


@functools.cache
def scene(motion: Steady, friction: float = FRICTION) -> engine.Scene:
    """The coin in steady motion about the z axis."""
    rough = engine.Material(friction=friction)
    floor = engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    c, s = math.cos(motion.lean), math.sin(motion.lean)
    coin = engine.RigidBody(
        name="coin",
        mass=MASS,
        shape=engine.Cylinder(RADIUS, THICKNESS),
        position=(motion.circle, 0.0, motion.height),
        orientation=(math.cos(0.5 * motion.lean), 0.0, math.sin(0.5 * motion.lean), 0.0),
        velocity=(0.0, motion.rate * motion.circle, 0.0),
        angular_velocity=(motion.spin * s, 0.0, motion.rate + motion.spin * c),
        material=rough,
    )
    return engine.Scene(bodies=(floor, coin), gravity=(0.0, 0.0, -GRAVITY))


def step(motion: Steady) -> float:
    """A six-hundredth of a turn [s]: at 1/60 s Euler's disk would turn by 34° a step."""
    return 2.0 * math.pi / motion.rate / STEPS_A_TURN


def axis(orientation: Any) -> Any:
    """The coin's axis in the world, of one or many orientations."""
    w, x, y, z = np.moveaxis(np.asarray(orientation), -1, 0)
    return np.stack((2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)), axis=-1)


def turn(simulate: case.Simulate, motion: Steady, steps: int, part: int = 1) -> Any:
    """Errors after one turn about the vertical of so many steps, or that part of it: lean [rad], phase [of it], centre [m] and
    energy [of m g height]."""
    observe = {
        "x": engine.Final(quantity=engine.Position("coin")),
        "q": engine.Trace(quantity=engine.Orientation("coin")),
        "energy": engine.Trace(quantity=engine.Energy()),
    }
    h = 2.0 * math.pi / motion.rate / steps
    result = simulate(scene(motion), time_step=h, steps=steps // part, observe=observe)
    leaning, energy = axis(result["q"]), result["energy"]
    phase = np.unwrap(np.arctan2(leaning[:, 1], leaning[:, 0]))
    return np.array(
        (
            float(np.arccos(leaning[-1, 2])) - motion.lean,
            float(phase[-1] - phase[0]) * part / (2.0 * math.pi) - 1.0,
            math.hypot(result["x"][0], result["x"][1]) - motion.circle,
            float(energy[-1] - energy[0]) / (MASS * GRAVITY * motion.height),
        )
    )


LEAST = COIN.rate**2 * COIN.circle / GRAVITY  # µ that keeps the coin's centre on its circle


def grips(simulate: case.Simulate, friction: float) -> bool:
    """Whether the coin goes for a quarter of a turn as it does on a floor as rough as any. A first step, which does not know
    yet how the contact wanders, asks for a seventh more friction, and may slip by a millimetre."""
    observe = {"x": engine.Final(quantity=engine.Position("coin"))}
    found = [
        simulate(scene(COIN, one), time_step=step(COIN), steps=STEPS_A_TURN // 4, observe=observe)
        for one in (friction, FRICTION)
    ]
    if not all(result.completed for result in found):
        return False
    return float(np.abs(found[0]["x"] - found[1]["x"]).max()) < 3e-3


def slippery(simulate: case.Simulate) -> case.BreakPoint:
    """The least friction on which the coin rolls."""
    return break_point(functools.partial(grips, simulate), 2.0 * LEAST, 0.3 * LEAST, resolution=1e-3)


def extrapolated(simulate: case.Simulate, motion: Steady, steps: int, part: int = 1) -> Any:
    """The errors of two time steps, extrapolated: what is of first order in the step drops out."""
    return 2.0 * turn(simulate, motion, 2 * steps, part) - turn(simulate, motion, steps, part)


def turns_flat(simulate: case.Simulate, degrees: float) -> bool:
    """Whether Euler's disk leaning by so little keeps lean, rate and energy for a quarter of a turn of 300 steps."""
    disk = Steady(math.radians(degrees), 0.0)
    lean, rate, centre, energy = extrapolated(simulate, disk, STEPS_A_TURN // 2, 4)
    left = (2.0 * disk.spin * step(disk)) ** 2
    return bool(max(abs(lean) / disk.lean, abs(rate), abs(centre) / RADIUS, abs(energy)) < left)


def measure(simulate: case.Simulate, motion: Steady) -> dict[str, float]:
    """Those of one turn."""
    errors = extrapolated(simulate, motion, STEPS_A_TURN)
    names = ("lean_error", "rate_error", "centre_error", "energy_error")
    return {name: float(value) for name, value in zip(names, errors, strict=True)}


def left_over(motion: Steady) -> float:
    """What may be left after that: the square of the coin's own turn in a step."""
    return (motion.spin * step(motion)) ** 2


def half_turn(time_step: float) -> float:
    """Of the coin, in whole steps [s]."""
    return round(math.pi / COIN.rate / time_step) * time_step


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Distance of the coin's centre from its place on the circle after half a turn [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("coin"))}
    duration = half_turn(time_step)
    result = simulate(scene(COIN), time_step=time_step, duration=duration, method=method, observe=observe)
    angle = COIN.rate * duration
    place = COIN.circle * complex(math.cos(angle), math.sin(angle))
    return abs(complex(result["x"][0], result["x"][1]) - place)


def draw(simulate: case.Simulate) -> case.Drawing:
    """How far the coin leans over one turn, at three time steps."""
    curves, ends = [], []
    for steps in (STEPS_A_TURN // 2, STEPS_A_TURN, 2 * STEPS_A_TURN):
        h = 2.0 * math.pi / COIN.rate / steps
        observe = {"q": engine.Trace(quantity=engine.Orientation("coin"))}
        result = simulate(scene(COIN), time_step=h, steps=steps, observe=observe)
        leaning = np.degrees(np.arccos(axis(result["q"])[:, 2]))
        ends.append(float(leaning[-1]) - math.degrees(COIN.lean))
        curves.append(line(f"h = {told(1e3 * h, 3)} ms", result.sample_times["q"], leaning))
    curves.append(
        line("steady", (0.0, 2.0 * math.pi / COIN.rate), (math.degrees(COIN.lean),) * 2, "reference")
    )
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="angle of the axis from the vertical [°]",
        note=f"After a turn the lean is off by {told(ends[0], 3)}°, {told(ends[1], 3)}° and {told(ends[2], 3)}°, each with half "
        "the step of the one before.",
    )


def _asked(configuration: str, motion: Steady, note: str) -> case.Measurement:
    limit = left_over(motion)
    source = (
        "first order drops out; what is left is of the order of (s h)², s h the coin's own turn in a step"
    )

    def metric(name: str, description: str, unit: str, scale: float = 1.0) -> case.Metric:
        return error(
            name, description, unit, scale * limit, source, "gate" if name == "rate_error" else "companion"
        )

    return ask(
        functools.partial(measure, motion=motion),
        (
            metric("rate_error", "turns about the vertical in the time of one, minus one, extrapolated", "1"),
            metric("lean_error", "lean after one turn less that of the start, extrapolated", "rad"),
            metric(
                "centre_error",
                "centre's distance from the axis less its circle's radius, extrapolated",
                "m",
                motion.circle + RADIUS,
            ),
            metric("energy_error", "change of energy over m g times the centre's height, extrapolated", "1"),
        ),
        note,
        step(motion),
        configuration,
    )


SHAKEN = abs(COIN.spin) * step(COIN)

TEST = case.ScalarTest(
    title="Rolling coin",
    question="Do a coin on its circle and Euler's disk keep their steady motion?",
    why="A coin that rolls leaning is held by gyroscopic moments and by friction that does no work, at one point that "
    "wanders round its edge. Contact, rotation and friction must agree at every moment.",
    model="A coin of 0.5 kg, 0.1 m radius and 4 mm thickness rolls on a rough floor: leaning by 30° on a circle of 0.5 m, "
    "and at 20° from the floor with its centre at rest (Euler's disk).",
    parameters=(
        ("time step", "1/600 of a turn, and half of it: 3.9 ms and 0.31 ms"),
        ("coin", "radius 0.1 m, thickness 4 mm, 0.5 kg"),
        ("friction", "µ = 0.9"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "θ: axis from the vertical. The contact is c = r cos θ − ½ d sin θ outside the centre, which is z = r sin θ + "
        "½ d cos θ high and goes round R. Rolling: s = −Ω (R + c)/r about the axis.",
        "Moments about the centre: Ω² [m R z + sin θ ((I₁ − I₃) cos θ + I₃ (R + c)/r)] = m g c.",
        "Euler's disk, R = 0 and d = 0: Ω² = 4 g/(r sin θ).",
        "Each step rolls about the contact of its start: first order. From two steps, 2 e(h/2) − e(h) is of second order.",
    ),
    reference="Closed form of steady rolling.",
    conclusion="Green: the contact wanders round the edge as it must, and friction does no work. Red: the coin falls, "
    "rises or drifts off its circle by more than the step explains.",
    source="ours; H. K. Moffatt, Nature 404 (2000), 833, for the disk; E. J. Routh for steady rolling",
    measurements=(
        _asked("coin", COIN, "a coin on a circle, one turn"),
        _asked("disk", DISK, "Euler's disk, one turn"),
    ),
    example=lambda: case.Example(scene=scene(COIN), time_step=step(COIN), duration=2.0 * math.pi / COIN.rate),
    figures=(case.Figure(name="lean", title="Lean of the coin over one turn", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="least-friction",
            title="Least friction on which the coin rolls",
            configuration="plain",
            definition="after a quarter of a turn it is within 3 mm of where it would be on a floor as rough as any",
            study=slippery,
            unit="1",
            better="smaller",
            expected=((1.0 - SHAKEN) * LEAST, (1.0 + SHAKEN) * LEAST),
            expected_source="Ω² R/g = 0.363, to a part s h, the coin's own turn in a step",
        ),
        unbroken(
            turns_flat,
            20.0,
            0.01,
            name="flattest",
            title="Flattest Euler's disk that turns steadily",
            definition="after a quarter of a turn of 300 steps lean, rate, centre and energy are right to (s h)², extrapolated, the lean as "
            "a part of itself",
            source="heights, and what moves them, all go with the lean: a turn is a turn, as fast as 1/√sin θ",
            unit="degrees",
            walk=4,
        ),
    ),
    ladders=(
        case.Ladder(
            name="place",
            description="distance of the coin's centre from its place on the circle after about half a turn",
            unit="m",
            time_steps=tuple(1.0 / n for n in (240, 480, 960, 1920, 3840)),
            configurations=configured({"direct": 1.0, "half-step": 1.0}, (1 / 3840, 1 / 480)),
            error=ladder_error,
            target_error=0.01,
            target_seconds=0.1,
        ),
    ),
)

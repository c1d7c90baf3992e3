"""Does a ball on a turntable circle at 2/7 of its rate, and which boxes does the turntable throw off?"""

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

GRAVITY = 9.81  # m/s²
FRICTION = 0.5
RATE = 3.0  # rad/s
RADIUS, MASS = 0.05, 0.5  # m, kg
START, PUSH = (0.3, 0.0), (0.1, 0.2)  # m, m/s
TIME_STEP = 1.0 / 60.0  # s
CIRCLE = 2.0 / 7.0 * RATE  # rad/s
TURN = 2.0 * math.pi / CIRCLE  # s
STEPS = round(TURN / TIME_STEP)
THROWN = FRICTION * GRAVITY / RATE**2  # m, where boxes begin to slide
BOX = (0.06, 0.06, 0.02)  # m
FEW = 10  # steps, of the study of the longest
# s: a step asks (2/7) Ω h |v| of h µ g, and |v| grows by √(1 + (2 Ω h/7)²) a step; the last friction that is seen is that of the
# last step but one.
LONGEST = math.sqrt((FRICTION * GRAVITY / CIRCLE / math.hypot(*PUSH)) ** (2.0 / (FEW - 2)) - 1.0) / CIRCLE

ROUGH = engine.Material(friction=FRICTION)


def table() -> engine.RigidBody:
    """A level plane that turns about the z axis."""
    return engine.RigidBody(
        name="table",
        motion="kinematic",
        shape=engine.Plane(),
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, RATE),
        material=ROUGH,
    )


def rolling() -> engine.Scene:
    """A ball that rolls on the table without slip from the start: v + r n × w = Ω × x."""
    (x, y), (vx, vy) = START, PUSH
    slip = (-RATE * y - vx, RATE * x - vy)  # r n × w = r (−w_y, w_x)
    ball = engine.RigidBody(
        name="ball",
        mass=MASS,
        shape=engine.Sphere(RADIUS),
        position=(x, y, RADIUS),
        velocity=(vx, vy, 0.0),
        angular_velocity=(slip[1] / RADIUS, -slip[0] / RADIUS, 0.0),
        material=ROUGH,
    )
    return engine.Scene(bodies=(table(), ball), gravity=(0.0, 0.0, -GRAVITY))


def riding(radius: float) -> engine.Scene:
    """A box that moves with the table, so far from its axis."""
    box = engine.RigidBody(
        name="box",
        mass=1.0,
        shape=engine.Box(BOX),
        position=(radius, 0.0, 0.5 * BOX[2]),
        velocity=(0.0, RATE * radius, 0.0),
        angular_velocity=(0.0, 0.0, RATE),
        material=ROUGH,
    )
    return engine.Scene(bodies=(table(), box), gravity=(0.0, 0.0, -GRAVITY))


def recursion(time_step: float, steps: int) -> Any:
    """Places of the ball as complex numbers: x₊ = x + h v, v₊ = v + (2/7) i Ω h v: the table is felt where it stood."""
    x, v = complex(*START), complex(*PUSH)
    places = [x]
    for _ in range(steps):
        x += time_step * v
        v += 1j * CIRCLE * time_step * v
        places.append(x)
    return np.array(places)


def circle(time: Any) -> Any:
    """The circle itself, about x₀ + i v₀/(2/7 Ω)."""
    centre = complex(*START) + 1j * complex(*PUSH) / CIRCLE
    return centre + (complex(*START) - centre) * np.exp(1j * CIRCLE * np.asarray(time))


def roll(simulate: case.Simulate) -> dict[str, float]:
    """One whole circle."""
    observe = {"x": engine.Trace(quantity=engine.Position("ball"))}
    result = simulate(rolling(), time_step=TIME_STEP, steps=STEPS, observe=observe)
    places = result["x"][:, 0] + 1j * result["x"][:, 1]
    speeds = np.diff(places)
    phase = float(np.unwrap(np.angle(speeds))[-1] - np.angle(speeds[0]))
    return {
        "rate_error": phase / ((STEPS - 1) * TIME_STEP * CIRCLE) - 1.0,
        "path_error": float(np.abs(places - recursion(TIME_STEP, STEPS)).max()),
        "height_error": float(np.abs(result["x"][:, 2] - RADIUS).max()),
    }


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Distance from the circle after 2 s [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("ball"))}
    result = simulate(rolling(), time_step=time_step, duration=2.0, method=method, observe=observe)
    return abs(complex(result["x"][0], result["x"][1]) - complex(circle(2.0)))


def stays(simulate: case.Simulate, radius: float) -> bool:
    """Whether a box moves with the table for one step: what friction can bend its way by is h µ g."""
    observe = {"x": engine.Final(quantity=engine.Position("box"))}
    result = simulate(riding(radius), time_step=TIME_STEP, steps=2, observe=observe)
    if not result.completed:
        return False
    place = complex(result["x"][0], result["x"][1])
    carried = radius * (1.0 + 1j * RATE * TIME_STEP) ** 2
    return abs(place - carried) < 1e-3 * RATE**2 * radius * TIME_STEP**2


def farthest(simulate: case.Simulate) -> case.BreakPoint:
    """The largest radius at which boxes stay."""
    return break_point(lambda radius: stays(simulate, radius), 0.3 * THROWN, 3.0 * THROWN, resolution=1e-3)


def follows(simulate: case.Simulate, time_step: float) -> bool:
    """Whether the ball's places are those of the recursion in so long steps [s]."""
    observe = {"x": engine.Trace(quantity=engine.Position("ball"))}
    result = simulate(rolling(), time_step=time_step, steps=FEW, observe=observe)
    places = result["x"][:, 0] + 1j * result["x"][:, 1]
    return result.completed and float(np.abs(places - recursion(time_step, FEW)).max()) < 1e-6


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step in which the ball rolls."""
    return break_point(
        functools.partial(follows, simulate), TIME_STEP, 4.0 * LONGEST, resolution=1e-3, walk=6
    )


def draw(simulate: case.Simulate) -> case.Drawing:
    """The ball's way over one circle, from above."""
    observe = {"x": engine.Trace(quantity=engine.Position("ball"))}
    result = simulate(rolling(), time_step=TIME_STEP, steps=STEPS, observe=observe)
    exact = circle(result.sample_times["x"])
    places = result["x"][:, 0] + 1j * result["x"][:, 1]
    apart = float(np.abs(places - exact).max())
    ways = np.unwrap(np.angle(np.diff(places)))
    circled = float(ways[-1] - ways[0]) / math.tau * STEPS / (STEPS - 1)
    return case.Drawing(
        curves=(
            line("ball", result["x"][:, 0], result["x"][:, 1]),
            line("circle", exact.real, exact.imag, "reference"),
        ),
        x_label="x [m]",
        y_label="y [m]",
        note=f"The ball circles {told(circled, 3)} times while the table turns {told(RATE * STEPS * TIME_STEP / math.tau, 3)} times; "
        f"the run leaves the circle by {told(apart)} m.",
    )


SLOW = (CIRCLE * TIME_STEP) ** 2 / 3.0

TEST = case.ScalarTest(
    title="Turntable",
    question="Do bodies on a turntable roll or slide as mechanics says?",
    why="The ball's circle is a classic that no engine gets by chance: rolling, spin and a moving surface must all be "
    "right. Sorting tables rest on the radius at which friction loses.",
    model="A solid ball rolls without slip on a rough table that turns at 3 rad/s. Boxes ride on the same table.",
    parameters=(
        ("time step", "1/60 s"),
        ("table", "3 rad/s, µ = 0.5"),
        ("ball", "radius 0.05 m, 0.5 kg"),
        ("box", "0.06 × 0.06 × 0.02 m"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Rolling: v + r n × w = Ω × x. With I = ⅖ m r² the friction gives (7/2) v' = Ω × v: a circle at (2/7) Ω.",
        "One step: x₊ = x + h v, v₊ = v + (2/7) h Ω × v. The speed grows by (1 + (2 Ω h/7)²)^½ a step, the turn is "
        "arctan(2 Ω h/7): the rate is (2 Ω h/7)²/3 too low. It rolls while (2/7) Ω |v| ≤ µ g.",
        "A box rides along while Ω² R ≤ µ g; a step asks h Ω² R of at most h µ g, so the radius is exact.",
    ),
    reference="Closed forms; the recursion of one step.",
    conclusion="Green: friction ties the ball's spin, its way and the table together. Red: the moving surface or the "
    "spin is lost in the contact.",
    source="ours; E. Soodak and M. S. Tiersten, American Journal of Physics 64 (1996), 289, for the circle",
    measurements=(
        ask(
            roll,
            (
                error(
                    "rate_error",
                    "rate of the circle over 2/7 of the table's, minus one",
                    "1",
                    1.02 * SLOW,
                    f"the discrete turn is (2 Ω h/7)²/3 = {told(SLOW, 3)} too small",
                ),
                error(
                    "path_error",
                    "largest difference to the recursion of one step over a circle",
                    "m",
                    1e-8,
                    "the same sums in another order; the solver stops at 1e-10 of the load, h g of speed, in each of 440 steps",
                    "companion",
                ),
                error(
                    "height_error", "how far the ball leaves the table", "m", 1e-9, "it rests", "companion"
                ),
            ),
            "one circle of the ball",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=rolling(), time_step=TIME_STEP, duration=TURN),
    stability=(
        case.StabilityStudy(
            name="thrown",
            title="Largest radius at which a box rides along",
            configuration="plain",
            definition="after two steps the box is where the table carried it",
            study=farthest,
            unit="m",
            expected=(0.998 * THROWN, 1.002 * THROWN),
            expected_source="µ g/Ω² = 0.545 m, to the resolution of the search and of what counts as carried",
        ),
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which the ball rolls",
            configuration="plain",
            definition="its places in ten steps are those of the recursion, to 1e-6 m",
            study=longest_step,
            unit="s",
            expected=(0.998 * LONGEST, 1.001 * LONGEST),
            expected_source="the ball's speed grows by √(1 + (2 Ω h/7)²) a step, until (2/7) Ω |v| is more than µ g in the ninth; "
            "to the resolution of the search",
        ),
    ),
    figures=(case.Figure(name="circle", title="The ball's way from above", draw=draw),),
    ladders=(
        case.Ladder(
            name="place",
            description="distance from the circle after 2 s",
            unit="m",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480, 960)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=0.005,
            target_seconds=0.05,
        ),
    ),
)

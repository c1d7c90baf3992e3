"""Does a spring latch hold a door up to the push that statics allows, and let it go as mechanics says?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case, overlap
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
WIDTH, HEIGHT, THICKNESS, DOOR = 0.8, 2.0, 0.04, 20.0  # m, kg
RADIUS, BOLT = 0.01, 0.2  # m, kg: a ball as the bolt's nose
STIFFNESS, PRESSED = 1000.0, 0.02  # N/m, m: its spring where the bolt is out
BEVEL = math.radians(45.0)  # of the strike's face against the bolt
TIME_STEP = 1.0 / 60.0  # s
FRICTION = 0.3  # of a rough strike
HELD, PUSHED = 0.9, 1.5  # of the moment that opens it
STANDS, OPENING = 1.0, 0.2  # s
LEAST = 1e-6  # rad, by which what opens turns
SEARCHED = 2e-4  # the search's resolution


def opens(friction: float = 0.0) -> float:
    """The moment that opens the door [N m]: the strike's force N has N (cos β − µ sin β) along the bolt, which the spring
    bears, and N (sin β + µ cos β) across it; friction acts on the nose's surface."""
    c, s = math.cos(BEVEL), math.sin(BEVEL)
    force = STIFFNESS * PRESSED / (c - friction * s)
    return force * (WIDTH * (s + friction * c) + RADIUS * friction)


@functools.cache
def scene(share: float, friction: float = 0.0) -> engine.Scene:
    """A shut door under `share` of the moment that opens it."""
    rough = engine.Material(friction=friction)
    half = 0.5 * WIDTH
    normal = np.array((-math.cos(BEVEL), -math.sin(BEVEL)))  # of the strike's face
    back = np.array((WIDTH, 0.0)) - (RADIUS + 0.02) * normal
    return engine.Scene(
        bodies=(
            engine.RigidBody(
                name="door",
                mass=DOOR,
                shape=engine.Box((WIDTH - 0.06, THICKNESS, HEIGHT)),
                position=(half, 0, 0),
            ),
            engine.RigidBody(
                name="bolt",
                mass=BOLT,
                shape=engine.Sphere(RADIUS),
                position=(WIDTH, 0.0, 0.0),
                material=rough,
            ),
            engine.RigidBody(
                name="strike",
                motion="static",
                shape=engine.Box((0.04, 0.08, 0.08)),
                position=(float(back[0]), float(back[1]), 0.0),
                orientation=(math.cos(0.5 * BEVEL), 0.0, 0.0, math.sin(0.5 * BEVEL)),
                material=rough,
            ),
        ),
        constraints=(
            engine.Hinge(
                name="hinge", between=(engine.WORLD, "door"), at=(0, 0, 0), axis=(0, 0, 1), compliance=0.0
            ),
            engine.Prismatic(
                name="guide",
                between=("door", "bolt"),
                axis=(1, 0, 0),
                compliance=0.0,
                spring=engine.JointSpring(stiffness=STIFFNESS, rest=PRESSED, damping=0.0),
                limit=engine.Limit(lower=-0.03, upper=0.0, compliance=0.0),
            ),
        ),
        forces=(engine.Load(name="push", body="door", torque=(0.0, 0.0, share * opens(friction))),),
        gravity=(0.0, 0.0, -GRAVITY),
        no_contact=(("door", "strike"), ("door", "bolt")),
    )


def nose(angle: float) -> tuple[float, float, float]:
    """How far from the hinge a nose that slides along the strike is [m] where the door has turned [rad], and its first and
    second derivative: it stays on a plane."""
    off = angle - BEVEL
    reach = WIDTH * math.cos(BEVEL) / math.cos(off)
    slope = reach * math.tan(off)
    return reach, slope, slope * math.tan(off) + reach / math.cos(off) ** 2


def gained(angle: float, rate: float, share: float) -> float:
    """Angular acceleration of the door [rad/s²], by Lagrange: T = ½ (I + m ρ²) θ'² + ½ m ρ'² and the spring's energy."""
    reach, slope, bend = nose(angle)
    door = DOOR * ((WIDTH - 0.06) ** 2 + THICKNESS**2) / 12.0 + DOOR * (0.5 * WIDTH) ** 2
    inertia = door + 0.4 * BOLT * RADIUS**2 + BOLT * (reach**2 + slope**2)
    turning = BOLT * (reach * slope + slope * bend)
    spring = STIFFNESS * (PRESSED + WIDTH - reach) * slope
    return (share * opens() + spring - turning * rate**2) / inertia


@functools.cache
def opened(share: float, time: float) -> tuple[float, float]:
    """How far the door has turned [rad] and how fast it turns [rad/s], by Runge and Kutta."""
    q, v, h = 0.0, 0.0, time / 50.0
    for _ in range(50):
        a1 = gained(q, v, share)
        a2 = gained(q + 0.5 * h * v, v + 0.5 * h * a1, share)
        a3 = gained(q + 0.5 * h * v + 0.25 * h * h * a1, v + 0.5 * h * a2, share)
        a4 = gained(q + h * v + 0.5 * h * h * a2, v + h * a3, share)
        q, v = q + h * v + h * h / 6.0 * (a1 + a2 + a3), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return q, v


ANGLE = {"q": engine.Trace(quantity=engine.JointCoordinate("hinge"))}


def hold(simulate: case.Simulate) -> dict[str, float]:
    """Under nine tenths of the moment that opens it, for a second."""
    observe: dict[str, Observable] = {
        "turned": engine.MaximumAbsolute(quantity=engine.JointCoordinate("hinge")),
        "strike": engine.Final(quantity=engine.ContactForce("bolt", "strike")),
        "hinge": engine.Final(quantity=engine.ConstraintForce("hinge")),
    }
    result = simulate(scene(HELD), time_step=TIME_STEP, duration=STANDS, observe=observe)
    force = HELD * opens() / (WIDTH * math.sin(BEVEL))
    caught = force * np.array((-math.cos(BEVEL), -math.sin(BEVEL), 0.0))
    weight = np.array((0.0, 0.0, (DOOR + BOLT) * GRAVITY))
    bent = (0.5 * DOOR + BOLT) * WIDTH * GRAVITY  # N m
    carried = np.array((*(weight - caught), 0.0, -bent, 0.0))
    return {
        "held_error": float(np.abs(result["strike"] - caught).max()) / force,
        "hinge_error": float(np.abs(result["hinge"] - carried).max()) / float(weight[2]),
        "held_turned": float(result["turned"]),
    }


def angle(simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN) -> float:
    """How far the door has turned after `OPENING` less where it should be [rad]."""
    observe = {"q": engine.Final(quantity=engine.JointCoordinate("hinge"))}
    result = simulate(scene(PUSHED), time_step=time_step, duration=OPENING, method=method, observe=observe)
    return float(result["q"]) - opened(PUSHED, OPENING)[0]


def let_go(simulate: case.Simulate) -> dict[str, float]:
    """Under half as much again."""
    return {"opening_error": angle(simulate, TIME_STEP)}


def shut(simulate: case.Simulate, friction: float, share: float) -> bool:
    """Whether the door does not move within half a second."""
    observe = {"q": engine.MaximumAbsolute(quantity=engine.JointCoordinate("hinge"))}
    result = simulate(scene(share, friction), time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and abs(float(result["q"])) < LEAST


def hardest(simulate: case.Simulate, friction: float) -> case.BreakPoint:
    """The hardest push that the latch holds, over that of statics."""
    return break_point(functools.partial(shut, simulate, friction), 0.5, 2.0, resolution=SEARCHED, walk=4)


def draw(simulate: case.Simulate) -> case.Drawing:
    """The door's angle over time, held and let go."""
    curves, ends = [], []
    for share in (HELD, PUSHED):
        result = simulate(scene(share), time_step=TIME_STEP, duration=OPENING, observe=ANGLE)
        times = result.sample_times["q"]
        curves.append(line(f"{share:g} of the moment", times, result["q"], "points"))
        ends.append(float(result["q"][-1]))
    right = [opened(PUSHED, float(t))[0] if t else 0.0 for t in times]
    return case.Drawing(
        curves=(*curves, line("Lagrange", times, right, "reference")),
        x_label="time [s]",
        y_label="angle of the door [rad]",
        note=f"Held it ends at {told(ends[0])} rad, let go at {told(ends[1], 3)} rad, and by Lagrange's equation at "
        f"{told(right[-1], 3)} rad.",
    )


STATICS = "statics: nothing moves at any time step; rounding and the solver's tolerance remain"
TEST = case.ScalarTest(
    title="Door with a latch",
    question="Does a spring latch hold a door up to the push that statics allows, and let it go as mechanics says?",
    why="A latch is a stop, a spring, a slide, a hinge and a contact that hold each other up. Solvers that sweep over them one "
    "by one let such a door give way, or never open.",
    model="A door on a hinge; in it a bolt with a round nose slides, pressed against its stop by a spring. The nose meets the "
    "bevelled face of a strike. A moment pushes the door.",
    parameters=(
        ("time step", "1/60 s"),
        ("door", f"{DOOR:g} kg, {WIDTH:g} m from the hinge to the nose"),
        (
            "bolt",
            f"{BOLT:g} kg, {STIFFNESS:g} N/m, pressed by {STIFFNESS * PRESSED:g} N, radius {RADIUS:g} m",
        ),
        ("strike", f"bevel 45°, smooth; µ = {FRICTION:g} in the search"),
        ("push", f"{HELD:g} and {PUSHED:g} of the moment that opens it"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "The strike pushes with N = M/(b sin β); along the bolt are N cos β, and what the spring has more the stop bears.",
        "It opens where N cos β is the spring's force: M = k s b tan β; with friction "
        "M = k s (b (sin β + µ cos β) + µ r)/(cos β − µ sin β).",
        "Then the nose slides: ρ = b cos(β)/cos(θ − β), one coordinate, and Lagrange's equation has its motion.",
    ),
    reference="Statics and Coulomb's law (closed form); the motion by Runge and Kutta.",
    conclusion="Green: stop, spring, slide, hinge and contact are solved together. Red: one of them gives way before it must.",
    source="ours; mechanisms are asked for in the thesis, section 5.4",
    measurements=(
        ask(
            hold,
            (
                error("held_error", "error of the strike's force over that force", "1", 1e-9, STATICS),
                error(
                    "hinge_error",
                    "error of what the hinge bears [N, N m], over the weight",
                    "1",
                    1e-9,
                    STATICS,
                ),
                error(
                    "held_turned",
                    "how far the door turns while it is held",
                    "rad",
                    1e-9,
                    STATICS,
                    "companion",
                ),
            ),
            "held for a second",
            TIME_STEP,
        ),
        ask(
            let_go,
            (
                error(
                    "opening_error",
                    "how far the door has turned after 0.2 s less where it should be",
                    "rad",
                    0.5 * TIME_STEP * opened(PUSHED, OPENING)[1],
                    "a step's force acts from its beginning on: half a step ahead",
                ),
            ),
            "let go",
            TIME_STEP,
            "let go",
        ),
    ),
    example=lambda: case.Example(scene=scene(PUSHED), time_step=TIME_STEP, duration=OPENING),
    figures=(case.Figure(name="angle", title="Angle of the door", draw=draw),),
    stability=tuple(
        case.StabilityStudy(
            name=name,
            title=f"Hardest push that the latch holds, over that of statics, µ = {friction:g}",
            configuration="plain",
            definition="within half a second the door turns by less than 1e-6 rad",
            study=functools.partial(hardest, friction=friction),
            unit="1",
            expected=(0.9997, 1.0001),
            expected_source="statics: 1; what is 1e-4 too hard turns it until the spring has as much more, by 5e-6 rad, and the search ends within 2e-4",
        )
        for name, friction in (("hardest", 0.0), ("hardest-rough", FRICTION))
    ),
    ladders=(
        case.Ladder(
            name="angle",
            description="how far the door has turned after 0.2 s less where it should be",
            unit="rad",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480)),
            configurations=configured({"direct": 1.0, "iterative": 1.0}, (1 / 480, 1 / 120)),
            error=angle,
            target_error=3e-4,
            target_seconds=0.02,
        ),
        overlap.ladder(functools.partial(scene, PUSHED), OPENING, of="bolt and strike"),
    ),
)

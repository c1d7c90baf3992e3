"""Does a quadruped stand on legs that carry what virtual work asks of them, and keep the books of momentum as it trots?"""

from __future__ import annotations

import functools
import math

from spook_tracker import engine

from .. import case, overlap
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..ropes.falling_chain import measure
from ..standing import GRAVITY, Robot, Vector, floor, limb, stand, stands
from ..sweep import line, told

RADIUS, THIGH, SHIN, BACK = (
    0.02,
    0.17,
    0.215,
    0.12,
)  # m: of limbs and feet, drops of the links, and knees behind hips
TRUNK, HIP, UPPER, LOWER = 10.0, 0.7, 1.0, 0.25  # kg
BESIDE, AHEAD, OUT = 0.12, 0.2, 0.07  # m: hips from the middle, legs from the hips
FRICTION = 0.8
STIFFNESS, SOFT = 300.0, 30.0  # N m/rad; soft enough that sweeps do not settle
TIME_STEP = 1.0 / 60.0  # s
STANDS, STEPS = 1.0, 30  # s, and steps of a study
PACE, LIFT, BEND = 2.0, 0.35, 0.7  # Hz, rad: how often legs are lifted, hips and knees
KNOTS = 60  # of a second of the trot
LONGEST = 100.0  # s
LEGS = {
    f"{end} {side}": (x, y)
    for end, x in (("front", 1), ("rear", -1))
    for side, y in (("left", 1), ("right", -1))
}
ROUGH = engine.Material(friction=FRICTION)


@functools.cache
def robot() -> Robot:
    """Thirteen bodies on twelve hinges; each foot right under its hip, so that four upright loads bear it."""
    height = THIGH + SHIN + RADIUS
    bodies = [
        engine.RigidBody(
            name="trunk",
            mass=TRUNK,
            shape=engine.Box((0.5, 0.25, 0.12)),
            position=(0, 0, height),
            material=ROUGH,
        )
    ]
    joints, soles = [], {}
    for leg, (front, side) in LEGS.items():
        x, inside, y = front * AHEAD, side * BESIDE, side * (BESIDE + OUT)
        knee: Vector = (x - BACK, y, height - THIGH)
        bodies += [
            engine.RigidBody(
                name=f"{leg} hip",
                mass=HIP,
                shape=engine.Box((0.06, 0.05, 0.06)),
                position=(x, 0.5 * (inside + y), height),
                material=ROUGH,
            ),
            limb(f"{leg} thigh", (x, y, height), knee, RADIUS, UPPER, ROUGH),
            limb(f"{leg} shin", knee, (x, y, RADIUS), RADIUS, LOWER, ROUGH),
        ]
        for name, first, second, at, axis in (
            ("roll", "trunk", f"{leg} hip", (x, inside, height), (1, 0, 0)),
            ("pitch", f"{leg} hip", f"{leg} thigh", (x, y, height), (0, 1, 0)),
            ("knee", f"{leg} thigh", f"{leg} shin", knee, (0, 1, 0)),
        ):
            joints.append(
                engine.Hinge(name=f"{leg} {name}", between=(first, second), at=at, axis=axis, compliance=0.0)
            )
        soles[f"{leg} shin"] = (x, y)
    weight = GRAVITY * math.fsum(body.mass or 0.0 for body in bodies)
    moment = GRAVITY * math.fsum((body.mass or 0.0) * body.position[0] for body in bodies)
    feet = {
        name: ((x, y, 0.0), (0.0, 0.0, 0.25 * (weight + math.copysign(moment / AHEAD, x * moment))))
        for name, (x, y) in soles.items()
    }
    return Robot(tuple(bodies), tuple(joints), feet)


@functools.cache
def scene(stiffness: float = STIFFNESS, share: float | None = None) -> engine.Scene:
    """Standing, with drives of at most `share` of what they carry."""
    return robot().scene(floor(ROUGH), stiffness, share)


@functools.cache
def trot(seconds: float = 2.0) -> engine.Scene:
    """Legs across from each other are lifted in turn."""
    times = tuple(k / KNOTS for k in range(round(seconds * KNOTS) + 1))
    moves = {}
    for leg, (front, side) in LEGS.items():
        phase = 0.0 if front == side else math.pi
        lift = [max(0.0, math.sin(2.0 * math.pi * PACE * time + phase)) for time in times]
        moves[f"{leg} pitch"] = engine.Table(times, tuple(LIFT * part for part in lift))
        moves[f"{leg} knee"] = engine.Table(times, tuple(-BEND * part for part in lift))
    return robot().scene(floor(ROUGH), STIFFNESS, moves=moves)


def rest(simulate: case.Simulate) -> dict[str, float]:
    """Standing for a second."""
    return stand(simulate, robot(), scene(), TIME_STEP, round(STANDS / TIME_STEP))


def trots(simulate: case.Simulate) -> dict[str, float]:
    """Momentum against all that acts, and how deep feet go in."""
    return measure(simulate, trot(), TIME_STEP)


def load_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest error of a foot's load over the weight, on soft drives."""
    return stand(simulate, robot(), scene(SOFT), time_step, round(STANDS / time_step), method)["load_error"]


def carries(simulate: case.Simulate, share: float) -> bool:
    """Whether drives of so much of their torques hold it for half a second."""
    found = stand(simulate, robot(), scene(STIFFNESS, share), TIME_STEP, STEPS)
    return found["moved"] < 1e-6


def weakest(simulate: case.Simulate) -> case.BreakPoint:
    """The weakest drives that hold it."""
    return break_point(functools.partial(carries, simulate), 2.0, 0.5, resolution=1e-3, walk=4)


def stands_for(simulate: case.Simulate, time_step: float) -> bool:
    """Whether feet and joints carry what statics asks after three steps so long [s]."""
    found = stand(simulate, robot(), scene(), time_step, 3)
    return max(found["load_error"], found["torque_error"]) < 1e-9


def draw(simulate: case.Simulate) -> case.Drawing:
    """Upright load of the feet as it trots."""
    observe = {foot: engine.Trace(quantity=engine.ContactForce(foot, "floor")) for foot in robot().feet}
    result = simulate(trot(), time_step=TIME_STEP, duration=1.0, observe=observe)
    times = next(iter(result.sample_times.values()))[1:]
    loads = [result[foot][1:, 2] for foot in robot().feet]
    whole = sum(loads)
    return case.Drawing(
        curves=(
            line("all feet", times, whole),
            line("front left and rear right", times, loads[0] + loads[3]),
            line("weight", times, [robot().weight] * len(times), "reference"),
        ),
        x_label="time [s]",
        y_label="upright load [N]",
        note=f"Two steps a second: the floor bears {told(float(whole.mean()), 4)} N in the mean and "
        f"{told(float(whole.max()), 3)} N at most, of a weight of {told(robot().weight, 4)} N.",
    )


NEWTON = "Newton: joints pass momentum on; rounding of a few hundred sums"
TEST = case.ScalarTest(
    title="Quadruped",
    question="Does a quadruped stand on legs that carry what virtual work asks, and keep the books of momentum as it trots?",
    why="Walking machines are trained in simulation. A solver that does not settle where joints and feet act on the same bodies "
    "lets them creep, sink, or float on momentum from nowhere.",
    model="A trunk on four legs of three hinges each, whose drives are springs with rests ahead by what they carry. It stands; "
    "and its drives lift legs that are across from each other in turn.",
    parameters=(
        ("time step", "1/60 s"),
        ("robot", "13 bodies, 17.8 kg, hips 0.4 m above the floor"),
        ("drives", f"{STIFFNESS:g} N m/rad, {SOFT:g} on the ladder"),
        ("trot", f"{PACE:g} Hz, hips turned by {LIFT:g} and knees by {BEND:g} rad"),
        ("friction coefficient", f"{FRICTION:g}"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Σ N = M g and Σ N x = Σ m g x; left and right bear alike.",
        "A joint's torque works against the weights and the feet beyond it: τ δq + Σ m g·δx + Σ N·δx = 0.",
        "Twelve drives that carry their torques leave four feet no other forces than these.",
        "Δp = h (Σ F_floor + Σ m g) in every step of a trot, whatever the drives do.",
    ),
    reference="Statics by virtual work, and Newton's law.",
    conclusion="Green: drives, joints, contacts and friction are solved together. Red: a leg gives way, or momentum leaks.",
    source="ours; robots are asked for in the thesis, section 5.4",
    measurements=(
        ask(rest, stands(STANDS), "standing", TIME_STEP),
        ask(
            trots,
            (
                error(
                    "momentum_error",
                    "largest momentum of a step that neither the weight nor the floor gave, over the largest momentum",
                    "1",
                    1e-12,
                    NEWTON,
                ),
                error("sunk", "deepest penetration", "m", 1e-9, "contacts are rigid", "companion"),
            ),
            "trotting",
            TIME_STEP,
            "trot",
        ),
    ),
    example=lambda: case.Example(scene=trot(), time_step=TIME_STEP, duration=2.0),
    figures=(case.Figure(name="loads", title="Load of the feet in a trot", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="weakest",
            title="Weakest drives that hold it, over what they carry",
            configuration="plain",
            definition="within half a second nothing moves by 1e-6 m",
            study=weakest,
            unit="1",
            better="smaller",
            expected=(0.9999, 1.0011),
            expected_source="virtual work: 1; the search ends within a thousandth",
        ),
        unbroken(
            stands_for,
            TIME_STEP,
            LONGEST,
            name="longest-step",
            title="Longest step in which feet and joints carry what statics asks",
            definition="loads and torques after three steps, to 1e-9",
            source="a pose of balance is one at any step",
            unit="s",
        ),
    ),
    ladders=(
        case.Ladder(
            name="load",
            description="largest error of a foot's load over the weight, after a second on drives a tenth as stiff",
            unit="1",
            time_steps=tuple(1.0 / n for n in (30, 60, 120)),
            configurations=configured({"direct": None, "iterative": None, "iterative, 200 iterations": None}),
            error=load_error,
            target_error=0.02,
            target_seconds=0.05,
        ),
        overlap.ladder(scene, STANDS, of="feet and floor"),
    ),
)

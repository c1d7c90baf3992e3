"""Does a humanoid stand on feet and joints that carry what statics asks, and fall against its stops without gaining energy?"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from spook_tracker import engine

from .. import case, overlap
from ..bracket import break_point, unbroken
from ..closed_form import ask, error
from ..configurations import configured
from ..ropes.falling_chain import measure
from ..standing import GRAVITY, Robot, apart, floor, limb, stand, stands
from ..sweep import line, told

FRICTION = 0.8
STIFFNESS = 1000.0  # N m/rad
TIME_STEP = 1.0 / 60.0  # s
STANDS, STEPS, FALL = 1.0, 30, 0.75  # s, steps of a study, s
STOPS = (-0.3, 0.6)  # rad, of every joint of the one that falls
ABOVE, PUSH, TUMBLE = 0.1, (1.0, 0.3, 0.0), (0.5, 2.0, 0.3)  # m, m/s, rad/s: how that one starts
LONGEST = 0.2  # s
SIDES = {"left": 0.1, "right": -0.1}  # m
ROUGH = engine.Material(friction=FRICTION)
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@functools.cache
def robot() -> Robot:
    """Nineteen bodies on eighteen hinges, six in each leg: two feet then have one share of the load."""
    solid = functools.partial(engine.RigidBody, material=ROUGH)
    bodies = [
        solid(name="pelvis", mass=10.0, shape=engine.Box((0.15, 0.25, 0.15)), position=(0, 0, 0.95)),
        solid(name="chest", mass=25.0, shape=engine.Box((0.2, 0.3, 0.4)), position=(0, 0, 1.25)),
        solid(name="head", mass=5.0, shape=engine.Sphere(0.1), position=(0, 0, 1.6)),
    ]
    table = [("waist y", "pelvis", "chest", (0.0, 0.0, 1.04)), ("neck y", "chest", "head", (0.0, 0.0, 1.48))]
    for side, y in SIDES.items():
        hip, knee, ankle = (0.0, y, 0.88), (0.05, y, 0.48), (0.0, y, 0.09)
        shoulder, elbow, hand = (0.0, 2 * y, 1.4), (-0.03, 2 * y, 1.12), (0.2, 2 * y, 1.0)
        bodies += [
            solid(name=f"{side} turn", mass=1.0, shape=engine.Sphere(0.05), position=hip),
            solid(name=f"{side} hip", mass=1.0, shape=engine.Sphere(0.05), position=hip),
            limb(f"{side} thigh", hip, knee, 0.06, 7.0, ROUGH),
            limb(f"{side} shin", knee, ankle, 0.04, 4.0, ROUGH),
            solid(name=f"{side} ankle", mass=0.5, shape=engine.Sphere(0.04), position=ankle),
            solid(
                name=f"{side} foot", mass=1.0, shape=engine.Box((0.26, 0.1, 0.06)), position=(0.04, y, 0.03)
            ),
            limb(f"{side} arm", shoulder, elbow, 0.04, 2.0, ROUGH),
            limb(f"{side} forearm", elbow, hand, 0.035, 1.5, ROUGH),
        ]
        table += [
            (f"{side} hip z", "pelvis", f"{side} turn", hip),
            (f"{side} hip x", f"{side} turn", f"{side} hip", hip),
            (f"{side} hip y", f"{side} hip", f"{side} thigh", hip),
            (f"{side} knee y", f"{side} thigh", f"{side} shin", knee),
            (f"{side} ankle y", f"{side} shin", f"{side} ankle", ankle),
            (f"{side} ankle x", f"{side} ankle", f"{side} foot", ankle),
            (f"{side} shoulder y", "chest", f"{side} arm", shoulder),
            (f"{side} elbow y", f"{side} arm", f"{side} forearm", elbow),
        ]
    joints = tuple(
        engine.Hinge(name=name, between=(first, second), at=at, axis=AXES[name[-1]], compliance=0.0)
        for name, first, second, at in table
    )
    masses = np.array([body.mass for body in bodies])
    middle = float(masses @ [body.position[0] for body in bodies] / masses.sum())
    half = 0.5 * GRAVITY * float(masses.sum())
    feet = {f"{side} foot": ((middle, y, 0.0), (0.0, 0.0, half)) for side, y in SIDES.items()}
    return Robot(tuple(bodies), joints, feet)


@functools.cache
def scene(share: float | None = None) -> engine.Scene:
    """Standing, with drives of at most `share` of what they carry."""
    return robot().scene(floor(ROUGH), STIFFNESS, share)


@functools.cache
def limp(above: float = ABOVE) -> engine.Scene:
    """Tumbling onto the floor without drives, every joint between stops."""
    bodies = []
    for body in robot().bodies:
        arm = np.array(body.position) - (0.0, 0.0, 1.0)
        u, v, w = (float(one) for one in np.cross(TUMBLE, arm) + PUSH)
        x, y, z = body.position
        bodies.append(replace(body, position=(x, y, z + above), velocity=(u, v, w), angular_velocity=TUMBLE))
    low, high = STOPS
    joints = []
    for joint in robot().joints:
        x, y, z = joint.at or (0.0, 0.0, 0.0)
        stops = engine.Limit(lower=low, upper=high, compliance=0.0)
        joints.append(replace(joint, at=(x, y, z + above), limit=stops))
    return engine.Scene(
        bodies=(floor(ROUGH), *bodies),
        constraints=tuple(joints),
        gravity=(0.0, 0.0, -GRAVITY),
        no_contact=apart([body.name for body in bodies]),
    )


def rest(simulate: case.Simulate) -> dict[str, float]:
    """Standing for a second."""
    return stand(simulate, robot(), scene(), TIME_STEP, round(STANDS / TIME_STEP))


def fall(simulate: case.Simulate) -> dict[str, float]:
    """Momentum and energy of the one that falls."""
    return measure(simulate, limp(), TIME_STEP)


def residue(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """How deep the one that falls goes in [m]."""
    return measure(simulate, limp(), time_step, method)["sunk"]


def carries(simulate: case.Simulate, share: float) -> bool:
    """Whether drives of so much of their torques hold it for half a second."""
    return stand(simulate, robot(), scene(share), TIME_STEP, STEPS)["moved"] < 1e-6


def weakest(simulate: case.Simulate) -> case.BreakPoint:
    """The weakest drives that hold it."""
    return break_point(functools.partial(carries, simulate), 2.0, 0.5, resolution=1e-3, walk=4)


def stands_for(simulate: case.Simulate, time_step: float) -> bool:
    """Whether feet and joints carry what statics asks after three steps so long [s]."""
    found = stand(simulate, robot(), scene(), time_step, 3)
    return max(found["load_error"], found["torque_error"]) < 1e-9


def draw(simulate: case.Simulate) -> case.Drawing:
    """Energy of the fall."""
    observe = {"E": engine.Trace(quantity=engine.Energy())}
    result = simulate(limp(), time_step=TIME_STEP, duration=FALL, observe=observe)
    return case.Drawing(
        curves=(line("energy", result.sample_times["E"], result["E"]),),
        x_label="time [s]",
        y_label="energy [J]",
        note=f"It ends with {told(float(result['E'][-1]), 3)} J; the largest change upwards of a step is "
        f"{told(float(np.diff(result['E']).max()))} J.",
    )


TEST = case.ScalarTest(
    title="Humanoid",
    question="Does a humanoid stand on joints that carry what statics asks, and fall against its stops without gaining energy?",
    why="Nineteen bodies, eighteen joints with drives or stops, flat feet: one solve in which everything depends on everything. "
    "What does not settle there shakes, and what shakes gains energy.",
    model="A trunk, a head, two arms and two legs of six hinges: standing on both feet, with springs for drives whose rests "
    "are ahead by what they carry; and falling without drives, every joint between stops. No rebound.",
    parameters=(
        ("time step", "1/60 s"),
        ("robot", "19 bodies, 76 kg, 1.7 m"),
        ("drives", f"{STIFFNESS:g} N m/rad"),
        ("fall", "from 0.1 m, 1 m/s ahead, tumbling with 2.1 rad/s; stops at −0.3 and 0.6 rad"),
        ("friction coefficient", f"{FRICTION:g}"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Each foot bears half of the weight, under the centre of mass.",
        "A joint's torque works against the weights and the foot beyond it: τ δq + Σ m g·δx + Σ N·δx = 0.",
        "Twelve drives in the legs that carry their torques leave the feet no other forces and moments than these.",
        "Falling: Δp = h (Σ F_floor + Σ m g), and contacts, friction and stops take energy only.",
    ),
    reference="Statics by virtual work, Newton's law, and that nothing drives the fall.",
    conclusion="Green: drives, stops, joints and contacts are solved together. Red: a joint gives way, or energy comes from nowhere.",
    source="ours; robots are asked for in the thesis, section 5.4",
    measurements=(
        ask(rest, stands(STANDS), "standing", TIME_STEP),
        ask(
            fall,
            (
                error(
                    "momentum_error",
                    "largest momentum of a step that neither the weight nor the floor gave, over the largest momentum",
                    "1",
                    1e-12,
                    "Newton: joints pass momentum on; rounding of a few hundred sums",
                ),
                error(
                    "gain",
                    "largest gain of energy in a step",
                    "J",
                    1e-9,
                    "nothing drives it: plastic contact, friction and stops take, joints hold",
                ),
                error("sunk", "deepest penetration", "m", 1e-9, "contacts are rigid", "companion"),
            ),
            "falling",
            TIME_STEP,
            "fall",
        ),
    ),
    example=lambda: case.Example(scene=limp(), time_step=TIME_STEP, duration=2.0),
    figures=(case.Figure(name="energy", title="Energy of the fall", draw=draw),),
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
            name="sunk",
            description="how deep the one that falls goes in: not at all is right",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120)),
            configurations=configured({"direct": None, "iterative": None}),
            error=residue,
            target_error=1e-6,
            target_seconds=0.05,
        ),
        overlap.ladder(limp, FALL, of="the one that falls and the floor"),
    ),
)

"""Does a vehicle on six driven wheels climb two steps, and go on as fast as its wheels turn, its weight where statics has it?"""

from __future__ import annotations

import functools
import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.joints import Constraint
from spook_tracker.engine.observe import Observable

from .. import case, overlap
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..standing import apart, floor
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
CHASSIS, LOAD, WHEEL, RADIUS, WIDTH = 40.0, 10.0, 2.0, 0.14, 0.08  # kg, m
AXLES, TRACK, AHEAD = (
    {"front": 0.4, "middle": 0.0, "rear": -0.4},
    0.33,
    0.2,
)  # m; the load is before the middle
FRICTION = 0.8
RATE, TORQUE = 6.0, 100.0  # rad/s, N m: more than the friction of a wheel that bears all
STEP, FIRST, DEEP = 0.03, 0.9, 0.6  # m, of each of two steps
TIME_STEP = 1.0 / 60.0  # s
LEVEL, DURATION = 0.5, 4.0  # s: before the first step, and until all wheels are on the second
CLIMBS = 1.0  # s, until the first wheels are on the first step
HILL = 0.3  # of the search for the weakest drive
SPEED = RATE * RADIUS  # m/s
WEIGHT = GRAVITY * (CHASSIS + LOAD + 6.0 * WHEEL)  # N
CENTRE = LOAD * AHEAD * GRAVITY / WEIGHT  # m, before the chassis'
WHEELS = {
    f"{end} {side}": (x, y) for end, x in AXLES.items() for side, y in (("left", TRACK), ("right", -TRACK))
}


@functools.cache
def scene(slope: float = 0.0, rate: float = RATE, torque: float | None = TORQUE) -> engine.Scene:
    """At rest before two steps, or on a slope of that tan θ without them; each wheel driven at `rate` with `torque` at most."""
    rough = engine.Material(friction=FRICTION)
    bodies = [
        engine.RigidBody(
            name="chassis",
            mass=CHASSIS,
            shape=engine.Box((1.0, 0.5, 0.12)),
            position=(0, 0, 0.24),
            material=rough,
        ),
        engine.RigidBody(
            name="load",
            mass=LOAD,
            shape=engine.Box((0.2, 0.2, 0.2)),
            position=(AHEAD, 0, 0.4),
            material=rough,
        ),
    ]
    joints: list[Constraint] = [engine.Lock(name="lashing", between=("chassis", "load"), compliance=0.0)]
    for name, (x, y) in WHEELS.items():
        bodies.append(
            engine.RigidBody(
                name=name,
                mass=WHEEL,
                shape=engine.Cylinder(RADIUS, WIDTH),
                position=(x, y, RADIUS),
                orientation=(math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0),
                material=rough,
            )
        )
        joints.append(
            engine.Hinge(
                name=f"{name} axle",
                between=("chassis", name),
                at=(x, y, RADIUS),
                axis=(0, 1, 0),
                compliance=0.0,
                motor=engine.Motor(speed=rate, max_force=torque),
            )
        )
    steps = [
        engine.RigidBody(
            name=f"step {k + 1}",
            motion="static",
            shape=engine.Box((6.0, 2.0, 0.2)),
            position=(FIRST + DEEP * k + 3.0, 0.0, (k + 1) * STEP - 0.1),
            material=rough,
        )
        for k in range(0 if slope else 2)
    ]
    tilt = math.atan(slope)
    return engine.Scene(
        bodies=(floor(rough), *steps, *bodies),
        constraints=tuple(joints),
        gravity=(-GRAVITY * math.sin(tilt), 0.0, -GRAVITY * math.cos(tilt)),
        no_contact=apart([body.name for body in bodies]),
    )


def speeds(times: np.ndarray) -> np.ndarray:
    """Of the chassis before the steps [m/s]: all wheels spin until it is as fast as they turn."""
    return np.minimum(SPEED, FRICTION * GRAVITY * times)


def measure(simulate: case.Simulate) -> dict[str, float]:
    """Up both steps."""
    observe: dict[str, Observable] = {
        "v": engine.Trace(quantity=engine.Velocity("chassis")),
        "x": engine.Final(quantity=engine.Position("chassis")),
        "deep": engine.MaximumAbsolute(quantity=engine.Penetration()),
    }
    observe |= {name: engine.Final(quantity=engine.ContactForce(name)) for name in WHEELS}
    observe |= {f"at {name}": engine.Final(quantity=engine.Position(name)) for name in WHEELS}
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    times = result.sample_times["v"]
    before = times <= LEVEL
    loads = np.array([result[name][2] for name in WHEELS])
    places = np.array([result[f"at {name}"] for name in WHEELS])
    top = 2.0 * STEP + RADIUS
    ahead = result["v"][-1] / np.linalg.norm(result["v"][-1])
    return {
        "climbed": float((np.abs(places[:, 2] - top) < 0.5 * STEP).sum()),
        "start_error": float(np.abs(result["v"][before, 0] - speeds(times[before])).max()),
        "speed_error": float(np.hypot(*result["v"][-1, :2])) - SPEED,
        "height_error": float(result["x"][2]) - 0.24 - 2.0 * STEP,
        "load_error": float(loads.sum()) / WEIGHT - 1.0,
        "centre_error": float((loads @ places / loads.sum() - result["x"]) @ ahead) - CENTRE,
        "overlap": float(result["deep"]),
    }


def stays(simulate: case.Simulate, slope: float) -> bool:
    """Whether it stands on a slope of that tan θ with its wheels held for half a second."""
    observe = {"v": engine.Final(quantity=engine.Velocity("chassis"))}
    result = simulate(scene(slope, 0.0, None), time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and float(np.abs(result["v"]).max()) < 1e-6


def steepest(simulate: case.Simulate) -> case.BreakPoint:
    """The steepest slope it stands on."""
    return break_point(
        functools.partial(stays, simulate), 0.5 * FRICTION, 2.0 * FRICTION, resolution=1e-3, walk=4
    )


NEEDED = WEIGHT * math.sin(math.atan(HILL)) * RADIUS / 6.0  # N m


def climbs(simulate: case.Simulate, torque: float) -> bool:
    """Whether drives so strong take it up the hill within half a second."""
    observe = {"v": engine.Final(quantity=engine.Velocity("chassis"))}
    result = simulate(scene(HILL, RATE, torque), time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and float(result["v"][0]) > 0.0


def weakest(simulate: case.Simulate) -> case.BreakPoint:
    """The weakest drives that do."""
    return break_point(
        functools.partial(climbs, simulate), 2.0 * NEEDED, 0.5 * NEEDED, resolution=1e-3, walk=4
    )


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Way before the steps less v t − v²/(2 µ g) [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("chassis"))}
    result = simulate(scene(), time_step=time_step, duration=LEVEL, method=method, observe=observe)
    return float(result["x"][0]) - SPEED * (LEVEL - 0.5 * SPEED / (FRICTION * GRAVITY))


def draw(simulate: case.Simulate) -> case.Drawing:
    """Height of the chassis along its way."""
    observe = {"x": engine.Trace(quantity=engine.Position("chassis"))}
    result = simulate(scene(), time_step=TIME_STEP, duration=DURATION, observe=observe)
    x, z = result["x"][:, 0], result["x"][:, 2] - result["x"][0, 2]
    return case.Drawing(
        curves=(
            line("chassis", x, z),
            line("the last step", (x[0], x[-1]), (2.0 * STEP, 2.0 * STEP), "reference"),
        ),
        x_label="way [m]",
        y_label="height gained [m]",
        note=f"It ends {told(float(z[-1]), 4)} m higher after {told(float(x[-1] - x[0]), 3)} m, at most "
        f"{told(float(z.max()), 3)} m above its start.",
    )


STATICS = "statics and rolling without slip: rounding and the solver's tolerance remain"
TEST = case.ScalarTest(
    title="Six wheels over steps",
    question="Does a vehicle on six driven wheels climb two steps and go on as fast as its wheels turn?",
    why="Wheels that hit a step while five others push are impacts, friction, drives and joints at once. Solvers that do not "
    "settle there sink in, hop, or throw the vehicle.",
    model="A chassis on six wheels, all driven, with a load lashed to it before its middle, starts on the level with spinning "
    "wheels and climbs two steps.",
    parameters=(
        ("time step", "1/60 s"),
        (
            "vehicle",
            f"{CHASSIS:g} kg, {LOAD:g} kg of load {AHEAD:g} m ahead, wheels of {WHEEL:g} kg and {RADIUS:g} m",
        ),
        ("drives", f"{RATE:g} rad/s with at most {TORQUE:g} N m"),
        (
            "steps",
            f"{STEP:g} m each, the first {FIRST:g} m ahead of the middle, the second {DEEP:g} m further",
        ),
        ("friction coefficient", f"{FRICTION:g}"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "All wheels spin at first: v = µ g t, up to ω r; then nothing slips, and drives have nothing to do.",
        "On the last step it is higher by both, and as fast as before.",
        "Σ N = M g, and Σ N x = Σ m g x: which wheel bears what is not for statics to say.",
        "Held wheels stand up to tan θ = µ; drives climb that give Σ T/r = M g sin θ.",
    ),
    reference="Statics and Coulomb's law (closed form).",
    conclusion="Green: wheels climb, and nothing is left of it. Red: weight, speed or height are lost on the way.",
    source="ours; vehicles are asked for in the thesis, section 5.4",
    measurements=(
        ask(
            measure,
            (
                case.Metric(
                    name="climbed",
                    description="wheels that stand on the last step",
                    unit="1",
                    role="gate",
                    better="larger",
                    limit=6.0,
                    limit_source="all of six",
                    limit_kind="physical",
                    reference=6.0,
                ),
                error(
                    "start_error", "largest difference of the speed to µ g t, then ω r", "m/s", 1e-9, STATICS
                ),
                error("speed_error", "speed on the last step less ω r", "m/s", 1e-8, STATICS),
                error("height_error", "height gained less both steps", "m", 1e-8, STATICS),
                error(
                    "load_error",
                    "what all wheels bear at the end over the weight, minus one",
                    "1",
                    1e-8,
                    STATICS,
                ),
                error(
                    "centre_error",
                    "how far ahead of where statics has it the centre of all loads is",
                    "m",
                    1e-8,
                    STATICS,
                    "companion",
                ),
                error("overlap", "deepest overlap", "m", 1e-9, "contacts are rigid", "companion"),
            ),
            "over two steps",
            TIME_STEP,
        ),
    ),
    example=lambda: case.Example(scene=scene(), time_step=TIME_STEP, duration=DURATION),
    figures=(case.Figure(name="height", title="Height along the way", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="steepest",
            title="Steepest slope on which held wheels stand",
            configuration="plain",
            definition="after half a second it moves by less than 1e-6 m/s",
            study=steepest,
            unit="1",
            expected=(0.9985 * FRICTION, 1.0001 * FRICTION),
            expected_source="Coulomb: tan θ = µ, however wheels share the load; the search ends within a thousandth",
        ),
        case.StabilityStudy(
            name="weakest",
            title="Weakest drives that climb a slope of 0.3",
            configuration="plain",
            definition="after half a second it moves up",
            study=weakest,
            unit="N m",
            better="smaller",
            expected=(0.9999 * NEEDED, 1.0015 * NEEDED),
            expected_source="6 T/r = M g sin θ; the search ends within a thousandth",
        ),
    ),
    ladders=(
        case.Ladder(
            name="way",
            description="way on the level in half a second less v t − v²/(2 µ g)",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
            configurations=configured({"direct": 1.0, "iterative": None}),
            error=ladder_error,
            target_error=0.005,
            target_seconds=0.05,
        ),
        overlap.ladder(scene, CLIMBS, of="wheels and steps"),
    ),
)

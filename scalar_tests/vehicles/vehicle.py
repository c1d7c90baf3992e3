"""Does a vehicle on four wheels roll down a slope, brake and shift its weight as mechanics says?"""

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
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
CHASSIS, WHEEL = 1000.0, 25.0  # kg
RADIUS, WIDTH = 0.3, 0.2  # m, of a wheel
FRONT, REAR, TRACK = 1.2, 1.5, 1.5  # m: axles before and behind the chassis' centre; between left and right
RISE = 0.3  # m, of the chassis' centre over the axles
FRICTION = 0.7
COMPLIANCE = 1e-10  # m/N a point: with none the loads of eight points on four wheels are not unique
SLOPE = 0.1  # tan θ
SPEED = 10.0  # m/s, before braking
LONGEST = 10.0  # s, where the search for the longest step ends
TIME_STEP = 1.0 / 60.0  # s
DURATION = 1.0  # s
MASS = CHASSIS + 4.0 * WHEEL
INERTIA = 0.5 * WHEEL * RADIUS**2  # kg m², of a wheel about its axle
ROLLING = MASS * GRAVITY * math.sin(math.atan(SLOPE)) / (MASS + 4.0 * INERTIA / RADIUS**2)  # m/s²
BRAKING = FRICTION * GRAVITY  # m/s²
STOPPED = 5.0  # m/s, from which it comes to stand within a second
WHEELS = {
    "front left": (FRONT, 1),
    "front right": (FRONT, -1),
    "rear left": (-REAR, 1),
    "rear right": (-REAR, -1),
}
HALF = math.sqrt(0.5)


def scene(
    slope: float = 0.0, speed: float = 0.0, locked: bool = False, rise: float = RISE, torque: float = 0.0
) -> engine.Scene:
    """The vehicle on a plane, x ahead; gravity is tilted by atan(slope) ahead. `locked`: the brakes hold its wheels.
    `torque` [N m]: of each rear wheel's drive, which wants to turn faster than it ever will."""
    rough = engine.Material(friction=FRICTION, compliance=0.5 * COMPLIANCE)
    road = engine.RigidBody(
        name="road", motion="static", shape=engine.Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    chassis = engine.RigidBody(
        name="chassis",
        mass=CHASSIS,
        inertia=(400.0, 1500.0, 1700.0),
        shape=engine.Box((3.6, 1.2, 0.5)),  # touches nothing
        position=(0.0, 0.0, RADIUS + rise),
        velocity=(speed, 0.0, 0.0),
    )
    wheels = [
        engine.RigidBody(
            name=name,
            mass=WHEEL,
            shape=engine.Cylinder(RADIUS, WIDTH),
            position=(x, 0.5 * side * TRACK, RADIUS),
            orientation=(HALF, HALF, 0.0, 0.0),  # the axle along y
            velocity=(speed, 0.0, 0.0),
            angular_velocity=(0.0, 0.0 if locked else speed / RADIUS, 0.0),
            material=rough,
        )
        for name, (x, side) in WHEELS.items()
    ]
    drive = engine.Motor(speed=1000.0, max_force=torque) if torque > 0.0 else None
    axles = [
        engine.Hinge(
            name=f"{name} axle",
            between=("chassis", name),
            axis=(0.0, 1.0, 0.0),
            compliance=0.0,
            motor=engine.Motor(speed=0.0) if locked else drive if name.startswith("rear") else None,
        )
        for name in WHEELS
    ]
    tilt = math.atan(slope)
    sides = [(a, b) for a in WHEELS for b in WHEELS if a < b]
    return engine.Scene(
        bodies=(road, chassis, *wheels),
        constraints=tuple(axles),
        gravity=(GRAVITY * math.sin(tilt), 0.0, -GRAVITY * math.cos(tilt)),
        no_contact=(*sides, *(("chassis", name) for name in ("road", *WHEELS))),
    )


def front_load(ahead: float, down: float = GRAVITY, rise: float = RISE) -> float:
    """What the front wheels carry [N] while friction accelerates the vehicle by `ahead` [m/s²].

    Moments about the rear wheels' footprint: of weights and of m a at each height.
    """
    base = FRONT + REAR
    weights = CHASSIS * REAR * down + 2.0 * WHEEL * base * down
    return (weights - ahead * (CHASSIS * (RADIUS + rise) + 4.0 * WHEEL * RADIUS)) / base


def roll(simulate: case.Simulate) -> dict[str, float]:
    """Free rolling down the slope."""
    observe = {
        "v": engine.Trace(quantity=engine.Velocity("chassis")),
        "w": engine.Trace(quantity=engine.AngularVelocity("front left")),
    }
    result = simulate(scene(SLOPE), time_step=TIME_STEP, duration=DURATION, observe=observe)
    exact = ROLLING * result.sample_times["v"]
    return {
        "speed_error": float(np.abs(result["v"][:, 0] - exact).max()),
        "spin_error": float(np.abs(RADIUS * result["w"][:, 1] - exact).max()),
        "sideways": float(np.abs(result["v"][:, 1:]).max()),
    }


def brake(simulate: case.Simulate) -> dict[str, float]:
    """Sliding on four locked wheels."""
    observe: dict[str, Observable] = {"v": engine.Trace(quantity=engine.Velocity("chassis"))}
    observe |= {name: engine.Final(quantity=engine.ContactForce(name, "road")) for name in WHEELS}
    result = simulate(scene(0.0, SPEED, locked=True), time_step=TIME_STEP, duration=DURATION, observe=observe)
    exact = SPEED - BRAKING * result.sample_times["v"]
    stop = simulate(
        scene(0.0, STOPPED, locked=True),
        time_step=TIME_STEP,
        duration=DURATION,
        observe={
            "x": engine.Final(quantity=engine.Position("chassis")),
            "v": engine.Final(quantity=engine.Velocity()),
        },
    )
    front = float(result["front left"][2] + result["front right"][2])
    rear = float(result["rear left"][2] + result["rear right"][2])
    return {
        "speed_error": float(np.abs(result["v"][:, 0] - exact).max()),
        "stopping_error": float(stop["x"][0]) - stopping(TIME_STEP),
        "stands": float(np.abs(stop["v"]).max()),
        "transfer_error": front / front_load(-BRAKING) - 1.0,
        "load_error": (front + rear) / (MASS * GRAVITY) - 1.0,
    }


def stopping(time_step: float) -> float:
    """The way it slides [m], summed at the ends of steps until it stands: v²/(2 µ g), v h/2 less to first order."""
    steps = np.arange(1, round(DURATION / time_step) + 1)
    return time_step * float(np.maximum(0.0, STOPPED - BRAKING * time_step * steps).sum())


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Stopping way against v²/(2 µ g) [m]."""
    observe = {"x": engine.Final(quantity=engine.Position("chassis"))}
    asked = scene(0.0, STOPPED, locked=True)
    result = simulate(asked, time_step=time_step, duration=DURATION, method=method, observe=observe)
    return float(result["x"][0]) - STOPPED**2 / (2.0 * BRAKING)


# Over the front wheels it goes when they carry all: µ g (m_c (r + rise) + 4 m_w r) = g (m_c FRONT + 2 m_w L).
TIPPING = (
    (CHASSIS * FRONT + 2.0 * WHEEL * (FRONT + REAR)) / FRICTION - 4.0 * WHEEL * RADIUS
) / CHASSIS - RADIUS  # m


def rolls(simulate: case.Simulate, time_step: float) -> bool:
    """Whether the vehicle rolls down the slope by a t, to a millionth, after ten steps so long [s]."""
    observe = {
        "v": engine.Final(quantity=engine.Velocity("chassis")),
        "w": engine.Final(quantity=engine.AngularVelocity("front left")),
    }
    result = simulate(scene(SLOPE), time_step=time_step, steps=10, observe=observe)
    speed = 10.0 * time_step * ROLLING
    off = (float(result["v"][0]) / speed, RADIUS * float(result["w"][1]) / speed)
    return result.completed and max(abs(one - 1.0) for one in off) < 1e-6


def longest_step(simulate: case.Simulate) -> case.BreakPoint:
    """The longest step [s] in which the vehicle rolls as it should."""
    return break_point(functools.partial(rolls, simulate), TIME_STEP, LONGEST, walk=5)


def stays_down(simulate: case.Simulate, rise: float) -> bool:
    """Whether the rear wheels stay on the road for a quarter of a second of braking."""
    observe = {"x": engine.Final(quantity=engine.Position("rear left"))}
    asked = scene(0.0, SPEED, locked=True, rise=rise)
    result = simulate(asked, time_step=TIME_STEP, duration=0.25, observe=observe)
    return result.completed and float(result["x"][2]) < RADIUS + 1e-6


def highest(simulate: case.Simulate) -> case.BreakPoint:
    """The highest centre of mass that brakes without tipping over."""
    return break_point(
        functools.partial(stays_down, simulate), 0.5 * TIPPING, 2.0 * TIPPING, resolution=0.002
    )


def draw(simulate: case.Simulate) -> case.Drawing:
    """Speed against time, rolling down and braking."""
    curves, apart = [], 0.0
    for name, asked, start, gain in (
        ("down the slope", scene(SLOPE), 0.0, ROLLING),
        ("brakes locked", scene(0.0, SPEED, locked=True), SPEED, -BRAKING),
    ):
        observe = {"v": engine.Trace(quantity=engine.Velocity("chassis"))}
        result = simulate(asked, time_step=TIME_STEP, duration=DURATION, observe=observe)
        time, along = result.sample_times["v"], result["v"][:, 0]
        exact = start + gain * time
        apart = max(apart, float(np.abs(along - exact).max()))
        curves += [line(name, time, along, "points"), line(f"{name}, closed form", time, exact, "reference")]
    return case.Drawing(
        curves=tuple(curves),
        x_label="time [s]",
        y_label="speed [m/s]",
        note=f"The runs are at most {told(apart)} m/s off the closed forms.",
    )


# The most a wheel sinks [m]: ε F of one of its two points, of the front axle while it brakes.
SINK = COMPLIANCE * front_load(-BRAKING) / 4.0
TURNED = "constant forces are exact in a step, but the road gives way by ε F = 0.19 µm, a part of the wheel's radius"
ROLLED = SINK / RADIUS * ROLLING * DURATION  # m/s
STATICS = "moments about the rear footprints, with heights that sink by ε F = 0.19 µm"
SETTLING = "the wheels sink by ε F = 0.19 µm in the first steps: by less than that in one"

TEST = case.ScalarTest(
    title="Vehicle",
    question="Does a vehicle on four wheels roll down a slope, brake and shift its weight as mechanics says?",
    why="Wheels, axles, contact and friction act at once: a slip of the wheel, a lost moment or a soft axle shows at once "
    "in the acceleration or in the loads of the axles.",
    model="A rigid chassis of 1000 kg on four wheels of 25 kg, cylinders on hinges. It rolls freely down a slope, and "
    "slides with all wheels locked until it stands. There are no tyres and no suspension.",
    parameters=(
        ("time step", "1/60 s"),
        ("chassis", "1000 kg, centre 0.6 m over the road"),
        ("wheels", "25 kg, radius 0.3 m, width 0.2 m"),
        ("axles", "1.2 m before and 1.5 m behind the centre, track 1.5 m"),
        ("road", "µ = 0.7, slope 0.1"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Rolling: a = g sin θ · M/(M + 4 I/r²).",
        "Locked: a = −µ g. Σ m a h about the rear footprints moves load to the front: N_f L = (m_c b + 2 m_w L) g + "
        "µ g (m_c h + 4 m_w r).",
        "The stopping way is v²/(2 µ g), v h/2 less when summed at the ends of steps.",
        "It tips over its front wheels when these carry all.",
    ),
    reference="Closed forms.",
    conclusion="Green: wheels roll and slide as they must, and the road carries what moments say. Red: inertia of the "
    "wheels, friction or the height of the centre is lost somewhere between road and chassis.",
    source="ours; vehicles are asked for in the thesis, section 5.4",
    measurements=(
        ask(
            roll,
            (
                error("speed_error", "largest difference of the speed to a t", "m/s", ROLLED, TURNED),
                error(
                    "spin_error",
                    "largest difference of r w of a wheel to a t",
                    "m/s",
                    ROLLED,
                    TURNED,
                    "companion",
                ),
                error(
                    "sideways",
                    "largest speed across and upwards",
                    "m/s",
                    SINK / TIME_STEP,
                    SETTLING,
                    "companion",
                ),
            ),
            "free rolling down a slope",
            TIME_STEP,
        ),
        ask(
            brake,
            (
                error(
                    "speed_error",
                    "largest difference of the speed to v − µ g t",
                    "m/s",
                    SINK / TIME_STEP,
                    SETTLING,
                ),
                error(
                    "stopping_error",
                    "way from 5 m/s to standing, less the sum of the steps' speeds by −µ g",
                    "m",
                    SINK / TIME_STEP * DURATION,
                    f"{SETTLING}, of speed for a second",
                ),
                error(
                    "stands",
                    "largest speed of any part after that",
                    "m/s",
                    SINK / TIME_STEP,
                    SETTLING,
                    "companion",
                ),
                error(
                    "transfer_error",
                    "load of the front wheels over statics, minus one",
                    "1",
                    SINK / RADIUS,
                    STATICS,
                ),
                error(
                    "load_error",
                    "load of all wheels over the weight, minus one",
                    "1",
                    SINK / RADIUS,
                    STATICS,
                    "companion",
                ),
            ),
            "all wheels locked",
            TIME_STEP,
            "braking",
        ),
    ),
    example=lambda: case.Example(scene=scene(SLOPE), time_step=TIME_STEP, duration=3.0),
    stability=(
        case.StabilityStudy(
            name="tipping",
            title="Highest centre of mass that brakes without tipping over",
            configuration="plain",
            definition="after a quarter of a second with locked wheels the rear ones are on the road",
            study=highest,
            unit="m",
            expected=(0.99 * TIPPING, 1.005 * TIPPING),
            expected_source="the front wheels carry all at a rise of 1.577 m over the axles; a millionth of a metre is "
            "lifted in a quarter of a second by half a per cent more",
        ),
        case.StabilityStudy(
            name="longest-step",
            title="Longest step in which the vehicle rolls as it should",
            configuration="plain",
            definition="speed of chassis and wheels a t after ten steps, to a millionth",
            study=longest_step,
            unit="s",
            expected=(LONGEST, LONGEST),
            expected_source="a constant acceleration is exact in every step, and a wheel turns by h ω about its axle however far; the "
            "search ends at 10 s",
        ),
    ),
    figures=(case.Figure(name="speed", title="Speed against time", draw=draw),),
    ladders=(
        case.Ladder(
            name="stopping",
            description="stopping way from 5 m/s against v²/(2 µ g)",
            unit="m",
            time_steps=tuple(1.0 / n for n in (30, 60, 120, 240, 480)),
            configurations=configured({"direct": 1.0, "half-step": None}),
            error=ladder_error,
            target_error=0.03,
            target_seconds=0.1,
        ),
    ),
)

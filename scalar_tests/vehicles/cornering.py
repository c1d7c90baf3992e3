"""Does a vehicle on tyres go round a bend as the bicycle model says, with its understeer?"""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point
from ..closed_form import ask, error
from ..configurations import configured
from ..sweep import line, told

GRAVITY = 9.81  # m/s²
CHASSIS, WHEEL, UPRIGHT = 1000.0, 25.0, 1700.0  # kg, kg, kg m² of the chassis about the vertical
RADIUS, WIDTH = 0.3, 0.2  # m, of a wheel
FRONT, REAR, TRACK, RISE = 1.2, 1.5, 1.5, 0.2  # m: axles from the chassis' centre; its height over them
STIFFNESS, ALONG = 2e5, 5e4  # N/m and N per unit of slip, of a tyre
FRICTION = 0.9
SOFT, HARD = 20_000.0, 60_000.0  # N/rad, of a tyre: the axle that gives way more, and the other
STEER = 2e-3  # rad
SPEED = 12.0  # m/s
TIME_STEP = 1.0 / 120.0  # s: a wheel of 0.3 m at 1.4 times the critical speed turns by 0.75 rad in it
SETTLED = 5.0  # s: the slowest motion there is dies out as e^(−3.4 t)
CREEP = 1e-3  # m/s, by which a tyre's speed is taken too large; see Tyre
MASS = CHASSIS + 4.0 * WHEEL
BEHIND = 2.0 * WHEEL * (REAR - FRONT) / MASS  # m, of the common centre behind the chassis'
AHEAD, BACK = FRONT + BEHIND, REAR - BEHIND  # m, of the axles from the common centre
BASE = FRONT + REAR
MOMENT = (
    UPRIGHT
    + CHASSIS * BEHIND**2
    + 4.0 * WHEEL * (0.25 * RADIUS**2 + WIDTH**2 / 12.0 + 0.25 * TRACK**2)
    + 2.0 * WHEEL * (AHEAD**2 + BACK**2)
)
WHEELS = {
    "front left": (FRONT, 1),
    "front right": (FRONT, -1),
    "rear left": (-REAR, 1),
    "rear right": (-REAR, -1),
}
HALF = math.sqrt(0.5)


def understeer(front: float, rear: float) -> float:
    """K [s²/m] of r = V δ/(L + K V²); `front`, `rear`: cornering stiffness of one tyre [N/rad]."""
    return 0.5 * MASS / BASE * (BACK / front - AHEAD / rear)


def yaw(speed: float, front: float = SOFT, rear: float = HARD, steer: float = STEER) -> float:
    """Steady yaw rate [rad/s]."""
    return speed * steer / (BASE + understeer(front, rear) * speed**2)


def scene(
    speed: float, front: float = SOFT, rear: float = HARD, steer: float = STEER, leans: bool = True
) -> engine.Scene:
    """The vehicle on its tyres, rolling ahead along x; the front axles are turned by `steer`.

    Unless it `leans` its chassis cannot roll and pitch, as in the bicycle model.
    """
    # Loads by moments; each tyre starts as far pressed in as it will be.
    loads = {True: 0.5 * MASS * GRAVITY * BACK / BASE, False: 0.5 * MASS * GRAVITY * AHEAD / BASE}
    # A rigid chassis on equal springs leans a little: the hubs are where the axles are.
    sunk = {ahead: load / STIFFNESS for ahead, load in loads.items()}
    slope = (sunk[True] - sunk[False]) / BASE
    level = RADIUS - sunk[False] - slope * REAR
    chassis = engine.RigidBody(
        name="chassis",
        mass=CHASSIS,
        inertia=(400.0, 1500.0, UPRIGHT) if leans else (1e9, 1e9, UPRIGHT),
        shape=engine.Box((3.6, 1.2, 0.4)),
        position=(0.0, 0.0, level + RISE),
        velocity=(speed, 0.0, 0.0),
    )
    wheels, axles, tyres = [], [], []
    for name, (x, side) in WHEELS.items():
        angle = steer if x > 0.0 else 0.0
        axis = (-math.sin(angle), math.cos(angle), 0.0)
        turn = (math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))
        wheels.append(
            engine.RigidBody(
                name=name,
                mass=WHEEL,
                shape=engine.Cylinder(RADIUS, WIDTH),
                position=(x, 0.5 * side * TRACK, RADIUS - sunk[x > 0.0]),
                # about x by a quarter turn, then about z
                orientation=(HALF * turn[0], HALF * turn[0], HALF * turn[3], HALF * turn[3]),
                velocity=(speed, 0.0, 0.0),
                angular_velocity=tuple(speed / RADIUS * a for a in axis),  # type: ignore[arg-type]
            )
        )
        axles.append(engine.Hinge(name=f"{name} axle", between=("chassis", name), axis=axis, compliance=0.0))
        tyres.append(
            engine.Tyre(
                name=f"{name} tyre",
                between=(engine.WORLD, name),
                axis=axis,
                radius=RADIUS,
                stiffness=STIFFNESS,
                longitudinal=ALONG,
                cornering=front if x > 0.0 else rear,
                friction=FRICTION,
            )
        )
    return engine.Scene(
        bodies=(chassis, *wheels),
        constraints=(*axles, *tyres),
        gravity=(0.0, 0.0, -GRAVITY),
        contacts=False,
    )


def turn(simulate: case.Simulate, front: float, rear: float) -> dict[str, float]:
    """The steady bend, seen after it has settled."""
    observe: dict[str, Observable] = {
        "v": engine.Final(quantity=engine.Velocity("chassis", point=(-BEHIND, 0.0, 0.0))),
        "w": engine.Final(quantity=engine.AngularVelocity("chassis")),
        "left": engine.Final(quantity=engine.ConstraintForce("front left tyre")),
        "right": engine.Final(quantity=engine.ConstraintForce("front right tyre")),
    }
    result = simulate(scene(SPEED, front, rear), time_step=TIME_STEP, duration=SETTLED, observe=observe)
    v, rate = result["v"], float(result["w"][2])
    along = math.hypot(float(v[0]), float(v[1]))
    pull = float(np.hypot(*result["left"][:2]) + np.hypot(*result["right"][:2]))
    return {
        "yaw_error": rate / yaw(along, front, rear) - 1.0,
        "front_error": pull / (MASS * along * rate * BACK / BASE) - 1.0,
        "slowed": 1.0 - along / SPEED,
    }


def goes_straight(simulate: case.Simulate, speed: float) -> bool:
    """Whether an oversteering vehicle comes out of a nudge: its yaw dies out."""
    asked = scene(speed, HARD, SOFT, steer=0.0)
    nudged = engine.Scene(
        bodies=tuple(
            engine.RigidBody(
                name=body.name,
                mass=body.mass,
                inertia=body.inertia,
                position=body.position,
                orientation=body.orientation,
                velocity=(body.velocity[0], 1e-3, 0.0),
                angular_velocity=body.angular_velocity,
            )
            for body in asked.bodies
            if isinstance(body, engine.RigidBody)
        ),
        constraints=asked.constraints,
        gravity=asked.gravity,
        contacts=False,
    )
    observe = {"w": engine.Trace(quantity=engine.AngularVelocity("chassis"), first=30, every=30)}
    result = simulate(nudged, time_step=TIME_STEP, duration=2.0, observe=observe)
    rates = np.abs(result["w"][:, 2])
    return result.completed and bool(rates[-1] < rates[-2])


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest that runs straight with the stiff tyres in front."""
    return break_point(
        functools.partial(goes_straight, simulate), 0.7 * CRITICAL, 1.4 * CRITICAL, resolution=0.01, walk=5
    )


NEEDED = SPEED * yaw(SPEED) / GRAVITY  # µ of the understeering bend: V r/g, of both axles alike


def holds(simulate: case.Simulate, friction: float) -> bool:
    """Whether the understeering vehicle is in its bend after a second and a half, to one per cent."""
    asked = scene(SPEED)
    tyres = tuple(
        replace(one, friction=friction) if isinstance(one, engine.Tyre) else one for one in asked.constraints
    )
    result = simulate(
        replace(asked, constraints=tyres),
        time_step=2.0 * TIME_STEP,
        steps=90,
        observe={"w": engine.Final(quantity=engine.AngularVelocity("chassis"))},
    )
    return result.completed and abs(float(result["w"][2]) / yaw(SPEED) - 1.0) < 0.01


def slipperiest(simulate: case.Simulate) -> case.BreakPoint:
    """The least friction that holds the bend."""
    return break_point(
        functools.partial(holds, simulate), 4.0 * NEEDED, 0.5 * NEEDED, resolution=5e-3, walk=3
    )


def linear(time: float) -> float:
    """Yaw rate [rad/s] of the bicycle model that starts straight: d/dt (v, r) = A (v, r) + b δ, solved in closed form."""
    front, rear = 2.0 * SOFT, 2.0 * HARD
    # Inner wheels slow down and outer ones speed up while the yaw rate grows: I/r² of each at half the track.
    moment = MOMENT + 4.0 * (0.5 * WHEEL) * (0.5 * TRACK) ** 2
    a = np.array(
        (
            (-(front + rear) / (MASS * SPEED), (rear * BACK - front * AHEAD) / (MASS * SPEED) - SPEED),
            (
                (rear * BACK - front * AHEAD) / (moment * SPEED),
                -(front * AHEAD**2 + rear * BACK**2) / (moment * SPEED),
            ),
        )
    )
    b = STEER * np.array((front / MASS, front * AHEAD / moment))
    steady = -np.linalg.solve(a, b)
    roots, modes = np.linalg.eig(a)
    parts = np.linalg.solve(modes, -steady.astype(complex))
    return float((steady + (modes * np.exp(roots * time)) @ parts)[1].real)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Yaw rate a tenth of a second into the bend against the bicycle model's [rad/s]."""
    observe = {"w": engine.Final(quantity=engine.AngularVelocity("chassis"))}
    asked = scene(SPEED, leans=False)
    result = simulate(asked, time_step=time_step, duration=0.1, method=method, observe=observe)
    return float(result["w"][2]) - linear(0.1)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Yaw rate per steering angle against the speed, of three vehicles."""
    curves, off = [], 0.0
    for name, front, rear in (
        ("understeering", SOFT, HARD),
        ("nearly neutral", 0.5 * (SOFT + HARD), 0.5 * (SOFT + HARD)),
        ("oversteering", HARD, SOFT),
    ):
        reach = 0.8 * CRITICAL if understeer(front, rear) < 0.0 and front > rear else 25.0
        speeds = np.linspace(5.0, reach, 4)
        rates = []
        for speed in speeds:
            observe = {"w": engine.Final(quantity=engine.AngularVelocity("chassis"))}
            asked = scene(float(speed), front, rear)
            result = simulate(asked, time_step=TIME_STEP, duration=2.0, observe=observe)
            rates.append(float(result["w"][2]) / STEER)
        smooth = np.linspace(2.0, reach, 60)
        curves.append(line(name, speeds, rates, "points"))
        model = [yaw(float(u), front, rear) / STEER for u in speeds]
        off = max(off, *(abs(rate / right - 1.0) for rate, right in zip(rates, model, strict=True)))
        exact = [yaw(float(u), front, rear) / STEER for u in smooth]
        curves.append(line(f"{name}, bicycle model", smooth, exact, "reference"))
    return case.Drawing(
        curves=tuple(curves),
        x_label="speed [m/s]",
        y_label="yaw rate per steering angle [1/s]",
        note=f"At most {told(off)} of a rate away from the bicycle model.",
    )


CRITICAL = math.sqrt(-BASE / understeer(HARD, SOFT))  # m/s
SLIPS = CREEP / SPEED  # of the speed that slip is measured by
LEFT_OUT = (
    f"the tyre takes V {told(SLIPS)} too large, which K V²/(L + K V²) of it passes on; small angles leave out δ² and "
    "(r t/V)², the inner and outer wheels' speeds, a few of each"
)


def left_out(front: float, rear: float) -> float:
    """What the linear model leaves out of the yaw rate, relative to it."""
    turned = understeer(front, rear) * SPEED**2
    inner = yaw(SPEED, front, rear) * TRACK / SPEED
    return 1.1 * SLIPS * abs(turned) / (BASE + turned) + 4.0 * (STEER**2 + inner**2)


TEST = case.ScalarTest(
    title="Cornering",
    question="Does a vehicle on tyres go round a bend as the bicycle model says, with its understeer?",
    why="Whether a vehicle follows its wheels, runs wide or spins is decided by the slip of its tyres: the first thing that "
    "is asked of a vehicle's simulation, and a number with a closed form.",
    model="A rigid chassis on four wheels with tyres; load by springs, forces along and across in proportion to slip. The "
    "front axles are turned a little. Once with softer tyres in front, once behind.",
    parameters=(
        ("time step", "1/120 s: wheels turn by at most 1 rad in it"),
        ("chassis", "1000 kg, 1700 kg m² about the vertical"),
        ("wheels", "25 kg, radius 0.3 m; 1.2 m before and 1.5 m behind, track 1.5 m"),
        ("tyres", "200 kN/m; 20 and 60 kN/rad across, 50 kN along; µ = 0.9"),
        ("steering angle", "2 mrad"),
        ("speed", "12 m/s"),
    ),
    theory=(
        "Bicycle model: m (v' + V r) = F_f + F_r, I r' = a F_f − b F_r, F = C × slip angle of the axle.",
        "Steady: r = V δ/(L + K V²), K = (m/L)(b/C_f − a/C_r); the front axle carries m V r b/L.",
        "K < 0 oversteers: from V² = −L/K on it does not run straight.",
        "In the step a tyre is two velocity rows, s + V/(C h) λ = 0: a steady bend is exact, motion first order.",
    ),
    reference="P. Riekert and T. E. Schunck 1940: the bicycle model, in closed form.",
    conclusion="Green: tyres hold by slip, and moments about the vertical balance. Red: slip, load or heading is wrong.",
    source="ours; vehicles are asked for in the thesis, section 5.4",
    measurements=tuple(
        ask(
            functools.partial(turn, front=front, rear=rear),
            (
                error("yaw_error", "relative error of the yaw rate", "1", left_out(front, rear), LEFT_OUT),
                error(
                    "front_error",
                    "relative error of the force of the front axle",
                    "1",
                    left_out(front, rear),
                    LEFT_OUT,
                    "companion",
                ),
                error(
                    "slowed",
                    "part of the speed that is lost",
                    "1",
                    1e-3,
                    "F_f δ acts against it: a_y δ t/V, below 1e-4",
                    "companion",
                ),
            ),
            note,
            TIME_STEP,
            configuration,
        )
        for note, configuration, front, rear in (
            ("understeers", "plain", SOFT, HARD),
            ("oversteers, below its critical speed", "oversteer", HARD, SOFT),
        )
    ),
    example=lambda: case.Example(scene=scene(SPEED, steer=0.03), time_step=TIME_STEP, duration=3.0),
    stability=(
        case.StabilityStudy(
            name="critical-speed",
            title="Fastest that runs straight with the soft tyres behind",
            configuration="plain",
            definition="a second and a half after a nudge the yaw rate falls",
            study=fastest,
            unit="m/s",
            expected=(0.97 * CRITICAL, 1.03 * CRITICAL),
            expected_source="V² = −L/K; within one per cent of the search and two of V² by the slow motion's start",
        ),
        case.StabilityStudy(
            name="slipperiest",
            title="Least friction that holds the bend",
            configuration="plain",
            definition="the yaw rate after a second and a half is that of the bend to 1 %",
            study=slipperiest,
            unit="1",
            better="smaller",
            expected=(0.98 * NEEDED, 1.01 * NEEDED),
            expected_source="V r/g: side forces are to loads as the sideways acceleration to g, on both axles; less by the 1 % that "
            "is asked, and the search's half",
        ),
    ),
    figures=(case.Figure(name="gain", title="Yaw rate per steering angle", draw=draw),),
    ladders=(
        case.Ladder(
            name="into-the-bend",
            description="yaw rate after a tenth of a second against the bicycle model's; its chassis cannot lean",
            unit="rad/s",
            time_steps=tuple(1.0 / n for n in (120, 240, 480, 960, 1920)),
            configurations=configured({"plain": 1.0, "iterative": 1.0}),
            error=ladder_error,
            target_error=1e-3,
            target_seconds=0.1,
        ),
    ),
)

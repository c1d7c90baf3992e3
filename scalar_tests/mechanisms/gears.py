"""Do gears turn each other and their casings as their ratios say?"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.joints import Constraint
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point
from ..closed_form import error
from ..configurations import configured
from ..sweep import line, told

SUN, PLANET, RING = 20.0, 30.0, 80.0  # teeth; ring = sun + 2 planets
RATIO = 1.0 + RING / SUN  # Willis, ring held: ω_sun/ω_carrier = 5
MODULE = 0.01  # m of pitch radius per tooth
INERTIA = {"sun": 0.02, "carrier": 0.4, "planet": 0.05}  # kg m²
PLANET_MASS = 0.5  # kg
ORBIT = 0.5 * MODULE * (SUN + PLANET)  # m, from the sun's axle to the planet's
TORQUE = 2.0  # N m on the sun
HEAVIEST = 1e12  # kg m², where the search for the heaviest carrier ends
TIME_STEP = 1.0 / 60.0  # s
DURATION = 10.0  # s
SPEED = 6.0  # rad/s of the driven sun
PINION, RACK_MASS, PINION_INERTIA, PUSH = 0.1, 3.0, 0.05, 1e-4  # m, kg, kg m², N
AXIS = (0.0, 0.0, 1.0)


def planetary(torque: float = 0.0, back: float = 0.0, motor: engine.Motor | None = None) -> engine.Scene:
    """A sun, a carrier and one planet inside a ring that belongs to the world. `torque` [N m] is on the sun, `back`
    on the carrier. What meshes is what turns relative to the carrier."""
    orbit = {"sun": 0.0, "carrier": 0.0, "planet": ORBIT}
    mass = {"sun": 1.0, "carrier": 1.0, "planet": PLANET_MASS}
    bodies = tuple(
        engine.RigidBody(
            name=name, mass=mass[name], inertia=(moment, moment, moment), position=(orbit[name], 0.0, 0.0)
        )
        for name, moment in INERTIA.items()
    )
    constraints: tuple[Constraint, ...] = (
        engine.Hinge(name="sun axle", between=(engine.WORLD, "sun"), axis=AXIS, compliance=0.0, motor=motor),
        engine.Hinge(name="carrier axle", between=(engine.WORLD, "carrier"), axis=AXIS, compliance=0.0),
        engine.Hinge(name="planet axle", between=("carrier", "planet"), axis=AXIS, compliance=0.0),
        engine.Relation(
            name="sun and planet",
            terms=(("sun axle", SUN), ("carrier axle", -SUN), ("planet axle", PLANET)),
            compliance=0.0,
        ),
        engine.Relation(
            name="planet and ring", terms=(("planet axle", PLANET), ("carrier axle", RING)), compliance=0.0
        ),
    )
    loads = (
        engine.Load(name="torque", body="sun", torque=(0.0, 0.0, torque)),
        engine.Load(name="back", body="carrier", torque=(0.0, 0.0, back)),
    )
    return engine.Scene(bodies=bodies, constraints=constraints, forces=loads)


def reduced_inertia() -> float:
    """J of the whole train at the carrier [kg m²]: squares of the speed ratios, and the planet's orbit."""
    spins = 1.0 - RING / PLANET  # of the planet, over the carrier's
    return (
        INERTIA["sun"] * RATIO**2 + INERTIA["carrier"] + INERTIA["planet"] * spins**2 + PLANET_MASS * ORBIT**2
    )


def rack() -> engine.Scene:
    """A rack on a slide, pushed with `PUSH`, that turns a pinion."""
    bodies = (
        engine.RigidBody(name="rack", mass=RACK_MASS, inertia=(1.0, 1.0, 1.0), position=(0.0, PINION, 0.0)),
        engine.RigidBody(name="pinion", mass=1.0, inertia=(PINION_INERTIA,) * 3, position=(0.0, 0.0, 0.0)),
    )
    constraints = (
        engine.Prismatic(name="slide", between=(engine.WORLD, "rack"), axis=(1.0, 0.0, 0.0), compliance=0.0),
        engine.Hinge(name="pinion axle", between=(engine.WORLD, "pinion"), axis=AXIS, compliance=0.0),
        engine.Relation(name="mesh", terms=(("slide", 1.0), ("pinion axle", PINION)), compliance=0.0),
    )
    return engine.Scene(
        bodies=bodies,
        constraints=constraints,
        forces=(engine.Load(name="push", body="rack", force=(PUSH, 0.0, 0.0)),),
    )


def turn(simulate: case.Simulate) -> dict[str, float]:
    """The driven set after ten seconds, the set in balance, and the rack."""
    angles: dict[str, Observable] = {
        name: engine.Final(quantity=engine.JointCoordinate(f"{name} axle")) for name in INERTIA
    }
    angles["w"] = engine.Final(quantity=engine.AngularVelocity("carrier"))
    driven = simulate(
        planetary(motor=engine.Motor(speed=SPEED)), time_step=TIME_STEP, duration=DURATION, observe=angles
    )
    observe = {
        "sun": engine.Final(quantity=engine.ConstraintForce("sun and planet")),
        "ring": engine.Final(quantity=engine.ConstraintForce("planet and ring")),
        "w": engine.MaximumAbsolute(quantity=engine.AngularVelocity("carrier")),
    }
    held = simulate(planetary(TORQUE, -RATIO * TORQUE), time_step=TIME_STEP, steps=100, observe=observe)
    v = {
        "v": engine.Final(quantity=engine.Velocity("rack")),
        "w": engine.Final(quantity=engine.AngularVelocity("pinion")),
    }
    pushed = simulate(rack(), time_step=TIME_STEP, duration=1.0, observe=v)
    a = PUSH / (RACK_MASS + PINION_INERTIA / PINION**2)
    return {
        "ratio_error": float(driven["sun"]) / float(driven["carrier"]) / RATIO - 1.0,
        "rate_error": float(driven["w"][2]) / (SPEED / RATIO) - 1.0,
        "planet_error": float(driven["planet"]) / float(driven["carrier"]) * PLANET / RING + 1.0,
        "ring_torque_error": RING * float(held["ring"]) / (RING / SUN * TORQUE) - 1.0,
        "sun_torque_error": -SUN * float(held["sun"]) / TORQUE - 1.0,
        "creep": float(held["w"].max()),
        "rack_error": float(pushed["v"][0]) / a - 1.0,
        "pinion_error": -float(pushed["w"][2]) * PINION / a - 1.0,
    }


def follows(simulate: case.Simulate, speed: float) -> bool:
    """Whether the set turns with a sun of that speed for 100 steps, the carrier a fifth of its turns."""
    observe = {
        name: engine.Final(quantity=engine.JointCoordinate(f"{name} axle")) for name in ("sun", "carrier")
    }
    result = simulate(
        planetary(motor=engine.Motor(speed=speed)), time_step=TIME_STEP, steps=100, observe=observe
    )
    return result.completed and abs(RATIO * float(result["carrier"]) / float(result["sun"]) - 1.0) < 0.1


def fastest(simulate: case.Simulate) -> case.BreakPoint:
    """The fastest sun that the set follows."""
    return break_point(
        functools.partial(follows, simulate), 0.3 / TIME_STEP, 30.0 / TIME_STEP, resolution=1e-3
    )


def starts_right(simulate: case.Simulate, carrier: float) -> bool:
    """Whether a set with so heavy a carrier [kg m²] starts with the acceleration of its reduced inertia, to 1e-9."""
    built = planetary(TORQUE)
    bodies = tuple(
        replace(body, inertia=(carrier,) * 3)
        if body.name == "carrier" and isinstance(body, engine.RigidBody)
        else body
        for body in built.bodies
    )
    observe = {"w": engine.Final(quantity=engine.AngularVelocity("carrier"))}
    result = simulate(replace(built, bodies=bodies), time_step=TIME_STEP, steps=1, observe=observe)
    right = TIME_STEP * TORQUE * RATIO / (reduced_inertia() - INERTIA["carrier"] + carrier)
    return result.completed and abs(float(result["w"][2]) / right - 1.0) < 1e-9


def heaviest_carrier(simulate: case.Simulate) -> case.BreakPoint:
    """The heaviest carrier [kg m²] with which the set starts as it should."""
    return break_point(functools.partial(starts_right, simulate), INERTIA["carrier"], HEAVIEST, walk=8)


def start_up(simulate: case.Simulate) -> dict[str, float]:
    """Angular acceleration of the carrier from rest over T i/J, minus one, in the first step."""
    observe = {"w": engine.Final(quantity=engine.AngularVelocity("carrier"))}
    w = simulate(planetary(TORQUE), time_step=TIME_STEP, steps=1, observe=observe)["w"]
    return {"inertia_error": float(w[2]) / TIME_STEP * reduced_inertia() / (TORQUE * RATIO) - 1.0}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Angle of the carrier after a second from rest, less ½ (T i/J) t² [rad]."""
    observe = {"angle": engine.Trace(quantity=engine.JointCoordinate("carrier axle"))}
    result = simulate(planetary(TORQUE), time_step=time_step, duration=1.0, method=method, observe=observe)
    return float(result["angle"][-1]) - 0.5 * TORQUE * RATIO / reduced_inertia()


def draw(simulate: case.Simulate) -> case.Drawing:
    """Angles of all three against time."""
    observe = {
        name: engine.Trace(quantity=engine.JointCoordinate(f"{name} axle"), every=12) for name in INERTIA
    }
    result = simulate(
        planetary(motor=engine.Motor(speed=SPEED)), time_step=TIME_STEP, duration=DURATION, observe=observe
    )
    time = result.sample_times["sun"]
    off = float(np.abs(result["sun"] - RATIO * result["carrier"]).max())
    return case.Drawing(
        curves=(
            line("sun", time, result["sun"]),
            line("carrier", time, result["carrier"]),
            line("planet, seen from the carrier", time, result["planet"]),
            line("sun over 5", time, SPEED / RATIO * time, "reference"),
        ),
        x_label="time [s]",
        y_label="angle [rad]",
        note=f"The sun is never more than {told(off, 2)} rad from five times the carrier, as Willis has it.",
    )


STATICS = "statics are exact in one step; rounding remains"
EXACT = "a step turns each by h ω, and the rows ask the ratio of ω: rounding remains"

TEST = case.ScalarTest(
    title="Gears",
    question="Do gears turn each other and their casings as their ratios say?",
    why="Gears, racks, screws, belts and differentials are one kind of row: a linear relation between coordinates. A "
    "planetary set asks it of joints that sit on each other.",
    model="A planetary set of 20, 30 and 80 teeth with its ring held: driven at the sun for 10 s; in balance under 2 N m "
    "on the sun; from rest in one step. A rack of 3 kg on a pinion, pushed for 1 s.",
    parameters=(
        ("time step", "1/60 s"),
        ("teeth", "sun 20, planet 30, ring 80 (held)"),
        ("inertias", "sun 0.02, carrier 0.4, planet 0.05 kg m² and 0.5 kg at 0.25 m"),
        ("rack", "3 kg on a pinion of 0.05 kg m² and 0.1 m, pushed with 1e-4 N"),
    ),
    theory=(
        "Willis: (ω_sun − ω_carrier)/(ω_ring − ω_carrier) = −z_ring/z_sun, so ω_sun = (1 + z_ring/z_sun) ω_carrier = 5 ω_carrier.",
        "Balance: T_carrier = −5 T_sun; the ring, that is the casing, takes T_ring = 4 T_sun.",
        "Start: ω' = T i/(J_sun i² + J_carrier + J_planet (1 − z_ring/z_planet)² + m r²).",
        "Rack: a = F/(m + J/r²).",
    ),
    reference="Willis' equation, statics and reduced inertia in closed form.",
    conclusion="Green: relations act on the right coordinates with the right reactions. Red: a sign, a ratio or a turn "
    "that was not counted.",
    source="ours; R. Willis, Principles of Mechanism (1841)",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                error(
                    "ratio_error",
                    "angle of the sun over five times the carrier's after 10 s, minus one",
                    "1",
                    1e-12,
                    EXACT,
                ),
                error(
                    "rate_error",
                    "speed of the carrier over a fifth of the sun's, minus one",
                    "1",
                    1e-12,
                    EXACT,
                ),
                error(
                    "planet_error",
                    "the same of the planet against the ring",
                    "1",
                    1e-12,
                    EXACT,
                    "companion",
                ),
                error("ring_torque_error", "relative error of the torque on the ring", "1", 1e-11, STATICS),
                error(
                    "sun_torque_error",
                    "relative error of the torque at the sun's mesh",
                    "1",
                    1e-11,
                    STATICS,
                    "companion",
                ),
                error(
                    "creep", "largest speed of the carrier in balance", "rad/s", 1e-12, STATICS, "companion"
                ),
                error(
                    "rack_error",
                    "relative error of the rack's speed after 1 s",
                    "1",
                    1e-9,
                    EXACT,
                    "companion",
                ),
                error("pinion_error", "relative error of the pinion's", "1", 1e-9, EXACT, "companion"),
            ),
            measure=turn,
            note="planetary set and rack",
        ),
        case.Measurement(
            configuration="start",
            time_step=TIME_STEP,
            metrics=(
                error(
                    "inertia_error",
                    "relative error of the carrier's first angular acceleration",
                    "1",
                    1e-11,
                    "the first step from rest knows no turn: exact",
                ),
            ),
            measure=start_up,
            note="one step from rest",
        ),
    ),
    example=lambda: case.Example(
        scene=planetary(motor=engine.Motor(speed=SPEED)), time_step=TIME_STEP, duration=6.0
    ),
    figures=(case.Figure(name="angles", title="Angles", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="fastest",
            title="Fastest sun that the set follows",
            configuration="plain",
            definition="after 100 steps the carrier has turned by a fifth of the sun's angle, to a tenth",
            study=fastest,
            unit="rad/s",
            expected=(0.999 * RATIO / TIME_STEP, RATIO / TIME_STEP),
            expected_source="wheels turn exactly; a planet's way is along its tangent, and its joint takes it back to the "
            "orbit up to h ω = 1 of the carrier",
        ),
        case.StabilityStudy(
            name="heaviest-carrier",
            title="Heaviest carrier with which the set starts as it should",
            configuration="plain",
            definition="angular acceleration of the first step T i/J to 1e-9, J reduced to the carrier",
            study=heaviest_carrier,
            unit="kg m²",
            expected=(HEAVIEST, HEAVIEST),
            expected_source="what meshes with a heavy carrier is held to it by light wheels' rows, none of which becomes small; the "
            "search ends at 1e12 kg m²",
        ),
    ),
    ladders=(
        case.Ladder(
            name="start",
            description="angle of the carrier after 1 s from rest against ½ (T i/J) t²",
            unit="rad",
            time_steps=tuple(1.0 / n for n in (60, 120, 240, 480, 960, 1920, 3840)),
            configurations=configured({"plain": 1.0, "half-step": 2.0}, (1 / 3840, 1 / 960)),
            error=ladder_error,
            target_error=0.1,
            target_seconds=0.05,
        ),
    ),
)

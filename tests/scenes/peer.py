"""Scenes with an answer in closed form, small enough to be put to every other engine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    AngularVelocity,
    Ball,
    Box,
    Compound,
    Distance,
    Energy,
    Final,
    Hinge,
    JointCoordinate,
    Load,
    Lock,
    Material,
    MaximumAbsolute,
    Motor,
    Orientation,
    Particle,
    Plane,
    Position,
    Prismatic,
    Relation,
    RigidBody,
    Scene,
    Sphere,
    Spring,
    Trace,
    Velocity,
    Violation,
)
from spook_tracker.engine import simulate as ours
from tests.scenes import rigid as rigid_scenes
from tests.scenes.corpus import fixed, solid

GRAVITY = (0.0, 0.0, -9.81)  # m/s²
G = 9.81


def fall_error(simulate: Any, time_step: float, seconds: float = 2.0) -> float:
    """How much deeper than ½ g t² a body has fallen [m]; g t h / 2 for the symplectic step."""
    ball = Particle(name="ball", mass=2.0, position=(0.0, 0.0, 0.0))
    end = {"end": Final(quantity=Position("ball"))}
    run = simulate(Scene(bodies=(ball,), gravity=GRAVITY), time_step=time_step, duration=seconds, observe=end)
    return -float(run["end"][2]) - 0.5 * G * seconds**2


def pendulum(at: tuple[float, float, float] = (1.0, 0.0, 0.0), mass: float = 1.0) -> Scene:
    weight = Particle(name="weight", mass=mass, position=at)
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "weight"), compliance=0.0)
    return Scene(bodies=(weight,), constraints=(rod,), gravity=GRAVITY)


def swung(simulate: Any, time_step: float) -> tuple[float, float]:
    """22 s of a pendulum of 1 kg and 1 m let go level: largest stretch, and error of energy per m g l."""
    observe = {
        "length": MaximumAbsolute(quantity=Violation("rod")),
        "energy": MaximumAbsolute(quantity=Energy(), from_start=True),
    }
    run = simulate(pendulum(), time_step=time_step, duration=22.0, observe=observe)
    return float(run["length"]), float(run["energy"]) / G


def chain(links: int) -> Scene:
    """Links of 1 m and 1 kg along x, let go."""
    weights = [Particle(name=f"{k}", mass=1.0, position=(k + 1.0, 0.0, 0.0)) for k in range(links)]
    rods = [
        Distance(name=f"rod {k}", between=((0.0, 0.0, 0.0) if k == 0 else f"{k - 1}", f"{k}"), compliance=0.0)
        for k in range(links)
    ]
    return Scene(bodies=tuple(weights), constraints=tuple(rods), gravity=GRAVITY)


def stretched_and_gained(
    simulate: Any, links: int, time_step: float, seconds: float, **options: Any
) -> tuple[Any, float, float]:
    """The run of a chain, its largest stretch [m], and its error of energy per drop to hanging."""
    observe = {
        "stretch": MaximumAbsolute(quantity=Violation()),
        "energy": MaximumAbsolute(quantity=Energy(), from_start=True),
    }
    run = simulate(chain(links), time_step=time_step, duration=seconds, observe=observe, **options)
    if run.status != "completed":
        return run, math.nan, math.nan
    drop = G * links * (links + 1) / 2.0
    return run, float(run["stretch"].max()), float(run["energy"]) / drop


def hung(kind: Any, backwards: bool = False) -> Scene:
    """A body of 2 kg on a joint with the world, where it rests: beside a hinge or lock, below a ball or slide."""
    beside = kind in (Hinge, Lock)
    place = (0.5, 0.0, 0.0) if beside else (0.0, 0.0, -1.0)
    body = RigidBody(name="arm", mass=2.0, inertia=(1.0, 1.2, 0.8), position=place)
    ends = ("arm", "world") if backwards else ("world", "arm")
    more = {Hinge: {"axis": (0.0, 0.0, 1.0)}, Prismatic: {"axis": (1.0, 0.0, 0.0)}}.get(kind, {})
    joint = kind(name="joint", between=ends, at=(0.0, 0.0, 0.0), compliance=0.0, **more)
    return Scene(bodies=(body,), constraints=(joint,), gravity=GRAVITY)


def load_on_joint(kind: Any, backwards: bool = False) -> Any:
    """Force [N] and torque [N m] about the joint that hold the body of `hung`, read on the second end."""
    torque = -9.81 if kind in (Hinge, Lock) else 0.0
    return (-1.0 if backwards else 1.0) * np.array([0.0, 0.0, 2.0 * G, 0.0, torque, 0.0])


def left_its_place(simulate: Any, kind: Any, backwards: bool = False) -> float:
    """How far the body of `hung` is from its place after 2 s [m]."""
    scene = hung(kind, backwards)
    end = {"path": Trace(quantity=Position("arm"))}
    run = simulate(scene, time_step=1 / 60, duration=2.0, observe=end)
    return float(np.abs(run["path"] - run["path"][0]).max())


def swings(simulate: Any, time_step: float) -> float:
    """Period of small swings of a hinged body, per 2 π √((I + m L²) / (m g L))."""
    mass, inertia, length, angle = 2.0, 0.5, 1.0, 0.02
    body = solid(
        "body",
        None,
        (length * math.sin(angle), 0.0, -length * math.cos(angle)),
        mass,
        inertia=(inertia, inertia, inertia),
    )
    hinge = Hinge(
        name="hinge", between=("world", "body"), at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), compliance=0.0
    )
    period = 2.0 * math.pi * math.sqrt((inertia + mass * length**2) / (mass * G * length))
    run = simulate(
        Scene(bodies=(body,), constraints=(hinge,), gravity=GRAVITY),
        time_step=time_step,
        duration=2.1 * period,
        observe={"path": Trace(quantity=Position("body"))},
    )
    x = run["path"][:, 0]
    down = np.flatnonzero((x[1:] < 0.0) & (x[:-1] >= 0.0))
    times = (down + x[down] / (x[down] - x[down + 1])) * time_step
    return float(times[1] - times[0]) / period


def momentum_lost(simulate: Any, time_step: float) -> float:
    """How far the momentum of a free body spinning near its middle axis strays in 2 s, per its size."""
    body = solid("body", None, (0.0, 0.0, 0.0), spin=(0.1, 3.0, 0.1), inertia=(1.0, 2.0, 2.5))
    spin = {"spin": Trace(quantity=AngularMomentum())}
    run = simulate(
        Scene(bodies=(body,), gravity=(0.0, 0.0, 0.0)), time_step=time_step, duration=2.0, observe=spin
    )
    return float(np.abs(run["spin"] - run["spin"][0]).max() / np.linalg.norm(run["spin"][0]))


def box_on_ground(pull: float, friction: float = 0.5) -> Scene:
    """A cube of 1 m and 1 kg on a plane, with `pull` of its weight sideways."""
    rough = Material(friction=friction)
    ground = fixed("ground", Plane(), (0.0, 0.0, 0.0), material=rough)
    box = solid("box", Box((1.0, 1.0, 1.0)), (0.0, 0.0, 0.5), material=rough)
    return Scene(bodies=(ground, box), gravity=(pull * G, 0.0, -G))


def unlike(*frictions: float, pull: float = 0.0) -> Scene:
    """Cubes of these frictions, far from each other, on a plane of 0.5 with `pull` of their weight sideways."""
    ground, box = box_on_ground(pull).bodies
    assert isinstance(box, RigidBody)
    boxes = (
        replace(box, name=f"box {k}" if k else "box", position=(0.0, 3.0 * k, 0.5), material=Material(friction=f))
        for k, f in enumerate(frictions)
    )  # fmt: skip
    return Scene(bodies=(ground, *boxes), gravity=(pull * G, 0.0, -G))


def slid(simulate: Any, pull: float, seconds: float = 2.0, scene: Scene | None = None) -> float:
    """How far that cube slid [m]: none below its friction of 0.5, ½ (pull − 0.5) g t² above."""
    end = {"end": Final(quantity=Position("box"))}
    asked = scene or box_on_ground(pull)
    return float(simulate(asked, time_step=1 / 60, duration=seconds, observe=end)["end"][0])


def sunk(simulate: Any, shape: Any = None, height: float = 0.5, under: Any = None) -> float:
    """How far a body rests from where it touches the ground [m] after 2 s; a cube of 1 m on a plane unless said."""
    ground = RigidBody(name="ground", motion="static", shape=under or Plane(), position=(0.0, 0.0, 0.0))
    shape = shape or Box((1.0, 1.0, 1.0))
    body = RigidBody(
        name="body", mass=1.0, shape=shape, position=(0.0, 0.0, height),
        inertia=(1 / 6, 1 / 6, 1 / 6) if isinstance(shape, Compound) else None,
    )  # fmt: skip
    end = {"end": Final(quantity=Position("body"))}
    run = simulate(Scene(bodies=(ground, body), gravity=GRAVITY), time_step=1 / 60, duration=2.0, observe=end)
    return float(run["end"][2]) - height


def bounced(simulate: Any, restitution: float, time_step: float) -> float:
    """Height [m] to which a ball dropped by 1 m comes back; restitution² of it."""
    ball = solid("ball", Sphere(0.5), (0.0, 0.0, 1.5), material=Material(restitution=restitution))
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    path = {"path": Trace(quantity=Position("ball"))}
    run = simulate(
        Scene(bodies=(ground, ball), gravity=GRAVITY), time_step=time_step, steps=1000, observe=path
    )
    height = run["path"][:, 2]
    lowest = int(np.argmin(height[: round(0.5 / time_step)]))
    return float(height[lowest:].max()) - 0.5


def beam(count: int = 80) -> Scene:
    """Boxes locked in a row, the first to the world."""
    boxes = [
        RigidBody(name=f"{k}", mass=2.5, shape=Box((0.125, 0.1, 0.1)), position=(0.125 * (k + 0.5), 0.0, 0.0))
        for k in range(count)
    ]
    locks = [
        Lock(name=f"lock {k}", between=("world" if k == 0 else f"{k - 1}", f"{k}"), at=(0.125 * k, 0.0, 0.0))
        for k in range(count)
    ]
    return Scene(bodies=tuple(boxes), constraints=tuple(locks), gravity=GRAVITY, contacts=False)


def sag(simulate: Any, count: int = 80, seconds: float = 0.5) -> float:
    """How far the free end of that beam is below its place at the end [m]; ½ g t² where nothing holds."""
    tip = {"tip": Final(quantity=Position(f"{count - 1}"))}
    return -float(simulate(beam(count), time_step=1 / 60, duration=seconds, observe=tip)["tip"][2])


def door(hinges: int) -> Scene:
    """A door of 45 kg, 1 m wide, on hinges along its edge, opened by a quarter turn and at rest."""
    body = RigidBody(name="door", mass=45.0, inertia=(15.0, 18.0, 4.0), position=(0.5, 0.0, 0.0))
    heights = np.linspace(0.75, -0.75, hinges)
    made = [
        Hinge(name=f"{k}", between=("world", "door"), at=(0.0, 0.0, float(z)), axis=(0.0, 0.0, 1.0))
        for k, z in enumerate(heights)
    ]
    return Scene(bodies=(body,), constraints=tuple(made), gravity=GRAVITY)


def nodding() -> Scene:
    """A body turned against the world that spins about a ball joint, on which hangs another that spins as well."""
    spins = (np.array([1.0, 2.0, 3.0]), np.array([-2.0, 0.5, 1.0]))
    turns = (
        (math.cos(0.4), math.sin(0.4), 0.0, 0.0),
        (math.cos(0.3), 0.0, 0.6 * math.sin(0.3), 0.8 * math.sin(0.3)),
    )
    points = (np.zeros(3), np.array([1.0, 0.2, -0.3]), np.array([1.7, 0.1, 0.4]))
    speed, bodies = np.zeros(3), []
    for k, (spin, turn) in enumerate(zip(spins, turns, strict=True)):
        place = 0.5 * (points[k] + points[k + 1])
        bodies.append(
            solid(
                f"{k}",
                None,
                tuple(float(x) for x in place),
                velocity=tuple(float(x) for x in speed + np.cross(spin, place - points[k])),
                spin=tuple(float(x) for x in spin),
                inertia=(0.3, 0.2, 0.25),
                orientation=turn,
            )
        )
        speed = speed + np.cross(spin, points[k + 1] - points[k])
    joints = [
        Ball(
            name=f"ball {k}",
            between=("world" if k == 0 else f"{k - 1}", f"{k}"),
            at=tuple(float(x) for x in points[k]),
            compliance=0.0,
        )
        for k in range(2)
    ]
    return Scene(bodies=tuple(bodies), constraints=tuple(joints), gravity=GRAVITY)


def started(simulate: Any) -> tuple[float, float]:
    """How far the speeds [m/s] and spins [rad/s] of those two bodies are from the scene's before any step."""
    scene = nodding()
    observe = {"speeds": Trace(quantity=Velocity()), "spins": Trace(quantity=AngularVelocity())}
    run = simulate(scene, time_step=1e-3, steps=1, observe=observe)
    speeds = np.array([body.velocity for body in scene.bodies])
    spins = np.array([body.angular_velocity for body in scene.bodies if isinstance(body, RigidBody)])
    return float(np.abs(run["speeds"][0] - speeds).max()), float(np.abs(run["spins"][0] - spins).max())


def parted_from_ours(simulate: Any, kind: str) -> float:
    """Two bodies turned at random, from rest, on a joint of that kind: how far they are from where our engine has
    them after half a second, over the way they went. Both converge to one motion."""
    drawn = rigid_scenes.one_joint(np.random.default_rng(7), kind, bodies=2)
    joint = drawn.constraints[0]
    names = [name for name in ("name", "between", "at", "axis", "cross_axis") if hasattr(joint, name)]
    rigid = type(joint)(**{name: getattr(joint, name) for name in names}, compliance=0.0)
    still = [replace(b, velocity=(0, 0, 0), angular_velocity=(0, 0, 0)) for b in drawn.bodies]  # type: ignore[arg-type]
    hold = Ball(name="hold", between=("world", "b0"), at=(0.5, 0.0, 0.0), compliance=0.0)
    scene = Scene(bodies=tuple(still), constraints=(hold, rigid), gravity=rigid_scenes.GRAVITY)
    observe = {"path": Trace(quantity=Position(), every=500)}

    theirs, mine = (
        asked(scene, time_step=1e-3, duration=0.5, observe=observe)["path"] for asked in (simulate, ours)
    )
    moved = float(np.abs(mine[-1] - mine[0]).max())
    assert moved > 0.02
    return float(np.abs(theirs[-1] - mine[-1]).max()) / moved


def set_going(
    simulate: Any, *, slides: bool = True, bodies: Sequence[Particle] = (), joints: Sequence[Distance] = ()
) -> Any:
    """Speeds (2, n, 3) m/s before and after one step of a hinged body, one on a slide (or free) and those given."""
    turning = solid(
        "turning",
        None,
        (1.0, 0.0, 0.0),
        velocity=(0.0, 2.0, 0.0),
        spin=(0.0, 0.0, 2.0),
        inertia=(1.0, 1.0, 1.0),
    )
    sliding = solid("sliding", None, (0, 0, 2.0), velocity=(3.0, 0.0, 0.0), inertia=(1.0, 1.0, 1.0))
    hinge = Hinge(name="hinge", between=("world", "turning"), at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    slide = Prismatic(name="slide", between=("world", "sliding"), axis=(1.0, 0.0, 0.0))
    held = (hinge, slide) if slides else (hinge,)
    scene = Scene(bodies=(turning, sliding, *bodies), constraints=(*held, *joints), gravity=(0.0, 0.0, 0.0))
    return simulate(scene, time_step=1e-3, steps=1, observe={"v": Trace(quantity=Velocity())})["v"]


BRAKED = (1.5, 2.0, 2.0)  # m or rad: the way of `braked` after 2, 4 and 6 s


def rough(kind: Any) -> Scene:
    """A hinge or slide with dry friction 0.5 that moves with 1, and must move a moment of inertia or a mass of 2."""
    moving: Any = {"angular_velocity" if kind is Hinge else "velocity": (0.0, 0.0, 1.0)}
    body = RigidBody(name="b", mass=2.0, inertia=(2.0, 2.0, 2.0), position=(0.0, 0.0, 0.0), **moving)
    joint = kind(
        name="j",
        between=("world", "b"),
        at=(0.0, 0.0, 0.0),
        axis=(0.0, 0.0, 1.0),
        friction=0.5,
        compliance=0.0,
    )
    return Scene(bodies=(body,), constraints=(joint,))


def braked(simulate: Any, kind: Any) -> list[float]:
    """Its way after 2, 4 and 6 s, in steps of 1 ms: slower by 1/4 a second, so it stands after four seconds."""
    seen = {"way": Trace(quantity=JointCoordinate("j"), every=2000)}
    return [
        float(x)
        for x in np.ravel(simulate(rough(kind), time_step=1e-3, duration=6.0, observe=seen)["way"])[1:]
    ]


def driven(simulate: Any, kind: Any, backwards: bool) -> list[float]:
    """Speeds [rad/s or m/s] after 1 and 8 s of what a motor drives to 10 with 4 N m or N, at most, and weighs 2: 2 and 10."""
    body = RigidBody(name="b", mass=2.0, inertia=(2.0, 2.0, 2.0), position=(0.0, 0.0, 0.0))
    joint = kind(
        name="j",
        between=("b", "world") if backwards else ("world", "b"),
        at=(0.0, 0.0, 0.0),
        axis=(0.0, 0.6, 0.8),
        motor=Motor(speed=10.0, max_force=4.0),
        compliance=0.0,
    )
    seen = {"speed": Trace(quantity=AngularVelocity("b") if kind is Hinge else Velocity("b"), every=60)}
    run = simulate(Scene(bodies=(body,), constraints=(joint,)), time_step=1 / 60, duration=8.0, observe=seen)
    along = (-1.0 if backwards else 1.0) * run["speed"] @ np.array(joint.axis)
    return [float(along[1]), float(along[8])]


def given_way(simulate: Any, damping: float) -> tuple[float, float]:
    """Where a mass of 3 kg is after 1 s on a distance of 3 m that gives by 1/30 m/N, let go at 4 m, in steps of 1 ms; and
    where the damped oscillator is."""
    weight = Particle(name="weight", mass=3.0, position=(4.0, 0.0, 0.0))
    row = Distance(
        name="row", between=((0.0, 0.0, 0.0), "weight"), rest_length=3.0, compliance=1 / 30, damping=damping
    )
    end = {"end": Final(quantity=Position("weight"))}
    run = simulate(Scene(bodies=(weight,), constraints=(row,)), time_step=1e-3, duration=1.0, observe=end)
    rate = 0.5 * damping * 10.0
    turn = math.sqrt(10.0 - rate**2)
    exact = 3.0 + math.exp(-rate) * (math.cos(turn) + rate / turn * math.sin(turn))
    return float(run["end"][0]), exact


def pulled_aside(simulate: Any) -> Any:
    """Speed [m/s] and spin [rad/s] after 10 ms of a body of 2 kg that a spring of 8 N pulls up beside its centre."""
    body = RigidBody(name="b", mass=2.0, inertia=(4.0, 4.0, 4.0), position=(0.0, 0.0, 0.0))
    spring = Spring(
        name="s", between=((0.5, 0.0, 1.0), "b"), stiffness=16.0, rest_length=0.5,
        anchors=((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)),
    )  # fmt: skip
    seen = {"v": Final(quantity=Velocity("b")), "w": Final(quantity=AngularVelocity("b"))}
    run = simulate(Scene(bodies=(body,), forces=(spring,)), time_step=1e-3, steps=10, observe=seen)
    return np.array([run["v"], run["w"]])


def racked(simulate: Any) -> float:
    """How far a rack of 2 kg goes in 1 s, pushed with 5 N, with a pinion of 0.5 m and 0.25 kg m² on it: 5/6 m."""
    rack = RigidBody(name="rack", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.5, 0.0))
    pinion = RigidBody(name="pinion", mass=1.0, inertia=(0.25, 0.25, 0.25), position=(0.0, 0.0, 0.0))
    joints = (
        Prismatic(name="slide", between=("world", "rack"), axis=(1.0, 0.0, 0.0), compliance=0.0),
        Hinge(name="axle", between=("pinion", "world"), axis=(0.0, 0.0, 1.0), compliance=0.0),
        Relation(name="mesh", terms=(("slide", 1.0), ("axle", -0.5)), compliance=0.0),
    )
    push = Load(name="push", body="rack", force=(5.0, 0.0, 0.0))
    seen = {"x": Final(quantity=JointCoordinate("slide")), "turn": Final(quantity=JointCoordinate("axle"))}
    scene = Scene(bodies=(rack, pinion), constraints=joints, forces=(push,))
    run = simulate(scene, time_step=1e-3, duration=1.0, observe=seen)
    assert float(run["turn"]) == pytest.approx(2.0 * float(run["x"]), rel=2e-3)
    return float(run["x"])


def carried(simulate: Any) -> list[float]:
    """Speeds [m/s] after .1 and 1 s of a cube on a belt of 2 m/s with a friction of .5: .5 g .1 and 2."""
    ground, box = box_on_ground(0.0).bodies
    assert isinstance(ground, RigidBody)
    belt = replace(ground, surface_velocity=(2.0, 0.0, 0.0))
    speed = {"v": Trace(quantity=Velocity("box"), every=100)}
    run = simulate(Scene(bodies=(belt, box), gravity=GRAVITY), time_step=1e-3, duration=1.0, observe=speed)
    return [float(run["v"][1][0]), float(run["v"][10][0])]


def turned_along(simulate: Any) -> Any:
    """Where a turntable of 1 rad/s has what stands on it, 0.3 m off its axis, after 1 s, and how far itself is turned."""
    rough = Material(friction=0.5)
    table = RigidBody(
        name="table", motion="kinematic", shape=Plane(), position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, 1.0), material=rough,
    )  # fmt: skip
    cube = RigidBody(
        name="cube", mass=1.0, shape=Box((0.1, 0.1, 0.1)), position=(0.3, 0.0, 0.05), velocity=(0.0, 0.3, 0.0),
        angular_velocity=(0.0, 0.0, 1.0), material=rough,
    )  # fmt: skip
    seen = {"cube": Final(quantity=Position("cube")), "table": Final(quantity=Orientation("table"))}
    run = simulate(Scene(bodies=(table, cube), gravity=GRAVITY), time_step=1e-3, duration=1.0, observe=seen)
    return np.array([run["cube"][0], run["cube"][1], 2.0 * math.asin(run["table"][3])])

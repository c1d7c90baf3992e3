"""Joints with an answer in closed form that are put to every other engine: gears, rods, slides and what a hinge carries."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from spook_tracker.engine import (
    AngularVelocity,
    ConstraintForce,
    Distance,
    Final,
    Hinge,
    JointCoordinate,
    Load,
    Lock,
    Motor,
    Orientation,
    Position,
    Prismatic,
    Relation,
    RigidBody,
    Scene,
)
from spook_tracker.engine import simulate as ours
from spook_tracker.engine.recorded_joints import turned
from tests.scenes.peer import GRAVITY


def geared(simulate: Any, ratio: float, backwards: bool = False) -> Any:
    """Speeds of two coordinates x + ratio y = 0 after 1 s of 3 N m on x, and what they are: moments of inertia 1 and 2 kg m²."""
    wheels = tuple(
        RigidBody(name=n, mass=1.0, inertia=(i, i, i), position=(2.0 * i, 0.0, 0.0), orientation=(0.8, 0.0, 0.6, 0.0))
        for n, i in (("a", 1.0), ("b", 2.0))
    )  # fmt: skip
    axles = (
        Hinge(name="x", between=("world", "a"), axis=(0.0, 0.0, 1.0), compliance=0.0),
        Hinge(name="y", between=("b", "world") if backwards else ("world", "b"), axis=(0.0, 0.6, 0.8), compliance=0.0),
    )  # fmt: skip
    mesh = Relation(name="mesh", terms=(("x", 1.0), ("y", ratio)), compliance=0.0)
    push = Load(name="push", body="a", torque=(0.0, 0.0, 3.0))
    seen = {"a": Final(quantity=AngularVelocity("a")), "b": Final(quantity=AngularVelocity("b"))}
    scene = Scene(bodies=wheels, constraints=(*axles, mesh), forces=(push,))
    run = simulate(scene, time_step=1 / 240, duration=1.0, observe=seen)
    turns = np.array([run["a"][2], (-1.0 if backwards else 1.0) * float(run["b"] @ np.array(axles[1].axis))])
    fast = 3.0 / (1.0 + 2.0 / ratio**2)
    return turns, np.array([fast, -fast / ratio])


def spun(friction: float) -> Scene:
    """A body whose axes are not its hinge's, which it turns about through its centre, with dry friction [N m]."""
    body = RigidBody(
        name="b", mass=2.0, inertia=(2.0, 1.0, 1.5), position=(0.0, 0.0, 0.0), orientation=(0.8, 0.0, 0.6, 0.0),
        angular_velocity=(0.0, 0.0, 5.0),
    )  # fmt: skip
    hinge = Hinge(name="j", between=("world", "b"), axis=(0.0, 0.0, 1.0), friction=friction, compliance=0.0)
    return Scene(bodies=(body,), constraints=(hinge,))


def load_on_spun(turn: Any, spin: float, friction: float) -> Any:
    """Torque [N m] on that body so turned, at that speed: I α + ω×I ω, with α from the friction about the axis."""
    axes = np.array([turned(turn, axis) for axis in np.eye(3)]).T
    tensor = axes @ np.diag((2.0, 1.0, 1.5)) @ axes.T
    omega, alpha = np.array([0.0, 0.0, spin]), np.array([0.0, 0.0, -friction / tensor[2, 2]])
    return tensor @ alpha + np.cross(omega, tensor @ omega)


def rodded(simulate: Any, rod: Distance) -> Any:
    """Where a body of 1 kg, 1.5 m beside the world's origin, is after 0.3 s of falling on a rod."""
    body = RigidBody(name="b", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(1.5, 0.0, 0.0))
    seen = {"end": Final(quantity=Position("b"))}
    scene = Scene(bodies=(body,), constraints=(rod,), gravity=GRAVITY)
    return simulate(scene, time_step=1e-3, duration=0.3, observe=seen)["end"]


def slid_turned(simulate: Any) -> tuple[Any, Any]:
    """How far [m] a body goes in 1 s on a slide at 1 m/s about whose axis it is turned, and how its turn changes."""
    axis = (0.0, 0.6, 0.8)
    turn = (math.cos(0.5), *(math.sin(0.5) * x for x in axis))
    body = RigidBody(
        name="b", mass=2.0, inertia=(0.5, 0.3, 0.4), position=(0.0, 0.0, 0.0), orientation=turn, velocity=axis
    )
    slide = Prismatic(name="s", between=("world", "b"), axis=axis, compliance=0.0)
    seen = {"x": Final(quantity=JointCoordinate("s")), "q": Final(quantity=Orientation("b"))}
    run = simulate(Scene(bodies=(body,), constraints=(slide,)), time_step=1 / 240, duration=1.0, observe=seen)
    return float(run["x"]), run["q"] - np.array(turn)


def held_on_a_slide(simulate: Any, backwards: bool = False) -> Any:
    """Force and torque on the second end of a slide after .1 s, and what they are: all across it holds, and the torque
    about a point beside the centre that keeps the body from turning."""
    axis, centre, gravity = (
        np.array([0.0, math.sqrt(0.5), math.sqrt(0.5)]),
        np.array([1.0, 0.0, 0.0]),
        np.array(GRAVITY),
    )
    mass, pull, twist, seconds = 2.0, np.array([0.0, 4.0, 1.0]), np.array([1.0, 0.0, 2.0]), 0.1
    body = RigidBody(
        name="b", mass=mass, inertia=(0.3, 0.5, 0.6), position=tuple(centre), orientation=(0.8, 0.0, 0.6, 0.0)
    )
    ends = ("b", "world") if backwards else ("world", "b")
    slide = Prismatic(name="j", between=ends, at=(0.0, 0.0, 0.0), axis=tuple(axis), compliance=0.0)
    push = Load(name="push", body="b", force=tuple(pull), torque=tuple(twist))
    scene = Scene(bodies=(body,), constraints=(slide,), forces=(push,), gravity=GRAVITY)
    seen = {"f": Final(quantity=ConstraintForce("j"))}
    found = simulate(scene, time_step=1e-3, duration=seconds, observe=seen)["f"]

    along = float((pull + mass * gravity) @ axis)
    force = along * axis - pull - mass * gravity
    torque = np.cross(centre, force) - twist
    if backwards:
        slid = 0.5 * along / mass * seconds**2 * axis
        force, torque = -force, -torque - np.cross(slid, force)
    return found, np.concatenate([force, torque])


def pushed_arm(simulate: Any, backwards: bool = False) -> tuple[float, float]:
    """Speed [rad/s] after .1 s of an arm of a metre pushed across at its centre and turned besides, and what it is."""
    arm = RigidBody(name="b", mass=2.0, inertia=(0.3, 0.5, 0.6), position=(1.0, 0.0, 0.0))
    ends = ("b", "world") if backwards else ("world", "b")
    hinge = Hinge(name="j", between=ends, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), compliance=0.0)
    push = Load(name="push", body="b", force=(0.0, 3.0, 0.0), torque=(0.0, 0.0, 0.5))
    scene = Scene(bodies=(arm,), constraints=(hinge,), forces=(push,))
    run = simulate(scene, time_step=1e-3, duration=0.1, observe={"w": Final(quantity=AngularVelocity("b"))})
    return float(run["w"][2]), 0.1 * (3.0 + 0.5) / (0.6 + 2.0)


def locked_askew(simulate: Any, still: bool = False) -> tuple[float, float]:
    """How far a heavy body, turned and locked to the world beside its centre, moves [m] and turns in half a second; or to a
    body that stands `still`, turned otherwise."""
    turn = (0.8, 0.0, 0.6, 0.0)
    body = RigidBody(name="b", mass=2.0, inertia=(0.3, 0.5, 0.6), position=(1.0, 0.0, 0.0), orientation=turn)
    post = RigidBody(name="post", motion="static", position=(0.5, 0.2, 0.1), orientation=(0.6, 0.0, 0.0, 0.8))
    lock = Lock(name="j", between=("post" if still else "world", "b"), at=(0.3, 0.1, 0.0), compliance=0.0)
    scene = Scene(bodies=(post, body), constraints=(lock,), gravity=GRAVITY)
    seen = {"x": Final(quantity=Position("b")), "q": Final(quantity=Orientation("b"))}
    run = simulate(scene, time_step=1e-3, duration=0.5, observe=seen)
    moved = float(np.linalg.norm(run["x"] - np.array(body.position)))
    return moved, 1.0 - abs(float(run["q"] @ np.array(turn)))


def _scaled_arm(scale: float, place: float) -> RigidBody:
    inertia = tuple(x * scale**5 for x in (0.3, 0.4, 0.5))
    return RigidBody(
        name="b", mass=2.0 * scale**3, inertia=inertia, position=(place * scale, 0.0, 0.0), orientation=(0.8, 0.0, 0.6, 0.0)
    )  # fmt: skip


def fallen_arm(simulate: Any, scale: float) -> tuple[Any, Any]:
    """Where an arm is on a slanted hinge after half a second of its scale, over its length, and where ours has it."""
    hinge = Hinge(
        name="j", between=("world", "b"), at=(0.0, 0.0, 0.0), axis=(0.0, math.sqrt(0.5), math.sqrt(0.5)), compliance=0.0
    )  # fmt: skip
    scene = Scene(bodies=(_scaled_arm(scale, 1.0),), constraints=(hinge,), gravity=GRAVITY)
    second, seen = math.sqrt(scale), {"x": Final(quantity=Position("b"))}
    theirs, mine = (
        asked(scene, time_step=1e-3 * second, duration=0.5 * second, observe=seen)["x"] / scale
        for asked in (simulate, ours)
    )
    return theirs, mine


def driven_wheel(simulate: Any, scale: float) -> float:
    """Speed of a wheel by a motor of bounded torque, over what that gives; then of one without bound, over what it asks for;
    the one that is further from 1."""
    second = math.sqrt(scale)
    found = []
    for speed, most, exact in ((9.0, 1.0, 0.5 / (0.3 * 0.96**2 + 0.5 * 0.28**2)), (4.0, None, 4.0)):
        bound = None if most is None else most * scale**4
        hinge = Hinge(
            name="j", between=("world", "b"), at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0),
            motor=Motor(speed=speed / second, max_force=bound), compliance=0.0,
        )  # fmt: skip
        scene = Scene(bodies=(_scaled_arm(scale, 0.0),), constraints=(hinge,))
        seen = {"w": Final(quantity=AngularVelocity("b"))}
        run = simulate(scene, time_step=1e-3 * second, duration=0.5 * second, observe=seen)
        found.append(float(run["w"][2]) * second / exact)
    return max(found, key=lambda ratio: abs(ratio - 1.0))

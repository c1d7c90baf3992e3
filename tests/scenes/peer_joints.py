"""Joints with an answer in closed form that are put to every other engine: gears, rods, slides and what a hinge carries."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from spook_tracker.engine import (
    AngularVelocity,
    Distance,
    Final,
    Hinge,
    JointCoordinate,
    Load,
    Orientation,
    Position,
    Prismatic,
    Relation,
    RigidBody,
    Scene,
)
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

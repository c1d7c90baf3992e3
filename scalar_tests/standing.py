"""Robots that stand: what their joints carry by virtual work, and springs that hold them in that pose."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from spook_tracker import engine

from . import case
from .closed_form import error

GRAVITY = 9.81  # m/s²
STRAYED = 5e-3  # m, of a body that does no longer stand where it stood
STATICS = "statics: the pose is one of balance at any time step; rounding and the solver's tolerance remain"
Vector = tuple[float, float, float]


def floor(material: engine.Material, height: float = 0.0) -> engine.RigidBody:
    """Level."""
    return engine.RigidBody(
        name="floor", motion="static", shape=engine.Plane(), position=(0.0, 0.0, height), material=material
    )


def apart(names: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """All pairs: parts of a robot pass through each other."""
    return tuple((one, other) for k, one in enumerate(names) for other in names[k + 1 :])


def limb(
    name: str, start: Vector, end: Vector, radius: float, mass: float, material: engine.Material
) -> engine.RigidBody:
    """A capsule, its round ends about `start` and `end`, which are at the same y."""
    along, up = end[0] - start[0], end[2] - start[2]
    turn = 0.5 * math.atan2(along, up)
    return engine.RigidBody(
        name=name,
        mass=mass,
        shape=engine.Capsule(radius, math.hypot(along, up)),
        position=(0.5 * (start[0] + end[0]), start[1], 0.5 * (start[2] + end[2])),
        orientation=(math.cos(turn), 0.0, math.sin(turn), 0.0),
        material=material,
    )


@dataclass(frozen=True)
class Robot:
    """A tree of bodies on hinges, from the trunk outwards, and what bears its feet: where [m], with what [N]."""

    bodies: tuple[engine.RigidBody, ...]
    joints: tuple[engine.Hinge, ...]
    feet: Mapping[str, tuple[Vector, Vector]]

    @property
    def weight(self) -> float:
        return GRAVITY * math.fsum(body.mass or 0.0 for body in self.bodies)

    def beyond(self, joint: engine.Hinge) -> set[str]:
        """The bodies that turn with this joint while the trunk stays."""
        found = {joint.between[1]}
        for one in self.joints:
            if one.between[0] in found:
                found.add(one.between[1])
        return found

    def torques(self) -> dict[str, float]:
        """What each joint gives the body further out about its axis [N m]: against the moment of weights and feet beyond."""
        found = {}
        for joint in self.joints:
            turning, at, moment = self.beyond(joint), np.array(joint.at), np.zeros(3)
            for body in self.bodies:
                if body.name in turning:
                    weight = (0.0, 0.0, -GRAVITY * (body.mass or 0.0))
                    moment += np.cross(np.array(body.position) - at, weight)
            for foot, (place, force) in self.feet.items():
                if foot in turning:
                    moment += np.cross(np.array(place) - at, force)
            found[joint.name] = -float(moment @ joint.axis)
        return found

    def scene(
        self,
        ground: engine.RigidBody,
        stiffness: float,
        share: float | None = None,
        moves: Mapping[str, engine.Table] | None = None,
    ) -> engine.Scene:
        """Held by springs [N m/rad] whose rests are ahead by torque over stiffness: drives of at most `share` of their torques.
        `moves` are added to rests [rad]."""
        joints = []
        for joint, torque in zip(self.joints, self.torques().values(), strict=True):
            ahead = torque / stiffness
            rest: float | engine.Table = ahead
            if moves and joint.name in moves:
                move = moves[joint.name]
                rest = engine.Table(move.times, tuple(ahead + turn for turn in move.values))
            bound = None if share is None else share * abs(torque)
            spring = engine.JointSpring(stiffness=stiffness, rest=rest, max_force=bound)
            joints.append(replace(joint, spring=spring))
        return engine.Scene(
            bodies=(ground, *self.bodies),
            constraints=tuple(joints),
            gravity=(0.0, 0.0, -GRAVITY),
            no_contact=apart([body.name for body in self.bodies]),
        )


def stand(
    simulate: case.Simulate,
    robot: Robot,
    scene: engine.Scene,
    time_step: float,
    steps: int,
    method: engine.Method = engine.PLAIN,
) -> dict[str, float]:
    """Loads of the feet and torques of the joints against statics at the end, and how long it stood still [s]."""
    observe: dict[str, Any] = {
        foot: engine.Final(quantity=engine.ContactForce(foot, "floor")) for foot in robot.feet
    }
    observe |= {
        joint.name: engine.Final(quantity=engine.ConstraintForce(joint.name)) for joint in robot.joints
    }
    observe["x"] = engine.Trace(quantity=engine.Position())
    result = simulate(scene, time_step=time_step, steps=steps, method=method, observe=observe)
    right = robot.torques()
    found = [float(result[joint.name][3:] @ joint.axis) for joint in robot.joints]
    torque = max(abs(a - b) for a, b in zip(found, right.values(), strict=True))
    load = max(float(np.abs(result[foot] - force).max()) for foot, (_, force) in robot.feet.items())
    moved = np.abs(result["x"] - result["x"][0]).reshape(steps + 1, -1).max(axis=1)
    strayed = np.flatnonzero(moved > STRAYED)
    return {
        "load_error": load / robot.weight,
        "torque_error": torque / max(map(abs, right.values())),
        "moved": float(moved.max()),
        "stood": time_step * float(strayed[0] if len(strayed) else steps),
    }


def stands(duration: float) -> tuple[case.Metric, ...]:
    """What a robot that stands so long [s] is held to."""
    return (
        error("load_error", "largest error of a foot's load, over the weight", "1", 1e-9, STATICS),
        error("torque_error", "largest error of a joint's torque over the largest", "1", 1e-9, STATICS),
        case.Metric(
            name="stood",
            description="how long it stands before anything has moved by 5 mm",
            unit="s",
            role="gate",
            better="larger",
            limit=duration,
            limit_source="statics: for ever",
            limit_kind="physical",
            reference=duration,
        ),
        error("moved", "how far anything moves", "m", 1e-9, STATICS, "companion"),
    )

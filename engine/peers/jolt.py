"""Jolt in Node, by its WebAssembly package: single precision, joints and contacts by sequential impulses.

Central gravity and springs are pushed from JavaScript at every step. Contact forces are not shown: Jolt keeps them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from spook_tracker.engine.bodies import WORLD
from spook_tracker.engine.build_info import BuildInfo
from spook_tracker.engine.forces import CentralGravity, Load, Spring
from spook_tracker.engine.joints import Ball, Distance, Hinge, Joint, Lock, Prismatic, frictions
from spook_tracker.engine.observe import ConstraintForce, Penetration
from spook_tracker.engine.peers import node
from spook_tracker.engine.peers.described import described as common
from spook_tracker.engine.peers.described import numbered
from spook_tracker.engine.protocol import Capabilities, Configuration, Task
from spook_tracker.engine.recorded_joints import joint_point
from spook_tracker.engine.recording import Recording
from spook_tracker.engine.shapes import Box, Capsule, Plane, Sphere

PACKAGE = "jolt-physics"
SCRIPT = Path(__file__).with_suffix(".mjs")
KINDS: dict[type[Any], str] = {Ball: "ball", Lock: "lock", Hinge: "hinge", Prismatic: "prismatic"}
FOUND = node.package(PACKAGE)


class Jolt:
    """The adapter."""

    name = "jolt"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ConstraintForce, Penetration}),
        shows_force_of=frozenset({Distance, Ball, Hinge}),
        friction=True,
        joint_friction=True,
        restitution=True,
        kinematic=True,
    )
    configurations = (
        Configuration(
            name="many-iterations",
            reason="100 velocity and 20 position iterations in place of 10 and 2, gyroscopic torques, bodies that may "
            "sink 1 mm into each other in place of 2 cm, and restitution from 1 cm/s on in place of 1 m/s",
            expected_order=1.0,
            options={
                "gyroscopic": True,
                "settings": {
                    "mNumVelocitySteps": 100,
                    "mNumPositionSteps": 20,
                    "mPenetrationSlop": 1e-3,
                    "mMinVelocityForRestitution": 1e-2,
                },
            },
        ),
        Configuration(
            name="defaults",
            reason="10 velocity and 2 position iterations, no gyroscopic torques: what one gets without asking",
            expected_order=1.0,
            options={"gyroscopic": False, "settings": {}},
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = str(node.facts(FOUND)["version"])
        return BuildInfo(self.name, installed, "", False, "", (), "npm package, WebAssembly run by Node", "")

    def record(self, task: Task) -> Recording:
        return node.run(SCRIPT, described(task), task.time_limit)


def described(task: Task) -> dict[str, Any]:
    """The task as JSON takes it."""
    shown: dict[str, int] = {}
    if task.constraint_forces:
        for constraint in task.scene.constraints:
            if type(constraint) in (Jolt.capabilities.shows_force_of or ()):
                shown[constraint.name] = 1 if isinstance(constraint, Distance) else 6
    places = numbered(task)
    constraints = [_constraint(task, constraint, places) for constraint in task.scene.constraints]
    return {**common(task, FOUND, constraints), "forces_of": shown, "depth": task.contacts}


def _constraint(task: Task, constraint: Any, places: dict[str, int]) -> dict[str, Any]:
    scene = task.scene
    ends = [places[end] if isinstance(end, str) and end != WORLD else None for end in constraint.between]
    if isinstance(constraint, Distance):
        length = scene.length(constraint) if constraint.rest_length is None else constraint.rest_length
        points = [list(scene.anchor(constraint, k)) for k in (0, 1)]
        return {"kind": "distance", "name": constraint.name, "ends": ends, "length": length, "points": points}
    assert isinstance(constraint, Joint)
    return {
        "kind": KINDS[type(constraint)],
        "name": constraint.name,
        "ends": ends,
        "at": list(joint_point(scene, constraint)),
        "axis": list(getattr(constraint, "axis", (0.0, 0.0, 1.0))),
        "friction": max(frictions(constraint)[0]),
    }


ENGINE = Jolt()

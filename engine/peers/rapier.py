"""Rapier in Node, by its WebAssembly package: single precision, joints and contacts by sequential impulses.

It has no rod of constant length (its rope only pulls), shows no forces of joints, and single precision bounds every
answer from below. Of a contact's friction its package shows nothing, so that contact forces are asked of smooth surfaces
only. Central gravity is pushed from JavaScript at every step; springs are its own joints.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies import WORLD, RigidBody
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load, Spring
from ..joints import AxialJoint, Ball, Hinge, Joint, Lock, Prismatic
from ..meshes import HeightField, TriangleMesh
from ..observe import ContactForce
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import turned
from ..recording import Recording
from ..scene import Scene
from ..shapes import Box, Capsule, Compound, ConvexHull, Cylinder, Plane, Sphere
from . import node
from .described import described as common
from .described import numbered
from .frames import drive, drive_damping, ends_of

PACKAGE = "@dimforge/rapier3d-compat"
SCRIPT = Path(__file__).with_suffix(".mjs")
FOUND = node.package(PACKAGE)
CAP = 399.99  # m/s
MOST_PAIRS = 2000  # of bodies whose contact forces are kept, 48 kB a sample


class Rapier:
    """The adapter."""

    name = "rapier"
    capabilities = Capabilities(
        shapes=frozenset(
            {Sphere, Box, Capsule, Cylinder, ConvexHull, Plane, Compound, TriangleMesh, HeightField}
        ),
        joints=frozenset({Lock, Ball, Hinge, Prismatic}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ContactForce}),
        friction=True,
        joint_friction=True,
        motors=True,
        springs_aside=True,
        restitution=True,
        kinematic=True,
        absent=frozenset(
            {
                "the joint distance",
                "the joint relation",
                "the observable constraint force",
                "compliance of a surface",
                "friction of rolling or turning",
                "friction that differs with the direction",
                "the force fluid",
            }
        ),
    )
    configurations = (
        Configuration(
            name="many-iterations",
            reason="100 solver iterations a step in place of 4: joints and stacks are solved further",
            expected_order=1.0,
            options={"sweeps": 100},
        ),
        Configuration(
            name="defaults",
            reason="4 solver iterations: what one gets without asking",
            expected_order=1.0,
            options={"sweeps": 4},
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = str(node.facts(FOUND)["version"])
        return BuildInfo(self.name, installed, "", False, "", (), "npm package, WebAssembly run by Node", "")

    def record(self, task: Task) -> Recording:
        found = node.run(SCRIPT, described(task), task.time_limit)
        if (
            np.linalg.norm(found.velocities, axis=-1) > CAP
        ).any():  # the package cannot ask for another bound
            raise NotSupported(
                f"rapier does not support speeds of {CAP:g} m/s and more: it bounds all by 400 m/s"
            )
        return found


def described(task: Task) -> dict[str, Any]:
    """The task as JSON takes it."""
    scene = task.scene
    joined = {frozenset(c.between) for c in scene.constraints if isinstance(c, Joint)}
    places = numbered(task)
    parted = [pair for pair in scene.no_contact if scene.contacts and frozenset(pair) not in joined]
    constraints = [_joint(task, constraint, places) for constraint in scene.constraints]
    pairs = _touching(scene, places) if task.contacts else []
    return {
        **common(task, FOUND, constraints),
        "parted": [[places[name] for name in pair] for pair in parted],
        "contacts_of": pairs,
        "names": list(places),
    }


def _touching(scene: Scene, places: Mapping[str, int]) -> list[tuple[int, int]]:
    """Pairs of bodies that may touch, by their places. Raises NotSupported where their forces would be told in part."""
    solid = [b for b in scene.bodies if isinstance(b, RigidBody) and b.shape is not None]
    if any(body.material.friction for body in solid):
        raise NotSupported(
            "rapier does not support a contact force with friction: its package shows none of friction's"
        )
    pairs = [
        (places[a.name], places[b.name])
        for a, b in combinations(solid, 2)
        if "dynamic" in (a.motion, b.motion)
    ]
    if len(pairs) > MOST_PAIRS:
        raise NotSupported("our adapter cannot ask rapier for the contact forces of so many bodies")
    return pairs


@functools.cache
def _has(name: str) -> bool:
    """Whether this release of the package has a function of joints of that name."""
    return any(name in file.read_text(encoding="utf-8") for file in FOUND.rglob("impulse_joint.d.ts"))


def _joint(task: Task, joint: Any, places: dict[str, int]) -> dict[str, Any]:
    """Points on both ends, the turns there that carry x onto its axis, and what drives it."""
    first, second = ends_of(task.scene, joint)
    axes = [turned(end.turn, np.array([1.0, 0.0, 0.0])) for end in (first, second)]
    askew = isinstance(joint, AxialJoint) and np.abs(axes[0] - axes[1]).max() > 1e-12
    # A slide holds all of a turn, so that one about its own axis counts as well.
    askew |= isinstance(joint, Prismatic) and abs(first.turn @ second.turn) < 1.0 - 1e-15
    if askew and not _has("setLocalFrame1"):
        raise NotSupported(
            "this release of rapier does not support a hinge or slide between bodies that are turned against each other"
        )
    driven = drive(joint, "rapier")
    if driven is not None and not _has("setMotorMaxForce"):
        raise NotSupported("this release of rapier does not support a motor of bounded force")
    return {
        "kind": {Ball: "ball", Lock: "lock", Hinge: "hinge", Prismatic: "prismatic"}[type(joint)],
        "ends": [places.get(end, -1) if end != WORLD else None for end in joint.between],
        "points": [first.point, second.point],
        "turns": [list(first.turn), list(second.turn)],
        "axis": None if askew else list(axes[0]),
        "motor": None
        if driven is None
        else {
            "speed": driven[0],
            "most": driven[1],
            "damping": drive_damping(task.scene, joint, task.time_step),
        },
    }


ENGINE = Rapier()

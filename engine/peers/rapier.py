"""Rapier in Node, by its WebAssembly package: single precision, joints and contacts by sequential impulses.

It has no rod of constant length (its rope only pulls), shows no forces of joints, and single precision bounds every
answer from below. The force of a contact is the one its contact force events tell, which is along the normal: with
friction it would be a part, so that it is asked of smooth surfaces only.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from spook_tracker.engine.bodies import WORLD, Particle, RigidBody
from spook_tracker.engine.build_info import BuildInfo
from spook_tracker.engine.forces import Load
from spook_tracker.engine.joints import Ball, Hinge, Joint, Lock, Prismatic
from spook_tracker.engine.observe import ContactForce
from spook_tracker.engine.peers import node
from spook_tracker.engine.peers.described import described as common
from spook_tracker.engine.peers.described import numbered
from spook_tracker.engine.protocol import Capabilities, Configuration, NotSupported, Task
from spook_tracker.engine.recorded_joints import conjugate, joint_point, turned_back
from spook_tracker.engine.recording import Recording
from spook_tracker.engine.scene import Scene
from spook_tracker.engine.shapes import Box, Capsule, Plane, Sphere

PACKAGE = "@dimforge/rapier3d-compat"
SCRIPT = Path(__file__).with_suffix(".mjs")
FOUND = node.package(PACKAGE)
MOST_PAIRS = 2000  # of bodies whose contact forces are kept, 48 kB a sample


class Rapier:
    """The adapter."""

    name = "rapier"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Capsule, Plane}),
        joints=frozenset({Lock, Ball, Hinge, Prismatic}),
        forces=frozenset({Load}),
        shows=frozenset({ContactForce}),
        friction=True,
        restitution=True,
        kinematic=True,
        absent=frozenset({"the joint distance", "the observable constraint force"}),
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
        return node.run(SCRIPT, described(task), task.time_limit)


def described(task: Task) -> dict[str, Any]:
    """The task as JSON takes it. Raises NotSupported for pairs kept apart that no joint ties."""
    scene = task.scene
    joined = {frozenset(c.between) for c in scene.constraints if isinstance(c, Joint)}
    if scene.contacts and any(frozenset(pair) not in joined for pair in scene.no_contact):
        raise NotSupported("our adapter cannot ask rapier for single pairs that must not touch")
    places = numbered(task)
    constraints = [_joint(task, constraint, places) for constraint in scene.constraints]
    pairs = _touching(scene, places) if task.contacts else []
    return {**common(task, FOUND, constraints), "contacts_of": pairs, "names": list(places)}


def _touching(scene: Scene, places: Mapping[str, int]) -> list[tuple[int, int]]:
    """Pairs of bodies that may touch, by their places. Raises NotSupported where their forces would be told in part."""
    solid = [b for b in scene.bodies if isinstance(b, RigidBody) and b.shape is not None]
    if any(body.material.friction for body in solid):
        raise NotSupported("our adapter cannot ask rapier for a contact force with friction")
    pairs = [
        (places[a.name], places[b.name])
        for a, b in combinations(solid, 2)
        if "dynamic" in (a.motion, b.motion)
    ]
    if len(pairs) > MOST_PAIRS:
        raise NotSupported("our adapter cannot ask rapier for the contact forces of so many bodies")
    return pairs


def _joint(task: Task, joint: Any, places: dict[str, int]) -> dict[str, Any]:
    """Points, turns and axis in the axes of both ends."""
    scene, at = task.scene, joint_point(task.scene, joint)
    frames = [_frame(None if end == WORLD else scene.body(end)) for end in joint.between]
    points = [list(turned_back(turn, at - place)) for place, turn in frames]
    axes = [turned_back(turn, np.array(getattr(joint, "axis", (0.0, 0.0, 1.0)))) for _, turn in frames]
    if isinstance(joint, Hinge | Prismatic) and np.abs(axes[0] - axes[1]).max() > 1e-12:
        raise NotSupported(
            "our adapter cannot ask rapier for a hinge or slide between bodies that are turned against each other"
        )
    return {
        "kind": {Ball: "ball", Lock: "lock", Hinge: "hinge", Prismatic: "prismatic"}[type(joint)],
        "ends": [places.get(end, -1) if end != WORLD else None for end in joint.between],
        "points": points,
        "turns": [list(conjugate(turn)) for _, turn in frames],
        "axis": list(axes[0]),
    }


def _frame(body: Particle | RigidBody | None) -> tuple[Any, Any]:
    if body is None:
        return np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    turn = (1.0, 0.0, 0.0, 0.0) if isinstance(body, Particle) else body.orientation
    return np.array(body.position), np.array(turn)


ENGINE = Rapier()

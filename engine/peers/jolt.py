"""Jolt in Node, by its WebAssembly package: single precision, joints and contacts by sequential impulses.

Central gravity and springs are pushed from JavaScript at every step; distances that give are its own soft constraints.
Contact forces are not shown: Jolt keeps them. Its gears and racks hold two bodies that turn or slide against what stands.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..build_info import BuildInfo
from ..couplings import Relation
from ..forces import CentralGravity, Load, Spring
from ..joints import AxialJoint, Ball, Distance, Hinge, Joint, Lock, Prismatic, frictions
from ..meshes import HeightField, TriangleMesh
from ..observe import ConstraintForce, Penetration
from ..protocol import RIGID, Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import joint_point, turned_back
from ..recording import Recording
from ..scene import Scene
from ..shapes import Box, Capsule, Compound, ConvexHull, Cylinder, Plane, Sphere
from . import node
from .described import UPRIGHT, numbered
from .described import described as common
from .frames import drive

PACKAGE = "jolt-physics"
SCRIPT = Path(__file__).with_suffix(".mjs")
KINDS: dict[type[Any], str] = {Ball: "ball", Lock: "lock", Hinge: "hinge", Prismatic: "prismatic"}
FOUND = node.package(PACKAGE)
UNBOUNDED = 1e30  # N or N m
LIGHTEST = 1e-6  # kg m²: a body whose moments are less has those of a ball of 1 m in Jolt (SetMassProperties)


class Jolt:
    """The adapter."""

    name = "jolt"
    capabilities = Capabilities(
        shapes=frozenset(
            {Sphere, Box, Capsule, Cylinder, ConvexHull, Plane, Compound, TriangleMesh, HeightField}
        ),
        joints=frozenset({Distance, Lock, Ball, Hinge, Prismatic, Relation}),
        soft=frozenset({Distance}),
        forces=frozenset({CentralGravity, Load, Spring}),
        shows=frozenset({ConstraintForce, Penetration}),
        shows_force_of=frozenset({Distance, Ball, Hinge}),
        friction=True,
        joint_friction=True,
        motors=True,
        springs_aside=True,
        restitution=True,
        surface_velocity=True,
        kinematic=True,
        absent=frozenset(
            {
                "the observable contact force",
                "compliance of a surface",
                "friction of rolling or turning",
                "friction that differs with the direction",
            }
        ),
    )
    configurations = (
        Configuration(
            name="many-iterations",
            reason="100 velocity and 20 position iterations in place of 10 and 2, gyroscopic torques, bodies that may "
            "sink 1 mm into each other in place of 2 cm, restitution from 1 cm/s on in place of 1 m/s, and no bumps where "
            "the triangles of a mesh meet (mEnhancedInternalEdgeRemoval)",
            expected_order=1.0,
            options={
                "gyroscopic": True,
                "edges": True,
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
            options={"gyroscopic": False, "edges": False, "settings": {}},
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = str(node.facts(FOUND)["version"])
        return BuildInfo(self.name, installed, "", False, "", (), "npm package, WebAssembly run by Node", "")

    def record(self, task: Task) -> Recording:
        factor = _heavier(task.scene)
        heavier = replace(task, scene=_weighed(task.scene, factor))
        found = node.run(SCRIPT, described(heavier), task.time_limit)
        forces = {name: of / factor for name, of in found.constraint_forces.items()}
        return replace(found, constraint_forces=forces)


def described(task: Task) -> dict[str, Any]:
    """The task as JSON takes it."""
    shown: dict[str, int] = {}
    if task.constraint_forces:
        for constraint in task.scene.constraints:
            if type(constraint) in (Jolt.capabilities.shows_force_of or ()):
                shown[constraint.name] = 1 if isinstance(constraint, Distance) else 6
    places = numbered(task)
    joints = [one for one in task.scene.constraints if not isinstance(one, Relation)]
    constraints = [_constraint(task, joint, places) for joint in joints]
    relations = [_relation(task.scene, one) for one in task.scene.constraints if isinstance(one, Relation)]
    told = common(task, FOUND, constraints)
    shapes = [b.shape for b in task.scene.bodies if isinstance(b, RigidBody)]
    told["options"]["edges"] &= any(isinstance(shape, TriangleMesh | HeightField) for shape in shapes)
    return {**told, "relations": relations, "forces_of": shown, "depth": task.contacts}


def _heavier(scene: Scene) -> float:
    """By how much all masses and forces grow together, which moves nothing otherwise, so that Jolt keeps all moments."""
    sizes = [
        np.linalg.norm(np.array(b.inertia))
        for b in scene.bodies
        if isinstance(b, RigidBody) and b.motion == "dynamic"
    ]
    least = min(sizes, default=1.0)
    return 1.0 if least > 2.0 * LIGHTEST else 2.0 ** math.ceil(math.log2(2.0 * LIGHTEST / least))


def _weighed(scene: Scene, factor: float) -> Scene:
    """The scene with all masses and forces that much larger."""

    def of(body: Any) -> Any:
        if getattr(body, "motion", "dynamic") != "dynamic":
            return body
        moments = {} if isinstance(body, Particle) else {"inertia": tuple(factor * x for x in body.inertia)}
        return replace(body, mass=factor * body.mass, **moments)

    def held(row: Any) -> Any:
        if isinstance(row, Distance):
            return replace(row, compliance=row.compliance / factor if row.compliance > RIGID else 0.0)
        if not isinstance(row, AxialJoint):
            return row
        motor = row.motor
        if motor is not None and motor.max_force is not None:
            motor = replace(motor, max_force=factor * motor.max_force)  # type: ignore[operator]
        return replace(row, friction=factor * row.friction, motor=motor)

    def pushed(force: Any) -> Any:
        if isinstance(force, Load):
            push, torque = (np.multiply(factor, part) for part in (force.force, force.torque))
            return replace(force, force=tuple(push), torque=tuple(torque))
        if isinstance(force, Spring):
            return replace(force, stiffness=factor * force.stiffness, viscosity=factor * force.viscosity)
        return force

    return replace(
        scene,
        bodies=tuple(map(of, scene.bodies)),
        constraints=tuple(map(held, scene.constraints)),
        forces=tuple(map(pushed, scene.forces)),
    )


def _relation(scene: Scene, relation: Relation) -> dict[str, Any]:
    """A gear of two hinges, or a rack on a slide with its pinion, the hinge first."""
    terms = sorted(relation.terms, key=lambda term: not isinstance(scene.constraint(term[0]), Hinge))
    joints = [scene.constraint(name) for name, _ in terms]
    kinds = [type(joint) for joint in joints]
    if kinds not in ([Hinge, Hinge], [Hinge, Prismatic]):
        raise NotSupported(
            f"jolt does not support {relation.name!r}: its gears and racks are of two joints, one a hinge"
        )
    ground = {WORLD, *(b.name for b in scene.bodies if getattr(b, "motion", "dynamic") == "static")}
    signs = [-1.0 if joint.between[1] in ground else 1.0 for joint in joints]
    if any(ground.isdisjoint(joint.between) for joint in joints):
        raise NotSupported(f"jolt does not support {relation.name!r}: its gears turn against what stands")
    return {
        "kind": "gear" if kinds[1] is Hinge else "rack",
        "names": [name for name, _ in terms],
        "axes": [_in_its_body(scene, joint, ground) for joint in joints],
        "factors": [sign * factor for sign, (_, factor) in zip(signs, terms, strict=True)],
    }


def _in_its_body(scene: Scene, joint: Any, ground: set[str]) -> list[float]:
    """A joint's axis in the axes of the body that moves."""
    moving = next(scene.body(end) for end in joint.between if end not in ground)
    turn = moving.orientation if isinstance(moving, RigidBody) else UPRIGHT
    return [float(x) for x in turned_back(np.array(turn), np.array(joint.axis))]


def _motor(joint: Any) -> dict[str, float] | None:
    """Speed and largest force of what drives a joint; friction is a part of its own."""
    driven = drive(joint, "jolt") if getattr(joint, "motor", None) else None
    return driven and {"speed": driven[0], "most": UNBOUNDED if driven[1] is None else driven[1]}


def _constraint(task: Task, constraint: Any, places: dict[str, int]) -> dict[str, Any]:
    scene = task.scene
    ends = [places[end] if isinstance(end, str) and end != WORLD else None for end in constraint.between]
    if isinstance(constraint, Distance):
        length = scene.length(constraint) if constraint.rest_length is None else constraint.rest_length
        points = [list(scene.anchor(constraint, k)) for k in (0, 1)]
        soft = constraint.compliance > 0.0
        return {
            "kind": "distance",
            "name": constraint.name,
            "ends": ends,
            "length": length,
            "points": points,
            "stiffness": 1.0 / constraint.compliance if soft else 0.0,
            "viscosity": (constraint.damping or 0.0) / constraint.compliance if soft else 0.0,
        }
    assert isinstance(constraint, Joint)
    return {
        "kind": KINDS[type(constraint)],
        "name": constraint.name,
        "ends": ends,
        "at": list(joint_point(scene, constraint)),
        "axis": list(getattr(constraint, "axis", (0.0, 0.0, 1.0))),
        "friction": max(frictions(constraint)[0]),
        "motor": _motor(constraint),
    }


ENGINE = Jolt()

"""p2-es in Node, the planar engine that steps by SPOOK, too: rows solved by Gauss-Seidel.

It is asked what stays in a plane and touches nothing: its friction is bounded by weights and not by normal forces,
and a body that lies on a plane in space is no body on a line. Single precision unless told otherwise.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load
from ..joints import Distance, Hinge, Lock
from ..observe import ConstraintForce
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import joint_point, turned, turned_back
from ..recording import Recording
from ..result import Array
from ..scene import Scene
from . import node
from .described import described as common
from .described import numbered

PACKAGE = "p2-es"
SCRIPT = Path(__file__).with_suffix(".mjs")
FORCE = 1e15  # N, more than any row needs: p2 bounds every row
FLAT = 1e-12  # of the scene's size: farther out of the plane is out of it
FOUND = node.package(PACKAGE)


class P2:
    """The adapter."""

    name = "p2"
    capabilities = Capabilities(
        joints=frozenset({Distance, Lock, Hinge}),
        forces=frozenset({CentralGravity, Load}),
        shows=frozenset({ConstraintForce}),
        shows_force_of=frozenset({Distance}),
        absent=frozenset({"the force fluid"}),
    )
    configurations = (
        Configuration(
            name="accurate",
            reason="double precision, rigid rows (stiffness 1e15) relaxed over two steps, which is SPOOK with a damping "
            "of 2 h, and 500 sweeps at every step: what the method gives where time is no matter",
            expected_order=1.0,
            options={"sweeps": 500, "stiffness": 1e15, "relaxation": 2.0, "double": True},
        ),
        Configuration(
            name="defaults",
            reason="single precision, 10 sweeps, stiffness 1e6, relaxed over four steps: what one gets without asking",
            expected_order=1.0,
            options={"sweeps": 10, "stiffness": 1e6, "relaxation": 4.0, "double": False},
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = str(node.facts(FOUND)["version"])
        return BuildInfo(self.name, installed, "", False, "", (), "npm package, run by Node", "")

    def record(self, task: Task) -> Recording:
        return node.run(SCRIPT, described(task), task.time_limit)


def described(task: Task) -> dict[str, Any]:
    """The task as JSON takes it. Raises NotSupported for scenes that leave a plane."""
    scene = task.scene
    across, up, normal = plane(scene)
    rods = [c.name for c in scene.constraints if isinstance(c, Distance)]
    places = numbered(task)
    told = common(task, FOUND, [_constraint(task, constraint, places) for constraint in scene.constraints])
    for body, row in zip(scene.bodies, told["bodies"], strict=True):
        row["turning"] = _moment(body, normal)
    return {
        **told,
        "plane": {"across": list(across), "up": list(up), "normal": list(normal)},
        "force": FORCE,
        "forces_of": dict.fromkeys(rods, 1) if task.constraint_forces else {},
    }


def plane(scene: Scene) -> tuple[Array, Array, Array]:
    """Two unit vectors that span the plane all stays in, and its normal. Raises NotSupported if there is none."""
    points = [np.array(body.position) for body in scene.bodies]
    for constraint in scene.constraints:
        if isinstance(constraint, Distance):
            points += [np.array(scene.anchor(constraint, k)) for k in (0, 1)]
        elif isinstance(constraint, Hinge | Lock):
            points.append(joint_point(scene, constraint))
    points += [np.array(f.centre) for f in scene.forces if isinstance(f, CentralGravity)]
    along = [point - points[0] for point in points] + [np.array(b.velocity) for b in scene.bodies]
    along += [np.array(scene.gravity), *(np.array(f.force) for f in scene.forces if isinstance(f, Load))]
    about = [np.array(b.angular_velocity) for b in scene.bodies if isinstance(b, RigidBody)]
    about += [np.array(c.axis) for c in scene.constraints if isinstance(c, Hinge)]
    about += [np.array(f.torque) for f in scene.forces if isinstance(f, Load)]
    turning = [axis / np.linalg.norm(axis) for axis in about if axis.any()]
    size = max(float(np.linalg.norm(v)) for v in along) or 1.0
    normal = turning[0] if turning else np.linalg.svd(np.array(along))[2][2]
    if any(abs(v @ normal) > FLAT * size for v in along) or any(
        np.linalg.norm(np.cross(axis, normal)) > 1e-9 for axis in turning
    ):
        raise NotSupported("p2 does not support scenes that leave a plane")
    least = np.eye(3)[int(np.argmin(np.abs(normal)))]
    across = np.cross(least, normal)
    across /= np.linalg.norm(across)
    return across, np.cross(normal, across), normal


def _moment(body: Particle | RigidBody, normal: Array) -> float:
    """Moment of inertia about the normal, which must be a principal axis of a body that moves."""
    if isinstance(body, Particle) or body.motion != "dynamic":
        return 0.0
    axis = turned_back(np.array(body.orientation), normal)
    moments = np.array(body.inertia) * axis
    if np.abs(np.cross(moments, axis)).max() > 1e-9 * np.abs(moments).max():
        raise NotSupported("p2 does not support a body whose principal axes lean out of the plane")
    return float(moments @ axis)


def _constraint(task: Task, constraint: Any, places: dict[str, int]) -> dict[str, Any]:
    scene = task.scene
    ends = [places[end] if isinstance(end, str) and end != WORLD else None for end in constraint.between]
    if isinstance(constraint, Distance):
        length = scene.length(constraint) if constraint.rest_length is None else constraint.rest_length
        anchors = []
        for end, anchor in zip(constraint.between, constraint.anchors, strict=True):
            body = scene.body(end) if isinstance(end, str) and end != WORLD else None
            turn = np.array(body.orientation if isinstance(body, RigidBody) else (1.0, 0.0, 0.0, 0.0))
            anchors.append(turned(turn, np.array(anchor) if body is not None else np.zeros(3)).tolist())
        points = [list(scene.anchor(constraint, k)) for k in (0, 1)]
        return {
            "kind": "distance",
            "name": constraint.name,
            "ends": ends,
            "length": length,
            "points": points,
            "anchors": anchors,
        }
    at = list(joint_point(scene, constraint))
    kind = "hinge" if isinstance(constraint, Hinge) else "lock"
    return {"kind": kind, "name": constraint.name, "ends": ends, "points": [at, at]}


ENGINE = P2()

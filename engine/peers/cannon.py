"""cannon-es, the JavaScript engine that steps by SPOOK, too: rows solved by Gauss-Seidel, in Node.

An implementation of the method that shares no line with ours: with sweeps enough, the same answers.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..bodies import WORLD
from ..build_info import BuildInfo
from ..forces import CentralGravity, Load
from ..joints import Ball, Distance, Hinge, Lock
from ..observe import ConstraintForce
from ..protocol import Capabilities, Configuration, NotSupported, Task
from ..recorded_joints import joint_point
from ..recording import Recording
from ..shapes import Box, Plane, Sphere
from . import node
from .described import described as common
from .described import numbered

PACKAGE = "cannon-es"
SCRIPT = Path(__file__).with_suffix(".mjs")
FORCE = 1e15  # N, more than any row needs: cannon bounds every row, by 1e6 N unless told
FOUND = node.package(PACKAGE)


class Cannon:
    """The adapter."""

    name = "cannon"
    capabilities = Capabilities(
        shapes=frozenset({Sphere, Box, Plane}),
        joints=frozenset({Distance, Lock, Ball, Hinge}),
        forces=frozenset({CentralGravity, Load}),
        shows=frozenset({ConstraintForce}),
        shows_force_of=frozenset({Distance}),
        friction=True,
        absent=frozenset(
            {
                "the joint relation",
                "the shape cylinder",
                "the force fluid",
                "friction of rolling or turning",
                "friction that differs with the direction",
            }
        ),
    )
    configurations = (
        Configuration(
            name="accurate",
            reason="rigid rows (stiffness 1e15) relaxed over two steps, which is SPOOK with a damping of 2 h, and 500 "
            "sweeps at every step: what the method gives where time is no matter",
            expected_order=1.0,
            options={"sweeps": 500, "tolerance": 0.0, "stiffness": 1e15, "relaxation": 2.0},
        ),
        Configuration(
            name="defaults",
            reason="10 sweeps, stiffness 1e7, relaxed over three steps: what one gets without asking",
            expected_order=1.0,
            options={"sweeps": 10, "tolerance": 1e-7, "stiffness": 1e7, "relaxation": 3.0},
        ),
    )

    def build_info(self) -> BuildInfo:
        installed = str(node.facts(FOUND)["version"])
        return BuildInfo(self.name, installed, "", False, "", (), "npm package, run by Node", "")

    def record(self, task: Task) -> Recording:
        return node.run(SCRIPT, described(task), task.time_limit)


def described(task: Task) -> dict[str, Any]:
    """The task as JSON takes it. Raises NotSupported for rods that do not end in centres."""
    places = numbered(task)
    rods = [c.name for c in task.scene.constraints if isinstance(c, Distance)]
    return {
        **common(
            task, FOUND, [_constraint(task, constraint, places) for constraint in task.scene.constraints]
        ),
        "force": FORCE,
        "forces_of": dict.fromkeys(rods, 1) if task.constraint_forces else {},
    }


def _constraint(task: Task, constraint: Any, places: dict[str, int]) -> dict[str, Any]:
    scene = task.scene
    ends: list[Any] = [
        places[end] if isinstance(end, str) and end != WORLD else end for end in constraint.between
    ]
    if isinstance(constraint, Distance):
        if any(any(anchor) for anchor in constraint.anchors):
            raise NotSupported("cannon does not support a rod that ends beside a centre of mass")
        length = scene.length(constraint) if constraint.rest_length is None else constraint.rest_length
        return {"kind": "distance", "name": constraint.name, "ends": ends, "length": length}
    at = joint_point(scene, constraint)
    ends = [list(at) if end == WORLD else end for end in ends]
    kind = {Ball: "ball", Lock: "lock", Hinge: "hinge"}[type(constraint)]
    return {
        "kind": kind,
        "ends": ends,
        "at": list(at),
        "axis": list(getattr(constraint, "axis", (0.0, 0.0, 1.0))),
    }


ENGINE = Cannon()

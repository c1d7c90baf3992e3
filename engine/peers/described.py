"""A task as JSON takes it: what every engine run by Node is told of a scene. World axes, SI, at the start."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..bodies import WORLD, Particle, RigidBody
from ..forces import CentralGravity, Load, Spring
from ..joints import Joint
from ..meshes import HeightField, TriangleMesh
from ..protocol import Task
from ..shapes import Box, Capsule, Compound, ConvexHull, Cylinder, Plane, Shape, Sphere
from . import node

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def described(task: Task, folder: Path, constraints: list[dict[str, Any]]) -> dict[str, Any]:
    """Everything but the constraints, which each engine wants in its own words.

    `apart` are the pairs, by their places among the bodies, that must not touch: those named and those joined.
    """
    scene = task.scene
    places = numbered(task)
    return {
        "module": node.entry(folder),
        "gravity": scene.gravity,
        "time_step": task.time_step,
        "steps": task.steps,
        "every_step": task.every_step,
        "time_limit": task.time_limit,
        "options": dict(task.configuration.options),
        "contacts": scene.contacts,
        "apart": apart(task, places),
        "bodies": [_body(body) for body in scene.bodies],
        "constraints": constraints,
        "loads": [
            {"body": places[f.body], "force": f.force, "torque": f.torque}
            for f in scene.forces
            if isinstance(f, Load)
        ],
        "fields": [
            {"centre": f.centre, "strength": f.strength}
            for f in scene.forces
            if isinstance(f, CentralGravity)
        ],
        "springs": [
            {
                "ends": [places[end] if isinstance(end, str) else end for end in f.between],
                "stiffness": f.stiffness,
                "rest": f.rest_length,
                "viscosity": f.viscosity,
                "anchors": f.anchors,
            }
            for f in scene.forces
            if isinstance(f, Spring)
        ],
    }


def numbered(task: Task) -> dict[str, int]:
    """Each body's place in the lists."""
    return {body.name: place for place, body in enumerate(task.scene.bodies)}


def apart(task: Task, places: Mapping[str, int]) -> list[tuple[int, ...]]:
    """Pairs that must not touch."""
    scene = task.scene
    joined = [c.between for c in scene.constraints if isinstance(c, Joint) and WORLD not in c.between]
    return sorted({tuple(sorted((places[a], places[b]))) for a, b in (*scene.no_contact, *joined)})


def _body(body: Particle | RigidBody) -> dict[str, Any]:
    if isinstance(body, Particle):
        return {
            "motion": "particle",
            "mass": body.mass,
            "inertia": (0.0, 0.0, 0.0),
            "position": body.position,
            "velocity": body.velocity,
            "orientation": UPRIGHT,
            "spin": (0.0, 0.0, 0.0),
            "friction": 0.0,
            "restitution": 0.0,
            "belt": None,
            "shape": None,
        }
    moves = body.motion == "dynamic"
    return {
        "motion": body.motion,
        "mass": body.mass if moves else 0.0,
        "inertia": body.inertia if moves else (0.0, 0.0, 0.0),
        "position": body.position,
        "velocity": body.velocity,
        "orientation": body.orientation,
        "spin": body.angular_velocity,
        "friction": body.material.friction,
        "restitution": body.material.restitution,
        "belt": body.surface_velocity if any(body.surface_velocity) else None,
        "shape": None if body.shape is None else _shape(body.shape),
    }


def _shape(shape: Shape) -> dict[str, Any]:
    """`turn` carries the engine's own z axis onto the shape's: a plane's normal."""
    if isinstance(shape, Sphere):
        return {"kind": "sphere", "radius": shape.radius, "turn": UPRIGHT}
    if isinstance(shape, Box):
        return {"kind": "box", "half": [0.5 * edge for edge in shape.size], "turn": UPRIGHT}
    if isinstance(shape, Capsule):
        return {"kind": "capsule", "radius": shape.radius, "half": 0.5 * shape.length, "turn": UPRIGHT}
    if isinstance(shape, Cylinder):
        return {"kind": "cylinder", "radius": shape.radius, "half": 0.5 * shape.length, "turn": UPRIGHT}
    if isinstance(shape, ConvexHull):
        return {"kind": "hull", "corners": shape.corners, "turn": UPRIGHT}
    if isinstance(shape, TriangleMesh | HeightField):
        return {"kind": "mesh", "corners": shape.corners, "faces": shape.faces, "turn": UPRIGHT}
    if isinstance(shape, Compound):
        parts = [{"shape": _shape(p.shape), "at": p.position, "turn": p.orientation} for p in shape.parts]
        return {"kind": "compound", "parts": parts, "turn": UPRIGHT}
    assert isinstance(shape, Plane)
    return {"kind": "plane", "normal": list(shape.normal), "turn": list(upwards(shape.normal))}


def upwards(normal: tuple[float, float, float]) -> Any:
    """The turn (w, x, y, z) that carries z onto a plane's normal."""
    x, y, z = normal
    turn = np.array([1.0 + z, -y, x, 0.0]) if z > -1.0 + 1e-12 else np.array([0.0, 1.0, 0.0, 0.0])
    return turn / np.linalg.norm(turn)

"""A joint as engines want it that hold each end in axes of its own: point and turn there, x along the joint's axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..bodies import WORLD, Particle
from ..joints import Prismatic, frictions
from ..protocol import NotSupported
from ..recorded_joints import conjugate, joint_point, product, turned_back
from ..result import Array
from ..scene import Scene

RIGID_DRIVE = 1e6  # N s/m or N m s, at least
FIRM = 1e3  # 1: what a drive resists in a step, over what is to be moved
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class End:
    """Where a joint is on one of its ends, in the axes of that body at the start."""

    point: tuple[float, float, float]  # m
    turn: Array  # (w, x, y, z): carries x onto the joint's axis


def ends_of(scene: Scene, joint: Any) -> tuple[End, End]:
    """Both ends of a joint, in its order; the world's is in world axes."""
    at = joint_point(scene, joint)
    axes = along(getattr(joint, "axis", (1.0, 0.0, 0.0)))
    found = []
    for name in joint.between:
        body = None if name == WORLD else scene.body(name)
        place = np.zeros(3) if body is None else np.array(body.position)
        turn = UPRIGHT if body is None or isinstance(body, Particle) else np.array(body.orientation)
        x, y, z = turned_back(turn, at - place)
        found.append(End((float(x), float(y), float(z)), product(conjugate(turn), axes)))
    return found[0], found[1]


def drive(joint: Any, engine: str) -> tuple[float, float | None] | None:
    """Speed and largest force [N or N m; None is unbounded] of what drives or brakes a joint: friction is a motor that is to
    stand still. Raises NotSupported for both at once."""
    motor, dry = getattr(joint, "motor", None), max(frictions(joint)[0])
    if motor is None:
        return (0.0, dry) if dry else None
    if dry:
        raise NotSupported(f"{engine} does not support friction in {joint.name!r}, which a motor drives")
    return float(motor.speed), None if motor.max_force is None else float(motor.max_force)


def drive_damping(scene: Scene, joint: Any, time_step: float) -> float:
    """Of a drive that is a damper solved implicitly [N s/m or N m s]: enough for all that it may have to move."""
    load = _moved(scene) if isinstance(joint, Prismatic) else turned_inertia(scene, joint)
    return max(RIGID_DRIVE, FIRM * load / time_step)


def turned_inertia(scene: Scene, joint: Any) -> float:
    """Moment of inertia of all that moves, about a joint, at most [kg m²]."""
    at = joint_point(scene, joint)
    return sum(
        mass * float(np.sum((np.array(body.position) - at) ** 2)) + max(getattr(body, "inertia", (0.0,)))
        for body, mass in _masses(scene)
    )


def _moved(scene: Scene) -> float:
    return sum(mass for _, mass in _masses(scene))


def _masses(scene: Scene) -> list[tuple[Any, float]]:
    """Bodies that move by what pushes them, with their masses [kg]."""
    return [(b, float(b.mass or 0.0)) for b in scene.bodies if getattr(b, "motion", "dynamic") == "dynamic"]


def along(axis: tuple[float, float, float]) -> Array:
    """The turn (w, x, y, z) that carries x onto an axis of unit length."""
    x, y, z = axis
    turn = np.array([1.0 + x, 0.0, -z, y]) if x > -1.0 + 1e-12 else np.array([0.0, 0.0, 0.0, 1.0])
    return np.asarray(turn / np.linalg.norm(turn))


def xyzw(turn: Array) -> tuple[float, float, float, float]:
    """The same turn with its scalar last."""
    w, x, y, z = (float(part) for part in turn)
    return x, y, z, w

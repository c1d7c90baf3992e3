"""How far recorded bodies violate a joint, and its free coordinate; the conventions are those of rigid_program."""

from __future__ import annotations

import math

import numpy as np

from .bodies import WORLD, RigidBody
from .couplings import Relation, Wire
from .errors import MethodError
from .joints import (
    AxialJoint,
    Ball,
    Constraint,
    Distance,
    GuidedJoint,
    Joint,
    Lock,
    Prismatic,
    Universal,
)
from .result import Array
from .rigid_program import normals
from .scene import Scene
from .tyres import Tyre


def cross(a: Array, b: Array) -> Array:
    """a × b for (..., 3). NumPy's own spends 30 µs a call on what it might be given: most of a sample's reading."""
    if a.ndim == 1 and b.ndim == 1:
        (x, y, z), (u, v, w) = a.tolist(), b.tolist()
        return np.array([y * w - z * v, z * u - x * w, x * v - y * u])
    found = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        found[..., k] = a[..., i] * b[..., j] - a[..., j] * b[..., i]
    return found


def turned(orientations: Array, vectors: Array) -> Array:
    """Vectors in body axes seen in world axes; (..., 4) and (..., 3)."""
    w, u = orientations[..., :1], orientations[..., 1:]
    twice = 2.0 * cross(u, vectors)
    return np.asarray(vectors + w * twice + cross(u, twice))


def turned_back(orientations: Array, vectors: Array) -> Array:
    """Vectors in world axes seen in body axes."""
    return turned(conjugate(orientations), vectors)


def conjugate(orientations: Array) -> Array:
    """The opposite rotation."""
    return np.asarray(orientations * np.array([1.0, -1.0, -1.0, -1.0]))


def product(a: Array, b: Array) -> Array:
    """The rotation b, then a."""
    scalar = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(axis=-1, keepdims=True)
    vector = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + cross(a[..., 1:], b[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def joint_point(scene: Scene, joint: Joint) -> Array:
    """Where a joint sits at the start, in world axes [m]."""
    if joint.at is not None:
        return np.array(joint.at)
    ends = [end for end in reversed(joint.between) if end != WORLD]
    return np.array(scene.body(ends[0]).position)


class _End:
    """One end of a joint along the recording: where a point and the turn since the start are."""

    def __init__(self, scene: Scene, name: str, positions: Array, orientations: Array) -> None:
        samples = len(positions)
        self.start, self.turn = np.zeros(3), np.tile([1.0, 0.0, 0.0, 0.0], (samples, 1))
        self.place = np.zeros((samples, 3))
        if name == WORLD:
            return
        index = next(i for i, body in enumerate(scene.bodies) if body.name == name)
        body = scene.bodies[index]
        self.start, self.place = np.array(body.position), positions[:, index]
        if isinstance(body, RigidBody):
            first = conjugate(np.array(body.orientation))
            self.turn = product(orientations[:, index], np.broadcast_to(first, (samples, 4)))

    def point(self, at: Array) -> Array:
        """World positions (s, 3) of a point given at the start."""
        return np.asarray(self.place + turned(self.turn, np.broadcast_to(at - self.start, self.place.shape)))

    def direction(self, axis: Array) -> Array:
        """World directions (s, 3) of a direction given at the start."""
        return turned(self.turn, np.broadcast_to(axis, self.place.shape))


def violation(scene: Scene, constraint: Constraint, positions: Array, orientations: Array) -> Array:
    """(s,) m of a distance, (s, rows) m and rad of a joint."""
    if isinstance(constraint, Relation | Wire | Tyre):
        raise MethodError(f"observe: {constraint.kind} {constraint.name!r} is not found in a recording")
    if isinstance(constraint, Distance):
        ends = [
            np.asarray(scene.anchor(constraint, k))
            if not isinstance(where, str)
            else _End(scene, where, positions, orientations).point(np.array(scene.anchor(constraint, k)))
            for k, where in enumerate(constraint.between)
        ]
        rest = scene.length(constraint) if constraint.rest_length is None else constraint.rest_length
        return np.asarray(np.linalg.norm(ends[1] - ends[0], axis=-1) - rest)
    first, second = (_End(scene, name, positions, orientations) for name in constraint.between)
    at = joint_point(scene, constraint)
    gap = second.point(at) - first.point(at)
    axes = _axes(constraint)
    rows = [(first.direction(axis) * gap).sum(axis=1) for axis in axes]
    rows = rows[slice(*constraint.holds)]
    relative = _relative(first, second)
    part = relative[:, 1:]
    if constraint.turning == "held":
        rows += [2.0 * part @ axis for axis in axes]
    elif constraint.turning == "swing":
        moved = turned(relative, np.broadcast_to(axes[0], part.shape)) - axes[0]
        rows += [-moved @ axes[2], moved @ axes[1]]
    elif constraint.turning == "cross":
        moved = turned(relative, np.broadcast_to(axes[1], part.shape)) - axes[1]
        rows.append(moved @ axes[0])
    return np.stack(rows, axis=1)


def coordinate(scene: Scene, joint: Constraint, positions: Array, orientations: Array) -> Array:
    """Free coordinate (s,) of a hinge [rad] or prismatic joint [m]; turns are counted."""
    if not isinstance(joint, AxialJoint):
        raise MethodError(f"observe: {joint.name!r} is no hinge or prismatic joint and has no coordinate")
    first, second = (_End(scene, name, positions, orientations) for name in joint.between)
    axis = np.array(joint.axis)
    if isinstance(joint, Prismatic):
        at = joint_point(scene, joint)
        return np.asarray((first.direction(axis) * (second.point(at) - first.point(at))).sum(axis=1))
    relative = _relative(first, second)
    return np.unwrap(2.0 * np.arctan2(relative[:, 1:] @ axis, relative[:, 0]), period=2.0 * math.pi)


def _relative(first: _End, second: _End) -> Array:
    """The turn of the second end seen from the first, its real part not negative."""
    turn = product(conjugate(first.turn), second.turn)
    return np.where(turn[:, :1] < 0.0, -turn, turn)


def _axes(joint: Joint) -> tuple[Array, Array, Array]:
    """The directions in which a joint's rows are counted, at the start."""
    if isinstance(joint, AxialJoint | GuidedJoint):
        one, two = normals(joint.axis)
        return np.array(joint.axis), np.array(one), np.array(two)
    if isinstance(joint, Universal):
        axis, aside = np.array(joint.axis), np.array(joint.cross_axis)
        return axis, aside, cross(axis, aside)
    assert isinstance(joint, Ball | Lock)
    return np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])

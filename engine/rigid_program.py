"""Rigid bodies: pack a scene for the native pipeline, choose the stages, say why.

Conventions. The frame of a joint is fixed to its first body. Violations [m, rad] are measured in that frame:
translations along the world axes of the start (ball, lock), along (axis, cross axis, their normal) (universal) or
along (axis, normal, normal); rotations of lock and prismatic are twice the vector part of the relative quaternion;
those of a hinge are axis × (axis carried by the second body) along the normals; universal: axis · (cross axis
carried by the second). The normals of an axis are `normals(axis)`. The order of rows is that of engine.joints.
The row that drives a hinge, its motor and spring, is (axis carried by the first body) · (w2 − w1) with the angular
velocities w1, w2; that is the gradient of the angle only where the other rows of the hinge are not violated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from spook_tracker.engine import _core
from spook_tracker.engine.bodies import Particle, RigidBody
from spook_tracker.engine.check import Vector
from spook_tracker.engine.errors import MethodError
from spook_tracker.engine.forces import CentralGravity, Load, Spring
from spook_tracker.engine.joints import (
    AxialJoint,
    Ball,
    Constraint,
    Distance,
    Hinge,
    Joint,
    Lock,
    Prismatic,
    Universal,
)
from spook_tracker.engine.method import Method
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.program import Program, distinct_quantities, observation_tuples
from spook_tracker.engine.rigid_quantities import request
from spook_tracker.engine.rigid_stages import choose
from spook_tracker.engine.scene import Scene
from spook_tracker.engine.shapes import Box, Capsule, Compound, Plane, Shape, Sphere
from spook_tracker.engine.smooth import check_rigid

_MOTIONS = {"dynamic": 0, "static": 1, "kinematic": 2}
_JOINTS: dict[type[Constraint], int] = {Distance: 0, Lock: 1, Ball: 2, Hinge: 3, Prismatic: 4, Universal: 5}
_SOLVERS = {"direct": 0, "iterative": 1, "hybrid": 2}
_FRICTION = {"cone": 0, "box": 1, "scaled_box": 2}
_ORIGIN: Vector = (0.0, 0.0, 0.0)
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
_WORLD_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def compile_rigid(
    scene: Scene, time_step: float, method: Method, observe: Mapping[str, Observable]
) -> Program:
    """The Program of a scene with at least one rigid body."""
    field = lacking(method)
    if field is not None:
        raise MethodError(f"method: {field} is for scenes of particles only; leave it out for rigid bodies")
    requests, shapes = [], {}
    for quantity in distinct_quantities(observe):
        wanted, shapes[quantity] = request(quantity, scene)
        requests.append(wanted)
    native = _core.RigidProgram(
        **pack(scene, time_step, method), quantities=requests, observations=observation_tuples(observe)
    )
    check_rigid(scene, method, native.contacts_possible)
    return Program(
        native,
        time_step=time_step,
        choices=choose(scene, method, observe, native.solver, native.contacts_possible),
        bodies=[body.name for body in scene.bodies],
        observe=observe,
        shapes=[shapes[what.quantity] for what in observe.values()],
    )


def normals(axis: Vector) -> tuple[Vector, Vector]:
    """Two unit vectors that make a right-handed frame with `axis`: the first lies nearest to the world axis
    that is farthest from it (x before y before z)."""
    least = min(range(3), key=lambda i: abs(axis[i]))
    along = axis[least]
    raw = [float(i == least) - along * axis[i] for i in range(3)]
    length = math.hypot(*raw)
    x, y, z = (value / length for value in raw)
    a, b, c = axis
    return (x, y, z), (b * z - c * y, c * x - a * z, a * y - b * x)


def pack(scene: Scene, time_step: float, method: Method) -> dict[str, Any]:
    """The arguments of the native program, except what is observed: indices for names, no defaults left."""
    bodies = {body.name: index for index, body in enumerate(scene.bodies)}
    step = time_step / method.substeps
    pushes = np.zeros((len(bodies), 6))
    fields, springs, spring_ends = [], [], []
    for force in scene.forces:
        if isinstance(force, Load):
            pushes[bodies[force.body]] += (*force.force, *force.torque)
        elif isinstance(force, CentralGravity):
            fields.append((force.strength, *force.centre))
        elif isinstance(force, Spring):
            spring_ends.append([bodies[end] if isinstance(end, str) else -1 for end in force.between])
            points = [_ORIGIN if isinstance(end, str) else end for end in force.between]
            springs.append((*points[0], *points[1], force.stiffness, force.rest_length, force.viscosity))
    body_kinds, body_rows = [], []
    for body, push in zip(scene.bodies, pushes, strict=True):
        kind, row = _body(body, push, step, turning="rotation" in method.force_stages)
        body_kinds.append(kind)
        body_rows.append(row)
    joint_kinds, joint_rows = [], []
    for constraint in scene.constraints:
        kinds, numbers = _constraint(scene, constraint, bodies, step)
        joint_kinds.append(kinds)
        joint_rows.append(numbers)
    collider_kinds, colliders = _colliders(scene)
    apart = [(bodies[first], bodies[second]) for first, second in scene.no_contact]
    apart += [(kinds[1], kinds[2]) for kinds in joint_kinds if min(kinds[1], kinds[2]) >= 0]

    def table(rows: list[Any], columns: int) -> np.ndarray[Any, np.dtype[np.float64]]:
        return np.array(rows, dtype=np.float64).reshape(-1, columns)

    def indices(rows: list[Any], columns: int) -> np.ndarray[Any, np.dtype[np.int64]]:
        return np.array(rows, dtype=np.int64).reshape(-1, columns)

    return {
        "body_kinds": indices(body_kinds, 2),
        "bodies": table(body_rows, 28),
        "joint_kinds": indices(joint_kinds, 6),
        "joints": table(joint_rows, 37),
        "spring_ends": indices(spring_ends, 2),
        "springs": table(springs, 9),
        "fields": table(fields, 4),
        "collider_kinds": indices(collider_kinds, 2),
        "colliders": table(colliders, 10),
        "no_contact": indices(apart, 2),
        "gravity": scene.gravity,
        "method": {
            "time_step": time_step,
            "substeps": method.substeps,
            "refinements": method.refinements,
            "floor": method.floor,
            "solver": _SOLVERS[method.solver],
            "friction": _FRICTION[method.friction],
            "iterations": method.iterations,
            "residual_tolerance": method.residual_tolerance,
            "composition": {"none": 2, "order4": 4, "order6": 6, "order8": 8}[method.composition],
            "half_step_velocities": method.half_step_velocities,
            "corrections": method.corrections,
            "correction_cap": method.correction_cap,
            "string_stiffness": method.string_stiffness,
            "force_collision": "collision" in method.force_stages,
        },
    }


def lacking(method: Method) -> str | None:
    """The first option that scenes with rigid bodies do not have and that is not at its default; None if all is
    well."""
    for field, plain in (("string_stiffness", False),):
        if getattr(method, field) != plain:
            return field
    return None


def _body(
    body: Particle | RigidBody, push: Any, step: float, *, turning: bool
) -> tuple[tuple[int, int], tuple[float, ...]]:
    """`turning` gives a particle an inertia, to measure what its rotation would cost."""
    if isinstance(body, Particle):
        place = (*body.position, *_UPRIGHT, *body.velocity, *_ORIGIN)
        inertia = (body.mass,) * 3 if turning else _ORIGIN
        return (0, int(not turning)), (body.mass, *inertia, *place, *push, 0.0, 0.0, 0.0, 4.5 * step, 0.0)
    material = body.material
    surface = (
        material.friction,
        material.restitution,
        material.compliance,
        4.5 * step if material.damping is None else material.damping,
        material.slip_compliance,
    )
    place = (*body.position, *body.orientation, *body.velocity, *body.angular_velocity)
    dynamic = body.motion == "dynamic"
    mass = body.mass if dynamic and body.mass is not None else 0.0
    inertia = body.inertia if dynamic and body.inertia is not None else _ORIGIN
    return (_MOTIONS[body.motion], 0), (mass, *inertia, *place, *push, *surface)


def _constraint(
    scene: Scene, constraint: Constraint, bodies: Mapping[str, int], step: float
) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """Kinds and numbers of one joint, as documented at the native program."""
    default = 2.0 * step
    first, second = (bodies.get(end, -1) if isinstance(end, str) else -1 for end in constraint.between)
    if isinstance(constraint, Distance):
        length = constraint.rest_length
        if length is None:
            length = scene.length(constraint)
        points = (*scene.anchor(constraint, 0), *scene.anchor(constraint, 1))
        kinds: tuple[int, ...] = (0, first, second, 0, 0, 0)
        softness = (*_six(constraint.compliance), *_six(_or(constraint.damping, default)))
        return kinds, (*points, *_WORLD_AXES, length, *softness, *[0.0] * 9)
    at = constraint.at
    if at is None:
        end = constraint.between[1] if second >= 0 else constraint.between[0]
        at = scene.body(end).position
    damping = default if constraint.damping is None else constraint.damping
    motor, limit, spring = (
        (constraint.motor, constraint.limit, constraint.spring)
        if isinstance(constraint, AxialJoint)
        else (None, None, None)
    )
    numbers = [*at, *at, *_axes(constraint), 0.0, *_six(constraint.compliance), *_six(damping)]
    numbers += [motor.speed, _or(motor.max_force, math.inf)] if motor else [0.0, 0.0]
    numbers += (
        [limit.lower, limit.upper, limit.compliance, _or(limit.damping, default)] if limit else [0.0] * 4
    )
    numbers += [spring.stiffness, spring.rest, _or(spring.damping, default)] if spring else [1.0, 0.0, 0.0]
    free = (int(motor is not None), int(limit is not None), int(spring is not None))
    return (_JOINTS[type(constraint)], first, second, *free), tuple(numbers)


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


def _six(value: float | tuple[float, ...]) -> tuple[float, ...]:
    if isinstance(value, tuple):
        return (*value, *[0.0] * (6 - len(value)))
    return (value,) * 6


def _axes(joint: Joint) -> tuple[float, ...]:
    if isinstance(joint, AxialJoint):
        first, second = normals(joint.axis)
        return (*joint.axis, *first, *second)
    if isinstance(joint, Universal):
        (a, b, c), (x, y, z) = joint.axis, joint.cross_axis
        return (a, b, c, x, y, z, b * z - c * y, c * x - a * z, a * y - b * x)
    return _WORLD_AXES


def _colliders(scene: Scene) -> tuple[list[tuple[int, int]], list[tuple[float, ...]]]:
    kinds: list[tuple[int, int]] = []
    rows: list[tuple[float, ...]] = []
    if not scene.contacts:
        return kinds, rows
    for index, body in enumerate(scene.bodies):
        if not isinstance(body, RigidBody) or body.shape is None:
            continue
        placed = (
            [(part.position, part.orientation, part.shape) for part in body.shape.parts]
            if isinstance(body.shape, Compound)
            else [(_ORIGIN, _UPRIGHT, body.shape)]
        )
        for place, turn, shape in placed:
            kind, size = _primitive(shape)
            kinds.append((index, kind))
            rows.append((*place, *turn, *size))
    return kinds, rows


def _primitive(shape: Shape) -> tuple[int, Vector]:
    if isinstance(shape, Sphere):
        return 0, (shape.radius, 0.0, 0.0)
    if isinstance(shape, Capsule):
        return 1, (shape.radius, shape.length, 0.0)
    if isinstance(shape, Box):
        return 2, shape.size
    assert isinstance(shape, Plane)
    return 3, shape.normal

"""Rigid bodies: pack a scene for the native pipeline, which chooses its stages.

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

from . import _core
from .bodies import Particle, RigidBody
from .check import Vector
from .couplings import Relation, Wire
from .errors import MethodError
from .forces import CentralGravity, Fluid, Load, Spring
from .joint_tables import couplings, drives, or_default
from .joints import (
    AxialJoint,
    Constraint,
    Distance,
    GuidedJoint,
    Joint,
    Universal,
)
from .method import Method
from .observe import Observable
from .particle_program import ends
from .program import Program, observations, table
from .quantities import requests
from .scene import Scene, wire_length
from .smooth import check_rigid, check_trees, check_wide_rows
from .surface_tables import Outlined, hull_tables, surfaces
from .time_functions import Ramp, Sinusoid, TimeFunction
from .tyres import Tyre
from .watch import in_time, time_left

_MOTIONS = {"dynamic": "dynamic", "static": "fixed", "kinematic": "kinematic"}
_ORIGIN: Vector = (0.0, 0.0, 0.0)
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
_UNIT: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_WORLD_AXES = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def compile_rigid(
    scene: Scene, time_step: float, method: Method, observe: Mapping[str, Observable], held: bool = False
) -> Program:
    """The Program of a scene with at least one rigid body; `held`: its loads may be set."""
    check_wide_rows(scene, method)
    if method.runge_kutta != "none":
        check_trees(scene, method)
    quantities, shapes = requests(scene, observe)
    packed = pack(scene, time_step, method, held)
    try:
        native = _core.RigidProgram(packed, quantities, observations(observe), time_left())
    except ValueError as error:
        if method.runge_kutta == "none":
            raise
        raise MethodError(str(error)) from None
    names = [body.name for body in scene.bodies]
    program = Program(
        native,
        time_step=time_step,
        bodies=names,
        joints=[constraint.name for constraint in scene.constraints],
        observe=observe,
        shapes=shapes,
    )
    check_rigid(
        scene, method, touching="impact" in {stage.stage for stage in program.explain() if stage.kept}
    )
    return program


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


def pack(scene: Scene, time_step: float, method: Method, held: bool = False) -> dict[str, Any]:
    """The scene as the native program takes it: tables with indices for names, no defaults left."""
    bodies = {body.name: index for index, body in enumerate(scene.bodies)}
    step = time_step / method.substeps
    pushes = np.zeros((len(bodies), 6))
    fields, springs = [], []
    for force in scene.forces:
        if isinstance(force, Load) and force.factor is None:
            pushes[bodies[force.body]] += (*force.force, *force.torque)
        elif isinstance(force, CentralGravity):
            fields.append({"strength": force.strength, "centre": force.centre})
        elif isinstance(force, Spring):
            columns = ends(force.between, bodies)
            for end, anchor, side in zip(force.between, force.anchors, ("first", "second"), strict=True):
                if isinstance(end, str):
                    columns[f"{side}_point"] = anchor
            springs.append(
                columns
                | {
                    "stiffness": force.stiffness,
                    "rest_length": force.rest_length,
                    "viscosity": force.viscosity,
                }
            )
    hulls: dict[Outlined, int] = {}
    joints = [_joint(scene, constraint, bodies, step) for constraint in in_time(scene.constraints)]
    apart = [{"first": bodies[first], "second": bodies[second]} for first, second in scene.no_contact]
    apart += [
        {"first": joint["first"], "second": joint["second"]}
        for joint in joints
        if min(joint["first"], joint["second"]) >= 0 and joint["kind"] not in ("relation", "wire")
    ]
    return {
        "bodies": table(
            [_body(body, push, step) for body, push in in_time(zip(scene.bodies, pushes, strict=True))]
        ),
        "joints": table(joints),
        **drives(scene, step),
        **couplings(scene, bodies),
        **_fluids(scene, hulls),
        **_in_time(scene, bodies),
        "springs": table(springs),
        "fields": table(fields),
        "colliders": table(surfaces(scene, hulls) if scene.contacts else []),
        **hull_tables(hulls),
        "no_contact": table(apart),
        "pair_frictions": table(
            [
                {
                    "first": bodies[pair.between[0]],
                    "second": bodies[pair.between[1]],
                    "friction": pair.friction,
                    "rolling_friction": pair.rolling_friction,
                    "torsional_friction": pair.torsional_friction,
                }
                for pair in scene.pair_frictions
            ]
        ),
        "contacts": scene.contacts,
        "gravity": scene.gravity,
        "loads_change": held and any(isinstance(force, Load) for force in scene.forces),
        "method": {
            "time_step": time_step,
            "substeps": method.substeps,
            "refinements": method.refinements,
            "floor": method.floor,
            "solver": method.solver,
            "friction": method.friction,
            "impacts": method.impacts,
            "unsettled_residual": method.residual_of("unsettled_residual", scene),
            "sleep_speed": method.sleep_speed,
            "sleep_after": method.sleep_after,
            "iterations": method.iterations,
            "residual_tolerance": method.residual_of("residual_tolerance", scene),
            "composition": method.composition,
            "runge_kutta": method.runge_kutta != "none",
            "tolerance": method.tolerance,
            "string_stiffness": method.string_stiffness,
            "half_step_velocities": method.half_step_velocities,
            "linear_turns": method.turns == "linear",
            "corrections": method.corrections,
            "correction_cap": method.correction_cap,
            "force_collision": "collision" in method.force_stages,
            "force_rotation": "rotation" in method.force_stages,
            "force_block": "solve_block" in method.force_stages,
        },
    }


def _body(body: Particle | RigidBody, push: Any, step: float) -> dict[str, Any]:
    columns: dict[str, Any] = {
        "motion": "dynamic",
        "particle": True,
        "mass": body.mass,
        "inertia": _ORIGIN,
        "inertia_axes": _UPRIGHT,
        "position": body.position,
        "orientation": _UPRIGHT,
        "velocity": body.velocity,
        "angular_velocity": _ORIGIN,
        "force": push[:3],
        "torque": push[3:],
        "friction": 0.0,
        "restitution": 0.0,
        "tangential_restitution": 0.0,
        "compliance": 0.0,
        "damping": 4.5 * step,
        "slip_compliance": 0.0,
        "rolling_friction": 0.0,
        "torsional_friction": 0.0,
        "surface_velocity": _ORIGIN,
        "friction_across": 0.0,
        "friction_direction": _ORIGIN,
    }
    if isinstance(body, Particle):
        return columns
    material = body.material
    dynamic = body.motion == "dynamic"
    return columns | {
        "motion": _MOTIONS[body.motion],
        "particle": False,
        "mass": body.mass if dynamic and body.mass is not None else 0.0,
        "inertia": body.inertia if dynamic and body.inertia is not None else _ORIGIN,
        "inertia_axes": body.inertia_axes if dynamic else _UPRIGHT,
        "orientation": body.orientation,
        "angular_velocity": body.angular_velocity,
        "friction": material.friction,
        "restitution": material.restitution,
        "tangential_restitution": material.tangential_restitution,
        "compliance": material.compliance,
        "damping": or_default(material.damping, 4.5 * step),
        "slip_compliance": material.slip_compliance,
        "rolling_friction": material.rolling_friction,
        "torsional_friction": material.torsional_friction,
        "surface_velocity": body.surface_velocity,
        "friction_across": material.friction_across if material.oriented else 0.0,
        "friction_direction": material.friction_direction if material.oriented else _ORIGIN,
    }


def _joint(scene: Scene, constraint: Constraint, bodies: Mapping[str, int], step: float) -> dict[str, Any]:
    columns: dict[str, Any] = {
        "kind": constraint.kind.replace(" ", "_"),
        **{
            side: bodies.get(end, -1) if isinstance(end, str) else -1
            for side, end in zip(("first", "second"), constraint.between, strict=True)
        },
        "compliance": _six(constraint.compliance),
        "damping": _six(2.0 * step if constraint.damping is None else constraint.damping),
        "one_sided": False,
        "restitution": 0.0,
        "strength": or_default(getattr(constraint, "strength", None), math.inf),
        "torque_strength": or_default(getattr(constraint, "torque_strength", None), math.inf),
    }
    if isinstance(constraint, Relation | Wire):
        columns |= {"first_point": _ORIGIN, "second_point": _ORIGIN, "axes": _WORLD_AXES, "rest_length": 0.0}
        if isinstance(constraint, Wire):
            columns |= {"one_sided": constraint.slack, "restitution": constraint.restitution}
            columns["rest_length"] = wire_length(constraint)
        return columns
    if isinstance(constraint, Distance):
        length = constraint.rest_length
        return columns | {
            "first_point": scene.anchor(constraint, 0),
            "second_point": scene.anchor(constraint, 1),
            "axes": _WORLD_AXES,
            "rest_length": scene.length(constraint) if length is None else length,
        }
    if isinstance(constraint, Tyre):
        wheel = scene.body(constraint.between[1])
        axes = (*constraint.axis, *constraint.normal, *_ORIGIN)
        return columns | {
            "first_point": constraint.at,
            "second_point": wheel.position,
            "axes": axes,
            "rest_length": 0.0,
        }
    at = constraint.at
    if at is None:
        end = constraint.between[1] if columns["second"] >= 0 else constraint.between[0]
        at = scene.body(end).position
    return columns | {"first_point": at, "second_point": at, "axes": _axes(constraint), "rest_length": 0.0}


def _fluids(scene: Scene, hulls: dict[Outlined, int]) -> dict[str, Any]:
    """Fluids, and the surfaces of dynamic bodies that displace them."""
    down = math.hypot(*scene.gravity)
    fluids = [
        {
            "density": fluid.density,
            "level": fluid.level,
            "up": tuple(-g / down for g in scene.gravity),
            "velocity": fluid.velocity,
            "drag": fluid.drag_coefficient,
        }
        for fluid in scene.forces
        if isinstance(fluid, Fluid)
    ]
    floaters = (
        [part for part in surfaces(scene, hulls) if _moves(scene.bodies[part["body"]])] if fluids else []
    )
    return {"fluids": table(fluids), "floaters": table(floaters)}


def _moves(body: Particle | RigidBody) -> bool:
    return isinstance(body, Particle) or body.motion == "dynamic"


def _in_time(scene: Scene, bodies: Mapping[str, int]) -> dict[str, Any]:
    """What follows the time, and the knots of tables."""
    drives: list[dict[str, Any]] = []
    knots: list[dict[str, Any]] = []

    def add(
        kind: str, index: int, function: Any, linear: Vector = _ORIGIN, angular: Vector = _ORIGIN
    ) -> None:
        wave = isinstance(function, Sinusoid)
        if not wave:
            points = function.table() if isinstance(function, Ramp) else function
            for time, value in zip(points.times, points.values, strict=True):
                knots.append({"drive": len(drives), "time": time, "value": value})
        drives.append(
            {
                "kind": kind,
                "function": "sinusoid" if wave else "table",
                "index": index,
                "linear": linear,
                "angular": angular,
                "offset": function.offset if wave else 0.0,
                "amplitude": function.amplitude if wave else 0.0,
                "rate": 2.0 * math.pi * function.frequency if wave else 0.0,
                "phase": function.phase if wave else 0.0,
            }
        )

    for force in scene.forces:
        if isinstance(force, Load) and force.factor is not None:
            add("load", bodies[force.body], force.factor, force.force, force.torque)
    for index, joint in enumerate(scene.constraints):
        if isinstance(joint, AxialJoint):
            if joint.motor is not None:
                push = joint.motor.max_force if joint.motor.force is None else joint.motor.force
                if isinstance(joint.motor.speed, TimeFunction):
                    add("motor", index, joint.motor.speed)
                if isinstance(push, TimeFunction):
                    add("push", index, push)
            if joint.spring is not None and not isinstance(joint.spring.rest, float):
                add("rest", index, joint.spring.rest)
    for body in scene.bodies:
        if not isinstance(body, RigidBody):
            continue
        if body.pace is not None:
            add("pace", bodies[body.name], body.pace, body.velocity, body.angular_velocity)
        if body.spin_pace is not None:
            add("spin", bodies[body.name], body.spin_pace, angular=body.angular_velocity)
        for axis, place in zip(_UNIT, body.path or (), strict=False):
            if isinstance(place, TimeFunction):
                add("path", bodies[body.name], place, axis)
        if body.angle is not None:
            add("angle", bodies[body.name], body.angle, angular=body.angle_axis)
    return {"drives": table(drives), "knots": table(knots)}


def _six(value: float | tuple[float, ...]) -> tuple[float, ...]:
    if isinstance(value, tuple):
        return (*value, *[0.0] * (6 - len(value)))
    return (value,) * 6


def _axes(joint: Joint) -> tuple[float, ...]:
    if isinstance(joint, AxialJoint | GuidedJoint):
        first, second = normals(joint.axis)
        return (*joint.axis, *first, *second)
    if isinstance(joint, Universal):
        (a, b, c), (x, y, z) = joint.axis, joint.cross_axis
        return (a, b, c, x, y, z, b * z - c * y, c * x - a * z, a * y - b * x)
    return _WORLD_AXES

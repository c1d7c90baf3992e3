"""Tables of what joints have beyond two frames: drives, relations, wires with their eyes and drums, tyres."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from .couplings import Relation, Wire
from .joints import AxialJoint, frictions
from .program import table
from .scene import Scene
from .time_functions import at_start
from .tyres import Tyre


def drives(scene: Scene, step: float) -> dict[str, Any]:
    """Motors, limits, springs, friction and armature of the free coordinates, each with the index of its joint."""
    motors, limits, springs, rubbing, rotors = [], [], [], [], []
    for index, joint in enumerate(scene.constraints):
        constant, load = frictions(joint)
        if any(constant) or any(load):
            rubbing.append({"joint": index, "constant": constant, "load": load})
        if not isinstance(joint, AxialJoint):
            continue
        if joint.armature:
            rotors.append({"joint": index, "inertia": joint.armature})
        if (motor := joint.motor) is not None:
            pushes = motor.force is not None
            force = motor.force if motor.force is not None else motor.max_force
            motors.append(
                {
                    "joint": index,
                    "speed": 0.0 if motor.speed is None else at_start(motor.speed),
                    "max_force": math.inf if force is None else at_start(force),
                    "pushes": pushes,
                }
            )
        if (limit := joint.limit) is not None:
            limits.append(
                {
                    "joint": index,
                    "lower": limit.lower,
                    "upper": limit.upper,
                    "compliance": limit.compliance,
                    "damping": or_default(limit.damping, 2.0 * step),
                    "restitution": limit.restitution,
                }
            )
        if (spring := joint.spring) is not None:
            springs.append(
                {
                    "joint": index,
                    "stiffness": spring.stiffness,
                    "rest": at_start(spring.rest),
                    "damping": or_default(spring.damping, 2.0 * step),
                    "max_force": or_default(spring.max_force, math.inf),
                }
            )
    return {
        "motors": table(motors),
        "limits": table(limits),
        "joint_springs": table(springs),
        "joint_frictions": table(rubbing),
        "armatures": table(rotors),
    }


def couplings(scene: Scene, bodies: Mapping[str, int]) -> dict[str, Any]:
    """Joints of relations and drums, points of wires, those they rub on, and tyres, by the index of the constraint."""
    index = {constraint.name: k for k, constraint in enumerate(scene.constraints)}
    terms = [
        {"row": index[row.name], "joint": index[joint], "coefficient": factor}
        for row in scene.constraints
        if isinstance(row, Relation)
        for joint, factor in row.terms
    ]
    points = [
        {"wire": index[row.name], "body": bodies.get(end, -1), "point": point}
        for row in scene.constraints
        if isinstance(row, Wire)
        for end, point in row.through
    ]
    terms += [
        {"row": index[row.name], "joint": index[hinge], "coefficient": radius}
        for row in scene.constraints
        if isinstance(row, Wire)
        for hinge, radius in row.wound
    ]
    eyes = [
        {"wire": index[row.name], "point": place, "friction": friction, "turns": turns}
        for row in scene.constraints
        if isinstance(row, Wire)
        for place, friction, turns in row.eyes
    ]
    tyres = [
        {
            "joint": index[row.name],
            "radius": row.radius,
            "slip_stiffness": (row.longitudinal, row.cornering),
            "friction": row.friction,
        }
        for row in scene.constraints
        if isinstance(row, Tyre)
    ]
    return {
        "terms": table(terms),
        "wire_points": table(points),
        "eyes": table(eyes),
        "tyres": table(tyres),
    }


def or_default(value: float | None, default: float) -> float:
    """The value, unless there is none."""
    return default if value is None else value

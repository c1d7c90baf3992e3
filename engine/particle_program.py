"""Particles: pack a scene for the native pipeline, which chooses its stages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _core
from .errors import MethodError
from .forces import CentralGravity, End, Load, Spring
from .joints import Distance
from .method import Method
from .observe import Observable
from .program import Program, observations, table
from .quantities import requests
from .scene import Scene
from .smooth import check_smooth
from .watch import in_time, time_left

_ORIGIN = (0.0, 0.0, 0.0)


def compile_particles(
    scene: Scene, time_step: float, method: Method, observe: Mapping[str, Observable], held: bool = False
) -> Program:
    """The Program of a scene that has only particles, distances and forces; `held`: its loads may be set."""
    if method.string_stiffness and method.solver == "iterative":
        raise MethodError("method: string_stiffness needs the direct solver")
    if method.composition != "none":
        check_smooth(scene, method)
    quantities, shapes = requests(scene, observe)
    native = _core.ParticleProgram(
        pack(scene, time_step, method, held), quantities, observations(observe), time_left()
    )
    return Program(
        native,
        time_step=time_step,
        bodies=[body.name for body in scene.bodies],
        observe=observe,
        shapes=shapes,
    )


def pack(scene: Scene, time_step: float, method: Method, held: bool = False) -> dict[str, Any]:
    """The scene as the native program takes it: tables with indices for names, no defaults left."""
    bodies = {body.name: index for index, body in enumerate(scene.bodies)}
    loads = np.zeros((len(bodies), 3))
    fields, springs = [], []
    for force in scene.forces:
        if isinstance(force, Load):
            loads[bodies[force.body]] += force.force
        elif isinstance(force, CentralGravity):
            fields.append({"strength": force.strength, "centre": force.centre})
        elif isinstance(force, Spring):
            springs.append(
                ends(force.between, bodies)
                | {
                    "stiffness": force.stiffness,
                    "rest_length": force.rest_length,
                    "viscosity": force.viscosity,
                }
            )
    default_damping = 2.0 * time_step / method.substeps
    positions = {body.name: body.position for body in scene.bodies}
    rows = []
    for row in in_time(scene.constraints):
        assert isinstance(row, Distance)  # the scene refuses joints between particles
        length = row.rest_length
        if length is None:
            length = math.dist(*(positions[end] if isinstance(end, str) else end for end in row.between))
        rows.append(
            ends(row.between, bodies)
            | {
                "rest_length": length,
                "compliance": row.compliance,
                "damping": default_damping if row.damping is None else row.damping,
            }
        )
    return {
        "bodies": table(
            [
                {"mass": body.mass, "position": body.position, "velocity": body.velocity, "load": load}
                for body, load in zip(scene.bodies, loads, strict=True)
            ]
        ),
        "rows": table(rows),
        "springs": table(springs),
        "fields": table(fields),
        "gravity": scene.gravity,
        "loads_change": held and any(isinstance(force, Load) for force in scene.forces),
        "method": {
            "time_step": time_step,
            "substeps": method.substeps,
            "corrections": method.corrections,
            "correction_cap": method.correction_cap,
            "half_step_velocities": method.half_step_velocities,
            "string_stiffness": method.string_stiffness,
            "iterative": method.solver == "iterative",
            "force_block": "solve_block" in method.force_stages,
            "iterations": method.iterations,
            "residual_tolerance": method.residual_of("residual_tolerance", scene),
            "refinements": method.refinements,
            "floor": method.floor,
            "composition": method.composition,
        },
    }


def ends(between: tuple[End, End], bodies: Mapping[str, int]) -> dict[str, Any]:
    """Both ends as the native side takes them: the index of a body, or -1 and a point of the world."""
    first, second = between
    return {
        "first": bodies[first] if isinstance(first, str) else -1,
        "second": bodies[second] if isinstance(second, str) else -1,
        "first_point": _ORIGIN if isinstance(first, str) else first,
        "second_point": _ORIGIN if isinstance(second, str) else second,
    }

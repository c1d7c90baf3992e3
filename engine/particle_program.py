"""Particles: pack a scene for the native pipeline, choose the stages, say why."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from spook_tracker.engine import _core
from spook_tracker.engine.errors import MethodError
from spook_tracker.engine.forces import CentralGravity, End, Load, Spring
from spook_tracker.engine.joints import Distance
from spook_tracker.engine.method import Method
from spook_tracker.engine.observe import (
    AngularMomentum,
    AngularVelocity,
    ConstraintForce,
    ContactCount,
    ContactForce,
    Energy,
    KineticEnergy,
    Momentum,
    Observable,
    Orientation,
    Penetration,
    Position,
    PotentialEnergy,
    Quantity,
    Velocity,
    Violation,
)
from spook_tracker.engine.program import (
    Program,
    StageChoice,
    distinct_quantities,
    observation_tuples,
    observes_each_step,
)
from spook_tracker.engine.scene import Scene
from spook_tracker.engine.smooth import check_smooth

_ORDERS = {"none": 2, "order4": 4, "order6": 6, "order8": 8}
_SCALARS: dict[type[Quantity], str] = {
    KineticEnergy: "kinetic_energy",
    PotentialEnergy: "potential_energy",
    Energy: "energy",
    ContactCount: "contact_count",
    Penetration: "penetration",
}
_OF_BODIES: dict[type[Quantity], tuple[str, int]] = {
    Position: ("position", 3),
    Velocity: ("velocity", 3),
    Orientation: ("orientation", 4),
    AngularVelocity: ("angular_velocity", 3),
}
_OF_ROWS: dict[type[Quantity], str] = {Violation: "violation", ConstraintForce: "constraint_force"}
_QuantityTuple = tuple[str, int, tuple[float, float, float]]
_ORIGIN = (0.0, 0.0, 0.0)


def compile_particles(
    scene: Scene, time_step: float, method: Method, observe: Mapping[str, Observable]
) -> Program:
    """The Program of a scene that has only particles, distances and forces."""
    if method.string_stiffness and method.solver == "iterative":
        raise MethodError("method: string_stiffness needs the direct solver")
    if method.composition != "none":
        check_smooth(scene, method)
    bodies = {body.name: index for index, body in enumerate(scene.bodies)}
    rows = {row.name: index for index, row in enumerate(scene.constraints)}
    requests, shapes = [], {}
    for quantity in distinct_quantities(observe):
        request, shapes[quantity] = _quantity(quantity, bodies, rows)
        requests.append(request)
    native = _core.ParticleProgram(
        **_pack(scene, time_step, method, bodies),
        quantities=requests,
        observations=observation_tuples(observe),
    )
    return Program(
        native,
        time_step=time_step,
        choices=_choose(scene, method, observe, native.solver, native.held_twice),
        bodies=tuple(bodies),
        observe=observe,
        shapes=[shapes[what.quantity] for what in observe.values()],
    )


def _pack(scene: Scene, time_step: float, method: Method, bodies: Mapping[str, int]) -> dict[str, Any]:
    loads = np.zeros((len(bodies), 3))
    fields, springs, spring_ends = [], [], []
    for force in scene.forces:
        if isinstance(force, Load):
            loads[bodies[force.body]] += force.force
        elif isinstance(force, CentralGravity):
            fields.append((force.strength, *force.centre))
        elif isinstance(force, Spring):
            indices, points = _ends(force.between, bodies)
            spring_ends.append(indices)
            springs.append((*points, force.stiffness, force.rest_length, force.viscosity))
    default_damping = 2.0 * time_step / method.substeps
    rows, row_ends = [], []
    for row in scene.constraints:
        assert isinstance(row, Distance)  # the scene refuses joints between particles
        indices, points = _ends(row.between, bodies)
        row_ends.append(indices)
        length = row.rest_length
        if length is None:
            first, second = (
                scene.bodies[bodies[end]].position if isinstance(end, str) else end for end in row.between
            )
            length = math.dist(first, second)
        damping = default_damping if row.damping is None else row.damping
        rows.append((*points, length, row.compliance, damping))
    particles = [
        (body.mass, *body.position, *body.velocity, *load)
        for body, load in zip(scene.bodies, loads, strict=True)
    ]
    return {
        "bodies": np.array(particles, dtype=np.float64),
        "row_ends": np.array(row_ends, dtype=np.int64).reshape(-1, 2),
        "rows": np.array(rows, dtype=np.float64).reshape(-1, 9),
        "spring_ends": np.array(spring_ends, dtype=np.int64).reshape(-1, 2),
        "springs": np.array(springs, dtype=np.float64).reshape(-1, 9),
        "fields": np.array(fields, dtype=np.float64).reshape(-1, 4),
        "gravity": scene.gravity,
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
            "residual_tolerance": method.residual_tolerance,
            "refinements": method.refinements,
            "floor": method.floor,
            "composition": _ORDERS[method.composition],
        },
    }


def _ends(
    between: tuple[End, End], bodies: Mapping[str, int]
) -> tuple[tuple[int, int], tuple[float, float, float, float, float, float]]:
    indices = tuple(bodies[end] if isinstance(end, str) else -1 for end in between)
    first, second = (_ORIGIN if isinstance(end, str) else end for end in between)
    return (indices[0], indices[1]), (*first, *second)


def _quantity(
    quantity: Quantity, bodies: Mapping[str, int], rows: Mapping[str, int]
) -> tuple[_QuantityTuple, tuple[int, ...]]:
    """What the native side is asked for, and the shape of one sample."""
    kind = type(quantity)
    if kind in _SCALARS:
        return (_SCALARS[kind], -1, _ORIGIN), ()
    if isinstance(quantity, Position | Velocity | Orientation | AngularVelocity):
        name, width = _OF_BODIES[kind]
        if quantity.body is None:
            return (name, -1, _ORIGIN), (len(bodies), width)
        return (name, _index("body", quantity.body, bodies), _ORIGIN), (width,)
    if isinstance(quantity, Violation | ConstraintForce):
        if quantity.constraint is None:
            return (_OF_ROWS[kind], -1, _ORIGIN), (len(rows),)
        return (_OF_ROWS[kind], _index("constraint", quantity.constraint, rows), _ORIGIN), ()
    if isinstance(quantity, Momentum):
        return ("momentum", -1, _ORIGIN), (3,)
    if isinstance(quantity, AngularMomentum):
        return ("angular_momentum", -1, quantity.about), (3,)
    if isinstance(quantity, ContactForce):
        _index("body", quantity.body, bodies)
        if quantity.other is not None:
            _index("body", quantity.other, bodies)
        return ("contact_force", 0, _ORIGIN), (3,)
    raise MethodError(f"observe: {quantity!r} means nothing in a scene of particles")


def _index(kind: str, name: str, known: Mapping[str, int]) -> int:
    if name not in known:
        raise MethodError(f"observe: there is no {kind} named {name!r}")
    return known[name]


def _choose(
    scene: Scene, method: Method, observe: Mapping[str, Observable], solver: str, held_twice: bool
) -> tuple[StageChoice, ...]:
    def has(kind: type) -> bool:
        return any(isinstance(force, kind) for force in scene.forces)

    rows = len(scene.constraints)
    no_rows = "no constraints, so nothing to solve"
    no_contacts = "particles have no surface, so no contact is possible"
    direct = solver in ("path", "block")

    def choose(stage: str, kept: bool, why: str, why_not: str) -> StageChoice:
        return StageChoice(stage, kept, why if kept else why_not)

    def leave(stage: str, why_not: str) -> StageChoice:
        return StageChoice(stage, False, why_not)

    not_path = "a body has more than two rows or a loop closes" if rows else no_rows
    if "solve_block" in method.force_stages and rows:
        not_path = "solve_block was forced"
    elif held_twice:
        not_path = "a path without compliance is held at both ends, so its rows may say the same"
    elif method.string_stiffness and rows:
        not_path = "string stiffness couples the bodies of a row"
    if solver == "iterative":
        not_path = "the method asks for the iterative solver"
    composed = method.composition != "none"
    half = method.half_step_velocities or composed
    return (
        leave("collision", no_contacts),
        choose("apply_gravity", any(scene.gravity), "uniform gravity acts", "gravity is zero"),
        choose(
            "apply_central_gravity",
            has(CentralGravity),
            "a centre attracts every body",
            "there is no central gravity",
        ),
        choose("apply_springs", has(Spring), "springs pull as plain forces", "there are no springs"),
        choose(
            "apply_loads",
            has(Load),
            "constant loads act; with gravity they are one kick, found before the first step",
            "there are no loads",
        ),
        leave("impact", no_contacts),
        choose(
            "string_stiffness",
            method.string_stiffness and bool(rows),
            "the method treats the transverse stiffness of taut distances implicitly",
            no_rows if not rows else "the method does not ask for it",
        ),
        choose("assemble_rows", bool(rows), f"{rows} distance rows", "there are no constraints"),
        leave("tangents", no_contacts),
        choose(
            "solve_path",
            solver == "path",
            "no body has more than two rows and no loop closes: tridiagonal, one pass up and down",
            not_path,
        ),
        choose(
            "solve_block",
            solver == "block",
            f"{not_path}: sparse LDLᵀ in blocks, ordered once",
            no_rows
            if not rows
            else "rows form open paths"
            if direct
            else "the method asks for the iterative solver",
        ),
        choose(
            "solve_iterative",
            solver == "iterative",
            "the method asks for projected Gauss–Seidel",
            no_rows if not rows else "the method asks for a direct solver",
        ),
        leave("pivot", "distances are bilateral: no row can let go" if rows else no_rows),
        leave("friction", no_contacts),
        choose(
            "correct_curvature",
            (method.corrections > 0 or composed) and bool(rows),
            "Newton's method keeps the curvature of the rows to rounding"
            if composed
            else f"{method.corrections} extra back-substitutions keep the curvature of the rows",
            no_rows if not rows else "the method linearises the rows",
        ),
        choose(
            "half_step",
            half,
            f"a symmetric composition of half-step steps, {method.composition}"
            if composed
            else "velocities live at mid-step: half-kick start, mid-step read-out",
            "velocities live at whole steps",
        ),
        StageChoice("integrate_positions", True, "every body can move"),
        leave("integrate_rotations", "a particle has no rotation"),
        choose(
            "observe",
            observes_each_step(observe),
            "observables are reduced inside the loop",
            "nothing is read while the loop runs",
        ),
    )

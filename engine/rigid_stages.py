"""The stages of a step of rigid bodies: which a scene keeps, and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from spook_tracker.engine.bodies import Particle, RigidBody
from spook_tracker.engine.forces import CentralGravity, Load, Spring
from spook_tracker.engine.method import Method
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.program import STAGES, StageChoice, observes_each_step
from spook_tracker.engine.scene import Scene


def choose(
    scene: Scene, method: Method, observe: Mapping[str, Observable], solver: str, contacts: bool
) -> tuple[StageChoice, ...]:
    """Every stage in the order of the step, kept or left out. `solver` and `contacts` are what the native
    program found it needs: none, block, pivot or iterative; and whether any two surfaces can ever touch."""
    choices = {choice.stage: choice for choice in _choices(scene, method, observe, solver, contacts)}
    return tuple(choices[stage] for stage in STAGES)


def _choices(
    scene: Scene, method: Method, observe: Mapping[str, Observable], solver: str, contacts: bool
) -> Iterator[StageChoice]:
    def choice(stage: str, kept: bool, why: str, why_not: str) -> StageChoice:
        return StageChoice(stage, kept, why if kept else why_not)

    def has(kind: type) -> bool:
        return any(isinstance(force, kind) for force in scene.forces)

    no_contact = _why_nothing_touches(scene)
    friction = contacts and sum(_rubs(body) for body in scene.bodies) >= 2
    smooth = no_contact if not contacts else "no two surfaces have friction"
    joints = solver != "none"
    bounded = solver == "pivot" or (contacts and method.solver != "iterative")
    iterative = method.solver == "iterative" and (joints or contacts)
    turning = any(isinstance(body, RigidBody) and body.motion != "static" for body in scene.bodies)
    moving = any(isinstance(body, Particle) or body.motion != "static" for body in scene.bodies)
    no_rows = "no joints and no contacts, so nothing to solve"
    particles_only = "rigid scenes do not have it"

    forced = "forced by the method"
    yield choice(
        "collision",
        contacts or "collision" in method.force_stages,
        "surfaces may touch" if contacts else forced,
        no_contact,
    )
    yield choice("apply_gravity", any(scene.gravity), "uniform gravity acts", "gravity is zero")
    yield choice(
        "apply_central_gravity",
        has(CentralGravity),
        "a centre attracts every body",
        "there is no central gravity",
    )
    yield choice("apply_springs", has(Spring), "springs pull as plain forces", "there are no springs")
    yield choice("apply_loads", has(Load), "constant loads act, one kick with gravity", "there are no loads")
    yield choice("impact", contacts, "surfaces that meet exchange impulses first", no_contact)
    yield StageChoice("string_stiffness", False, particles_only)
    yield choice(
        "assemble_rows",
        joints or contacts,
        "joints and contacts give rows"
        if joints and contacts
        else "joints give rows"
        if joints
        else "contacts give rows",
        no_rows,
    )
    yield choice("tangents", friction, "friction needs two directions per contact", smooth)
    yield StageChoice("solve_path", False, "rigid bodies couple in blocks")
    yield choice(
        "solve_block",
        solver == "block",
        "joints are bilateral: one sparse LDLᵀ per step, ordered once"
        + (" (while nothing touches)" if contacts else ""),
        "the method asks for the iterative solver"
        if iterative
        else "some joint row has a bound"
        if joints
        else "there are no joints",
    )
    yield choice(
        "solve_iterative",
        iterative,
        "the method asks for projected Gauss–Seidel",
        no_rows if not (joints or contacts) else "the method asks for a direct solver",
    )
    yield choice(
        "pivot",
        bounded,
        "contacts can let go" if contacts else "a limit or a bounded motor can let go",
        "the method asks for the iterative solver"
        if iterative
        else "all rows are bilateral: no row can let go"
        if joints
        else no_rows,
    )
    yield choice("friction", friction, f"surfaces rub: {method.friction} model", smooth)
    composed = method.composition != "none"
    yield choice(
        "correct_curvature",
        (method.corrections > 0 or composed) and joints,
        "iteration keeps the curvature of the rows to rounding"
        if composed
        else f"{method.corrections} extra back-substitutions keep the curvature of the rows",
        "the method linearises the rows" if joints else "no joints, so nothing is curved",
    )
    yield choice(
        "half_step",
        method.half_step_velocities or composed,
        f"a symmetric composition of half-step steps, {method.composition}"
        if composed
        else "velocities live at mid-step: half-kick start, mid-step read-out",
        "velocities live at whole steps",
    )
    yield choice("integrate_positions", moving, "bodies can move", "nothing can move")
    yield choice(
        "integrate_rotations",
        turning or "rotation" in method.force_stages,
        "rigid bodies can turn" if turning else forced,
        "no rigid body can turn",
    )
    yield choice(
        "observe",
        observes_each_step(observe),
        "observables are reduced inside the loop",
        "nothing is read while the loop runs",
    )


def _rubs(body: Particle | RigidBody) -> bool:
    return isinstance(body, RigidBody) and body.shape is not None and body.material.friction > 0.0


def _why_nothing_touches(scene: Scene) -> str:
    if not scene.contacts:
        return "the scene switches contacts off"
    if sum(isinstance(body, RigidBody) and body.shape is not None for body in scene.bodies) < 2:
        return "fewer than two bodies have a surface"
    return "every pair of surfaces is tied, excluded or cannot move"

"""What a method beyond plain SPOOK asks of a scene: smoothness, and rows that are held. Refusals, by name."""

from __future__ import annotations

import math

from .bodies import WORLD, RigidBody
from .couplings import Relation, Wire
from .errors import MethodError
from .forces import Fluid, Load, Spring
from .joints import AxialJoint, Constraint, Distance, Joint, Universal, frictions
from .method import Method
from .scene import Scene
from .time_functions import TimeFunction
from .tyres import Tyre

RIGID = 1e-7  # m/N or rad/(N m), the softest row a composition takes for rigid
MOST_IN_TREES = 2000  # bodies


def check_smooth(scene: Scene, method: Method) -> None:
    """Compositions go back and forth in time and hold rows rigidly: refuse what that cannot do."""
    if method.solver == "iterative" or method.string_stiffness:
        raise MethodError("method: a composition needs the direct solver, without string stiffness")
    for force in scene.forces:
        if isinstance(force, Spring) and force.viscosity > 0.0:
            raise MethodError(
                f"method: a composition goes back in time, where the viscosity of spring {force.name!r} explodes"
            )
        if isinstance(force, Fluid) or (isinstance(force, Load) and force.factor is not None):
            raise MethodError(
                f"method: a composition goes back and forth in time, and {force.name!r} does not follow it there; use "
                "half_step_velocities"
            )
    for body in scene.bodies:
        if isinstance(body, RigidBody) and body.follows_time:
            given = next(n for n in ("pace", "spin_pace", "path", "angle") if getattr(body, n) is not None)
            raise MethodError(
                f"method: a composition goes back and forth in time, which the {given} of {body.name!r} does not follow"
            )
    known = {body.name: body for body in scene.bodies}
    for row in scene.constraints:
        _check_held(row, scene.length(row, known) if isinstance(row, Distance) else 0.0)


def check_trees(scene: Scene, method: Method) -> None:
    """Runge-Kutta moves joint coordinates: refuse what has none, closes a loop or holds softly."""
    if method.solver == "iterative" or method.string_stiffness or method.half_step_velocities:
        raise MethodError(
            "method: runge_kutta needs the direct solver, without string stiffness and half_step_velocities"
        )
    bodies = {body.name: body for body in scene.bodies}
    moving = sum(1 for body in scene.bodies if not isinstance(body, RigidBody) or body.motion == "dynamic")
    if moving > MOST_IN_TREES:
        raise MethodError(
            f"method: runge_kutta moves up to {MOST_IN_TREES} bodies, not {moving}; use composition='order8'"
        )
    for body in scene.bodies:
        if isinstance(body, RigidBody) and body.motion == "kinematic":
            raise MethodError(
                f"method: runge_kutta takes loads and springs in time, but {body.name!r} moves as it is told; use "
                f"half_step_velocities"
            )
    tree: dict[str, str] = {}

    def root(name: str) -> str:
        while name in tree:
            name = tree[name]
        return name

    for row in scene.constraints:
        if not isinstance(row, Joint) or isinstance(row, Universal):
            raise MethodError(
                f"method: runge_kutta moves along joint coordinates, and {row.kind} {row.name!r} has none here; use "
                f"composition='order8'"
            )
        roots = []
        for end in row.between:
            held = bodies.get(end) if isinstance(end, str) else None
            if isinstance(held, RigidBody) and held.motion == "kinematic":
                raise MethodError(
                    f"method: runge_kutta takes joints of the world and of bodies that move freely, but {row.name!r} holds {end!r}"
                )
            roots.append(
                root(held.name) if isinstance(held, RigidBody) and held.motion == "dynamic" else WORLD
            )
        if roots[0] == roots[1]:
            raise MethodError(
                f"method: runge_kutta needs joints that make trees, but {row.name!r} closes a loop; use composition='order8'"
            )
        first, second = sorted(roots, key=lambda name: name == WORLD)
        tree[first] = second
        _check_held(row, 0.0, "runge_kutta")
        spring = row.spring if isinstance(row, AxialJoint) else None
        if spring is not None and spring.damping and not isinstance(spring.rest, float):
            raise MethodError(
                f"method: runge_kutta does not know how fast the rest of {row.name!r} moves, which its damping opposes; "
                f"leave the damping out or use half_step_velocities"
            )


def check_wide_rows(scene: Scene, method: Method) -> None:
    """A relation or wire over more than two moving bodies has no stiffness of its own to its sides."""
    if not method.string_stiffness:
        return
    joints = {joint.name: joint for joint in scene.constraints}
    fixed = {body.name for body in scene.bodies if isinstance(body, RigidBody) and body.motion == "static"}
    for row in scene.constraints:
        if isinstance(row, Relation):
            held = {end for name, _ in row.terms for end in joints[name].between if isinstance(end, str)}
        elif isinstance(row, Wire):
            held = {end for end, _ in row.through}
            held |= {end for name, _ in row.wound for end in joints[name].between if isinstance(end, str)}
        else:
            continue
        if len(held - fixed - {WORLD}) <= 2:
            continue
        raise MethodError(
            f"method: {row.kind} {row.name!r} ties more than two moving bodies, which string_stiffness "
            "cannot hold; leave that out"
        )


def check_rigid(scene: Scene, method: Method, touching: bool) -> None:
    """What rigid bodies cannot do beyond plain SPOOK; `touching`: whether surfaces may ever meet."""
    composed = method.composition != "none"
    asked = [f"composition {method.composition!r}"] if composed else []
    asked += ["runge_kutta"] if method.runge_kutta != "none" else []
    asked += ["half_step_velocities"] if method.half_step_velocities else []
    asked += ["string_stiffness"] if method.string_stiffness else []
    if not asked:
        return
    wanted = asked[0]
    beyond = next((w for w in asked if w != "half_step_velocities"), None)
    if touching and beyond is not None:
        raise MethodError(
            f"method: {beyond} needs a smooth scene, but surfaces may touch here, and a contact that opens or closes "
            f"within a step leaves order 1; use half_step_velocities, of order 2 while contacts last, or give Scene "
            f"contacts=False"
        )
    if method.solver != "direct":
        raise MethodError(f"method: {wanted} needs the direct solver")
    for joint in scene.constraints:
        drive = _bounded(joint)
        if drive is not None:
            raise MethodError(
                f"method: {wanted} needs rows that never let go, but {joint.name!r} has {drive}; order 1 is the "
                f"highest there: leave it out"
            )
    if composed:
        check_smooth(scene, method)
    distance = next((row.name for row in scene.constraints if isinstance(row, Distance)), None)
    if method.string_stiffness and distance is not None:
        raise MethodError(
            f"method: string_stiffness of distances is for scenes of particles only, and {distance!r} is one here; "
            f"use a Ball at its ends, or leave it out"
        )


def _bounded(joint: Constraint) -> str | None:
    if isinstance(joint, Wire) and joint.slack:
        return "a wire that may go slack"
    if isinstance(joint, Wire) and joint.rubs:
        return "a wire with friction"
    if isinstance(joint, Tyre):
        return "a tyre"
    if (getattr(joint, "strength", None) or getattr(joint, "torque_strength", None)) is not None:
        return "a strength at which it breaks"
    if any(any(part) for part in frictions(joint)):
        return "friction"
    if not isinstance(joint, AxialJoint):
        return None
    if joint.limit is not None and joint.limit.lower < joint.limit.upper:
        return "a limit"
    if joint.motor is not None and joint.motor.force is not None:
        return "a motor of given force"
    bound = None if joint.motor is None else joint.motor.max_force
    if bound is not None and (not isinstance(bound, float) or math.isfinite(bound)):
        return "a motor of bounded force"
    if joint.spring is not None and joint.spring.max_force is not None:
        return "a spring of bounded force"
    return None


def _check_held(row: Constraint, length: float, by: str = "a composition") -> None:
    """`length` [m] at the start, of a distance."""
    held = row.compliance if isinstance(row.compliance, tuple) else (row.compliance,)
    if max(held) > RIGID:
        raise MethodError(
            f"method: {by} holds rows rigidly, but {row.name!r} has a compliance of "
            f"{max(held):g} m/N; make it {RIGID:g} at most, or a Spring"
        )
    if isinstance(row, AxialJoint):
        for drive in ("motor", "limit"):
            if getattr(row, drive) is not None:
                raise MethodError(
                    f"method: {by} holds rows rigidly, but the {drive} of {row.name!r} drives one; use "
                    f"half_step_velocities, of order 2, there"
                )
        if row.spring is not None and by == "runge_kutta":
            if row.spring.damping is None:
                raise MethodError(
                    f"method: runge_kutta takes the spring of {row.name!r} as a force, and its damping would be two time "
                    f"steps; give it one in seconds, or 0"
                )
        elif row.spring is not None and (
            row.spring.damping != 0.0 or isinstance(row.spring.rest, TimeFunction)
        ):
            raise MethodError(
                f"method: a composition takes the spring of {row.name!r} as a force that goes back and forth in time; "
                f"give it damping=0 and a rest that stays, or use half_step_velocities, of order 2"
            )
    rest = row.rest_length if isinstance(row, Distance) else None
    if rest is not None and abs(length - rest) > 1e-9 * rest:
        raise MethodError(
            f"method: a composition holds rows rigidly, but {row.name!r} starts {length:g} m long instead of "
            f"its rest length of {rest:g} m"
        )

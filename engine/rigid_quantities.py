"""What can be observed of a scene with rigid bodies, and the shape of one sample."""

from __future__ import annotations

from collections.abc import Iterable

from spook_tracker.engine.errors import MethodError
from spook_tracker.engine.joints import AxialJoint, Distance
from spook_tracker.engine.observe import (
    AngularMomentum,
    AngularVelocity,
    ConstraintForce,
    ContactCount,
    ContactForce,
    Energy,
    JointCoordinate,
    KineticEnergy,
    Momentum,
    Orientation,
    Penetration,
    Position,
    PotentialEnergy,
    Quantity,
    Velocity,
    Violation,
)
from spook_tracker.engine.scene import Scene

QuantityRequest = tuple[str, int, tuple[float, float, float]]  # name, index or -1, point

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
_ORIGIN = (0.0, 0.0, 0.0)


def request(quantity: Quantity, scene: Scene) -> tuple[QuantityRequest, tuple[int, ...]]:
    """What the native side is asked for, and the shape of one sample. Raises MethodError for unknown names."""
    kind = type(quantity)
    if kind in _SCALARS:
        return (_SCALARS[kind], -1, _ORIGIN), ()
    if isinstance(quantity, Position | Velocity | Orientation | AngularVelocity):
        name, width = _OF_BODIES[kind]
        if quantity.body is None:
            return (name, -1, _ORIGIN), (len(scene.bodies), width)
        return (name, _body(scene, quantity.body), _ORIGIN), (width,)
    if isinstance(quantity, Violation | ConstraintForce):
        return _of_constraint(quantity, scene)
    if isinstance(quantity, Momentum):
        return ("momentum", -1, _ORIGIN), (3,)
    if isinstance(quantity, AngularMomentum):
        return ("angular_momentum", -1, quantity.about), (3,)
    if isinstance(quantity, ContactForce):
        other = -1 if quantity.other is None else _body(scene, quantity.other)
        return ("contact_force", _body(scene, quantity.body), (float(other), 0.0, 0.0)), (3,)
    if isinstance(quantity, JointCoordinate):
        index = _constraint(scene, quantity.joint)
        if not isinstance(scene.constraints[index], AxialJoint):
            raise MethodError(
                f"observe: {quantity.joint!r} is no hinge or prismatic joint and has no coordinate"
            )
        return ("joint_coordinate", index, _ORIGIN), ()
    raise MethodError(f"observe: {quantity!r} means nothing in a scene of rigid bodies")


def _of_constraint(
    quantity: Violation | ConstraintForce, scene: Scene
) -> tuple[QuantityRequest, tuple[int, ...]]:
    force = isinstance(quantity, ConstraintForce)
    name = "constraint_force" if force else "violation"
    if quantity.constraint is None:
        count = sum(isinstance(constraint, Distance) for constraint in scene.constraints)
        return (name, -1, _ORIGIN), (count,)
    index = _constraint(scene, quantity.constraint)
    constraint = scene.constraints[index]
    if isinstance(constraint, Distance):
        return (name, index, _ORIGIN), ()
    return (name, index, _ORIGIN), (6 if force else constraint.rows,)


def _body(scene: Scene, name: str) -> int:
    return _index("body", name, (body.name for body in scene.bodies))


def _constraint(scene: Scene, name: str) -> int:
    return _index("constraint", name, (constraint.name for constraint in scene.constraints))


def _index(kind: str, name: str, names: Iterable[str]) -> int:
    for index, known in enumerate(names):
        if known == name:
            return index
    raise MethodError(f"observe: there is no {kind} named {name!r}")

"""What the native side is asked to observe, and the shape of one sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from . import _core
from .bodies import Body, Particle
from .check import Vector, unknown
from .couplings import Relation, Wire
from .errors import MethodError
from .joints import AxialJoint, Constraint, Distance
from .observe import (
    AngularMomentum,
    AngularVelocity,
    ConstraintForce,
    ContactCount,
    ContactForce,
    ContactPoints,
    Energy,
    JointCoordinate,
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
from .program import distinct_quantities
from .scene import Scene

Shape = tuple[int, ...]

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


def requests(
    scene: Scene, observe: Mapping[str, Observable]
) -> tuple[list[_core.QuantityRequest], list[Shape]]:
    """A request per distinct quantity, and per observable the shape of one sample.

    Raises MethodError for unknown names.
    """
    asked, shapes = [], {}
    for quantity in distinct_quantities(observe):
        request, shapes[quantity] = _request(quantity, scene)
        asked.append(request)
    return asked, [shapes[what.quantity] for what in observe.values()]


def _ask(kind: str, index: int = -1, point: Vector = _ORIGIN, other: int = -1) -> _core.QuantityRequest:
    return _core.QuantityRequest(kind=kind, index=index, point=point, other=other)


def _request(quantity: Quantity, scene: Scene) -> tuple[_core.QuantityRequest, Shape]:
    kind = type(quantity)
    if kind in _SCALARS:
        return _ask(_SCALARS[kind]), ()
    if isinstance(quantity, Position | Velocity | Orientation | AngularVelocity):
        name, width = _OF_BODIES[kind]
        if quantity.body is None:
            return _ask(name), (len(scene.bodies), width)
        point = quantity.point if isinstance(quantity, Position | Velocity) else _ORIGIN
        index = _body(scene, quantity.body)
        if any(point) and isinstance(scene.bodies[index], Particle):
            raise MethodError(
                f"observe: {quantity!r} asks for a point of a particle, which is one; leave it out"
            )
        return _ask(name, index, point), (width,)
    if isinstance(quantity, Violation | ConstraintForce):
        return _of_constraint(quantity, scene)
    if isinstance(quantity, Momentum):
        return _ask("momentum"), (3,)
    if isinstance(quantity, AngularMomentum):
        return _ask("angular_momentum", point=quantity.about), (3,)
    if isinstance(quantity, ContactForce):
        other = -1 if quantity.other is None else _body(scene, quantity.other)
        return _ask("contact_force", _body(scene, quantity.body), other=other), (3,)
    if isinstance(quantity, ContactPoints):
        return _ask("contact_points", quantity.most), (quantity.most, 10)
    if isinstance(quantity, JointCoordinate):
        index = _constraint(scene, quantity.joint)
        if not isinstance(scene.constraints[index], AxialJoint):
            raise MethodError(
                f"observe: {quantity!r} names no hinge or prismatic joint, and only those have a coordinate"
            )
        return _ask("joint_coordinate", index), ()
    raise MethodError(f"observe: {quantity!r} is no quantity of this engine")


def _of_constraint(
    quantity: Violation | ConstraintForce, scene: Scene
) -> tuple[_core.QuantityRequest, Shape]:
    force = isinstance(quantity, ConstraintForce)
    name = "constraint_force" if force else "violation"
    if quantity.constraint is None:
        count = sum(isinstance(constraint, Distance) for constraint in scene.constraints)
        if scene.constraints and not count:
            named = scene.constraints[0].name
            raise MethodError(
                f"observe: {quantity!r} means every distance constraint, and this scene has none; name one of its "
                f"constraints, as in {type(quantity).__name__}({named!r})"
            )
        return _ask(name), (count,)
    index = _constraint(scene, quantity.constraint)
    constraint = scene.constraints[index]
    if isinstance(constraint, Distance | Relation | Wire):
        return _ask(name, index), ()
    return _ask(name, index), (6 if force else constraint.rows,)


def _body(scene: Scene, name: str) -> int:
    return _index("body", name, scene.bodies)


def _constraint(scene: Scene, name: str) -> int:
    return _index("constraint", name, scene.constraints)


def _index(kind: str, name: str, items: Sequence[Body | Constraint]) -> int:
    for index, known in enumerate(items):
        if known.name == name:
            return index
    raise MethodError(f"observe: {unknown(kind, name, (item.name for item in items))}")

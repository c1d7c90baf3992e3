"""Constraints: the distance between two points, and the joints of rigid bodies.

Every constraint has a compliance (inverse stiffness; 0 is rigid) and a damping time per constrained degree
of freedom: one number for all, or one for each in the order its docstring gives. A damping of None means two
time steps, chosen at compile time: a scene knows no time step.

The default compliance gives 10 µm, or 10 µrad, to every 1 kN, or 1 kN m: right for machines of metres and kilograms,
where redundant joints then share their load as real ones do. What is long or small yields more than it may; there 0 is
meant, and redundant joints that then lock are refused by name. docs/explanation/compliance.md says it with numbers.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from . import check
from .check import Vector
from .couplings import COMPLIANCE, Relation, Wire
from .errors import SceneError
from .forces import ORIGIN, End, check_ends, check_held
from .time_functions import TimeFunction, least, number_or_function
from .tyres import Tyre

PerDegree = float | tuple[float, ...]


def _per_degree(owner: str, field: str, value: object, count: int) -> PerDegree:
    if isinstance(value, Sequence) and not isinstance(value, str):
        if len(value) != count:
            raise SceneError(f"{owner}: {field} needs one number or {count}, not {len(value)}")
        return tuple(check.not_negative(owner, field, entry) for entry in value)
    return check.not_negative(owner, field, value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Distance:
    """Keeps two points `rest_length` apart: g = |d| − rest_length [m], one row.

    `anchors` are the points [m] in body axes, from each centre of mass (that of WORLD is a world point, which `between` may
    name itself: then it is ignored); a particle has only its centre. A rest_length of None is the distance at the start.
    Costs one row.
    """

    rows: ClassVar[int] = 1
    kind: ClassVar[str] = "distance"
    name: str
    between: tuple[End, End]
    rest_length: float | None = None  # m
    compliance: float = COMPLIANCE  # m/N
    damping: float | None = None  # s
    anchors: tuple[Vector, Vector] = (ORIGIN, ORIGIN)  # m

    def __post_init__(self) -> None:
        check.name("distance", self.name)
        owner = f"distance {self.name!r}"
        between, anchors = check_held(owner, self.between, self.anchors)
        object.__setattr__(self, "between", between)
        object.__setattr__(self, "anchors", anchors)
        if self.rest_length is not None:
            object.__setattr__(self, "rest_length", check.positive(owner, "rest_length", self.rest_length))
        object.__setattr__(self, "compliance", check.not_negative(owner, "compliance", self.compliance))
        if self.damping is not None:
            object.__setattr__(self, "damping", check.not_negative(owner, "damping", self.damping))


@dataclass(frozen=True, slots=True, kw_only=True)
class Motor:
    """Drives a joint's free coordinate at a speed, with at most `max_force` [N or N m]; None is unbounded.

    Or it pushes with a `force` [N or N m] whatever the speed: a drive with a torque for its target. It acts on the second
    body, and back on the first. Exactly one of speed and force is given. Raises SceneError.
    """

    speed: float | TimeFunction | None = None  # m/s or rad/s
    max_force: float | TimeFunction | None = None
    force: float | TimeFunction | None = None

    def __post_init__(self) -> None:
        if (self.speed is None) == (self.force is None):
            raise SceneError("motor: needs either a speed or a force")
        if self.force is not None and self.max_force is not None:
            raise SceneError("motor: max_force bounds what a speed asks for; with a force leave it out")
        for name in ("speed", "force"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, number_or_function("motor", name, getattr(self, name)))
        if isinstance(self.max_force, TimeFunction):
            if least(self.max_force) < 0.0:
                raise SceneError(
                    f"motor: max_force must not be negative, and it falls to {least(self.max_force):g}"
                )
        elif self.max_force is not None:
            bound = number_or_function("motor", "max_force", self.max_force)
            object.__setattr__(self, "max_force", check.not_negative("motor", "max_force", bound))


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """Keeps a joint's free coordinate between lower and upper [m or rad], zero being the start."""

    lower: float
    upper: float
    compliance: float = COMPLIANCE  # m/N or rad/(N m)
    damping: float | None = None  # s
    restitution: float = 0.0  # 0 … 1, of the speed at which the limit is met

    def __post_init__(self) -> None:
        for name in ("lower", "upper"):
            object.__setattr__(self, name, check.number("limit", name, getattr(self, name)))
        object.__setattr__(self, "compliance", check.not_negative("limit", "compliance", self.compliance))
        if self.damping is not None:
            object.__setattr__(self, "damping", check.not_negative("limit", "damping", self.damping))
        restitution = check.not_negative("limit", "restitution", self.restitution)
        if restitution > 1.0:
            raise SceneError(f"limit: restitution must lie between 0 and 1, not {restitution:g}")
        object.__setattr__(self, "restitution", restitution)
        if self.lower > self.upper:
            raise SceneError(f"limit: lower {self.lower:g} lies above upper {self.upper:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSpring:
    """Pulls a joint's free coordinate to `rest` as a compliant row of compliance 1/stiffness.

    With a `max_force` it is a drive for positions that gives way: never more than that [N or N m], its damping included.
    """

    stiffness: float  # N/m or N m/rad
    rest: float | TimeFunction = 0.0  # m or rad
    damping: float | None = None  # s
    max_force: float | None = None  # N or N m; None is unbounded

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", check.positive("joint spring", "stiffness", self.stiffness))
        object.__setattr__(self, "rest", number_or_function("joint spring", "rest", self.rest))
        if self.damping is not None:
            object.__setattr__(self, "damping", check.not_negative("joint spring", "damping", self.damping))
        if self.max_force is not None:
            bound = check.not_negative("joint spring", "max_force", self.max_force)
            object.__setattr__(self, "max_force", bound)


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """What all joints share: `between` names two bodies, or WORLD and a body; the joint frame is fixed to the
    first and coincides with the second at the start. `at` [m] is a world point at the start (None: the second
    body's centre). Forces are read as those on the second body at the joint, in world axes. `compliance` [m/N, then
    rad/(N m)] and `damping` [s; None: two time steps] are one number, or one for each row.

    A joint whose own rows carry more than `strength` or `torque_strength` in a step holds nothing from the next one on:
    the last force it shows is the load it broke at. Its bodies do not touch each other after that either.
    """

    rows: ClassVar[int] = 0
    kind: ClassVar[str] = "joint"  # with underscores the native side's name
    # What it holds, as the native table says it: translations along its axes from the one to before the other, and of
    # turns none, all ("held"), those of the axis ("swing"), or one of an axis towards another ("cross").
    holds: ClassVar[tuple[int, int]] = (0, 3)
    turning: ClassVar[str] = "free"
    name: str
    between: tuple[str, str]
    at: Vector | None = None  # m
    compliance: PerDegree = COMPLIANCE  # m/N, then rad/(N m)
    damping: PerDegree | None = None  # s
    strength: float | None = None  # N; None never breaks
    torque_strength: float | None = None  # N m

    def __post_init__(self) -> None:
        check.name(self.kind, self.name)
        owner = f"{self.kind} {self.name!r}"
        ends = check_ends(owner, self.between)
        if not all(isinstance(end, str) for end in ends):
            raise SceneError(f"{owner}: ends must be names; use WORLD and `at` for a point of the world")
        object.__setattr__(self, "between", ends)
        if self.at is not None:
            object.__setattr__(self, "at", check.vector(owner, "at", self.at))
        for field in ("strength", "torque_strength"):
            if getattr(self, field) is not None:
                object.__setattr__(self, field, check.positive(owner, field, getattr(self, field)))
        object.__setattr__(self, "compliance", _per_degree(owner, "compliance", self.compliance, self.rows))
        if self.damping is not None:
            object.__setattr__(self, "damping", _per_degree(owner, "damping", self.damping, self.rows))


@dataclass(frozen=True, slots=True, kw_only=True)
class Lock(Joint):
    """Holds both bodies together: translations along world x, y, z of the start, then rotations.

    Costs six rows [m, rad].
    """

    rows: ClassVar[int] = 6
    kind: ClassVar[str] = "lock"
    turning: ClassVar[str] = "held"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ball(Joint):
    """Keeps one point common: three translations (world x, y, z at the start).

    Costs three rows [m].
    """

    rows: ClassVar[int] = 3
    kind: ClassVar[str] = "ball"


@dataclass(frozen=True, slots=True, kw_only=True)
class AxialJoint(Joint):
    """A joint with a free coordinate about or along `axis` (world direction at the start), zero at the start, with a `motor`,
    a `limit` and a `spring`.

    `friction` [N or N m] holds the coordinate at rest as far as it reaches, and brakes it where it moves, beside whatever
    drives it. `load_friction` adds its product with the force [N] that the joint's own rows hold: µ of a slide, µ times
    the radius of an axle. Where surfaces touch, that part follows the load of the step before.

    `armature` [kg or kg m²] is inertia that goes as the coordinate does, a geared rotor's: ½ armature × rate² is in the
    kinetic energy, and what it resists with is in the joint's force.
    """

    axis: Vector = (0.0, 0.0, 1.0)
    motor: Motor | None = None
    limit: Limit | None = None
    spring: JointSpring | None = None
    friction: float = 0.0  # N or N m
    load_friction: float = 0.0  # 1 or m
    armature: float = 0.0  # kg or kg m²

    def __post_init__(self) -> None:
        Joint.__post_init__(self)
        owner = f"{self.kind} {self.name!r}"
        object.__setattr__(self, "axis", check.direction(owner, "axis", self.axis))
        for name, kind in (("motor", Motor), ("limit", Limit), ("spring", JointSpring)):
            value = getattr(self, name)
            if value is not None and not isinstance(value, kind):
                raise SceneError(f"{owner}: {name} must be a {kind.__name__}, not {value!r}")
        for name in ("friction", "load_friction", "armature"):
            object.__setattr__(self, name, check.not_negative(owner, name, getattr(self, name)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Hinge(AxialJoint):
    """Leaves rotation about `axis` free.

    Rows: translations along the axis and two normals, then rotations about the normals. Costs five rows [m, rad].
    """

    rows: ClassVar[int] = 5
    kind: ClassVar[str] = "hinge"
    turning: ClassVar[str] = "swing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Prismatic(AxialJoint):
    """Leaves translation along `axis` free.

    Rows: translations along two normals, then rotations about the axis and the normals. Costs five rows [m, rad].
    """

    rows: ClassVar[int] = 5
    kind: ClassVar[str] = "prismatic"
    holds: ClassVar[tuple[int, int]] = (1, 3)
    turning: ClassVar[str] = "held"


@dataclass(frozen=True, slots=True, kw_only=True)
class Universal(Joint):
    """Ball, and `axis` (fixed to the first body) stays normal to `cross_axis` (fixed to the second).

    Rows: translations along axis, cross_axis and the normal of both, then the rotation about that normal. Costs four rows [m, rad].
    """

    rows: ClassVar[int] = 4
    kind: ClassVar[str] = "universal"
    turning: ClassVar[str] = "cross"
    axis: Vector = (1.0, 0.0, 0.0)
    cross_axis: Vector = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        Joint.__post_init__(self)
        owner = f"universal {self.name!r}"
        axis = check.direction(owner, "axis", self.axis)
        cross_axis = check.direction(owner, "cross_axis", self.cross_axis)
        if abs(sum(a * b for a, b in zip(axis, cross_axis, strict=True))) > 1e-9:
            raise SceneError(f"{owner}: axis and cross_axis must be normal to each other")
        object.__setattr__(self, "axis", axis)
        object.__setattr__(self, "cross_axis", cross_axis)


@dataclass(frozen=True, slots=True, kw_only=True)
class GuidedJoint(Joint):
    """A joint that holds less than a hinge; `axis` is a world direction at the start."""

    axis: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        Joint.__post_init__(self)
        object.__setattr__(self, "axis", check.direction(f"{self.kind} {self.name!r}", "axis", self.axis))


@dataclass(frozen=True, slots=True, kw_only=True)
class PointOnLine(GuidedJoint):
    """Keeps the second body's point on the line along `axis` of the first: two translations along its normals.

    Costs two rows [m].
    """

    rows: ClassVar[int] = 2
    kind: ClassVar[str] = "point on line"
    holds: ClassVar[tuple[int, int]] = (1, 3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylindrical(GuidedJoint):
    """Leaves rotation about `axis` and translation along it free.

    Rows: translations along two normals, then rotations about the normals. `friction` and `load_friction` as of a slide
    and of a hinge, for the way along the axis and the turn about it. Costs four rows [m, rad].
    """

    rows: ClassVar[int] = 4
    kind: ClassVar[str] = "cylindrical"
    holds: ClassVar[tuple[int, int]] = (1, 3)
    turning: ClassVar[str] = "swing"
    friction: tuple[float, float] = (0.0, 0.0)  # N, N m
    load_friction: tuple[float, float] = (0.0, 0.0)  # 1, m

    def __post_init__(self) -> None:
        GuidedJoint.__post_init__(self)
        for name in ("friction", "load_friction"):
            given = getattr(self, name)
            if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
                raise SceneError(
                    f"cylindrical {self.name!r}: {name} needs two numbers, along the axis and about it, not {given!r}"
                )
            clean = tuple(check.not_negative(f"cylindrical {self.name!r}", name, entry) for entry in given)
            object.__setattr__(self, name, clean)


@dataclass(frozen=True, slots=True, kw_only=True)
class Planar(GuidedJoint):
    """Leaves translations across `axis` and rotation about it free.

    Rows: translation along the axis, then rotations about two normals. Costs three rows [m, rad].
    """

    rows: ClassVar[int] = 3
    kind: ClassVar[str] = "planar"
    holds: ClassVar[tuple[int, int]] = (0, 1)
    turning: ClassVar[str] = "swing"


for _joint in (Lock, Ball, Hinge, Prismatic, Universal, PointOnLine, Cylindrical, Planar):
    # `help` shows a class without its bases: what joints share is told with each
    _told = [inspect.cleandoc(kind.__doc__ or "") for kind in _joint.__mro__[:-1]]
    _joint.__doc__ = "\n\n".join(text for text in _told if text)


def frictions(joint: object) -> tuple[tuple[float, float], tuple[float, float]]:
    """Of a joint's slide along its axis and its turn about it: what is constant [N, N m], and the share of the load."""
    if isinstance(joint, Cylindrical):
        return joint.friction, joint.load_friction
    if not isinstance(joint, AxialJoint):
        return (0.0, 0.0), (0.0, 0.0)
    if isinstance(joint, Prismatic):
        return (joint.friction, 0.0), (joint.load_friction, 0.0)
    return (0.0, joint.friction), (0.0, joint.load_friction)


Constraint = Distance | Lock | Ball | Hinge | Prismatic | Universal | GuidedJoint | Relation | Wire | Tyre

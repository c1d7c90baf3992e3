"""Forces that are not constraints: each is evaluated once per step, from positions and velocities."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from . import check
from .bodies import WORLD
from .check import Vector
from .errors import SceneError
from .time_functions import TimeFunction

End = str | Vector  # a body's name, or a fixed point of the world [m]
ORIGIN: Vector = (0.0, 0.0, 0.0)


def check_ends(owner: str, between: Any) -> tuple[End, End]:
    """Two ends, each a body's name or a world point; at least one must be a body."""
    ends = check.entries(between)
    if ends is None or len(ends) != 2:
        raise SceneError(f"{owner}: between must name two ends, not {between!r}")
    first, second = (end if isinstance(end, str) else check.vector(owner, "between", end) for end in ends)
    if not isinstance(first, str) and not isinstance(second, str):
        raise SceneError(f"{owner}: at least one end must be a body")
    if first == second:
        raise SceneError(f"{owner}: both ends are {first!r}; a body cannot be tied to itself")
    return (first, second)


def check_anchors(owner: str, anchors: Any) -> tuple[Vector, Vector]:
    """Two points in body axes [m]."""
    points = check.entries(anchors)
    if points is None or len(points) != 2:
        raise SceneError(f"{owner}: anchors must be two points, not {anchors!r}")
    first, second = (check.vector(owner, "anchors", point) for point in points)
    return (first, second)


def check_held(owner: str, between: Any, anchors: Any) -> tuple[tuple[End, End], tuple[Vector, Vector]]:
    """Two ends and where each is held; WORLD becomes the world point that its anchor is."""
    points, ends = check_anchors(owner, anchors), check.entries(between)
    if ends is None or len(ends) != 2:
        return check_ends(owner, between), points
    world = [isinstance(end, str) and end == WORLD for end in ends]
    first, second = (ORIGIN if fixed else point for fixed, point in zip(world, points, strict=True))
    held = [point if fixed else end for fixed, end, point in zip(world, ends, points, strict=True)]
    return check_ends(owner, held), (first, second)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spring:
    """A plain force −stiffness (|d| − rest_length) [N] along d, between two points; not a row.

    `anchors` are the points [m] in body axes, from each centre of mass; a particle has only its centre. That of WORLD is a world
    point, which `between` may name itself. With rest_length 0 the force is −stiffness d exactly, with no normalisation.
    Explicit: stable below h = 2 √(m/stiffness). Costs one distance a step, and no row.
    """

    name: str
    between: tuple[End, End]
    stiffness: float  # N/m
    rest_length: float = 0.0  # m
    viscosity: float = 0.0  # N s/m, along the spring
    anchors: tuple[Vector, Vector] = (ORIGIN, ORIGIN)  # m

    def __post_init__(self) -> None:
        check.name("spring", self.name)
        owner = f"spring {self.name!r}"
        between, anchors = check_held(owner, self.between, self.anchors)
        object.__setattr__(self, "between", between)
        object.__setattr__(self, "anchors", anchors)
        for name in ("stiffness", "rest_length", "viscosity"):
            object.__setattr__(self, name, check.not_negative(owner, name, getattr(self, name)))
        for end, anchor in zip(self.between, self.anchors, strict=True):
            if not isinstance(end, str) and any(anchor):
                raise SceneError(f"{owner}: {end} is a point of the world already; leave its anchor at zero")

    @property
    def aside(self) -> bool:
        """Whether it holds some body beside its centre, and so turns it."""
        return any(any(anchor) for anchor in self.anchors)


@dataclass(frozen=True, slots=True, kw_only=True)
class CentralGravity:
    """Every body accelerates by −strength (x − centre)/|x − centre|³ [m/s²]. Costs one distance a body and step, and no row."""

    name: str
    strength: float  # m³/s²
    centre: Vector = (0.0, 0.0, 0.0)  # m

    def __post_init__(self) -> None:
        check.name("central gravity", self.name)
        owner = f"central gravity {self.name!r}"
        object.__setattr__(self, "strength", check.not_negative(owner, "strength", self.strength))
        object.__setattr__(self, "centre", check.vector(owner, "centre", self.centre))


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """A force [N] and torque [N m] on one body, in world axes, at its centre of mass; constant, or times `factor`.

    Costs nothing to speak of; one with a `factor`, or set while a run is held, is looked up each step.
    """

    name: str
    body: str
    force: Vector = (0.0, 0.0, 0.0)  # N
    torque: Vector = (0.0, 0.0, 0.0)  # N m
    factor: TimeFunction | None = None

    def __post_init__(self) -> None:
        check.name("load", self.name)
        owner = f"load {self.name!r}"
        object.__setattr__(self, "body", check.name("load's body", self.body))
        object.__setattr__(self, "force", check.vector(owner, "force", self.force))
        object.__setattr__(self, "torque", check.vector(owner, "torque", self.torque))
        if self.factor is not None and not isinstance(self.factor, TimeFunction):
            raise SceneError(f"{owner}: factor must be a Sinusoid, Ramp or Table, not {self.factor!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Fluid:
    """A fluid below the horizontal surface at `level`, still or in steady motion; gravity says where up is.

    Every dynamic body with a surface is pushed up by ρ g times its submerged volume V [N], at the centre of V (closed
    forms of sphere and box, to rounding of the capsule; parts of a compound each for itself). Drag is −½ ρ C A |u| u
    at the same point, u its speed through the fluid, A the shadow of the whole part along u times the submerged share
    of its volume. There is no added mass and no drag of a pure turn. Neither counts in Energy.
    Costs the submerged volume of each part of a body in it, each step: of a capsule a quadrature; and no row.
    """

    name: str
    density: float  # kg/m³
    level: float = math.inf  # m, along up from the world's origin; infinite: everything is under it
    velocity: Vector = (0.0, 0.0, 0.0)  # m/s
    drag_coefficient: float = 0.0  # C, 1

    def __post_init__(self) -> None:
        check.name("fluid", self.name)
        owner = f"fluid {self.name!r}"
        object.__setattr__(self, "density", check.positive(owner, "density", self.density))
        if not (isinstance(self.level, float) and self.level == math.inf):
            object.__setattr__(self, "level", check.number(owner, "level", self.level))
        object.__setattr__(self, "velocity", check.vector(owner, "velocity", self.velocity))
        drag = check.not_negative(owner, "drag_coefficient", self.drag_coefficient)
        object.__setattr__(self, "drag_coefficient", drag)


Force = Spring | CentralGravity | Load | Fluid

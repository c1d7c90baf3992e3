"""Surfaces: sphere, box, capsule, cylinder, cone, convex hull, plane, and compounds of these. Each knows its inertia per mass.

A new shape says here what it is called, which columns the native side gets and how it is drawn.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

from . import check, polytope
from .check import Rotation, Vector
from .errors import SceneError


class Shape(ABC):
    """Base of every shape; `inertia(mass)` gives the moments [kg m²] about the body axes at uniform density."""

    __slots__ = ()
    kind: ClassVar[str] = ""  # the native side's name
    drawn_as: ClassVar[str] = ""  # a kind of DrawnSolid; none: not drawn
    fixed_only: ClassVar[bool] = False  # only static bodies may have it

    def columns(self) -> dict[str, Any]:
        """What the native side is told of it."""
        return {}

    def measures(self) -> tuple[float, ...]:
        """What it is drawn with: see DrawnSolid."""
        return ()

    @abstractmethod
    def inertia(self, mass: float) -> Vector | polytope.Tensor: ...

    @property
    def volume(self) -> float:
        """m³; infinite without bounds."""
        return math.inf


@dataclass(frozen=True, slots=True)
class Sphere(Shape):
    """A ball of `radius` [m] about the body's origin."""

    kind: ClassVar[str] = "sphere"
    drawn_as: ClassVar[str] = "sphere"
    radius: float  # m

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", check.positive("sphere", "radius", self.radius))

    def columns(self) -> dict[str, Any]:
        return {"radius": self.radius}

    def measures(self) -> tuple[float, ...]:
        return (self.radius,)

    def inertia(self, mass: float) -> Vector:
        moment = 0.4 * mass * self.radius**2
        return (moment, moment, moment)

    @property
    def volume(self) -> float:
        return 4.0 / 3.0 * math.pi * self.radius**3


@dataclass(frozen=True, slots=True)
class Box(Shape):
    """A cuboid about the body's origin; `size` [m] holds its full edges along the body axes x, y and z."""

    kind: ClassVar[str] = "box"
    drawn_as: ClassVar[str] = "box"
    size: Vector  # full edge lengths, m

    def __post_init__(self) -> None:
        x, y, z = (check.positive("box", "size", edge) for edge in check.vector("box", "size", self.size))
        object.__setattr__(self, "size", (x, y, z))

    def columns(self) -> dict[str, Any]:
        return {"size": self.size}

    def measures(self) -> tuple[float, ...]:
        return self.size

    def inertia(self, mass: float) -> Vector:
        x, y, z = self.size
        return (mass * (y * y + z * z) / 12.0, mass * (x * x + z * z) / 12.0, mass * (x * x + y * y) / 12.0)

    @property
    def volume(self) -> float:
        x, y, z = self.size
        return x * y * z


@dataclass(frozen=True, slots=True)
class Capsule(Shape):
    """A cylinder of `length` [m] along the body's z axis with half-spheres of `radius` [m] at both ends, not counted in it."""

    kind: ClassVar[str] = "capsule"
    drawn_as: ClassVar[str] = "capsule"
    radius: float  # m
    length: float  # of the cylinder, without the caps, m

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", check.positive("capsule", "radius", self.radius))
        object.__setattr__(self, "length", check.positive("capsule", "length", self.length))

    def columns(self) -> dict[str, Any]:
        return {"radius": self.radius, "length": self.length}

    def measures(self) -> tuple[float, ...]:
        return (self.radius, self.length)

    def inertia(self, mass: float) -> Vector:
        radius, length = self.radius, self.length
        cylinder, ball = length, 4.0 * radius / 3.0  # volumes over pi r²
        density = mass / (cylinder + ball)
        along = density * (cylinder * radius**2 / 2.0 + ball * 0.4 * radius**2)
        across = density * (
            cylinder * (length**2 / 12.0 + radius**2 / 4.0)
            + ball * (0.4 * radius**2 + length**2 / 4.0 + 0.375 * length * radius)
        )
        return (across, across, along)

    @property
    def volume(self) -> float:
        return math.pi * self.radius**2 * (self.length + 4.0 * self.radius / 3.0)


@dataclass(frozen=True, slots=True)
class Cylinder(Shape):
    """A cylinder of `radius` and `length` [m] along the body's z axis, the origin in its middle; a coin is a short one."""

    kind: ClassVar[str] = "cylinder"
    drawn_as: ClassVar[str] = "facets"
    radius: float  # m
    length: float  # m

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", check.positive("cylinder", "radius", self.radius))
        object.__setattr__(self, "length", check.positive("cylinder", "length", self.length))

    def columns(self) -> dict[str, Any]:
        return {"radius": self.radius, "length": self.length}

    def inertia(self, mass: float) -> Vector:
        across = mass * (self.radius**2 / 4.0 + self.length**2 / 12.0)
        return (across, across, mass * self.radius**2 / 2.0)

    @property
    def volume(self) -> float:
        return math.pi * self.radius**2 * self.length

    def measures(self) -> tuple[float, ...]:
        half, rim = 0.5 * self.length, _circle(self.radius)
        faces = [[(x, y, half) for x, y in rim], [(x, y, -half) for x, y in reversed(rim)]]
        for (x, y), (u, v) in zip(rim, [*rim[1:], rim[0]], strict=True):
            faces.append([(x, y, -half), (u, v, -half), (u, v, half), (x, y, half)])
        return polytope.drawn(faces)


@dataclass(frozen=True, slots=True)
class Cone(Shape):
    """A cone along the body's z axis, its apex up, its centre of mass in the origin: a quarter of the height over the base."""

    kind: ClassVar[str] = "cone"
    drawn_as: ClassVar[str] = "facets"
    radius: float  # of the base, m
    height: float  # m

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", check.positive("cone", "radius", self.radius))
        object.__setattr__(self, "height", check.positive("cone", "height", self.height))

    def columns(self) -> dict[str, Any]:
        return {"radius": self.radius, "length": self.height}

    def inertia(self, mass: float) -> Vector:
        across = 0.15 * mass * (self.radius**2 + self.height**2 / 4.0)
        return (across, across, 0.3 * mass * self.radius**2)

    @property
    def volume(self) -> float:
        return math.pi * self.radius**2 * self.height / 3.0

    def measures(self) -> tuple[float, ...]:
        low, rim = -0.25 * self.height, _circle(self.radius)
        faces = [[(x, y, low) for x, y in reversed(rim)]]
        for (x, y), (u, v) in zip(rim, [*rim[1:], rim[0]], strict=True):
            faces.append([(x, y, low), (u, v, low), (0.0, 0.0, 0.75 * self.height)])
        return polytope.drawn(faces)


def _circle(radius: float) -> list[tuple[float, float]]:
    """Corners of a drawn circle [m]."""
    turns = [2.0 * math.pi * k / 24 for k in range(24)]
    return [(radius * math.cos(turn), radius * math.sin(turn)) for turn in turns]


class PlacedHull(NamedTuple):
    """A hull in its principal axes, and where its body has to stand so that its corners are where they were given."""

    shape: ConvexHull
    position: Vector  # m
    orientation: Rotation


@dataclass(frozen=True, slots=True)
class ConvexHull(Shape):
    """The smallest convex solid round some points, in body axes: at most 64 corners, at most 16 round a face.

    The body's origin is its centre of mass, so the points must be given there, unless the body gets its inertia.
    `ConvexHull.placed(points)` finds it, and the principal axes, for points anywhere.
    """

    kind: ClassVar[str] = "hull"
    drawn_as: ClassVar[str] = "facets"
    corners: tuple[Vector, ...]  # m; of the points given only the corners are kept
    faces: tuple[polytope.Face, ...] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        given = check.entries(self.corners)
        if given is None:
            raise SceneError(f"convex hull: corners must be points, not {self.corners!r}")
        points = [check.vector("convex hull", "corners", point) for point in given]
        try:
            corners, faces = polytope.hull(points)
        except ValueError as refused:
            raise SceneError(f"convex hull: {refused}") from None
        object.__setattr__(self, "corners", corners)
        object.__setattr__(self, "faces", faces)

    @classmethod
    def placed(cls, points: Iterable[Vector]) -> PlacedHull:
        """The hull of points anywhere: its shape in principal axes, and the pose of its body."""
        rough = cls(tuple(points))
        _, (x, y, z), second = polytope.moments(rough.corners, rough.faces)
        axes = polytope.principal_axes(polytope.inertia_of(second))
        columns = tuple(zip(*axes, strict=True))
        moved = [polytope.minus(corner, (x, y, z)) for corner in rough.corners]
        turned = tuple(tuple(polytope.dot(column, p) for column in columns) for p in moved)
        return PlacedHull(cls(turned), (x, y, z), polytope.quaternion(axes))  # type: ignore[arg-type]

    @property
    def volume(self) -> float:
        """m³."""
        return polytope.moments(self.corners, self.faces)[0]

    def inertia(self, mass: float) -> Vector | polytope.Tensor:
        """A tensor, unless the body axes are principal. Raises SceneError off the centre of mass."""
        volume, centre, second = polytope.moments(self.corners, self.faces)
        tensor = polytope.inertia_of(second)
        size = max(math.hypot(*corner) for corner in self.corners)
        least = min(tensor[i][i] for i in range(3))
        off = max(abs(tensor[0][1]), abs(tensor[0][2]), abs(tensor[1][2]))
        if math.hypot(*centre) > 1e-9 * size:
            raise SceneError(
                "convex hull: its centre of mass is not the origin; ConvexHull.placed(points) finds it, or give the body "
                "its inertia"
            )
        if off > 1e-9 * least:
            return tuple(tuple(mass / volume * entry for entry in row) for row in tensor)  # type: ignore[return-value]
        return tuple(mass / volume * tensor[i][i] for i in range(3))  # type: ignore[return-value]

    def measures(self) -> tuple[float, ...]:
        return polytope.drawn([[self.corners[corner] for corner in face] for face in self.faces])


@dataclass(frozen=True, slots=True)
class Plane(Shape):
    """The half-space below the plane through the body's origin; `normal` points out, in body axes."""

    kind: ClassVar[str] = "plane"
    drawn_as: ClassVar[str] = "plane"
    normal: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", check.direction("plane", "normal", self.normal))

    def columns(self) -> dict[str, Any]:
        return {"normal": self.normal}

    def measures(self) -> tuple[float, ...]:
        return self.normal

    def inertia(self, mass: float) -> Vector:
        return (math.inf, math.inf, math.inf)


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One shape of a compound, placed in body axes."""

    shape: Shape
    position: Vector = (0.0, 0.0, 0.0)  # m
    orientation: Rotation = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if (
            not isinstance(self.shape, Shape)
            or isinstance(self.shape, Plane | Compound)
            or self.shape.fixed_only
        ):
            raise SceneError(f"compound: a part must be a bounded shape and no compound, not {self.shape!r}")
        object.__setattr__(self, "position", check.vector("compound part", "position", self.position))
        object.__setattr__(
            self, "orientation", check.rotation("compound part", "orientation", self.orientation)
        )


@dataclass(frozen=True, slots=True)
class Compound(Shape):
    """Several shapes in one body. Its inertia is the sum of its parts', of one density, about the body's origin: where
    parts overlap they count twice, so give the body its inertia there."""

    parts: tuple[Part, ...]

    def __post_init__(self) -> None:
        parts = tuple(check.entries(self.parts) or ())
        if not parts or not all(isinstance(part, Part) for part in parts):
            raise SceneError(f"compound: parts must be Parts, one at least, not {self.parts!r}")
        object.__setattr__(self, "parts", parts)

    @property
    def volume(self) -> float:
        return math.fsum(part.shape.volume for part in self.parts)

    def inertia(self, mass: float) -> Vector | polytope.Tensor:
        """By Steiner's theorem; a tensor, unless it is diagonal. Raises SceneError off the centre of mass."""
        try:
            whole = self.volume
            centre = [math.fsum(p.shape.volume * p.position[k] for p in self.parts) / whole for k in range(3)]
        except (OverflowError, ValueError, ZeroDivisionError):  # of infinities, opposite ones, or nothing
            centre = [math.nan]
        if not all(map(math.isfinite, centre)):
            raise SceneError(
                "compound: its parts are so large, so small or so far away that numbers do not hold their moments; "
                "choose another unit of length"
            )
        size = max(math.hypot(*part.position) + part.shape.volume ** (1.0 / 3.0) for part in self.parts)
        if math.hypot(*centre) > 1e-9 * size:
            raise SceneError(
                f"compound: its parts have their centre of mass at ({centre[0]:g}, {centre[1]:g}, {centre[2]:g}) m instead "
                "of the origin; move them there, or give the body its inertia"
            )
        tensor = [[0.0] * 3 for _ in range(3)]
        for part in self.parts:
            share = mass * (part.shape.volume / whole)
            given: Any = part.shape.inertia(share)
            own = (
                given
                if isinstance(given[0], tuple)
                else tuple(tuple(given[i] if i == j else 0.0 for j in range(3)) for i in range(3))
            )
            turn, at = rotation_matrix(part.orientation), part.position
            for i in range(3):
                for j in range(3):
                    square = math.fsum(x * x for x in at) if i == j else 0.0
                    turned = math.fsum(
                        turn[i][k] * own[k][m] * turn[j][m] for k in range(3) for m in range(3)
                    )
                    tensor[i][j] += turned + share * (square - at[i] * at[j])
        largest = max(tensor[i][i] for i in range(3))
        for i, j in ((0, 1), (0, 2), (1, 2)):
            tensor[i][j] = tensor[j][i] = 0.5 * (tensor[i][j] + tensor[j][i])
            if abs(tensor[i][j]) <= 1e-15 * largest:
                tensor[i][j] = tensor[j][i] = 0.0
        if not any(tensor[i][j] for i, j in ((0, 1), (0, 2), (1, 2))):
            return (tensor[0][0], tensor[1][1], tensor[2][2])
        return tuple(tuple(row) for row in tensor)  # type: ignore[return-value]


def rotation_matrix(turn: Rotation) -> polytope.Tensor:
    """Of a unit quaternion (w, x, y, z): body to world."""
    w, x, y, z = turn
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )

"""Surfaces: sphere, box, capsule, plane, and compounds of these. Each knows its inertia per mass."""

from __future__ import annotations

import math
from dataclasses import dataclass

from spook_tracker.engine import check
from spook_tracker.engine.check import Rotation, Vector
from spook_tracker.engine.errors import SceneError


class Shape:
    """Base of every shape; `inertia(mass)` gives the principal moments [kg m²] at uniform density."""

    __slots__ = ()

    def inertia(self, mass: float) -> Vector:
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class Sphere(Shape):
    """A ball about the body's origin."""

    radius: float  # m

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", check.positive("sphere", "radius", self.radius))

    def inertia(self, mass: float) -> Vector:
        moment = 0.4 * mass * self.radius**2
        return (moment, moment, moment)


@dataclass(frozen=True, slots=True)
class Box(Shape):
    """A cuboid about the body's origin, edges along the body axes."""

    size: Vector  # full edge lengths, m

    def __post_init__(self) -> None:
        x, y, z = (check.positive("box", "size", edge) for edge in check.vector("box", "size", self.size))
        object.__setattr__(self, "size", (x, y, z))

    def inertia(self, mass: float) -> Vector:
        x, y, z = self.size
        return (mass * (y * y + z * z) / 12.0, mass * (x * x + z * z) / 12.0, mass * (x * x + y * y) / 12.0)


@dataclass(frozen=True, slots=True)
class Capsule(Shape):
    """A cylinder along the body's z axis with half-spheres at both ends."""

    radius: float  # m
    length: float  # of the cylinder, without the caps, m

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", check.positive("capsule", "radius", self.radius))
        object.__setattr__(self, "length", check.positive("capsule", "length", self.length))

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


@dataclass(frozen=True, slots=True)
class Plane(Shape):
    """The half-space below the plane through the body's origin; `normal` points out, in body axes."""

    normal: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", check.direction("plane", "normal", self.normal))

    def inertia(self, mass: float) -> Vector:
        return (math.inf, math.inf, math.inf)


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One shape of a compound, placed in body axes."""

    shape: Shape
    position: Vector = (0.0, 0.0, 0.0)  # m
    orientation: Rotation = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Sphere | Box | Capsule):
            raise SceneError(f"compound: a part must be a sphere, box or capsule, not {self.shape!r}")
        object.__setattr__(self, "position", check.vector("compound part", "position", self.position))
        object.__setattr__(
            self, "orientation", check.rotation("compound part", "orientation", self.orientation)
        )


@dataclass(frozen=True, slots=True)
class Compound(Shape):
    """Several shapes in one body. Give the body its inertia: parts may overlap, so it cannot be derived."""

    parts: tuple[Part, ...]

    def __post_init__(self) -> None:
        parts = tuple(self.parts)
        if not parts or not all(isinstance(part, Part) for part in parts):
            raise SceneError("compound: needs at least one Part")
        object.__setattr__(self, "parts", parts)

    def inertia(self, mass: float) -> Vector:
        raise SceneError("compound: the inertia of a compound must be given with the body")

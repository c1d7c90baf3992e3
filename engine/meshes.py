"""Fixed surfaces of triangles: meshes and height fields. They have an outside, and no inertia.

What slides over the shared edge of two triangles in one plane, or along a valley, feels the faces alone; on ridges, tips and
rims a mesh is met by its edges and corners. A shape whose centre is below a triangle is let alone by it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

from . import check, polytope
from .check import Vector
from .errors import SceneError
from .shapes import Shape

MOST_TRIANGLES = 1_000_000
MOST_DRAWN = 2000
THIN = 1e-9  # least height of a triangle over its longest side


class _Sheet(Shape):
    """What both have: corners and triangles in body axes, anticlockwise seen from outside."""

    __slots__ = ()
    kind: ClassVar[str] = "triangle"
    drawn_as: ClassVar[str] = "facets"
    fixed_only: ClassVar[bool] = True
    corners: tuple[Vector, ...]
    faces: tuple[polytope.Face, ...]

    def inertia(self, mass: float) -> Vector:
        raise SceneError("a mesh is a surface and has no inertia")

    def measures(self) -> tuple[float, ...]:
        return polytope.drawn([[self.corners[k] for k in face] for face in self.faces[:MOST_DRAWN]])


@dataclass(frozen=True, slots=True)
class TriangleMesh(_Sheet):
    """Triangles with common corners; each is three indices, anticlockwise seen from outside. It may have rims and holes."""

    corners: tuple[Vector, ...]  # m, in body axes
    faces: tuple[polytope.Face, ...]

    def __post_init__(self) -> None:
        points = [
            check.vector("triangle mesh", "corners", point) for point in _listed("corners", self.corners)
        ]
        triangles = [
            _triangle(number, face, points) for number, face in enumerate(_listed("faces", self.faces))
        ]
        if not triangles:
            raise SceneError("triangle mesh: needs at least one triangle")
        if len(triangles) > MOST_TRIANGLES:
            raise SceneError(
                f"triangle mesh: has {len(triangles)} triangles, and at most {MOST_TRIANGLES} are taken"
            )
        first: dict[tuple[int, int], int] = {}
        for number, (a, b, c) in enumerate(triangles):
            for side in ((a, b), (b, c), (c, a)):
                if side in first:
                    raise SceneError(
                        f"triangle mesh: triangles {first[side]} and {number} run along the side from corner {side[0]} to "
                        f"{side[1]} in the same direction; turn one of them round, or part them"
                    )
                first[side] = number
        object.__setattr__(self, "corners", tuple(points))
        object.__setattr__(self, "faces", tuple(triangles))


def _listed(name: str, given: Any) -> list[Any]:
    found = check.entries(given)
    if found is None:
        raise SceneError(f"triangle mesh: {name} must be a list, not {given!r}")
    return found


def _triangle(number: int, face: Any, points: list[Vector]) -> polytope.Face:
    """Three different corners that enclose an area."""
    try:
        corners = tuple(int(k) for k in face)
    except (TypeError, ValueError, OverflowError):
        corners = ()
    if len(corners) != 3 or not all(0 <= k < len(points) for k in corners) or corners != tuple(face):
        raise SceneError(
            f"triangle mesh: triangle {number} must be three indices of its {len(points)} corners, not {face!r}"
        )
    if not _encloses_area(*(points[k] for k in corners)):
        raise SceneError(f"triangle mesh: triangle {number} has no area; leave it out")
    return corners


def _encloses_area(a: Vector, b: Vector, c: Vector) -> bool:
    longest = max(math.dist(a, b), math.dist(b, c), math.dist(c, a))
    twice = math.hypot(*polytope.cross(polytope.minus(b, a), polytope.minus(c, a)))
    return twice > THIN * longest * longest


@dataclass(frozen=True, slots=True)
class HeightField(_Sheet):
    """A surface over a grid in the body's x and y: heights[i][j] stands at (i dx, j dy), up is outside."""

    spacing: tuple[float, float]  # dx and dy, m
    heights: tuple[tuple[float, ...], ...]  # m
    corners: tuple[Vector, ...] = field(init=False, compare=False, repr=False)
    faces: tuple[polytope.Face, ...] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        try:
            dx, dy = self.spacing
            rows = [list(row) for row in self.heights]
        except (TypeError, ValueError):
            raise SceneError(
                "height field: spacing must be two numbers, and heights rows of numbers"
            ) from None
        spacing = (
            check.positive("height field", "spacing", dx),
            check.positive("height field", "spacing", dy),
        )
        wide = len(rows[0]) if rows else 0
        if len(rows) < 2 or wide < 2 or any(len(row) != wide for row in rows):
            raise SceneError(
                "height field: heights must be at least two rows of the same two or more numbers each"
            )
        heights = tuple(tuple(check.number("height field", "heights", z) for z in row) for row in rows)
        points = [
            (i * spacing[0], j * spacing[1], z) for i, row in enumerate(heights) for j, z in enumerate(row)
        ]
        triangles: list[polytope.Face] = []
        for i in range(len(heights) - 1):
            for j in range(wide - 1):
                a, b = i * wide + j, (i + 1) * wide + j
                triangles += [(a, b, b + 1), (a, b + 1, a + 1)]
        if len(triangles) > MOST_TRIANGLES:
            raise SceneError(
                f"height field: makes {len(triangles)} triangles, and at most {MOST_TRIANGLES} are taken"
            )
        for face in triangles:
            if not _encloses_area(*(points[k] for k in face)):
                i, j = divmod(face[0], wide)
                raise SceneError(
                    f"height field: its triangle at row {i}, column {j} has no area at spacing {spacing}; "
                    "make the cells more even, or the steps lower"
                )
        object.__setattr__(self, "spacing", spacing)
        object.__setattr__(self, "heights", heights)
        object.__setattr__(self, "corners", tuple(points))
        object.__setattr__(self, "faces", tuple(triangles))

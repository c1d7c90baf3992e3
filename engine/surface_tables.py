"""Surfaces of a scene as tables for the native side: a row for every primitive, and the hulls they name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .bodies import RigidBody
from .meshes import HeightField, TriangleMesh
from .program import table
from .scene import Scene
from .shapes import Compound, ConvexHull

Outlined = ConvexHull | TriangleMesh | HeightField  # has corners and faces
ORIGIN = (0.0, 0.0, 0.0)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def surfaces(scene: Scene, hulls: dict[Outlined, int]) -> list[dict[str, Any]]:
    """A row for every primitive or mesh; hulls and meshes are numbered as they are met, equal ones once."""
    colliders: list[dict[str, Any]] = []
    for index, body in enumerate(scene.bodies):
        if not isinstance(body, RigidBody) or body.shape is None:
            continue
        placed = (
            [(part.position, part.orientation, part.shape) for part in body.shape.parts]
            if isinstance(body.shape, Compound)
            else [(ORIGIN, UPRIGHT, body.shape)]
        )
        for position, orientation, shape in placed:
            row: dict[str, Any] = {"body": index, "position": position, "orientation": orientation}
            row |= {"kind": shape.kind, "radius": 0.0, "length": 0.0, "size": ORIGIN, "normal": ORIGIN}
            row["outline"] = hulls.setdefault(shape, len(hulls)) if isinstance(shape, Outlined) else -1
            colliders.append(row | shape.columns())
    return colliders


def hull_tables(hulls: Mapping[Outlined, int]) -> dict[str, Any]:
    """Corners of hulls and meshes, and the loops of corners round their faces."""
    corners = [
        {"outline": index, "position": corner} for hull, index in hulls.items() for corner in hull.corners
    ]
    loops = [
        {"outline": index, "face": face, "corner": corner}
        for hull, index in hulls.items()
        for face, loop in enumerate(hull.faces)
        for corner in loop
    ]
    return {"outline_corners": table(corners), "outline_faces": table(loops)}

"""What is seen of a compiled MuJoCo model: its geoms as shapes that a page can draw, and the bodies that carry them.

Those of the groups that MuJoCo's own viewer shows at first, or all where it would show none. A mesh is drawn as its hull,
of fewer corners the more meshes there are, in the end as a box.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np

from .. import polytope
from ..model_file import SHOWN_AS
from ..shapes import Cylinder
from .model_loop import Array

SHOWN_GROUPS = 3  # the first so many
CORNERS = 600  # of all hulls together
MOST, LEAST = 24, 8  # corners of a hull; with fewer it is a box
MOST_SHAPES = 300


class Shown:
    """Shapes at the start, and the numbers of the bodies they move with."""

    def __init__(self, model: Any, data: Any) -> None:
        kinds = np.asarray(model.geom_type)
        seen = (np.asarray(model.geom_group) < SHOWN_GROUPS) & (np.asarray(model.geom_rgba)[:, 3] > 0.0)
        geoms = np.flatnonzero(seen if seen.any() else np.ones(model.ngeom, dtype=bool))
        meshes = int(np.sum(kinds[geoms] == int(mujoco.mjtGeom.mjGEOM_MESH)))
        self.corners = min(MOST, CORNERS // max(1, meshes))
        bodies = np.asarray(model.geom_bodyid)[geoms]
        self.bodies: list[int] = sorted({int(body) for body in bodies})
        still = np.asarray(model.body_weldid) == 0
        self.kinds: list[float] = []
        self.sizes: list[tuple[float, ...]] = []
        self.rows: list[list[float]] = []  # body, whether it stands still, place, turn
        for geom in geoms[:MOST_SHAPES]:
            kind, size, away = self.shape(model, int(geom))
            if not kind:
                continue
            axes, turn = np.array(data.geom_xmat[geom]), np.zeros(4)
            mujoco.mju_mat2Quat(turn, axes)
            place = data.geom_xpos[geom] + axes.reshape(3, 3) @ away
            body = int(model.geom_bodyid[geom])
            self.kinds.append(float(SHOWN_AS.index(kind)))
            self.sizes.append(size)
            self.rows.append([float(self.bodies.index(body)), float(still[body]), *place, *turn])

    def arrays(self) -> dict[str, Array]:
        """As ModelRun has them."""
        width = max(map(len, self.sizes), default=0)
        sizes = np.full((len(self.sizes), width), np.nan)
        for row, size in zip(sizes, self.sizes, strict=True):
            row[: len(size)] = size
        rows = np.array(self.rows).reshape(-1, 9)
        return {
            "shape_kind": np.array(self.kinds),
            "shape_size": sizes,
            "shape_body": rows[:, 0],
            "shape_fixed": rows[:, 1],
            "shape_place": rows[:, 2:5],
            "shape_turn": rows[:, 5:],
        }

    def shape(self, model: Any, geom: int) -> tuple[str, tuple[float, ...], Array]:
        """Kind and size as a drawing has them, and how far from the geom's place; no kind of what is not drawn."""
        here = np.zeros(3)
        x, y, z = (float(size) for size in model.geom_size[geom])
        kind = mujoco.mjtGeom(int(model.geom_type[geom])).name.rpartition("_")[2]
        if kind == "PLANE":
            return "plane", (0.0, 0.0, 1.0), here
        if kind == "SPHERE":
            return "sphere", (x,), here
        if kind == "CAPSULE":
            return "capsule", (x, 2.0 * y), here
        if kind == "CYLINDER":
            return "facets", Cylinder(x, 2.0 * y).measures(), here
        if kind == "BOX":
            return "box", (2.0 * x, 2.0 * y, 2.0 * z), here
        if kind == "ELLIPSOID":
            return "facets", _facets(np.array([x, y, z]) * _directions(MOST), MOST), here
        if kind == "MESH":
            first, count = (
                int(getattr(model, f"mesh_vert{name}")[model.geom_dataid[geom]]) for name in ("adr", "num")
            )
            points = np.array(model.mesh_vert[first : first + count], dtype=float)
            if self.corners >= LEAST and (facets := _facets(points, self.corners)):
                return "facets", facets, here
            low, high = points.min(axis=0), points.max(axis=0)
            return "box", tuple((high - low).tolist()), 0.5 * (low + high)
        return "", (), here


def _facets(points: Array, corners: int) -> tuple[float, ...]:
    """The hull of those that reach furthest in so many directions; nothing where they enclose nothing."""
    kept = points[np.unique(np.argmax(points @ _directions(corners).T, axis=0))]
    places = [(float(x), float(y), float(z)) for x, y, z in kept]
    try:
        corner, faces = polytope.hull(places)
    except ValueError:
        return ()
    return polytope.drawn([[corner[k] for k in face] for face in faces])


def _directions(count: int) -> Array:
    """Spread evenly over a ball, by the golden angle."""
    up = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    turn = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
    flat = np.sqrt(1.0 - up * up)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), up])

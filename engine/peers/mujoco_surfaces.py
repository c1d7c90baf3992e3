"""Geoms of a compiled MuJoCo model as surfaces of ours: shapes, materials, and which bodies touch."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from ..bodies import Material, PairFriction, RigidBody
from ..errors import SceneError
from ..meshes import HeightField
from ..shapes import (
    Box,
    Capsule,
    Compound,
    ConvexHull,
    Cylinder,
    Part,
    Plane,
    Shape,
    Sphere,
)
from .lacking import Lacks

Array = npt.NDArray[np.float64]
MOST_CORNERS = 64  # of a hull of ours, 16 of them round a face
KIND = {int(getattr(mujoco.mjtGeom, f"mjGEOM_{name}")): name.lower() for name in (
    "PLANE", "SPHERE", "CAPSULE", "CYLINDER", "BOX", "ELLIPSOID", "MESH", "HFIELD", "SDF")}  # fmt: skip


Found = tuple[dict[str, list[RigidBody]], list[RigidBody], list[tuple[str, str]], list[PairFriction]]


def surfaces(
    model: Any,
    data: Any,
    weld: npt.NDArray[np.int64],
    main: Mapping[int, RigidBody],
    tied: set[frozenset[str]],
    lacks: Lacks,
) -> Found:
    """Moving bodies with their surfaces by name, a static body for each geom that stands still, pairs kept apart, and pairs
    that rub otherwise than their materials would.

    Geoms of one body that rub differently, or meet others, are surfaces of bodies of their own at the same place, which
    share its mass and are to be locked to the first.
    """
    return _Surfaces(model, data, weld, main, tied, lacks).found()


class _Surfaces:
    def __init__(
        self,
        model: Any,
        data: Any,
        weld: npt.NDArray[np.int64],
        main: Mapping[int, RigidBody],
        tied: set[frozenset[str]],
        lacks: Lacks,
    ) -> None:
        self.m, self.d, self.main, self.lacks = model, data, main, lacks
        self.weld = weld[np.asarray(model.geom_bodyid)]
        self.pairs = {
            frozenset((int(one), int(two))): pair
            for pair, (one, two) in enumerate(zip(model.pair_geom1, model.pair_geom2, strict=True))
        }
        self.meets = self.meeting(tied)
        self.rebounds = self.rebounding()
        self.rubs_as = [
            (
                self.rebounds[geom],
                *model.geom_friction[geom].tolist(),
                int(model.geom_condim[geom]),
                int(model.geom_priority[geom]),
            )
            for geom in range(model.ngeom)
        ]
        self.known: dict[Any, Material | None] = {}
        self.refuse_what_we_lack()

    def label(self, geom: int) -> str:
        return mujoco.mj_id2name(self.m, mujoco.mjtObj.mjOBJ_GEOM, geom) or str(geom)

    def refuse_what_we_lack(self) -> None:
        """What of surfaces that touch no material of ours can say."""
        m = self.m
        for kind, what in (
            ("surfacevel", "a surface that moves along itself"),
            ("adhesion", "a surface that clings"),
        ):
            values = getattr(m, f"geom_{kind}", np.zeros(m.ngeom))
            for geom in range(m.ngeom):
                if np.any(values[geom]) and self.meets[geom].any():
                    self.lacks.of(what, self.m, "geom", geom)
        if m.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_OVERRIDE):
            self.lacks.add("one friction and softness for all contacts (flag override)")
        for pair, (one, two) in enumerate(zip(m.pair_geom1, m.pair_geom2, strict=True)):
            if self.is_odd(pair):
                name = (
                    mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_PAIR, pair)
                    or f"{self.label(int(one))} and {self.label(int(two))}"
                )
                self.lacks.add(
                    "a pair that clings or whose friction differs with the direction", "pair", name
                )

    def is_odd(self, pair: int) -> bool:
        """Whether a pair has what no friction of ours can say."""
        one, other, _, rolling, crosswise = self.m.pair_friction[pair]
        clings = bool(np.any(getattr(self.m, "pair_adhesion", np.zeros(self.m.npair))[pair]))
        return clings or one != other or rolling != crosswise

    def rubbing(self, one: int, two: int) -> Material:
        """Friction of two geoms as MuJoCo has it: their pair's, else of the one of higher priority, else the larger."""
        m = self.m
        if (pair := self.pairs.get(frozenset((one, two)))) is not None:
            sliding, _, spin, roll, _ = m.pair_friction[pair]
            return _friction(int(m.pair_dim[pair]), (sliding, spin, roll))
        ahead = int(m.geom_priority[one]) - int(m.geom_priority[two])
        both = [one, two] if ahead == 0 else [one] if ahead > 0 else [two]
        return _friction(int(np.max(m.geom_condim[both])), np.max(m.geom_friction[both], axis=0))

    def rebounding(self) -> list[float]:
        """Restitution of each geom whose softness counts in all its contacts, for its priority; of others none is said."""
        m, found = self.m, [0.0] * self.m.ngeom
        paired = {geom for pair in self.pairs for geom in pair}
        for geom in range(m.ngeom):
            others = np.asarray(m.geom_priority)[self.meets[geom]]
            if geom not in paired and len(others) and m.geom_priority[geom] > others.max():
                found[geom] = rebound(m.geom_solref[geom])
        return found

    def meeting(self, tied: set[frozenset[str]]) -> npt.NDArray[np.bool_]:
        """Which geoms may touch, by bits, bodies, exclusions and pairs."""
        m = self.m
        kind, affinity = np.asarray(m.geom_contype), np.asarray(m.geom_conaffinity)
        found: npt.NDArray[np.bool_] = (kind[:, None] & affinity[None, :] != 0) | (
            affinity[:, None] & kind[None, :] != 0
        )
        apart = np.eye(m.nbody, dtype=bool)  # whole bodies
        place = {one.name: body for body, one in self.main.items()}
        if not m.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT):
            for pair in tied:
                both = [place[name] for name in pair if name in place]
                if len(both) == 2:
                    apart[np.ix_(both, both)] = True
        found &= ~apart[np.ix_(self.weld, self.weld)]
        bodies = np.asarray(m.geom_bodyid)
        for one, two in (divmod(int(signature), 1 << 16) for signature in m.exclude_signature):
            some = np.outer(bodies == one, bodies == two)
            found &= ~(some | some.T)
        for one, two in zip(m.pair_geom1, m.pair_geom2, strict=True):
            found[one, two] = found[two, one] = True
        return found

    def found(self) -> Found:
        bodies: dict[str, list[RigidBody]] = {}
        fixed: list[RigidBody] = []
        geoms: dict[str, int] = {}  # of every surface one geom
        for body, alike in self.alike().items():
            made = []
            for place, same in enumerate(alike):
                whole = self.main.get(body)
                name = (
                    f"geom {self.label(same[0])}"
                    if whole is None
                    else whole.name + (f" surface {place + 1}" if place else "")
                )
                try:
                    one = (
                        self.standing(name, same[0])
                        if whole is None
                        else self.moving(whole, name, same, len(alike))
                    )
                except SceneError as error:
                    self.lacks.of(f"a surface as this one: {error}", self.m, "geom", same[0])
                    continue
                if one is not None:
                    geoms[name] = same[0]
                    made.append(one)
            if body:
                bodies[self.main[body].name] = made
            else:
                fixed += made
        apart: list[tuple[str, str]] = []
        rubbing: list[PairFriction] = []
        for first, second in combinations(geoms, 2):
            if not self.weld[[geoms[first], geoms[second]]].any():
                continue
            if not self.meets[geoms[first], geoms[second]]:
                apart.append((first, second))
            elif (pair := self.pair_friction(first, second, geoms)) is not None:
                rubbing.append(pair)
        return bodies, fixed, apart, rubbing

    def pair_friction(self, one: str, two: str, geoms: Mapping[str, int]) -> PairFriction | None:
        """What is to be said of two surfaces; nothing where their materials say the same."""
        first, second = geoms[one], geoms[two]
        key = (self.rubs_as[first], self.rubs_as[second], self.pairs.get(frozenset((first, second))))
        if key not in self.known:
            wanted, given = self.rubbing(first, second), [self.material(geom) for geom in (first, second)]
            same = (
                math.isclose(wanted.friction, math.sqrt(given[0].friction * given[1].friction), rel_tol=1e-12)
                and wanted.rolling_friction == max(of.rolling_friction for of in given)
                and wanted.torsional_friction == max(of.torsional_friction for of in given)
            )
            self.known[key] = None if same else wanted
        if (found := self.known[key]) is None:
            return None
        return PairFriction(
            between=(one, two), friction=found.friction, rolling_friction=found.rolling_friction,
            torsional_friction=found.torsional_friction,
        )  # fmt: skip

    def alike(self) -> dict[int, list[list[int]]]:
        """Geoms that touch anything, by body, together where they rub alike and meet the same; those that stand still alone."""
        groups: dict[int, dict[Any, list[int]]] = {}
        for geom in map(int, np.flatnonzero(self.meets.any(axis=1))):
            body = int(self.weld[geom])
            if body and body not in self.main:
                continue
            paired = tuple(pair for both, pair in self.pairs.items() if geom in both)
            key = (self.rubs_as[geom], self.meets[geom].tobytes(), paired) if body else geom
            groups.setdefault(body, {}).setdefault(key, []).append(geom)
        return {body: list(alike.values()) for body, alike in groups.items()}

    def moving(self, body: RigidBody, name: str, geoms: list[int], share: int) -> RigidBody | None:
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, np.array(body.orientation))
        turn = axes.reshape(3, 3)
        parts = []
        for geom in geoms:
            shape = self.shape(geom)
            if shape is None or isinstance(shape, Plane | HeightField):
                self.lacks.of(f"a geom of kind {self.kind(geom)} on what moves", self.m, "geom", geom)
                continue
            place = turn.T @ (self.d.geom_xpos[geom] - body.position)
            axes = turn.T @ self.d.geom_xmat[geom].reshape(3, 3)
            parts.append(Part(shape=shape, position=tuple(place), orientation=_quaternion(axes)))
        if not parts:
            return None
        mass, inertia = float(body.mass or 0.0) / share, tuple(moment / share for moment in body.inertia)
        shape = Compound(tuple(parts))
        return replace(
            body, name=name, shape=shape, mass=mass, inertia=inertia, material=self.material(geoms[0])
        )

    def standing(self, name: str, geom: int) -> RigidBody | None:
        shape = self.shape(geom)
        if shape is None:
            self.lacks.of(f"a geom of kind {self.kind(geom)}", self.m, "geom", geom)
            return None
        place, turn = self.d.geom_xpos[geom], self.d.geom_xmat[geom].reshape(3, 3)
        if isinstance(shape, HeightField):
            place = place - turn @ np.array([*self.m.hfield_size[self.m.geom_dataid[geom], :2], 0.0])
        return RigidBody(
            name=name, position=tuple(place), orientation=_quaternion(turn), motion="static", shape=shape,
            material=self.material(geom),
        )  # fmt: skip

    def kind(self, geom: int) -> str:
        return KIND.get(int(self.m.geom_type[geom]), "of this kind")

    def material(self, geom: int) -> Material:
        """Friction of the kinds that its condim has, and its rebound."""
        rubs = _friction(int(self.m.geom_condim[geom]), self.m.geom_friction[geom])
        return replace(rubs, restitution=self.rebounds[geom])

    def shape(self, geom: int) -> Shape | None:
        m = self.m
        kind, (x, y, z) = KIND.get(int(m.geom_type[geom])), (float(s) for s in m.geom_size[geom])
        if kind == "sphere":
            return Sphere(x)
        if kind == "capsule":
            return Capsule(x, 2.0 * y)
        if kind == "cylinder":
            return Cylinder(x, 2.0 * y)
        if kind == "box":
            return Box((2.0 * x, 2.0 * y, 2.0 * z))
        if kind == "plane":
            return Plane()
        if kind == "ellipsoid":
            return _hull(np.array([x, y, z]) * _spread(MOST_CORNERS))
        if kind == "mesh":
            mesh = int(m.geom_dataid[geom])
            first = int(m.mesh_vertadr[mesh])
            return _hull(np.array(m.mesh_vert[first : first + m.mesh_vertnum[mesh]], dtype=float))
        if kind == "hfield":
            return self.height_field(int(m.geom_dataid[geom]))
        return None

    def height_field(self, field: int) -> HeightField:
        """MuJoCo's rows go along y, its data are parts of the height; below its zero lies a base, which nothing meets here."""
        m = self.m
        rows, columns, first = (int(getattr(m, f"hfield_{name}")[field]) for name in ("nrow", "ncol", "adr"))
        half_x, half_y, top, _ = (float(s) for s in m.hfield_size[field])
        data = top * np.asarray(m.hfield_data[first : first + rows * columns], dtype=float).reshape(
            rows, columns
        )
        spacing = (2.0 * half_x / (columns - 1), 2.0 * half_y / (rows - 1))
        return HeightField(spacing, tuple(map(tuple, data.T.tolist())))


def rebound(solref: Any) -> float:
    """What a damped spring that never pulls gives back of the speed it is met with, where a damping ratio below 1 asks for it."""
    first, second = (
        float(number) for number in solref
    )  # a time constant and a ratio, or -stiffness and -damping
    ratio = second if first > 0.0 else -second / (2.0 * math.sqrt(-first)) if first else 1.0
    if not 0.0 <= ratio < 1.0:
        return 0.0
    angle = math.asin(ratio)
    return math.exp(-2.0 * math.tan(angle) * (0.5 * math.pi - angle))


def _friction(kinds: int, numbers: Any) -> Material:
    """Of the kinds that a condim has: sliding, turning and rolling."""
    sliding, spin, roll = (float(number) for number in numbers)
    return Material(
        friction=sliding if kinds > 1 else 0.0,
        torsional_friction=spin if kinds > 3 else 0.0,
        rolling_friction=roll if kinds > 4 else 0.0,
    )


def _spread(count: int) -> Array:
    """Directions: both ways along the axes, and the others evenly over a ball, by the golden angle."""
    count -= 6
    up = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    flat = np.sqrt(1.0 - up * up)
    return np.vstack([np.eye(3), -np.eye(3), np.column_stack([flat * np.cos(turn), flat * np.sin(turn), up])])


def _hull(points: Array) -> ConvexHull:
    return hull_of(points.tobytes())


@functools.lru_cache(maxsize=1024)  # a model is loaded for each of its runs, and its meshes are most of that
def hull_of(places: bytes) -> ConvexHull:
    """The hull of points, as float64; with more corners than ours holds, of those that reach furthest in directions spread
    evenly."""
    points: Array = np.frombuffer(places).reshape(-1, 3)
    count = MOST_CORNERS
    while True:
        kept = points
        if len(points) > count:
            kept = points[np.unique(np.argmax(points @ _spread(count).T, axis=0))]
        try:
            return ConvexHull(tuple(map(tuple, kept.tolist())))
        except SceneError:
            if count <= 8:
                raise
            count //= 2


def _quaternion(axes: Any) -> Any:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(axes).ravel())
    return tuple(found / np.linalg.norm(found))

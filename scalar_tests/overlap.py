"""How deep bodies go into each other, by geometry: of where they are alone, so that it can be asked of any engine alike."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from spook_tracker import engine

from . import case
from .configurations import configured

ARC = np.linspace(0.0, 0.5 * np.pi, 17)[1:-1]  # rad, of directions between two faces
AROUND = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]  # rad, where else a direction is tried
TURNED = 1e-8  # rad, the least turn by which it is
BLOCK = 512  # times looked at together
OURS = (1.0 / 60.0, 1.0 / 240.0)  # s, steps of our ladders
Array = np.ndarray[Any, Any]


def _extent(shape: engine.Shape, along: Array) -> Array:
    """How far a shape reaches from its centre [m] along unit vectors (..., 3) in its axes."""
    x, y, z = np.moveaxis(np.abs(along), -1, 0)
    if isinstance(shape, engine.Sphere):
        return np.full(x.shape, shape.radius)
    if isinstance(shape, engine.Box):
        a, b, c = shape.size
        return np.asarray(0.5 * (a * x + b * y + c * z))
    if isinstance(shape, engine.Capsule):
        return np.asarray(shape.radius + 0.5 * shape.length * z)
    if isinstance(shape, engine.Cylinder):
        return np.asarray(0.5 * shape.length * z + shape.radius * np.hypot(x, y))
    raise TypeError(f"no extent is known of {shape}")


def _rotations(orientations: Array) -> Array:
    """Matrices (..., 3, 3) of unit quaternions."""
    w, x, y, z = np.moveaxis(orientations, -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _ground(shape: engine.Shape) -> Array | None:
    """Which way a floor looks that is a plane, in its own axes."""
    if isinstance(shape, engine.Plane):
        return np.array(shape.normal, dtype=float)
    if isinstance(shape, engine.HeightField) and np.ptp(shape.heights) == 0.0:
        return np.array((0.0, 0.0, 1.0))
    return None


class _Pair:
    """Two convex bodies at many times: `depths` is how far the first reaches beyond where the second begins."""

    def __init__(self, shapes: tuple[engine.Shape, engine.Shape], places: Array, turns: Array) -> None:
        """Places (2, times, 3) [m] of the centres, turns (2, times, 3, 3)."""
        self.shapes, self.turns = shapes, turns
        self.apart = places[1] - places[0]

    def depths(self, times: Array, along: Array) -> Array:
        """Along unit vectors (times, n, 3) in world axes, from the first to the second [m]; below zero where they are apart."""
        found = -np.einsum("ti,tni->tn", self.apart[times], along)
        for shape, turn in zip(self.shapes, self.turns, strict=True):
            found = found + _extent(shape, along @ turn[times])
        return np.asarray(found)

    def axes(self, times: Array) -> Array:
        """Those of both bodies, both ways (times, 12, 3)."""
        axes = np.concatenate([np.swapaxes(turn[times], 1, 2) for turn in self.turns], axis=1)
        return np.concatenate([axes, -axes], axis=1)

    def directions(self, times: Array) -> Array:
        """Where the least depth is looked for at first (times, n, 3): along axes, between two of them, across two edges, and
        from centre to centre."""
        axes = self.axes(times)
        between = [
            np.cos(turn) * axes[:, [j]] + np.sin(turn) * axes[:, [k]]
            for half in ((0, 1, 2, 6, 7, 8), (3, 4, 5, 9, 10, 11))
            for j, k in itertools.combinations(half, 2)
            if k - j != 6
            for turn in ARC
        ]
        edges = np.cross(axes[:, :3, None], axes[:, None, 3:6]).reshape(len(times), 9, 3)
        found = np.concatenate([axes, *between, edges, -edges, self.apart[times][:, None]], axis=1)
        size = np.linalg.norm(found, axis=2, keepdims=True)
        return np.where(size > 1e-9, found / np.maximum(size, 1e-9), axes[:, :1])

    def least(self, times: Array, along: Array) -> Array:
        """The least depth from directions (times, 3) on, turned by less and less as long as that finds a smaller one [m].

        Extents have kinks where a direction is at right angles to an axis: such a circle is gone to, and along it.
        """
        each, turn, axes = np.arange(len(times)), 0.1, self.axes(times)
        best = self.depths(times, along[:, None])[:, 0]
        while turn > TURNED:
            one = np.cross(along, np.eye(3)[np.argmin(np.abs(along), axis=1)])
            one /= np.linalg.norm(one, axis=1, keepdims=True)
            other = np.cross(along, one)
            around = np.cos(AROUND)[:, None] * one[:, None] + np.sin(AROUND)[:, None] * other[:, None]
            aside = np.concatenate([around, np.cross(along[:, None], axes)], axis=1)
            squared = along[:, None] - np.einsum("ti,tni->tn", along, axes)[:, :, None] * axes
            tried = np.concatenate([along[:, None] + turn * aside, squared], axis=1)
            size = np.linalg.norm(tried, axis=2, keepdims=True)
            tried = np.where(size > 1e-9, tried / np.maximum(size, 1e-9), along[:, None])
            found = self.depths(times, tried)
            at = found.argmin(axis=1)
            better = found[each, at] < best
            along = np.where(better[:, None], tried[each, at], along)
            best = np.minimum(best, found[each, at])
            turn *= 1.0 if better.any() else 0.5
        return best


def _deepest_of(pair: _Pair, floor: float) -> float:
    """The largest depth of a pair at any time [m], `floor` where none is larger."""
    reach = sum(_reach(shape) for shape in pair.shapes)
    near = np.flatnonzero(np.linalg.norm(pair.apart, axis=1) < reach - floor)
    for choose in (pair.axes, pair.directions):  # the few that part most of them, then all
        bounds, starts = [np.empty(0)], [np.empty((0, 3))]
        for k in range(0, len(near), BLOCK):
            times = near[k : k + BLOCK]
            tried = choose(times)
            found = pair.depths(times, tried)
            at = found.argmin(axis=1)
            each = np.arange(len(times))
            bounds.append(found[each, at])
            starts.append(tried[each, at])
        bound, start = np.concatenate(bounds), np.concatenate(starts)
        deep = bound > floor
        near, bound, start = near[deep], bound[deep], start[deep]
    order = np.argsort(-bound)
    for k in range(0, len(order), 16):  # the most promising first: none is deeper than its bound
        some = order[k : k + 16]
        if bound[some[0]] <= floor:
            break
        floor = max(floor, float(pair.least(near[some], start[some]).max()))
    return floor


def _reach(shape: engine.Shape) -> float:
    """Radius of a ball about the centre that holds it [m]."""
    if isinstance(shape, engine.Box):
        return 0.5 * float(np.linalg.norm(shape.size))
    if isinstance(shape, engine.Cylinder):
        return float(np.hypot(shape.radius, 0.5 * shape.length))
    return float(_extent(shape, np.array((0.0, 0.0, 1.0))))


def _touching(scene: engine.Scene) -> Iterator[tuple[tuple[int, engine.Shape], tuple[int, engine.Shape]]]:
    """Bodies that may touch each other, by their places in the scene, with their shapes; the floor is the second."""
    apart = {frozenset(pair) for pair in scene.no_contact}
    apart |= {frozenset(end for end in joint.between if isinstance(end, str)) for joint in scene.constraints}
    solid = [
        (k, body, body.shape)
        for k, body in enumerate(scene.bodies)
        if isinstance(body, engine.RigidBody) and body.shape is not None
    ]
    for (j, one, shape), (k, other, second) in itertools.combinations(solid, 2):
        if frozenset((one.name, other.name)) in apart or one.motion == other.motion == "static":
            continue
        pair = (j, shape), (k, second)
        yield pair if _ground(shape) is None else pair[::-1]


def deepest(scene: engine.Scene, places: Array, orientations: Array) -> float:
    """The deepest overlap at any time [m] of all pairs that may touch: the least way that parts two bodies, so that a gap is 0.

    Places (times, bodies, 3) [m] and orientations (times, bodies, 4) of all bodies. Of balls, boxes, capsules and
    cylinders, and of level ground; TypeError of two cylinders and of other shapes. The least way of two convex bodies is the least of h(d) + k(−d) − d·x over directions d,
    h and k their extents and x from centre to centre (Cameron and Culley, 1986).
    """
    turns, found = _rotations(orientations), 0.0
    for (j, one), (k, other) in _touching(scene):
        normal = _ground(other)
        if normal is not None:
            up = turns[:, k] @ normal
            height = np.einsum("ti,ti->t", places[:, j] - places[:, k], up)
            reach = _extent(one, np.einsum("tji,tj->ti", turns[:, j], up))
            found = max(found, float((reach - height).max()))
        elif isinstance(one, engine.Cylinder) and isinstance(other, engine.Cylinder):
            raise TypeError(
                "two cylinders: their rims part in several directions, each the least of those near it"
            )
        else:
            both = [j, k]
            pair = _Pair((one, other), np.swapaxes(places[:, both], 0, 1), np.swapaxes(turns[:, both], 0, 1))
            found = _deepest_of(pair, found)
    return found


def overlap(
    simulate: case.Simulate,
    time_step: float,
    method: engine.Method,
    *,
    scene: Callable[[], engine.Scene],
    duration: float,
) -> float:
    """The deepest overlap of a run [m]."""
    observe = {
        "x": engine.Trace(quantity=engine.Position()),
        "q": engine.Trace(quantity=engine.Orientation()),
    }
    asked = scene()
    result = simulate(asked, time_step=time_step, duration=duration, method=method, observe=observe)
    return deepest(asked, result["x"], result["q"])


def ladder(
    scene: Callable[[], engine.Scene], duration: float, name: str = "overlap", of: str = "bodies"
) -> case.Ladder:
    """How deep a scene's bodies go into each other within that time [s]; others are asked finer steps than ours, which needs none."""
    return case.Ladder(
        name=name,
        description=f"how deep {of} go into each other, by geometry: not at all is right",
        unit="m",
        time_steps=tuple(1.0 / (60 * 4**k) for k in range(5)),
        configurations=tuple(
            replace(one, time_steps=OURS) for one in configured({"direct": None, "iterative": None})
        ),
        error=functools.partial(overlap, scene=scene, duration=duration),
        target_error=1e-4,
        target_seconds=0.1,
    )

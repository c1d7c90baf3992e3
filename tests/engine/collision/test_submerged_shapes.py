"""Buoyancy and drag of cylinder, cone and hull, forces and moments, against volumes and shadows found another way."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull as Hull
from scipy.spatial import HalfspaceIntersection
from scipy.spatial.transform import Rotation

from spook_tracker.engine import Cone, ConvexHull, Cylinder, Fluid, RigidBody, Scene, Shape, simulate

G, RHO, DRAG = 9.81, 1000.0, 0.8
STREAM = np.array((0.7, -0.4, 0.3))  # m/s
COUNT = 500  # of a grid in two directions: good to 5e-5, a ninth of that with 1500
WEDGE = ((0, 0, 0), (1.1, 0, 0), (0, 0.9, 0), (0.2, 0.3, 1.2), (1.0, 0.8, 0.4), (0.5, 0.1, 0.9))
MIDDLE = np.mean(WEDGE, axis=0)  # where the body's centre is put
LUMP = ConvexHull(tuple(tuple(np.array(p) - MIDDLE) for p in WEDGE))
SHAPES = [Cylinder(0.4, 0.9), Cylinder(0.7, 0.1), Cone(0.5, 1.2), Cone(0.8, 0.3), LUMP]


def push(shape: Shape, place: Any, turn: Rotation, **fluid: Any) -> tuple[Any, Any]:
    """Force [N] and torque [N m] about the centre of mass that the fluid gives, from one tiny step without spin."""
    h = 1e-6
    x, y, z, w = turn.as_quat()
    body = RigidBody(
        name="body", mass=1.0, inertia=(1.0,) * 3, shape=shape, position=place, orientation=(w, x, y, z)
    )
    sea = Fluid(name="sea", density=RHO, level=0.0, **fluid)
    scene = Scene(bodies=(body,), forces=(sea,), gravity=(0.0, 0.0, -G))
    state = simulate(scene, time_step=h, steps=1).final_state["body"]
    return state[7:10] / h + np.array((0.0, 0.0, G)), state[10:13] / h


def below(shape: Shape, place: Any, turn: Rotation) -> tuple[float, Any]:
    """Volume under the plane z = 0 [m³] and its centre [m]. A hull is cut by the half space; of cylinder and cone columns
    along the axis, over a polar grid, are cut each for itself."""
    up = turn.as_matrix()[2]  # height of a point p of the body: place z + up · p
    if isinstance(shape, ConvexHull):
        planes = np.vstack((Hull(shape.corners).equations, (*up, place[2])))
        corners = np.array(shape.corners)
        depth = place[2] + corners @ up
        if depth.max() < 0.0 or depth.min() > 0.0:
            cut = Hull(corners)
        else:
            lowest = corners[depth.argmin()]  # a little way from there to the middle lies inside of both
            inside = lowest + min(0.3, 0.5 * depth.min() / (depth.min() - place[2])) * -lowest
            cut = Hull(HalfspaceIntersection(planes, inside).intersections)
        middle = cut.points[cut.vertices].mean(axis=0)
        volume, moment = 0.0, np.zeros(3)
        for a, b, c in (cut.points[simplex] for simplex in cut.simplices):
            part = abs(np.linalg.det((a - middle, b - middle, c - middle))) / 6.0
            volume, moment = volume + part, moment + part * (a + b + c + middle) / 4.0
        return (
            (0.0, np.zeros(3))
            if depth.min() > 0.0
            else (volume, np.array(place) + turn.apply(moment / volume))
        )
    assert isinstance(shape, Cylinder | Cone)
    middles = (np.arange(COUNT) + 0.5) / COUNT
    r, angle = np.meshgrid(shape.radius * middles, 2.0 * math.pi * middles)
    x, y = r * np.cos(angle), r * np.sin(angle)
    if isinstance(shape, Cylinder):
        low, high = np.full_like(r, -0.5 * shape.length), np.full_like(r, 0.5 * shape.length)
    else:
        low, high = np.full_like(r, -0.25 * shape.height), shape.height * (0.75 - r / shape.radius)
    over = place[2] + up[0] * x + up[1] * y  # height of the column's middle: over + up[2] z
    if abs(up[2]) < 1e-12:
        high = np.where(over < 0.0, high, low)
    elif up[2] > 0.0:
        high = np.clip(-over / up[2], low, high)
    else:
        low = np.clip(-over / up[2], low, high)
    cell = 2.0 * math.pi * shape.radius / COUNT**2  # times r
    long = r * (high - low)
    volume = float(long.sum()) * cell
    if volume == 0.0:
        return 0.0, np.zeros(3)
    centre = np.array([float((long * c).sum()) for c in (x, y, 0.5 * (low + high))]) * cell / volume
    return volume, np.array(place) + turn.apply(centre)


def shadow(shape: Shape, turn: Rotation, along: Any) -> float:
    """Area of the convex hull of the shape's outline, projected [m²]."""
    around = np.linspace(0.0, 2.0 * math.pi, 3000, endpoint=False)
    ring = np.stack((np.cos(around), np.sin(around), np.zeros_like(around)), axis=-1)
    if isinstance(shape, Cylinder):
        ends = [shape.radius * ring + (0.0, 0.0, side * 0.5 * shape.length) for side in (-1.0, 1.0)]
        points = np.vstack(ends)
    elif isinstance(shape, Cone):
        points = np.vstack((shape.radius * ring - (0, 0, 0.25 * shape.height), (0, 0, 0.75 * shape.height)))
    else:
        assert isinstance(shape, ConvexHull)
        points = np.array(shape.corners)
    across = np.linalg.svd(np.array([along]))[2][1:]
    return float(Hull(turn.apply(points) @ across.T).volume)  # of a plane figure: its area


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_buoyancy_turns_as_the_centre_of_what_is_below_does(shape: Shape) -> None:
    """Turned at random; upright, leaning, lying and upside down, each at several depths."""
    turns = Rotation.random(6, rng=np.random.default_rng(3))
    leans = [Rotation.from_rotvec((0.0, lean, 0.0)) for lean in (0.0, 0.4, 1.2, math.pi / 2, 2.5, math.pi)]
    asked = [(turn, -0.3 + 0.12 * k) for k, turn in enumerate(turns)]
    asked += [(turn, depth) for turn in leans for depth in (-0.2, -0.05, 0.1, 0.22)]
    for turn, depth in asked:
        place = (0.3, -0.2, depth)
        # m³; where it lies each column of the grid is under water as a whole, or not
        grid = 5e-5 if abs(turn.as_matrix()[2, 2]) < 1e-12 else 2e-6
        force, torque = push(shape, place, turn)
        volume, centre = below(shape, place, turn)
        right = np.array((0.0, 0.0, RHO * G * volume))

        assert volume > 0.0 or depth > 0.0
        np.testing.assert_allclose(force, right, atol=grid * RHO * G)
        np.testing.assert_allclose(torque, np.cross(centre - place, right), atol=grid * RHO * G)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_drag_is_of_the_shadow_and_acts_where_buoyancy_does(shape: Shape) -> None:
    """−½ ρ C A |u| u times the submerged share of the volume."""
    whole, _ = below(shape, (0.0, 0.0, -9.0), Rotation.identity())
    for k, turn in enumerate(Rotation.random(4, rng=np.random.default_rng(7))):
        place = (0.1, 0.4, -0.2 + 0.1 * k)
        force, torque = push(shape, place, turn, velocity=tuple(STREAM), drag_coefficient=DRAG)
        calm, still = push(shape, place, turn)
        volume, centre = below(shape, place, turn)
        area = shadow(shape, turn, STREAM / np.linalg.norm(STREAM)) * volume / whole
        right = 0.5 * RHO * DRAG * area * np.linalg.norm(STREAM) * STREAM

        np.testing.assert_allclose(force - calm, right, rtol=2e-5)
        np.testing.assert_allclose(
            torque - still, np.cross(centre - place, right), atol=5e-5 * np.abs(right).max()
        )

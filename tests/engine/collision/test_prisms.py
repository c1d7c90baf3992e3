"""Hulls with faces of up to sixteen corners: they stand, tip and float as prisms do."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    ContactCount,
    ContactForce,
    ConvexHull,
    Cylinder,
    Fluid,
    HeightField,
    Material,
    Plane,
    Position,
    RigidBody,
    Scene,
    SceneError,
    Shape,
    Velocity,
    simulate,
)
from tests.scenes.seen import finals

H = 1.0 / 60.0
G = 10.0  # m/s²
ROUGH = Material(friction=2.0)
RADIUS, HEIGHT = 0.5, 0.6  # m


def prism(sides: int, radius: float = RADIUS) -> ConvexHull:
    turns = 2.0 * math.pi * np.arange(sides) / sides
    rim = [(radius * math.cos(t), radius * math.sin(t)) for t in turns]
    return ConvexHull(tuple((x, y, z) for x, y in rim for z in (-0.5 * HEIGHT, 0.5 * HEIGHT)))


def stands(
    below: Shape, sides: int, turn: float = 0.0, gravity: Any = (0.0, 0.0, -G), steps: int = 90
) -> Any:
    top = {Box: 0.5, ConvexHull: 0.5 * HEIGHT, Cylinder: 0.3}.get(type(below), 0.0)
    corner = (-1.1, -1.2, 0.0) if isinstance(below, HeightField) else (0.0, 0.0, 0.0)
    scene = Scene(
        bodies=(
            RigidBody(name="below", motion="static", shape=below, position=corner, material=ROUGH),
            RigidBody(
                name="prism",
                mass=2.0,
                shape=prism(sides),
                position=(0.0, 0.0, top + 0.5 * HEIGHT),
                orientation=(math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn)),
                material=ROUGH,
            ),
        ),
        gravity=gravity,
    )
    observe = finals(x=Position("prism"), force=ContactForce("prism"), points=ContactCount())
    return top, simulate(scene, time_step=H, steps=steps, observe=observe)


@pytest.mark.parametrize("sides", [9, 12, 16])
@pytest.mark.parametrize(
    "below",
    [
        Plane(),
        Box((2.0, 2.0, 1.0)),
        Box((0.6, 0.6, 1.0)),
        prism(16),
        prism(12, 0.3),
        Cylinder(0.4, 0.6),
        HeightField((0.37, 0.41), ((0.0,) * 8,) * 8),
    ],
    ids=["plane", "block", "post", "prism", "narrow prism", "drum", "triangles"],
)
def test_a_prism_stands_where_it_was_put_and_weighs_what_it_weighs(below: Shape, sides: int) -> None:
    top, found = stands(below, sides, turn=0.1)
    np.testing.assert_allclose(found["x"], (0.0, 0.0, top + 0.5 * HEIGHT), atol=1e-6)
    np.testing.assert_allclose(found["force"], (0.0, 0.0, 2.0 * G), atol=1e-6)


def test_two_prisms_of_sixteen_sides_keep_all_corners_of_what_they_share() -> None:
    """Turned by half a side the common polygon has thirty-two corners: none is left out."""
    _, found = stands(prism(16), 16, turn=math.pi / 16)
    assert int(found["points"]) == 32
    _, found = stands(Plane(), 16)
    assert int(found["points"]) == 16


@pytest.mark.parametrize("sides", [12, 16])
@pytest.mark.parametrize("part", [0, 1])
@pytest.mark.parametrize("share", [0.98, 1.02])
def test_a_prism_tips_where_its_weight_leaves_its_foot(sides: int, part: int, share: float) -> None:
    """Over a corner at tan α = 2 r/h, over a side at 2 r cos(π/n)/h: every corner of the foot carries."""
    reach = RADIUS if part == 0 else RADIUS * math.cos(math.pi / sides)
    lean = math.atan(share * 2.0 * reach / HEIGHT)
    way = 0.0 if part == 0 else math.pi / sides
    gravity = (G * math.sin(lean) * math.cos(way), G * math.sin(lean) * math.sin(way), -G * math.cos(lean))
    _, found = stands(Plane(), sides, gravity=gravity, steps=60)
    lifted = float(found["x"][2]) - 0.5 * HEIGHT
    assert (lifted > 1e-3) if share > 1.0 else abs(lifted) < 1e-6


@pytest.mark.parametrize("sides", [12, 16])
def test_water_lifts_a_prism_by_what_it_displaces(sides: int) -> None:
    area = 0.5 * sides * RADIUS**2 * math.sin(2.0 * math.pi / sides)
    body = RigidBody(name="b", mass=5.0, shape=prism(sides), position=(0.0, 0.0, 0.0))
    water = Fluid(name="water", density=1000.0, level=0.1)
    scene = Scene(bodies=(body,), forces=(water,), gravity=(0.0, 0.0, -G))
    found = simulate(scene, time_step=1e-6, steps=1, observe=finals(v=Velocity("b")))
    lift = (float(found["v"][2]) / 1e-6 + G) * 5.0
    assert lift == pytest.approx(1000.0 * G * area * (0.5 * HEIGHT + 0.1), rel=1e-9)


def test_seventeen_sides_are_refused() -> None:
    with pytest.raises(SceneError, match="17 corners, and at most 16"):
        prism(17)

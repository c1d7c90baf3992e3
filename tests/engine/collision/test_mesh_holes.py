"""Holes in meshes: what fits falls through as if nothing were there, what does not lies on the rim as geometry says."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    Capsule,
    ContactForce,
    Cylinder,
    Material,
    Method,
    Position,
    RigidBody,
    Scene,
    Sphere,
    TriangleMesh,
    Velocity,
    simulate,
)
from spook_tracker.engine.shapes import Shape
from tests.scenes.seen import finals, traces

H, G = 1.0 / 60.0, 10.0
INNER, OUTER = 0.3, 2.0  # m, half the side of the square hole and of the sheet
CORNERS = tuple(
    (side * x, side * y, 0.0) for side in (INNER, OUTER) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
)
FACES = tuple(
    face for k in range(4) for face in ((k, 4 + k, 4 + (k + 1) % 4), (k, 4 + (k + 1) % 4, (k + 1) % 4))
)
SHEET = TriangleMesh(CORNERS, FACES)


def fall(shape: Shape, place: Any, steps: int, method: Method | None = None, **fields: Any) -> Any:
    """A body let go over the sheet; its way, speed and what the sheet presses with at the end."""
    sheet = RigidBody(
        name="sheet", motion="static", shape=SHEET, position=(0, 0, 0), material=Material(friction=0.5)
    )
    body = RigidBody(
        name="body", mass=2.0, shape=shape, position=place, material=Material(friction=0.5), **fields
    )
    observe = traces(x=Position("body"), v=Velocity("body")) | finals(f=ContactForce("body", "sheet"))
    scene = Scene(bodies=(sheet, body), gravity=(0.0, 0.0, -G))
    return simulate(scene, time_step=H, steps=steps, observe=observe, method=method or Method())


@pytest.mark.parametrize(
    ("shape", "turn"),
    [
        (Sphere(0.29), (1.0, 0.0, 0.0, 0.0)),
        (Box((0.55, 0.55, 0.3)), (1.0, 0.0, 0.0, 0.0)),
        (Capsule(0.25, 0.6), (1.0, 0.0, 0.0, 0.0)),
        (Cylinder(0.29, 0.4), (1.0, 0.0, 0.0, 0.0)),
    ],
    ids=lambda one: type(one).__name__,
)
@pytest.mark.parametrize("speed", [0.0, -40.0])
def test_what_fits_through_a_hole_falls_freely(shape: Shape, turn: Any, speed: float) -> None:
    result = fall(shape, (0.0, 0.0, 1.0), 60, orientation=turn, velocity=(0.0, 0.0, speed))
    steps = np.arange(61)

    np.testing.assert_allclose(result["v"][:, 2], speed - G * H * steps, atol=1e-11)
    np.testing.assert_allclose(
        result["x"][:, 2], 1.0 + speed * H * steps - G * H * H * steps * (steps + 1) / 2.0, atol=1e-9
    )
    np.testing.assert_allclose(result["x"][:, :2], 0.0, atol=1e-12)


@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_a_ball_too_large_lies_on_the_middles_of_the_rims_edges(solver: Any) -> None:
    """Four edges at the distance a from the axis: its centre is √(r² − a²) high, and they carry its weight."""
    radius = 0.5
    high = math.sqrt(radius**2 - INNER**2)
    result = fall(Sphere(radius), (0.0, 0.0, high + 0.1), 120, Method(solver=solver, iterations=500))

    assert result["x"][-1] == pytest.approx((0.0, 0.0, high), abs=1e-6)
    assert np.abs(result["v"][-1]).max() < 1e-6
    assert result["f"] == pytest.approx((0.0, 0.0, 2.0 * G), abs=1e-4)


def test_a_ball_beside_the_hole_is_held_by_the_sheet_and_over_the_rim_it_rolls_in() -> None:
    radius = 0.2
    beside = fall(Sphere(radius), (INNER + 0.05, 0.0, radius), 60)
    over = fall(Sphere(radius), (INNER - 0.05, 0.0, math.sqrt(radius**2 - 0.05**2) + 1e-6), 90)

    assert beside["x"][-1] == pytest.approx((INNER + 0.05, 0.0, radius), abs=1e-9)
    assert over["x"][-1, 2] < -1.0  # through the hole
    assert (
        np.abs(over["x"][over["x"][:, 2] > 0.0][:, 0]).max() <= INNER - 0.05 + 1e-6
    )  # never up again onto the sheet
    # As long as it is above, no part of the rim is inside of it.
    above = over["x"][over["x"][:, 2] > 0.0]
    assert np.hypot(above[:, 0] - INNER, above[:, 2]).min() > radius - 2e-3


def test_a_plank_bridges_the_hole_and_a_short_one_does_not() -> None:
    bridge = fall(Box((1.0, 0.1, 0.1)), (0.0, 0.0, 0.05), 60)
    short = fall(Box((0.5, 0.1, 0.1)), (0.0, 0.0, 0.05), 60)

    assert bridge["x"][-1, 2] == pytest.approx(0.05, abs=1e-9)
    assert bridge["f"] == pytest.approx((0.0, 0.0, 2.0 * G), rel=1e-6, abs=1e-6)
    assert short["x"][-1, 2] < -4.0

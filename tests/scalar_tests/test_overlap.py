"""How deep bodies go into each other: against closed forms, and against the distances of MuJoCo where it is installed."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from spook_tracker.engine import Box, Capsule, Cylinder, HeightField, Plane, RigidBody, Scene, Shape, Sphere
from spook_tracker.scalar_tests.overlap import deepest

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
SIDEWAYS = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)  # z to −y
ASKEW = (math.cos(math.pi / 8), 0.0, 0.0, math.sin(math.pi / 8))  # an eighth of a turn about z
CUBE, BALL = Box((0.2, 0.2, 0.2)), Sphere(0.1)
CORNER = 0.1 + (0.1 - 0.01) / math.sqrt(3.0)  # m: centre of a ball along each axis, .01 m beyond a corner
SHAPES = (BALL, Box((0.2, 0.3, 0.4)), Capsule(0.05, 0.2), Cylinder(0.1, 0.15))


def solid(name: str, shape: Shape) -> RigidBody:
    return RigidBody(name=name, mass=1.0, shape=shape, position=(0.0, 0.0, 0.0))


def depth(one: Shape, other: Shape, *at: tuple[tuple[float, ...], tuple[float, ...]]) -> float:
    """Of the first at places and turns beside the second at the origin."""
    scene = Scene(bodies=(solid("one", one), solid("other", other)), contacts=False)
    places = np.array([[place, (0.0, 0.0, 0.0)] for place, _ in at])
    turns = np.array([[turn, UPRIGHT] for _, turn in at])
    return deepest(scene, places, turns)


@pytest.mark.parametrize(
    ("one", "other", "place", "turn", "right"),
    [
        (BALL, BALL, (0.0, 0.0, 0.19), UPRIGHT, 0.01),
        (BALL, BALL, (0.0, 0.0, 0.21), UPRIGHT, 0.0),
        (BALL, CUBE, (CORNER, CORNER, CORNER), UPRIGHT, 0.01),
        (BALL, CUBE, (0.0, 0.1 + 0.09 * 0.6, 0.1 + 0.09 * 0.8), UPRIGHT, 0.01),
        (CUBE, CUBE, (0.19, 0.05, -0.1), UPRIGHT, 0.01),
        (CUBE, CUBE, (0.1 * math.sqrt(2.0) + 0.09, 0.0, 0.0), ASKEW, 0.01),
        (Capsule(0.05, 0.2), Capsule(0.05, 0.2), (0.09, 0.07, 0.03), SIDEWAYS, 0.01),
        (Cylinder(0.1, 0.15), CUBE, (0.19, 0.0, 0.05), UPRIGHT, 0.01),
        (Cylinder(0.1, 0.15), CUBE, (0.1 + 0.09 * 0.8, 0.02, 0.1 + 0.09 * 0.6), SIDEWAYS, 0.01),
    ],
)
def test_two_bodies_overlap_by_the_least_way_that_parts_them(
    one: Shape, other: Shape, place: tuple[float, ...], turn: tuple[float, ...], right: float
) -> None:
    assert depth(one, other, (place, turn)) == pytest.approx(right, abs=1e-9)


def test_the_deepest_of_all_times_counts() -> None:
    along = [((0.0, 0.0, 0.3 - 0.001 * k), UPRIGHT) for k in (*range(149), *range(147, -1, -1))]

    assert depth(BALL, CUBE, *along) == pytest.approx(0.048, abs=1e-9)


@pytest.mark.parametrize(
    ("shape", "turn", "reach"),
    [
        (BALL, ASKEW, 0.1),
        (CUBE, (math.cos(math.pi / 8), math.sin(math.pi / 8), 0.0, 0.0), 0.1 * math.sqrt(2.0)),
        (Capsule(0.05, 0.2), UPRIGHT, 0.15),
        (Cylinder(0.1, 0.15), SIDEWAYS, 0.1),
    ],
)
def test_level_ground_is_a_half_space(shape: Shape, turn: tuple[float, ...], reach: float) -> None:
    for ground in (Plane(), HeightField((1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)))):
        floor = RigidBody(name="floor", motion="static", shape=ground, position=(0.0, 0.0, 0.5))
        scene = Scene(bodies=(floor, solid("body", shape)))
        places = np.array([[(0.0, 0.0, 0.5), (0.2, 0.3, 0.5 + reach - 0.003)]])

        assert deepest(scene, places, np.array([[UPRIGHT, turn]])) == pytest.approx(0.003, abs=1e-12)


def test_pairs_that_do_not_touch_are_left_out() -> None:
    bodies = (solid("one", BALL), solid("other", BALL))
    places, turns = np.zeros((1, 2, 3)), np.tile(UPRIGHT, (1, 2, 1))

    assert deepest(Scene(bodies=bodies), places, turns) == pytest.approx(0.2)
    assert deepest(Scene(bodies=bodies, no_contact=(("one", "other"),)), places, turns) == 0.0


def test_two_cylinders_are_refused() -> None:
    with pytest.raises(TypeError, match="rims part in several directions"):
        depth(SHAPES[-1], SHAPES[-1], ((0.0, 0.0, 0.1), UPRIGHT))


def geom(shape: Shape) -> str:
    if isinstance(shape, Sphere):
        return f'type="sphere" size="{shape.radius}"'
    if isinstance(shape, Box):
        return f'type="box" size="{" ".join(str(0.5 * edge) for edge in shape.size)}"'
    assert isinstance(shape, Capsule | Cylinder)
    return f'type="{shape.kind}" size="{shape.radius} {0.5 * shape.length}"'


@pytest.mark.parametrize(
    ("one", "other"),
    list(itertools.combinations_with_replacement(SHAPES, 2))[:-1],
    ids=lambda shape: shape.kind,
)
def test_random_pairs_are_as_deep_as_mujoco_has_them(one: Shape, other: Shape) -> None:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option><flag nativeccd="enable"/></option><worldbody><body><freejoint/><geom {geom(one)}/></body>'
        f"<geom {geom(other)}/></worldbody></mujoco>"
    )
    model.opt.ccd_tolerance, model.opt.ccd_iterations = 1e-10, 500
    data, rng, found = mujoco.MjData(model), np.random.default_rng(7), []
    while len(found) < 40:
        way, turn = rng.normal(size=3), rng.normal(size=4)
        data.qpos[:] = *(rng.uniform(0.05, 0.4) * way / np.linalg.norm(way)), *(turn / np.linalg.norm(turn))
        mujoco.mj_forward(model, data)
        right = -mujoco.mj_geomDistance(model, data, 1, 0, 1.0, None)
        if 1e-4 < right < 0.03:
            mine = depth(one, other, (tuple(data.qpos[:3]), tuple(data.qpos[3:])))
            found.append(mine - right)

    assert np.abs(found).max() < 1e-6

"""All pairs of shapes against a distance found by a search over directions: depth where they overlap, none where not.

All that is bounded among itself, everything on a plane, and on triangles, those of height fields and of meshes with holes.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spook_tracker.engine import HeightField, Maximum, Penetration, Plane, Shape, TriangleMesh
from tests.engine.collision.test_rims import DIRECTIONS, SHAPES, body, farthest, fixed, gap, quaternion, run

RIMMED = {"can", "coin", "cone", "hat"}
PAIRS = [  # two shapes, a seed, and m before and behind the touch: the search finds what has rims less sharply
    (*pair, seed, near)
    for pair in itertools.combinations_with_replacement(SHAPES, 2)
    for seed, near in (((1, 1e-3),) if RIMMED & {*pair} else ((0, 1e-4), (1, 1e-4)))
]
FLAT = 1e-5  # m: a face is preferred within 1e-5 of the thickness, 0.8 m at most


def depth(*bodies: Any) -> float:
    found = run(*bodies, steps=1, gravity=(0, 0, 0), depth=Maximum(quantity=Penetration()))
    return float(found["depth"])


@pytest.mark.parametrize(("first", "second", "seed", "near"), PAIRS)
def test_two_solids_are_as_deep_as_a_search_over_all_directions_says(
    first: str, second: str, seed: int, near: float
) -> None:
    """Deep in each other, and moved along their connection to just before and behind the touch."""
    rng = np.random.default_rng([seed, *map(list(SHAPES).index, (first, second))])
    one, two = SHAPES[first], SHAPES[second]
    turn, other = Rotation.random(rng=rng), Rotation.random(rng=rng)
    away = rng.standard_normal(3)
    away /= np.linalg.norm(away)
    reach = farthest(one, -away @ turn.as_matrix()) + farthest(two, away @ other.as_matrix())

    def found(place: Any) -> float:
        return depth(
            fixed(two, orientation=quaternion(other)),
            body(one, position=tuple(map(float, place)), orientation=quaternion(turn)),
        )

    deep = 0.5 * reach * away
    wanted, _ = gap(one, turn.as_matrix(), deep, two, other.as_matrix())
    assert found(deep) == pytest.approx(max(0.0, -wanted), abs=FLAT)
    apart = 1.3 * reach * away
    distance, normal = gap(one, turn.as_matrix(), apart, two, other.as_matrix())
    assert distance > 0.0
    assert found(apart - (distance - near) * normal) == 0.0
    within = apart - (distance + near) * normal
    wanted, _ = gap(one, turn.as_matrix(), within, two, other.as_matrix())
    assert -near - 1e-8 < wanted < 0.0  # or less along another direction
    assert found(within) == pytest.approx(-wanted, abs=FLAT)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", SHAPES)
def test_on_a_plane_it_is_as_deep_as_its_lowest_point(name: str, seed: int) -> None:
    """The plane leans, too; exact but for the rounding of places of a metre."""
    rng = np.random.default_rng([seed, list(SHAPES).index(name)])
    shape, turn, lean = SHAPES[name], Rotation.random(rng=rng), Rotation.random(rng=rng)
    up = lean.apply((0.0, 0.0, 1.0))
    lowest = float(farthest(shape, -up @ turn.as_matrix()))
    aside = rng.standard_normal(3)
    aside -= (aside @ up) * up
    for deeper in (-1e-9, 1e-9, 1e-3, 0.5 * lowest):
        place = aside + (lowest - deeper) * up
        found = depth(
            fixed(Plane(), orientation=quaternion(lean)),
            body(shape, position=tuple(map(float, place)), orientation=quaternion(turn)),
        )
        assert found == pytest.approx(max(0.0, deeper), abs=1e-12)


def hills(rng: np.random.Generator) -> HeightField:
    return HeightField((0.5, 0.4), tuple(tuple(map(float, row)) for row in rng.uniform(0, 0.3, (7, 7))))


def holed(rng: np.random.Generator) -> TriangleMesh:
    whole = hills(rng)
    return TriangleMesh(whole.corners, tuple(face for face in whole.faces if rng.random() > 0.25))


def nearest(shape: Shape, turn: Any, place: Any, mesh: Any) -> tuple[float, Any]:
    """The least distance to all triangles, and its direction. Along any direction the gap is no more than the distance,
    so that most triangles are seen to be farther off than the best without a search of their own."""
    corners = np.array(mesh.corners)[np.array(mesh.faces)]
    low = farthest(shape, -DIRECTIONS @ turn)
    along = np.max(DIRECTIONS @ place - low - np.max(corners @ DIRECTIONS.T, axis=1), axis=1)
    best, direction = math.inf, np.zeros(3)
    for k in np.argsort(along):
        if along[k] >= best:
            break
        distance, normal = gap(shape, turn, place, corners[k], np.eye(3))
        if distance < best:
            best, direction = distance, normal
    return best, direction


@pytest.mark.parametrize("make", [hills, holed])
@pytest.mark.parametrize("name", SHAPES)
def test_it_touches_triangles_where_the_nearest_of_all_says(name: str, make: Any) -> None:
    """From above, over faces, ridges, tips, valleys and the rims of holes."""
    rng = np.random.default_rng([make is holed, list(SHAPES).index(name)])
    mesh, shape, turn = make(rng), SHAPES[name], Rotation.random(rng=rng)
    place = np.array((*rng.uniform(1.0, 1.5, 2), 1.4))
    distance, normal = nearest(shape, turn.as_matrix(), place, mesh)
    assert 0.0 < distance < 2.0 and normal[2] > 0.0
    near = 5e-5
    for closer in (-near, near):
        here = place - (distance + closer) * normal
        found = depth(
            fixed(mesh), body(shape, position=tuple(map(float, here)), orientation=quaternion(turn))
        )
        if closer < 0.0:
            assert found == 0.0
            continue
        # Along another direction one triangle may be left by less; its neighbours may be in that way.
        least, _ = nearest(shape, turn.as_matrix(), here, mesh)
        assert -least - FLAT <= found <= near + FLAT and least < 0.0

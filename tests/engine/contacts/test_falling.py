"""Boxes and balls that fall on each other: overlaps by a geometry of our own, of all pairs, met or not."""

from __future__ import annotations

from itertools import combinations, product
from typing import Literal

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Box,
    Method,
    Orientation,
    Position,
    RigidBody,
    Shape,
    Sphere,
    simulate,
)
from spook_tracker.engine.result import Array
from spook_tracker.scalar_tests.stacks import falling_pile
from tests.scenes.seen import traces

TURNED = np.array(
    [
        [[0, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[0, 0, -1], [0, 0, 0], [1, 0, 0]],
        [[0, 1, 0], [-1, 0, 0], [0, 0, 0]],
    ]
)
CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
LEFT_BY_SWEEPS = 1e-3  # of a body's radius: a residual of 20 mm/s over a step


def axes_of(turn: Array) -> Array:
    """The body's axes as columns, of a unit quaternion."""
    w, x, y, z = turn
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def boxes_overlap(place: Array, axes: Array, other_place: Array, other_axes: Array) -> float:
    """The least overlap of two boxes' shadows on the normals of faces and pairs of edges [m]; negative if apart."""
    edges = (
        (axes.T @ TURNED @ other_axes).transpose(1, 2, 0).reshape(-1, 3)
    )  # of each pair, the cross product
    lengths = np.sqrt((edges * edges).sum(axis=1))
    normals = np.vstack([axes.T, other_axes.T, edges[lengths > 1e-6] / lengths[lengths > 1e-6, None]])
    size = np.array(falling_pile.EDGES)
    one = normals @ (place[:, None] + axes @ (CORNERS * size).T)
    two = normals @ (other_place[:, None] + other_axes @ (CORNERS * size).T)
    return float(np.minimum(one.max(1) - two.min(1), two.max(1) - one.min(1)).min())


def ball_overlaps_box(centre: Array, place: Array, axes: Array) -> float:
    """The same of a ball whose centre is outside a box."""
    half, at = 0.5 * np.array(falling_pile.EDGES), axes.T @ (centre - place)
    return float(falling_pile.RADIUS - np.linalg.norm(at - np.clip(at, -half, half)))


def overlap(one: tuple[Shape, Array, Array], two: tuple[Shape, Array, Array]) -> float:
    (shape, place, axes), (other, other_place, other_axes) = one, two
    if isinstance(shape, Sphere) and isinstance(other, Sphere):
        return float(2.0 * falling_pile.RADIUS - np.linalg.norm(place - other_place))
    if isinstance(shape, Sphere):
        return ball_overlaps_box(place, other_place, other_axes)
    if isinstance(other, Sphere):
        return ball_overlaps_box(other_place, place, axes)
    return boxes_overlap(place, axes, other_place, other_axes)


def overlaps(
    seed: int, friction: float, solver: Literal["direct", "iterative"] = "direct"
) -> tuple[float, float]:
    """The deepest overlap of two bodies [m], and that beyond what both may turn aside in the step before."""
    scene = falling_pile.scene(seed, 0.0, friction)
    shapes = {
        k: body.shape
        for k, body in enumerate(scene.bodies)
        if isinstance(body, RigidBody) and isinstance(body.shape, Box | Sphere)
    }
    run = simulate(
        scene,
        time_step=falling_pile.TIME_STEP,
        steps=falling_pile.STEPS,
        method=Method(solver=solver),
        observe=traces(x=Position(), q=Orientation(), w=AngularVelocity()),
    )
    deepest = unexplained = -np.inf
    for x, q, w in zip(run["x"], run["q"], run["w"], strict=True):
        at = {k: (shape, x[k], axes_of(q[k])) for k, shape in shapes.items()}
        turned = falling_pile.TIME_STEP * np.linalg.norm(w, axis=1)
        aside = {
            k: 0.5 * falling_pile.REACH * turned[k] ** 2 * isinstance(shape, Box)
            for k, shape in shapes.items()
        }
        apart = np.linalg.norm(x[:, None] - x, axis=2)
        for i, j in combinations(at, 2):
            if apart[i, j] > 2.0 * falling_pile.REACH:
                continue
            depth = overlap(at[i], at[j])
            deepest, unexplained = max(deepest, depth), max(unexplained, depth - aside[i] - aside[j])
    return deepest, unexplained


FALLS = [(52, 0.4), (64, 0.4), (77, 0.4), (95, 0.4), (118, 0.4), (35, 0.0), (54, 0.0), (71, 0.0), (105, 0.0)]


@pytest.mark.parametrize(("seed", "friction"), FALLS)
def test_what_overlaps_where_a_step_ends_parts_however_it_is_turned(seed: int, friction: float) -> None:
    """Pushed out of one edge, a box came down on another, up to 19 mm deep, and was left there: the displacement had not
    halved the overlap. Or it was pushed into a neighbour, and what overlaps there was taken for a seam; or into one that
    was not looked at, by .08 mm."""
    deepest, unexplained = overlaps(seed, friction)

    assert deepest < LEFT_BY_SWEEPS * falling_pile.RADIUS
    assert unexplained < 1e-9


@pytest.mark.parametrize("friction", falling_pile.FRICTIONS)
@pytest.mark.parametrize("seed", range(10))
def test_iterations_part_again_what_comes_down_elsewhere(seed: int, friction: float) -> None:
    """Parted once a step, five of these piles were left with up to 13 mm more than turns explain. Sweeps that count as settled
    may leave a speed for a step; one pile is left with .6 mm."""
    scene = falling_pile.scene(seed, 0.0, friction)
    settled = Method().residual_of("unsettled_residual", scene) * falling_pile.TIME_STEP

    assert overlaps(seed, friction, "iterative")[1] < settled


@pytest.mark.parametrize("friction", falling_pile.FRICTIONS)
@pytest.mark.parametrize("seed", range(5))
def test_piles_overlap_by_no_more_than_what_turns_unforeseen(seed: int, friction: float) -> None:
    assert overlaps(seed, friction)[1] < 1e-7


@pytest.mark.parametrize(
    ("seed", "restitution"),
    [(8, 0.0), (44, 0.0), (50, 0.1), (53, 0.1), (91, 0.0), (148, 0.0), (172, 0.1), (183, 0.0)],
)
def test_what_comes_down_on_another_is_no_slider_at_its_side(seed: int, restitution: float) -> None:
    """Taken for one that iterations have left falling beside a tile, it would come to lie up to 10 mm in it."""
    friction = 0.0 if seed == 91 else 0.4
    fall = falling_pile.read(simulate, seed, restitution, friction, falling_pile.SWEEPS)
    assert (fall.depth - fall.bent).max() < 1e-7


@pytest.mark.parametrize("seed", [46, 61, 146, 233, 234, 256])
def test_a_side_skipped_between_iterations_is_met_if_the_body_gets_there(seed: int) -> None:
    """Between iterations it was taken for one that slides by, as fast as it still fell; its velocity was the one they ended
    with, and was not tested again: it came to lie 3 to 80 mm in the other."""
    fall = falling_pile.read(simulate, seed, 0.0, 0.0, falling_pile.SWEEPS)
    assert (fall.depth - fall.bent).max() < 1e-7

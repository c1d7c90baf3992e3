"""Convex hulls: faces and moments against SciPy, contacts against a distance computed another way, and what is refused."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial import ConvexHull as Reference
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from spook_tracker.engine import (
    Box,
    Capsule,
    Compound,
    ContactForce,
    ConvexHull,
    Fluid,
    Material,
    Orientation,
    Part,
    Penetration,
    Plane,
    Position,
    RigidBody,
    Scene,
    SceneError,
    Shape,
    Sphere,
    simulate,
)
from tests.scenes.corpus import solid
from tests.scenes.seen import finals, traces

H = 1.0 / 60.0
CUBE = tuple(itertools.product((-0.5, 0.5), repeat=3))


def ball_of(rng: np.random.Generator, count: int) -> Any:
    """Points on a sphere, none of them inside the hull."""
    points = rng.standard_normal((count, 3))
    return 0.5 * points / np.linalg.norm(points, axis=1)[:, None]


def wedge() -> Any:
    """A voussoir: a hexahedron whose faces are no rectangles."""
    corners = [
        (r * math.cos(a), y, r * math.sin(a)) for r in (0.9, 1.1) for y in (-0.2, 0.2) for a in (1.2, 1.6)
    ]
    return np.array(corners) - np.mean(corners, axis=0)


def solids(rng: np.random.Generator) -> list[Any]:
    return [
        np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) * 0.3,
        wedge(),
        ball_of(rng, 12),
        ball_of(rng, 24) * (1.0, 0.6, 0.3),
    ]


# --- faces and moments ----------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(6))
def test_faces_enclose_what_another_hull_encloses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.vstack((ball_of(rng, 14), 0.3 * ball_of(rng, 6)))  # some inside
    hull, reference = ConvexHull(tuple(map(tuple, points))), Reference(points)

    assert hull.volume == pytest.approx(reference.volume, rel=1e-12)
    assert {tuple(c) for c in hull.corners} == {tuple(points[i]) for i in reference.vertices}
    normals = []
    for face in hull.faces:
        a, b, c = (np.array(hull.corners[i]) for i in face[:3])
        normals.append(np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a)))
    assert all(np.abs(reference.equations[:, :3] - n).max(axis=1).min() < 1e-9 for n in normals)


def test_a_cube_has_six_faces_however_many_points_lie_on_it() -> None:
    rng = np.random.default_rng(3)
    on_faces = [(0.5, *rng.uniform(-0.5, 0.5, 2)) for _ in range(9)] + [(0.5, 0.5, z) for z in (-0.1, 0.2)]
    hull = ConvexHull((*CUBE, *map(tuple, on_faces), (0.0, 0.0, 0.0)))  # type: ignore[arg-type]

    assert sorted(hull.corners) == sorted(CUBE)
    assert sorted(len(face) for face in hull.faces) == [4] * 6


@pytest.mark.parametrize(
    ("corners", "edge", "share"),
    [
        (((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)), math.sqrt(8.0), 1.0 / 20.0),  # tetrahedron
        (((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)), math.sqrt(2.0), 1.0 / 10.0),
        (CUBE, 1.0, 1.0 / 6.0),
    ],
)
def test_regular_solids_have_their_textbook_inertia(corners: Any, edge: float, share: float) -> None:
    assert ConvexHull(corners).inertia(3.0) == pytest.approx((3.0 * share * edge**2,) * 3, rel=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_a_hull_anywhere_is_put_at_its_centre_along_its_principal_axes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = ball_of(rng, 10) * (1.0, 0.7, 0.4) + rng.standard_normal(3)
    shape, position, orientation = ConvexHull.placed(tuple(map(tuple, points)))
    turn = Rotation.from_quat(orientation, scalar_first=True)
    back = turn.apply(shape.corners) + position

    assert max(np.abs(points - corner).max(axis=1).min() for corner in back) < 1e-12
    # Another decomposition: SciPy's tetrahedra, each with the exact four-point rule for squares.
    place = (5.0 - math.sqrt(5.0)) / 20.0
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for simplex in Delaunay(points).simplices:
        corners = points[simplex]
        part = abs(np.linalg.det(corners[1:] - corners[0])) / 6.0
        for k in range(4):
            weights = np.full(4, place)
            weights[k] = 1.0 - 3.0 * place
            p = weights @ corners
            volume, first, second = (
                volume + part / 4,
                first + part / 4 * p,
                second + part / 4 * np.outer(p, p),
            )
    centre = first / volume
    second = second / volume - np.outer(centre, centre)
    inertia = np.trace(second) * np.eye(3) - second
    found = turn.as_matrix() @ np.diag(shape.inertia(1.0)) @ turn.as_matrix().T
    np.testing.assert_allclose(position, centre, atol=1e-13)
    np.testing.assert_allclose(found, inertia, atol=1e-13)


# --- contact against an independent distance ------------------------------------------------------------


def core(shape: Shape) -> tuple[Any, float]:
    """Points whose hull, grown by a radius, is the shape."""
    if isinstance(shape, Sphere):
        return np.zeros((1, 3)), shape.radius
    if isinstance(shape, Capsule):
        return np.array([(0, 0, -shape.length / 2), (0, 0, shape.length / 2)]), shape.radius
    if isinstance(shape, Box):
        return np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * shape.size, 0.0
    assert isinstance(shape, ConvexHull)
    return np.array(shape.corners), 0.0


def connection(first: Any, second: Any) -> Any:
    """The shortest vector from the hull of `second` to that of `first`: least squares over their differences."""
    differences = (first[:, None, :] - second[None, :, :]).reshape(-1, 3)
    heavy = 1e4
    weights, _ = nnls(
        np.vstack((differences.T, heavy * np.ones(len(differences)))), np.array([0, 0, 0, heavy])
    )
    return (weights / weights.sum()) @ differences


def depth_of(first: Any, second: Any) -> float:
    """How deep two hulls overlap: the facet of their Minkowski difference nearest to the origin."""
    differences = (first[:, None, :] - second[None, :, :]).reshape(-1, 3)
    return float(-Reference(differences, qhull_options="QJ Pp").equations[:, 3].max())


def overlap(one: RigidBody, two: RigidBody) -> float:
    result = simulate(Scene(bodies=(one, two)), time_step=H, steps=1, observe=traces(d=Penetration()))
    return float(result["d"].max())


def others(rng: np.random.Generator) -> list[Shape]:
    return [
        Sphere(0.2),
        Capsule(0.1, 0.5),
        Box((0.5, 0.3, 0.2)),
        *(ConvexHull(tuple(map(tuple, s))) for s in solids(rng)),
    ]


def pair(
    rng: np.random.Generator, first: Shape, second: Shape, away: float
) -> tuple[RigidBody, RigidBody, Any, Any]:
    bodies, places = [], []
    for name, shape, position in (
        ("one", first, away * ball_of(rng, 1)[0] * 2.0),
        ("two", second, np.zeros(3)),
    ):
        turn = Rotation.random(rng=rng)
        w, x, y, z = turn.as_quat(scalar_first=True)
        bodies.append(
            solid(
                name,
                shape,
                tuple(position),
                inertia=(0.1, 0.1, 0.1),
                orientation=(w, x, y, z),
                motion="dynamic" if name == "one" else "static",
            )
        )
        places.append(turn.apply(core(shape)[0]) + position)
    return bodies[0], bodies[1], places[0], places[1]


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", range(7))
def test_a_hull_touches_others_where_least_squares_say(kind: int, seed: int) -> None:
    """Brought together along their shortest connection they touch with its length, not a millionth before."""
    rng = np.random.default_rng([seed, kind])
    first = others(rng)[kind]
    second = ConvexHull(tuple(map(tuple, solids(rng)[seed % 4])))
    one, two, points, others_points = pair(rng, first, second, 2.5)
    way = connection(points, others_points)
    distance = float(np.linalg.norm(way))
    near = 1e-6
    for closer, touching in ((-near, False), (near, True)):
        shift = (distance - core(first)[1] + closer) / distance * way
        moved = solid(
            "one",
            first,
            tuple(np.array(one.position) - shift),
            inertia=one.inertia,
            orientation=one.orientation,
        )
        found = overlap(moved, two)
        assert (0.0 < found <= near * 1.001) if touching else found == 0.0, (closer, found)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", range(7))
def test_a_hull_is_parted_along_the_shortest_way_out(kind: int, seed: int) -> None:
    rng = np.random.default_rng([seed, kind, 1])
    first = others(rng)[kind]
    second = ConvexHull(tuple(map(tuple, solids(rng)[seed % 4])))
    one, two, points, other_points = pair(rng, first, second, 0.1)
    if isinstance(first, Sphere | Capsule):
        one, two = two, one
    reference = depth_of(points, other_points) + core(first)[1]
    movable = solid("m", one.shape, one.position, inertia=(0.1,) * 3, orientation=one.orientation)
    fixed = solid("f", two.shape, two.position, None, motion="static", orientation=two.orientation)

    # Near ties go to faces: a ten-thousandth of the thickness.
    assert overlap(movable, fixed) == pytest.approx(reference, abs=1e-4)


# --- what rests on it -----------------------------------------------------------------------------------


ROUGH = Material(friction=0.5)
GROUND = RigidBody(name="ground", motion="static", shape=Plane(), position=(0, 0, 0), material=ROUGH)


@pytest.mark.parametrize("count", [1, 4])
def test_cubes_as_hulls_stack_as_boxes_do(count: int) -> None:
    found = []
    for shape in (Box((1, 1, 1)), ConvexHull(CUBE)):
        bodies = [
            RigidBody(name=str(k), mass=1.0, shape=shape, position=(0.05 * k, 0, 0.5 + k), material=ROUGH)
            for k in range(count)
        ]
        observe = finals(
            x=Position(str(count - 1)), q=Orientation(str(count - 1)), force=ContactForce("0", "ground")
        )
        found.append(
            simulate(
                Scene(bodies=(GROUND, *bodies), gravity=(0, 0, -10.0)),
                time_step=H,
                steps=120,
                observe=observe,
            )
        )
    for name in ("x", "q", "force"):
        np.testing.assert_allclose(found[1][name], found[0][name], atol=1e-9)
    assert found[1]["force"][2] == pytest.approx(10.0 * count, abs=1e-9)


def test_a_hull_in_a_compound_and_in_water_is_the_box_it_looks_like() -> None:
    half = tuple((0.5 * x, 0.3 * y, 0.4 * z) for x, y, z in CUBE)
    found = []
    for shape in (Box((0.5, 0.3, 0.4)), ConvexHull(half)):
        body = solid(
            "b",
            Compound((Part(shape=shape, position=(0.0, 0.0, -0.1)),)),
            (0, 0, 0.1),
            30.0,
            inertia=(0.6, 0.8, 0.7),
            orientation=(math.cos(0.1), math.sin(0.1), 0.0, 0.0),
        )
        water = Fluid(name="water", density=1000.0, level=0.0, drag_coefficient=1.0)
        observe = traces(x=Position("b"), q=Orientation("b"))
        found.append(
            simulate(
                Scene(bodies=(body,), forces=(water,), gravity=(0, 0, -10.0)),
                time_step=H,
                steps=60,
                observe=observe,
            )
        )
    for name in ("x", "q"):
        np.testing.assert_allclose(found[1][name], found[0][name], atol=1e-10)


# --- refused --------------------------------------------------------------------------------------------


def test_a_corner_a_hair_out_of_a_face_is_one_or_none_and_no_crash() -> None:
    points = (*CUBE, (0.5 + 3e-9, 0.1, 0.1))
    try:
        assert ConvexHull(points).volume == pytest.approx(1.0, abs=1e-8)
    except SceneError as refused:
        assert "convex hull" in str(refused)


def test_a_hull_beside_its_centre_of_mass_needs_an_inertia_and_says_so() -> None:
    shifted = ConvexHull(tuple((x + 0.2, y, z) for x, y, z in CUBE))
    with pytest.raises(SceneError, match=r"ConvexHull\.placed"):
        RigidBody(name="b", mass=1.0, shape=shifted, position=(0, 0, 0))

    assert RigidBody(name="b", mass=1.0, shape=shifted, position=(0, 0, 0), inertia=(1, 1, 1)).inertia == (
        1,
        1,
        1,
    )

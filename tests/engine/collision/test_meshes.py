"""Meshes and height fields: seams are not felt, ridges and tips are met, distances as a search finds them, refusals."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spook_tracker.engine import (
    AngularVelocity,
    Box,
    Capsule,
    Compound,
    Cone,
    ContactCount,
    ContactForce,
    ConvexHull,
    Cylinder,
    Final,
    HeightField,
    Material,
    Maximum,
    Method,
    Part,
    Penetration,
    Plane,
    Position,
    RigidBody,
    Scene,
    SceneError,
    Shape,
    Sphere,
    Trace,
    TriangleMesh,
    Velocity,
    simulate,
)
from tests.scenes.seen import maxima, traces

H = 1.0 / 60.0
SMOOTH, ROUGH = Material(), Material(friction=0.5)
OCTAHEDRON = ConvexHull(((0.4, 0, 0), (-0.4, 0, 0), (0, 0.4, 0), (0, -0.4, 0), (0, 0, 0.3), (0, 0, -0.3)))
SLIDERS: dict[str, tuple[Shape, float]] = {  # and how high their centre lies
    "ball": (Sphere(0.3), 0.3),
    "box": (Box((0.6, 0.4, 0.5)), 0.25),
    "capsule": (Capsule(0.2, 0.6), 0.5),
    "can": (Cylinder(0.25, 0.4), 0.2),
    "cone": (Cone(0.3, 0.4), 0.1),
    "hull": (OCTAHEDRON, 0.3),
}


def sheet(shape: Shape, material: Material = ROUGH, **fields: Any) -> RigidBody:
    given = {"motion": "static", "shape": shape, "position": (0.0, 0.0, 0.0), "material": material}
    return RigidBody(name="sheet", **(given | fields))


def body(shape: Shape, material: Material = ROUGH, **fields: Any) -> RigidBody:
    given = {"mass": 2.0, "shape": shape, "inertia": (0.1, 0.1, 0.1), "material": material}
    return RigidBody(name="body", **(given | fields))


def quaternion(turn: Rotation) -> tuple[float, float, float, float]:
    w, x, y, z = turn.as_quat(scalar_first=True)
    return (float(w), float(x), float(y), float(z))


def run(*bodies: RigidBody, steps: int, gravity: Any = (0.0, 0.0, -10.0), **observe: Any) -> Any:
    return simulate(Scene(bodies=bodies, gravity=gravity), time_step=H, steps=steps, observe=observe)


def flat(cells: int = 9, size: float = 0.37) -> HeightField:
    return HeightField((size, size), ((0.0,) * (cells + 1),) * (cells + 1))


def scattered(seed: int) -> TriangleMesh:
    """A flat floor of triangles of all sizes and directions, from −3 to 3."""
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(seed)
    points = np.vstack((rng.uniform(-3.0, 3.0, (60, 2)), list(itertools.product((-3.0, 3.0), repeat=2))))
    faces = []
    for a, b, c in Delaunay(points).simplices:
        turns = np.cross(np.append(points[b] - points[a], 0), np.append(points[c] - points[a], 0))[2]
        if abs(turns) > 1e-6:
            faces.append((int(a), int(b), int(c)) if turns > 0 else (int(a), int(c), int(b)))
    return TriangleMesh(tuple((float(x), float(y), 0.0) for x, y in points), tuple(faces))


# --- seams ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("slider", SLIDERS)
def test_sliding_over_seams_of_a_flat_mesh_it_keeps_its_velocity_to_rounding(slider: str) -> None:
    shape, height = SLIDERS[slider]
    moving = body(shape, SMOOTH, position=(-1.5, -0.4, height), velocity=(2.0, 0.7, 0.0))
    found = run(
        sheet(scattered(3), SMOOTH),
        moving,
        steps=90,
        v=Trace(quantity=Velocity("body")),
        x=Final(quantity=Position("body")),
    )

    np.testing.assert_allclose(found["v"], np.broadcast_to((2.0, 0.7, 0.0), found["v"].shape), atol=1e-12)
    np.testing.assert_allclose(found["x"], (1.5, 0.65, height), atol=1e-9)


@pytest.mark.parametrize("slider", ["ball", "box", "can"])
def test_what_slides_or_rolls_with_friction_moves_as_on_a_plane(slider: str) -> None:
    shape, height = SLIDERS[slider]
    moving = body(shape, position=(-1.5, -0.4, height), velocity=(2.0, 0.7, 0.0))
    plane = RigidBody(name="sheet", motion="static", shape=Plane(), position=(0, 0, 0), material=ROUGH)
    one, other = (
        run(
            ground,
            moving,
            steps=90,
            x=Trace(quantity=Position("body")),
            f=Final(quantity=ContactForce("body")),
        )
        for ground in (sheet(scattered(4)), plane)
    )

    np.testing.assert_allclose(one["x"], other["x"], atol=1e-9)
    np.testing.assert_allclose(one["f"], other["f"], atol=1e-6)


def test_a_box_on_many_triangles_stands_on_its_four_corners() -> None:
    moving = body(Box((1.1, 0.9, 0.5)), position=(1.63, 1.7, 0.25))
    found = run(
        sheet(flat()),
        moving,
        steps=60,
        x=Final(quantity=Position("body")),
        n=Final(quantity=ContactCount()),
        force=Final(quantity=ContactForce("body")),
    )

    assert float(found["n"]) == 4
    np.testing.assert_allclose(found["x"], (1.63, 1.7, 0.25), atol=1e-9)
    np.testing.assert_allclose(found["force"], (0, 0, 20.0), atol=1e-7)


# --- distances ------------------------------------------------------------------------------------------


def hills(seed: int, height: float = 0.3) -> HeightField:
    rng = np.random.default_rng(seed)
    return HeightField(
        (0.5, 0.4), tuple(tuple(float(z) for z in row) for row in rng.uniform(0, height, (8, 8)))
    )


def nearest(mesh: HeightField | TriangleMesh, p: Any) -> float:
    """Distance to the nearest of all triangles, by projecting to the face, the three sides and the three corners."""
    best = math.inf
    for face in mesh.faces:
        a, b, c = (np.array(mesh.corners[k]) for k in face)
        normal = np.cross(b - a, c - a)
        weights = np.linalg.solve(np.column_stack((b - a, c - a, normal)), p - a)
        if weights[0] >= 0 and weights[1] >= 0 and weights[0] + weights[1] <= 1:
            best = min(best, abs(weights[2]) * float(np.linalg.norm(normal)))
        for u, v in ((a, b), (b, c), (c, a)):
            t = min(1.0, max(0.0, float((p - u) @ (v - u) / ((v - u) @ (v - u)))))
            best = min(best, float(np.linalg.norm(p - u - t * (v - u))))
    return best


@pytest.mark.parametrize("seed", range(12))
def test_a_ball_over_hills_is_as_deep_as_the_nearest_point_is_near(seed: int) -> None:
    rng = np.random.default_rng(seed)
    field = hills(seed)
    p = np.array((*rng.uniform(0.8, 2.2, 2), rng.uniform(0.4, 0.8)))
    distance = nearest(field, p)
    for deeper in (1e-3, -1e-3, 0.05):
        ball = body(Sphere(distance + deeper), position=tuple(p))
        found = run(sheet(field), ball, steps=1, gravity=(0, 0, 0), d=Maximum(quantity=Penetration()))

        assert float(found["d"]) == pytest.approx(max(0.0, deeper), abs=1e-9)


CUBE = TriangleMesh(
    tuple((0.5 * x, 0.4 * y, 0.6 * z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)),
    tuple(
        face
        for a, b, c, d in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        for face in ((a, b, c), (a, c, d))
    ),
)


@pytest.mark.parametrize("slider", SLIDERS)
@pytest.mark.parametrize("seed", range(3))
def test_a_mesh_round_a_box_is_met_as_the_box_is(slider: str, seed: int) -> None:
    """Overlapping a little, from any side: faces, edges and corners."""
    rng = np.random.default_rng(100 * seed + list(SLIDERS).index(slider))
    shape, solid = SLIDERS[slider][0], Box((1.0, 0.8, 1.2))
    away = rng.standard_normal(3)
    away /= np.linalg.norm(away)
    turn = quaternion(Rotation.random(rng=rng))

    def depth(fixed: Shape, distance: float) -> float:
        moving = body(shape, position=tuple(distance * away), orientation=turn)
        found = run(sheet(fixed), moving, steps=1, gravity=(0, 0, 0), d=Maximum(quantity=Penetration()))
        return float(found["d"])

    low, high = 0.0, 3.0
    for _ in range(26):  # where they touch
        middle = 0.5 * (low + high)
        low, high = (middle, high) if depth(solid, middle) > 0.0 else (low, middle)

    assert depth(CUBE, high + 1e-6) == 0.0
    for closer in (1e-4, 1e-3):
        assert depth(CUBE, low - closer) == pytest.approx(depth(solid, low - closer), rel=1e-3, abs=1e-8)


# --- valleys, ridges, flight ----------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [0.3, 0.8])
def test_a_ball_in_a_valley_presses_on_both_sides(angle: float) -> None:
    """Without friction each side carries m g/(2 cos θ); along the valley nothing holds it."""
    slope = math.tan(angle)
    valley = HeightField((1.0, 0.7), ((slope,) * 6, (0.0,) * 6, (slope,) * 6))
    ball = body(Sphere(0.2), SMOOTH, position=(1.0, 1.0, 0.2 / math.cos(angle)), velocity=(0.0, 0.5, 0.0))
    found = run(
        sheet(valley, SMOOTH),
        ball,
        steps=90,
        x=Final(quantity=Position("body")),
        v=Trace(quantity=Velocity("body")),
        n=Final(quantity=ContactCount()),
    )

    np.testing.assert_allclose(found["x"], (1.0, 1.75, 0.2 / math.cos(angle)), atol=1e-8)
    np.testing.assert_allclose(found["v"], np.broadcast_to((0, 0.5, 0), found["v"].shape), atol=1e-11)
    assert 2 <= float(found["n"]) <= 4


def test_a_plank_lies_on_two_tips() -> None:
    """Tips under a face, away from all its corners and edges: statics gives each its share."""
    tip = TriangleMesh(
        ((0.1, 0.1, 0), (-0.1, 0.1, 0), (-0.1, -0.1, 0), (0.1, -0.1, 0), (0, 0, 0.5)),
        ((0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    )
    tips = [
        RigidBody(name=f"tip {k}", motion="static", shape=tip, position=(x, y, 0.0), material=ROUGH)
        for k, (x, y) in enumerate(((-0.5, -0.3), (-0.5, 0.3), (0.8, 0.0)))
    ]
    plank = body(Box((3.0, 1.0, 0.1)), position=(0.0, 0.0, 0.55))
    observe = {f"f{k}": Final(quantity=ContactForce(f"tip {k}")) for k in range(3)}
    found = run(*tips, plank, steps=60, x=Final(quantity=Position("body")), **observe)

    np.testing.assert_allclose(found["x"], (0, 0, 0.55), atol=1e-8)
    shares = [-float(found[f"f{k}"][2]) for k in range(3)]
    assert shares == pytest.approx([20 * 0.8 / 1.3 / 2] * 2 + [20 * 0.5 / 1.3], rel=1e-6)


@pytest.mark.parametrize("quarter", range(4))
def test_whichever_edge_of_a_box_lies_across_a_ridge_it_is_held_where_they_cross(quarter: int) -> None:
    """All four edges along it have one direction, hence one axis with the ridge; the force acts at the lowest."""
    roof = TriangleMesh(((-3, 0, 0), (3, 0, 0), (0, 1, -1), (0, -1, -1)), ((0, 1, 2), (1, 0, 3)))
    tilt = Rotation.from_rotvec((0.1, 0, 0))
    about = Rotation.from_rotvec((math.pi / 4 + quarter * math.pi / 2, 0, 0))
    turn = tilt * Rotation.from_rotvec((0, 0, math.pi / 2)) * about
    along, up = tilt.apply((0, 1, 0)), tilt.apply((0, 0, 1))
    centre = (0.2, 0, 0) - 0.3 * along + (0.2 * math.sqrt(2) - 1e-4) * up
    falling = body(
        Box((2, 0.4, 0.4)),
        SMOOTH,
        position=tuple(map(float, centre)),
        orientation=quaternion(turn),
        velocity=tuple(map(float, -up)),
    )
    found = run(
        sheet(roof, SMOOTH),
        falling,
        steps=1,
        gravity=(0, 0, 0),
        v=Final(quantity=Velocity("body")),
        w=Final(quantity=AngularVelocity("body")),
    )
    push = 2.0 * (found["v"] + up)

    assert push @ up > 0.1
    np.testing.assert_allclose(push / (push @ up), up, atol=1e-9)
    torque = 0.1 * found["w"] / (push @ up)
    np.testing.assert_allclose(torque, np.cross((0.2, 0, 0) - centre, up), atol=1e-3)


@pytest.mark.parametrize("slider", SLIDERS)
@pytest.mark.parametrize("speed", [10.0, 200.0])
def test_nothing_falls_through_at_any_speed(slider: str, speed: float) -> None:
    rng = np.random.default_rng(list(SLIDERS).index(slider))
    moving = body(
        SLIDERS[slider][0],
        SMOOTH,
        inertia=(1e3, 1e3, 1e3),
        position=(1.71, 1.43, 3.0),
        orientation=quaternion(Rotation.random(rng=rng)),
        velocity=(0.0, 0.0, -speed),
    )
    found = run(
        sheet(hills(1), SMOOTH),
        moving,
        steps=30,
        gravity=(0, 0, 0),
        x=Final(quantity=Position("body")),
        d=Maximum(quantity=Penetration()),
    )

    assert float(found["x"][2]) > 0.0
    assert float(found["d"]) < 0.05


@pytest.mark.parametrize("slider", SLIDERS)
def test_dropped_on_hills_it_comes_to_rest_carried(slider: str) -> None:
    moving = body(SLIDERS[slider][0], Material(friction=0.9), position=(1.7, 1.4, 0.9))
    found = run(
        sheet(hills(2, 0.2), Material(friction=0.9)),
        moving,
        steps=80,
        x=Final(quantity=Position("body")),
        d=Maximum(quantity=Penetration()),
    )

    assert float(found["x"][2]) > 0.05 or slider in (
        "ball",
        "cone",
        "capsule",
        "can",
    )  # round ones may roll off the rim
    assert float(found["d"]) < 5e-3


def test_from_below_it_is_not_there() -> None:
    moving = body(Sphere(0.2), position=(1.5, 1.5, -1.0), velocity=(0, 0, 3.0))
    found = run(sheet(flat()), moving, steps=30, gravity=(0, 0, 0), v=Final(quantity=Velocity("body")))

    assert float(found["v"][2]) == 3.0


def test_a_mesh_is_fixed_and_no_part_of_a_compound() -> None:
    for motion in ("dynamic", "kinematic"):
        with pytest.raises(SceneError, match=r"'sheet'.*make the body static"):
            sheet(flat(), motion=motion, mass=1.0, inertia=(1, 1, 1))
    with pytest.raises(SceneError, match="part must be a bounded shape"):
        Compound((Part(shape=flat()),))


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("facets", [12, 20, 34])
@pytest.mark.parametrize("speed", [3.0, 7.0])
def test_a_smooth_ball_in_a_gutter_goes_on_along_it(speed: float, facets: int, solver: str) -> None:
    """A gutter of plane strips, all along y: no strip has a normal along y, or turns a ball without friction. Where the
    ball met the next strip, the point of contact was placed behind it: the row was kept by a turn of the ball, which sank
    in by a millimetre, turned at 2 rad/s, and paid for being lifted out with all of its velocity."""
    across, along = np.linspace(-12.0, 12.0, facets), np.linspace(-3.0, 3.0, 5)
    corners = tuple((float(x), float(y), 0.04 * float(x) ** 2) for x in across for y in along)
    corner = [[5 * i + j for j in range(5)] for i in range(facets)]
    pairs = tuple(
        face
        for i in range(facets - 1)
        for j in range(4)
        for face in (
            (corner[i][j], corner[i + 1][j], corner[i + 1][j + 1]),
            (corner[i][j], corner[i + 1][j + 1], corner[i][j + 1]),
        )
    )
    ball = body(Sphere(0.2), SMOOTH, position=(-5.0, 0.0, 1.6), velocity=(speed, -0.3, 0.0))
    result = simulate(
        Scene(bodies=(sheet(TriangleMesh(corners, pairs), SMOOTH), ball), gravity=(0.0, 0.0, -9.81)),
        time_step=H,
        duration=1.5,
        method=Method(solver=solver),
        observe=traces(v=Velocity("body"), w=AngularVelocity("body")) | maxima(deep=Penetration()),
    )

    assert np.abs(result["w"]).max() < 1e-9
    assert np.abs(result["v"][:, 1] + 0.3).max() < 1e-9
    assert float(result["deep"]) < 1e-6

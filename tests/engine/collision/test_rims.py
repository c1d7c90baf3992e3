"""Cylinders and cones against all that is bounded: rest, tipping, and cones; a search over directions for all shapes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from spook_tracker.engine import (
    AngularVelocity,
    Box,
    Capsule,
    Cone,
    ContactForce,
    ConvexHull,
    Cylinder,
    Energy,
    Final,
    Material,
    Maximum,
    Penetration,
    Plane,
    Position,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    Trace,
    Velocity,
    simulate,
)

H = 1.0 / 60.0
DOWN = (0.0, 0.0, -10.0)
ROUGH = Material(friction=0.5)
OCTAHEDRON = ConvexHull(
    ((0.5, 0, 0), (-0.5, 0, 0), (0, 0.7, 0), (0, -0.7, 0), (0.1, 0, 0.4), (0, -0.1, -0.6))
)
SHAPES: dict[str, Shape] = {
    "ball": Sphere(0.4),
    "capsule": Capsule(0.2, 0.9),
    "box": Box((0.7, 1.1, 0.5)),
    "hull": OCTAHEDRON,
    "can": Cylinder(0.3, 0.8),
    "coin": Cylinder(0.6, 0.05),
    "cone": Cone(0.4, 0.9),
    "hat": Cone(0.8, 0.2),
}


def fixed(shape: Shape, **fields: Any) -> RigidBody:
    given = {"motion": "static", "shape": shape, "position": (0.0, 0.0, 0.0), "material": ROUGH}
    return RigidBody(name="fixed", **(given | fields))


def body(shape: Shape, **fields: Any) -> RigidBody:
    given = {"mass": 2.0, "shape": shape, "inertia": (0.1, 0.1, 0.1), "material": ROUGH}
    return RigidBody(name="body", **(given | fields))


def quaternion(turn: Rotation) -> tuple[float, float, float, float]:
    w, x, y, z = turn.as_quat(scalar_first=True)
    return (float(w), float(x), float(y), float(z))


def run(*bodies: RigidBody, steps: int, gravity: Any = DOWN, time_step: float = H, **observe: Any) -> Any:
    scene = Scene(bodies=bodies, gravity=gravity)
    return simulate(scene, time_step=time_step, steps=steps, observe=observe)


# --- depths ---------------------------------------------------------------------------------------------


def farthest(shape: Shape | Any, n: Any) -> Any:
    """Largest n · p over a shape in its own axes: its support function, written down anew."""
    match shape:
        case Sphere():
            return shape.radius * np.sqrt((n * n).sum(axis=-1))
        case Capsule():
            return shape.radius * np.sqrt((n * n).sum(axis=-1)) + 0.5 * shape.length * np.abs(n[..., 2])
        case Box():
            return np.abs(n) @ np.array(shape.size) / 2.0
        case ConvexHull():
            return np.max(n @ np.array(shape.corners).T, axis=-1)
        case np.ndarray():  # corners alone
            return np.max(n @ shape.T, axis=-1)
        case Cylinder():
            return shape.radius * np.hypot(n[..., 0], n[..., 1]) + 0.5 * shape.length * np.abs(n[..., 2])
        case Cone():
            base = shape.radius * np.hypot(n[..., 0], n[..., 1]) - 0.25 * shape.height * n[..., 2]
            return np.maximum(base, 0.75 * shape.height * n[..., 2])
    raise AssertionError(shape)


def sphere_of_directions(count: int) -> Any:
    k = np.arange(count) + 0.5
    polar, azimuth = np.arccos(1.0 - 2.0 * k / count), math.pi * (1.0 + math.sqrt(5.0)) * k
    return np.stack(
        (np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)), axis=-1
    )


DIRECTIONS = sphere_of_directions(2000)
CORNERS = np.array(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))  # of a simplex


def gap(first: Shape, turn: Any, place: Any, second: Shape | Any, other: Any) -> tuple[float, Any]:
    """Distance of two shapes, or minus their least overlap, and its direction: the largest gap of all, by search."""

    def along(n: Any) -> Any:
        return n @ place - farthest(first, -n @ turn) - farthest(second, n @ other)

    values = along(DIRECTIONS)
    starts: list[Any] = []
    for k in np.argsort(-values):
        if all(DIRECTIONS[k] @ start < 0.97 for start in starts):
            starts.append(DIRECTIONS[k])
        if len(starts) == 3:
            break

    def climb(start: Any, width: float, precision: float) -> tuple[float, Any]:
        aside = np.linalg.svd(start[None])[2][1:]

        def tilted(t: Any) -> float:
            n = start + t @ aside
            return -float(along(n / math.sqrt(n @ n)))

        options = {"xatol": precision, "fatol": 1e-9, "initial_simplex": width * CORNERS}
        found = minimize(tilted, np.zeros(2), method="Nelder-Mead", options=options)
        normal = start + found.x @ aside
        return -float(found.fun), normal / math.sqrt(normal @ normal)

    rough = [climb(start, 0.05, 1e-3) for start in starts]
    best = max(value for value, _ in rough)
    # Whatever may still become the best is climbed to the end, from a small simplex again.
    near = [climb(normal, 1e-3, 1e-7) for value, normal in rough if value > best - 5e-3]
    return max(near, key=lambda found: found[0])


# --- rest -----------------------------------------------------------------------------------------------

UPRIGHT, LYING = Rotation.identity(), Rotation.from_rotvec((0, math.pi / 2, 0))  # lying along x


@pytest.mark.parametrize(
    ("below", "above", "turn", "height"),
    [
        (Box((1, 1, 1)), Cylinder(0.3, 0.5), UPRIGHT, 0.5 + 0.25),
        (Box((1, 1, 1)), Cylinder(0.3, 0.5), LYING, 0.5 + 0.3),
        (Box((0.3, 0.3, 1)), Cylinder(0.3, 0.5), UPRIGHT, 0.5 + 0.25),  # the foot is wider than the block
        (Box((1, 1, 1)), Cone(0.3, 0.8), UPRIGHT, 0.5 + 0.2),
        (Box((1, 1, 1)), Cone(0.3, 0.8), Rotation.from_rotvec((math.pi, 0, 0)), 0.5 + 0.6),
        (Cylinder(0.5, 1.0), Box((0.4, 0.4, 0.5)), UPRIGHT, 0.5 + 0.25),
        (Cylinder(0.5, 1.0), Cylinder(0.3, 0.5), UPRIGHT, 0.5 + 0.25),
        (Cylinder(0.5, 1.0), Cone(0.3, 0.8), UPRIGHT, 0.5 + 0.2),
        (Cylinder(0.5, 1.0), Capsule(0.2, 0.5), LYING, 0.5 + 0.2),
        (Cylinder(0.5, 1.0), Sphere(0.2), UPRIGHT, 0.5 + 0.2),
    ],
)
def test_what_stands_on_it_stays_and_weighs_what_it_weighs(
    below: Shape, above: Shape, turn: Rotation, height: float
) -> None:
    moving = body(above, position=(0.02, -0.03, height), orientation=quaternion(turn))
    found = run(
        fixed(below),
        moving,
        steps=120,
        x=Final(quantity=Position("body")),
        force=Final(quantity=ContactForce("body")),
    )

    np.testing.assert_allclose(found["x"], (0.02, -0.03, height), atol=2e-8)
    np.testing.assert_allclose(found["force"], (0, 0, 20.0), atol=1e-6)


def test_logs_lie_in_a_pile() -> None:
    """Two held apart by stops, a third between them: by statics each of the two carries half of it."""
    lying = quaternion(Rotation.from_rotvec((math.pi / 2, 0, 0)))
    log = {"shape": Cylinder(0.5, 2.0), "orientation": lying, "mass": 2.0, "material": ROUGH}
    ground = RigidBody(
        name="ground", motion="static", shape=Box((6, 6, 1)), position=(0, 0, -0.5), material=ROUGH
    )
    stops = [
        RigidBody(
            name=f"stop {x}", motion="static", shape=Box((0.2, 4, 1)), position=(x, 0, 0.5), material=ROUGH
        )
        for x in (-1.2, 1.2)
    ]
    pile = [
        RigidBody(name="left", position=(-0.6, 0, 0.5), **log),
        RigidBody(name="right", position=(0.6, 0, 0.5), **log),
        RigidBody(name="top", position=(0, 0, 0.5 + 0.8), **log),
    ]
    found = run(
        ground,
        *stops,
        *pile,
        steps=180,
        x=Final(quantity=Position("top")),
        force=Final(quantity=ContactForce("top")),
        ground=Final(quantity=ContactForce("ground")),
    )

    np.testing.assert_allclose(found["x"], (0, 0, 1.3), atol=1e-6)
    np.testing.assert_allclose(found["force"], (0, 0, 20.0), atol=1e-5)


@pytest.mark.parametrize("quarter", range(4))
@pytest.mark.parametrize("shape", [Cylinder(0.3, 2.0), Cone(0.3, 2.0)])
def test_whichever_edge_of_a_block_a_side_lies_across_it_is_held_where_they_cross(
    shape: Cylinder | Cone, quarter: int
) -> None:
    """Parallel edges share their axis with the side; the force acts at the one that is met."""
    beam = fixed(
        Box((2, 0.4, 0.4)),
        material=Material(),
        orientation=quaternion(Rotation.from_rotvec((math.pi / 4 + quarter * math.pi / 2, 0, 0))),
    )
    turn = Rotation.from_rotvec((math.pi / 2 + 0.1, 0, 0))
    axis, out = turn.apply((0, 0, 1)), turn.apply((0, -1, 0))  # out of the side, downwards
    crossing, place = np.array((0.3, 0, 0.2 * math.sqrt(2))), 0.2  # along the axis
    narrows = 0.15 if isinstance(shape, Cone) else 0.0
    reach = 0.225 - narrows * place if isinstance(shape, Cone) else 0.3
    up = -(out + narrows * axis) / math.hypot(1.0, narrows)
    centre = crossing - place * axis - reach * out - 1e-4 * up
    falling = body(
        shape,
        material=Material(),
        position=tuple(map(float, centre)),
        orientation=quaternion(turn),
        velocity=tuple(map(float, -up)),
    )
    found = run(
        beam,
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
    np.testing.assert_allclose(torque, np.cross(crossing - centre, up), atol=1e-3)


@pytest.mark.parametrize(("inside", "falls"), [(0.01, False), (-0.01, True)])
@pytest.mark.parametrize("shape", [Cylinder(0.3, 0.5), Cone(0.3, 0.8)])
@pytest.mark.parametrize("away", [0.0, 0.7])
def test_it_falls_over_an_edge_when_its_centre_is_beyond(
    shape: Cylinder | Cone, away: float, inside: float, falls: bool
) -> None:
    """A shelf's edge holds no torque: the centre of mass decides, whichever way the body is turned about its axis."""
    foot = 0.25 if isinstance(shape, Cylinder) else 0.2
    turn = quaternion(Rotation.from_rotvec((0, 0, away)))
    found = run(
        fixed(Box((2, 2, 1)), position=(-1.0, 0, -0.5)),
        body(shape, position=(-inside, 0.1, foot), orientation=turn),
        steps=60,
        x=Final(quantity=Position("body")),
    )

    if falls:
        assert float(found["x"][2]) < foot - 1e-3
    else:
        np.testing.assert_allclose(found["x"], (-inside, 0.1, foot), atol=1e-8)


@pytest.mark.parametrize("lean", [1e-6, 1e-3, 0.05])
def test_a_can_set_down_leaning_comes_to_rest_without_trembling(lean: float) -> None:
    turn = Rotation.from_rotvec((lean, 0.0, 0.0))
    height = 0.25 * math.cos(lean) + 0.3 * math.sin(lean)
    found = run(
        fixed(Box((2, 2, 1)), position=(0, 0, -0.5)),
        body(Cylinder(0.3, 0.5), position=(0, 0, height), orientation=quaternion(turn)),
        steps=180,
        v=Trace(quantity=Velocity("body")),
        x=Final(quantity=Position("body")),
        energy=Trace(quantity=Energy()),
    )

    assert float(found["x"][2]) == pytest.approx(0.25, abs=1e-7)
    assert np.abs(found["v"][-30:]).max() < 1e-8
    assert np.diff(found["energy"]).max() < 1e-3  # J of 5


@pytest.mark.parametrize("speed", [20.0, 300.0])
@pytest.mark.parametrize("second", ["can", "coin", "cone", "hat"])
@pytest.mark.parametrize("first", ["ball", "box", "coin"])
def test_nothing_flies_through_it(first: str, second: str, speed: float) -> None:
    """Towards its middle at up to 5 m a step, from any side."""
    rng = np.random.default_rng(8 * list(SHAPES).index(first) + list(SHAPES).index(second))
    away = rng.standard_normal(3)
    away /= np.linalg.norm(away)
    moving = body(
        SHAPES[first],
        position=tuple(3.0 * away),
        inertia=(1e3, 1e3, 1e3),
        material=Material(),
        orientation=quaternion(Rotation.random(rng=rng)),
        velocity=tuple(-speed * away),
    )
    hit = fixed(SHAPES[second], orientation=quaternion(Rotation.random(rng=rng)))
    found = run(
        hit,
        moving,
        steps=30,
        gravity=(0, 0, 0),
        v=Final(quantity=Velocity("body")),
        d=Maximum(quantity=Penetration()),
    )

    assert float(found["v"] @ away) > -0.9 * speed
    assert float(found["d"]) < 0.02


# --- cones ----------------------------------------------------------------------------------------------


def test_a_cone_has_its_centre_of_mass_in_the_origin_and_its_moments() -> None:
    cone = Cone(0.4, 0.9)

    # Gauss's points are exact for the polynomials in height and radius, equal steps for those in sine and cosine.
    points, weights = np.polynomial.legendre.leggauss(6)
    share, part = 0.5 * (points + 1.0), 0.5 * weights
    z = cone.height * (share - 0.25)
    rim = cone.radius * (0.75 - z / cone.height)
    rho = rim[:, None, None] * share[:, None]
    turn = np.arange(8) * math.pi / 4
    cell = cone.height * (part * rim)[:, None, None] * part[:, None] * rho * np.full(8, math.pi / 4)

    def integral(moment: Any) -> float:
        at = moment(rho * np.cos(turn), rho * np.sin(turn), z[:, None, None])
        return float((cell * at).sum())

    mass = integral(lambda x, y, z: 1.0)

    assert integral(lambda x, y, z: z) == pytest.approx(0.0, abs=1e-9)
    assert cone.inertia(mass) == pytest.approx(
        (
            integral(lambda x, y, z: y * y + z * z),
            integral(lambda x, y, z: x * x + z * z),
            integral(lambda x, y, z: x * x + y * y),
        ),
        rel=1e-12,
    )


def test_a_cone_lies_on_its_side_and_rolls_about_its_apex() -> None:
    """On a plane it touches along a line, from the apex to the rim; a push across it turns it about the apex."""
    cone = Cone(0.3, 0.8)
    opening = math.atan2(0.3, 0.8)
    turn = Rotation.from_rotvec((0, math.pi / 2 + opening, 0))
    apex = turn.apply((0, 0, 0.6))
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0, 0, 0), material=ROUGH)
    rolling = RigidBody(
        name="body",
        mass=2.0,
        shape=cone,
        position=(0.0, 0.0, -float(apex[2])),
        orientation=quaternion(turn),
        velocity=(0.0, 0.5, 0.0),
        material=ROUGH,
    )
    found = run(
        ground,
        rolling,
        steps=240,
        time_step=1.0 / 240.0,
        x=Trace(quantity=Position("body")),
        force=Final(quantity=ContactForce("body")),
    )
    centre = found["x"] - (apex[0], 0.0, 0.0)
    distance = np.hypot(centre[:, 0], centre[:, 1])

    assert distance.std() < 5e-3 and np.ptp(found["x"][:, 2]) < 1e-5
    assert found["force"][2] == pytest.approx(20.0, rel=1e-6)

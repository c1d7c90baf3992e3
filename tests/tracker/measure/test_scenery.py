"""The picture of a scene shows what the scene holds, where it is."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from spook_tracker.engine.bodies import WORLD, Particle, RigidBody
from spook_tracker.engine.couplings import Relation
from spook_tracker.engine.forces import CentralGravity, Spring
from spook_tracker.engine.joints import Distance, Hinge, Motor, Prismatic
from spook_tracker.engine.scene import Scene
from spook_tracker.engine.shapes import Box, Capsule, Compound, Part, Plane, Sphere
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.document.run_document import SceneDrawing
from spook_tracker.tracker.measure.scene_drawing import drawing
from spook_tracker.tracker.website.scenery import (
    AXIS,
    WIDTH,
    length_words,
    round_length,
    scenery,
    turned,
)

HALF_TURN_ABOUT_X = (0.0, 1.0, 0.0, 0.0)
QUARTER_TURN_ABOUT_Z = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))


def test_particles_links_and_attractors_are_drawn_where_they_are() -> None:
    scene = Scene(
        bodies=(Particle(name="a", position=(1.0, 0.0, 0.0), mass=1.0, velocity=(0.0, 2.0, 0.0)),),
        constraints=(Distance(name="rod", between=("a", (0.0, 0.0, 0.0))),),
        forces=(
            CentralGravity(name="sun", strength=1.0),
            Spring(name="spring", between=("a", (2.0, 0.0, 0.0)), stiffness=1.0),
        ),
        gravity=(0.0, 0.0, -9.81),
    )

    drawn = drawing(scene)

    assert [(s.kind, s.position, s.velocity) for s in drawn.solids] == [
        ("particle", (1.0, 0.0, 0.0), (0.0, 2.0, 0.0))
    ]
    assert [(link.kind, link.ends) for link in drawn.links] == [
        ("distance", ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))),
        ("spring", ((1.0, 0.0, 0.0), (2.0, 0.0, 0.0))),
    ]
    assert drawn.attractors == ((0.0, 0.0, 0.0),)
    assert drawn.gravity == (0.0, 0.0, -9.81)


def test_parts_of_a_compound_turn_with_their_body() -> None:
    shape = Compound((Part(shape=Sphere(0.1), position=(1.0, 0.0, 0.0)), Part(shape=Box((1.0, 2.0, 3.0)))))
    body = RigidBody(
        name="b",
        position=(5.0, 0.0, 0.0),
        mass=1.0,
        inertia=(1.0, 1.0, 1.0),
        shape=shape,
        orientation=QUARTER_TURN_ABOUT_Z,
    )

    ball, box = drawing(Scene(bodies=(body,))).solids

    assert ball.position == pytest.approx((5.0, 1.0, 0.0))
    assert box.size == (1.0, 2.0, 3.0)
    assert box.orientation == pytest.approx(QUARTER_TURN_ABOUT_Z)


def test_a_body_without_surface_is_drawn_as_the_box_that_turns_as_it_does() -> None:
    edges = (1.0, 2.0, 3.0)
    inertia = tuple((sum(e * e for e in edges) - e * e) / 12.0 * 6.0 for e in edges)
    body = RigidBody(name="b", position=(0.0, 0.0, 0.0), mass=6.0, inertia=inertia)  # type: ignore[arg-type]

    (solid,) = drawing(Scene(bodies=(body,))).solids

    assert solid.size == pytest.approx(edges)


def test_a_hinge_stands_where_it_was_put() -> None:
    door = RigidBody(name="door", position=(0.5, 0.0, 0.0), mass=1.0, shape=Box((1.0, 0.1, 2.0)))
    scene = Scene(bodies=(door,), constraints=(Hinge(name="h", between=("door", WORLD), at=(0.0, 0.0, 0.5)),))

    (link,) = drawing(scene).links

    assert link.ends == ((0.0, 0.0, 0.5), (0.0, 0.0, 0.5))


def test_what_is_driven_is_drawn_apart_from_what_only_moves_or_stands() -> None:
    ball = Sphere(0.1)
    bodies = (
        RigidBody(
            name="belt", shape=ball, motion="kinematic", position=(0.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0)
        ),
        RigidBody(name="stand", shape=ball, motion="kinematic", position=(1.0, 0.0, 0.0)),
        RigidBody(name="base", shape=ball, mass=1.0, position=(2.0, 0.0, 0.0)),
        RigidBody(name="arm", shape=ball, mass=1.0, position=(3.0, 0.0, 0.0)),
    )
    hinge = Hinge(
        name="h", between=("base", "arm"), at=(2.5, 0.0, 0.0), axis=(0.0, 0.0, 1.0), motor=Motor(speed=1.0)
    )

    drawn = drawing(Scene(bodies=bodies, constraints=(hinge,)))
    picture = scenery(drawn)

    assert [solid.driven for solid in drawn.solids] == [True, False, False, True]
    assert picture is not None and picture.driven
    assert "2 driven spheres, 1 fixed sphere, 1 sphere" in picture.description
    assert sum(shape.classes == "driven f2" for shape in picture.shapes) == 2
    assert not drawing(Scene(bodies=bodies[1:])).solids[0].driven


def test_gears_have_their_teeth_and_pitch_circles_that_touch_and_their_carrier_is_an_arm() -> None:
    """A planetary set of 20 and 30 teeth, .25 m apart; the wheel of a body without a relation stays its box."""
    scene = CATALOGUE["gears"].example().scene
    sun, arm, planet = drawing(scene).solids
    corners = [
        np.array(list(batched_corners(wheel.size))) for wheel in (sun, planet)
    ]  # of all faces, in the axes of the wheel

    assert [solid.kind for solid in (sun, arm, planet)] == ["facets", "box", "facets"]
    assert (sun.driven, arm.driven, planet.driven) == (True, False, False)
    radii = [np.hypot(c[:, 0], c[:, 1]) for c in corners]
    pitch = [0.5 * (r.max() + r[r > 1e-9].min()) for r in radii]
    assert sum(pitch) == pytest.approx(0.25, rel=1e-3) and pitch[1] / pitch[0] == pytest.approx(1.5, rel=1e-3)
    outer = [
        len(np.unique(np.round(c[np.isclose(r, r.max(), rtol=1e-3)][:, :2], 3), axis=0))
        for c, r in zip(corners, radii, strict=True)
    ]
    assert outer == [40, 60], "two corners a tooth"
    assert arm.position[:2] == pytest.approx((0.125, 0.0)) and arm.size[0] > 0.25
    assert [s.kind for s in drawing(replace(scene, constraints=scene.constraints[:3])).solids] == 3 * ["box"]


def geared(
    terms: tuple[float, float],
    apart: tuple[float, float, float] = (1.0, 0.0, 0.0),
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0),
    first: tuple[str, str] = (WORLD, "a"),
    second: type = Hinge,
) -> Scene:
    """Two bodies on joints of their own, and a relation between these."""
    places = {"a": (0.0, 0.0, 0.0), "b": apart}
    bodies = tuple(
        RigidBody(name=n, mass=1.0, inertia=(1.0, 1.0, 1.0), position=at) for n, at in places.items()
    )
    joints = (
        Hinge(name="one", between=first, axis=axis),
        second(name="two", between=(WORLD, "b"), axis=axis),
    )
    mesh = Relation(name="mesh", terms=(("one", terms[0]), ("two", terms[1])))
    return Scene(bodies=bodies, constraints=(*joints, mesh))


@pytest.mark.parametrize(
    ("scene", "kinds"),
    [
        (geared((20.0, 30.0)), ["facets", "facets"]),
        (geared((20.0, 30.0), first=("a", WORLD)), ["facets", "facets"]),
        (geared((0.2, 0.3), apart=(1.0, 0.0, 2.0), axis=(0.0, 1.0, 0.0)), ["facets", "facets"]),
        (geared((20.0, -30.0)), ["box", "box"]),  # a belt, or a ring: their size is not said
        (geared((20.0, 30.0), apart=(0.0, 0.0, 1.0)), ["box", "box"]),  # on one axle
        (geared((20.0, 30.0), apart=(0.0, 0.0, 0.0)), ["box", "box"]),
        (geared((1e300, 1.0)), ["box", "box"]),
        (geared((0.5, 1.0), second=Prismatic), ["facets", "box"]),
        (geared((1e300, 1.0), second=Prismatic), ["box", "box"]),
    ],
)
def test_only_what_meshes_as_far_as_can_be_seen_is_drawn_as_gears(scene: Scene, kinds: list[str]) -> None:
    drawn = drawing(scene)

    assert [solid.kind for solid in drawn.solids] == kinds
    assert scenery(drawn) is not None
    axis = scene.constraints[0].axis
    for wheel in (solid for solid in drawn.solids if solid.kind == "facets"):
        corners = np.array([turned(wheel.orientation, c) for c in batched_corners(wheel.size)])
        radius = np.linalg.norm(corners, axis=1).max()
        assert np.abs(corners @ np.array(axis)).max() < 0.2 * radius, "as flat as a wheel about its axis"


def test_a_pinion_has_the_radius_of_its_rack() -> None:
    wheel, _ = drawing(geared((0.5, 1.0), second=Prismatic)).solids
    reach = [math.hypot(x, y) for x, y, _ in batched_corners(wheel.size)]

    assert 0.5 * (max(reach) + min(r for r in reach if r > 0.0)) == pytest.approx(0.5, rel=1e-3)


def batched_corners(size: Sequence[float]) -> Iterator[tuple[float, ...]]:
    start = 0
    while start < len(size):
        end = start + 1 + 3 * int(size[start])
        yield from zip(*[iter(size[start + 1 : end])] * 3, strict=True)
        start = end


def test_a_joint_without_a_place_is_at_its_second_bodys_centre() -> None:
    ends = [
        RigidBody(name=n, mass=1.0, inertia=(1.0, 1.0, 1.0), position=(x, 0.0, 0.0))
        for n, x in (("a", 0.0), ("b", 1.0))
    ]
    scene = Scene(bodies=tuple(ends), constraints=(Hinge(name="h", between=("a", "b")),))

    (link,) = drawing(scene).links

    assert link.ends == ((1.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def test_turning_is_right_handed() -> None:
    assert turned(QUARTER_TURN_ABOUT_Z, (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0))
    assert turned(HALF_TURN_ABOUT_X, (0.0, 1.0, 2.0)) == pytest.approx((0.0, -1.0, -2.0))


def test_a_box_shows_three_faces_and_a_plane_lies_behind_everything() -> None:
    scene = Scene(
        bodies=(
            RigidBody(name="floor", position=(0.0, 0.0, -1.0), shape=Plane(), motion="static"),
            RigidBody(name="box", position=(0.0, 0.0, 0.0), mass=1.0, shape=Box((1.0, 1.0, 1.0))),
            RigidBody(name="rod", position=(2.0, 0.0, 0.0), mass=1.0, shape=Capsule(0.1, 1.0)),
        )
    )

    made = scenery(drawing(scene))

    assert made is not None
    assert [shape.classes for shape in made.shapes[:2]] == ["floor", "grid"]
    assert sum(shape.path.endswith("Z") and "solid" in shape.classes for shape in made.shapes) == 3
    assert "1 plane, 1 box, 1 capsule" in made.description


APART = (0.7, -1.3, 0.4)  # m


@pytest.mark.parametrize("size", [1e-4, 1.0, 30.0, 4e5])
def test_bar_and_axes_measure_the_picture(size: float) -> None:
    """Two places are as far apart in the picture as their way along the axes, in bars, says."""
    places = [(0.0, 0.0, 0.0), tuple(size * way for way in APART)]
    bodies = [Particle(name=f"{i}", position=at, mass=1.0) for i, at in enumerate(places)]  # type: ignore[arg-type]

    made = scenery(drawing(Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -9.81))))

    assert made is not None and made.bar is not None
    large = {s.centre: float(s.radius) for s in made.shapes if s.centre is not None}
    biggest = max(large.values())
    one, other = ([float(n) for n in at] for at, radius in large.items() if radius == biggest)
    ways = [[float(n) for n in mark.path.split("l")[1].split()] for mark in made.axes]
    long = float(made.bar.path.split("h")[1].split("v")[0])
    value, unit = (
        made.bar.words.replace("×10", "e").translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")).split()
    )
    metres = float(value) * {"m": 1.0, "mm": 1e-3, "km": 1e3}[unit]
    for k in (0, 1):
        expected = sum(size * APART[i] * ways[i][k] / AXIS for i in range(3)) * long / metres
        assert abs(other[k] - one[k]) == pytest.approx(abs(expected), abs=0.02 * WIDTH)
    assert [mark.words for mark in made.axes] == ["x", "y", "z"]
    assert 0.07 * WIDTH <= long <= 0.2 * WIDTH


@pytest.mark.parametrize(
    ("most", "length", "words"),
    [
        (1.0, 1.0, "1 m"),
        (0.999, 0.5, "0.5 m"),
        (0.21, 0.2, "0.2 m"),
        (0.0999, 0.05, "50 mm"),
        (4999.0, 2000.0, "2 km"),
        (2e-5, 2e-5, "2×10⁻⁵ m"),
        (7e8, 5e8, "5×10⁸ m"),
        (1e3, 1e3, "1 km"),
    ],
)
def test_a_bar_has_a_round_length(most: float, length: float, words: str) -> None:
    assert round_length(most) == length
    assert length_words(length) == words


def test_nothing_to_see_makes_no_picture() -> None:
    assert scenery(SceneDrawing(solids=())) is None


@pytest.mark.parametrize("name", sorted(CATALOGUE))
def test_every_scene_of_the_catalogue_fits_its_frame(name: str) -> None:
    made = scenery(drawing(CATALOGUE[name].example().scene))

    assert made is not None
    for shape in made.shapes:
        numbers = [float(n) for n in re.findall(r"-?[\d.]+", shape.path)]
        if shape.centre is not None:
            numbers = [float(shape.centre[0]), float(shape.centre[1])]
        assert all(-1.0 <= x <= made.width + 1.0 for x in numbers[0::2])
        assert all(-1.0 <= y <= made.height + 1.0 for y in numbers[1::2])
    for mark in [made.bar, *made.axes]:
        assert mark is not None
        assert 4.0 <= float(mark.x) <= made.width - 4.0
        assert 10.0 <= float(mark.y) <= made.height - 1.0


def test_a_wire_is_drawn_along_its_whole_way() -> None:
    scene = CATALOGUE["wires"].example().scene
    (wire,) = scene.constraints
    places = [point for _, point in wire.through]

    assert [link.ends for link in drawing(scene).links] == list(pairwise(places))


def test_a_body_without_a_surface_leaves_room_for_those_beside_it() -> None:
    """Its box says how it turns, in the proportions of its moments; two half a metre apart stay apart."""
    wheels = [
        RigidBody(name=f"{x}", mass=1.0, inertia=(0.4, 0.4, 0.6), position=(x, 0.0, 0.0)) for x in (0.0, 0.5)
    ]
    (alone,), (one, other) = drawing(Scene(bodies=wheels[:1])).solids, drawing(Scene(bodies=wheels)).solids

    assert max(alone.size) > 0.5 > 0.4 > max(one.size) == max(other.size)
    assert [edge / max(one.size) for edge in one.size] == pytest.approx(
        [edge / max(alone.size) for edge in alone.size]
    )

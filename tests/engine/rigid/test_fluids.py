"""Buoyancy and drag: volumes and centres against closed forms and sampled points, forces against Archimedes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    Capsule,
    Compound,
    Fluid,
    Method,
    MethodError,
    Part,
    RigidBody,
    Scene,
    SceneError,
    Shape,
    Sphere,
    simulate,
)
from tests.scenes.corpus import solid

G, RHO = 9.81, 1000.0


def push(
    shape: Shape,
    position: Any,
    orientation: Any = (1.0, 0.0, 0.0, 0.0),
    up: Any = (0.0, 0.0, 1.0),
    **fluid: Any,
) -> tuple[Any, Any]:
    """Force [N] and torque [N m] about the centre of mass that the fluid gives, from one tiny step without spin."""
    h = 1e-6
    gravity = tuple(-G * float(u) for u in up)
    body = solid("body", shape, position, inertia=(1.0, 1.0, 1.0), orientation=orientation)
    scene = Scene(bodies=(body,), forces=(Fluid(name="sea", density=RHO, **fluid),), gravity=gravity)
    state = simulate(scene, time_step=h, steps=1).final_state["body"]
    return state[7:10] / h - np.array(gravity), state[10:13] / h


def sampled(shape: Any, position: Any, orientation: Any, level: float, count: int = 90) -> tuple[float, Any]:
    """Volume and centre of what lies below, by counting points of a fine grid of the body's axes."""
    if isinstance(shape, Box):
        half = np.array(shape.size) / 2.0
    elif isinstance(shape, Sphere):
        half = np.full(3, shape.radius)
    else:
        half = np.array([shape.radius, shape.radius, shape.radius + shape.length / 2.0])
    axes = [(np.arange(count) + 0.5) / count * 2.0 * h - h for h in half]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    if isinstance(shape, Sphere):
        grid = grid[(grid**2).sum(axis=1) <= shape.radius**2]
    if isinstance(shape, Capsule):
        along = np.maximum(0.0, np.abs(grid[:, 2]) - shape.length / 2.0)
        grid = grid[grid[:, 0] ** 2 + grid[:, 1] ** 2 + along**2 <= shape.radius**2]
    w, *v = orientation
    u = np.array(v)
    turned = grid + 2.0 * np.cross(u, np.cross(u, grid) + w * grid) + np.asarray(position)
    below = turned[turned[:, 2] < level]
    cell = float(np.prod(2.0 * half / count))
    return len(below) * cell, below.mean(axis=0) if len(below) else np.zeros(3)


def some_turns(count: int) -> list[Any]:
    rng = np.random.default_rng(5)
    turns = rng.normal(size=(count, 4))
    return [tuple(q / np.linalg.norm(q)) for q in turns]


@pytest.mark.parametrize(
    "shape", [Sphere(0.7), Box((0.6, 0.9, 1.3)), Capsule(0.4, 1.1), Capsule(0.5, 0.05)], ids=repr
)
def test_the_force_is_the_weight_of_what_is_displaced_at_its_centre(shape: Shape) -> None:
    for k, turn in enumerate(some_turns(6)):
        place = (0.3, -0.2, -0.5 + 0.2 * k)
        force, torque = push(shape, place, turn, level=0.0)
        volume, centre = sampled(shape, place, turn, 0.0)
        right = RHO * G * volume

        np.testing.assert_allclose(force, (0.0, 0.0, right), atol=8e-3 * RHO * G)  # of the grid
        np.testing.assert_allclose(
            torque, np.cross(centre - np.array(place), (0.0, 0.0, right)), atol=8e-3 * RHO * G
        )


@pytest.mark.parametrize("depth", [0.01, 0.4, 1.0, 1.7, 1.999])
def test_a_sphere_and_an_upright_capsule_have_closed_forms(depth: float) -> None:
    r = 1.0
    cap = math.pi * depth**2 * (3.0 * r - depth) / 3.0
    force, torque = push(Sphere(r), (0.0, 0.0, r - depth), level=0.0)
    assert force[2] == pytest.approx(RHO * G * cap, rel=1e-9)
    assert np.abs(torque).max() < 1e-6 * RHO * G
    # Upright, its lower cap is that of the sphere, then a cylinder.
    long = Capsule(r, 3.0)
    force, _ = push(long, (0.0, 0.0, 2.5 - depth), level=0.0)
    volume = cap if depth < r else 2.0 / 3.0 * math.pi * r**3 + math.pi * r**2 * (depth - r)
    assert force[2] == pytest.approx(RHO * G * volume, rel=1e-9)
    # Lying, half of it is under; it weighs the same from both sides of the surface.
    half, lever = push(long, (0.0, 0.0, 0.0), (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0), level=0.0)
    whole = math.pi * r**2 * 3.0 + 4.0 / 3.0 * math.pi * r**3
    assert half[2] == pytest.approx(0.5 * RHO * G * whole, rel=1e-9)
    assert np.abs(lever).max() < 1e-6 * RHO * G


@pytest.mark.parametrize("shape", [Box((0.6, 0.9, 1.3)), Capsule(0.4, 1.1), Sphere(0.5)], ids=repr)
def test_what_is_below_and_what_is_above_make_the_whole(shape: Shape) -> None:
    """To rounding, at every turn: the same body seen with up and down exchanged."""
    whole = push(shape, (0.0, 0.0, -9.0), level=0.0)[0][2]
    for turn in some_turns(20):
        for height in (-0.4, -0.1, 0.0, 0.03, 0.35):
            below, twist = push(shape, (0.0, 0.0, height), turn, level=0.0)
            above, other = push(shape, (0.0, 0.0, height), turn, up=(0.0, 0.0, -1.0), level=0.0)

            assert below[2] - above[2] == pytest.approx(whole, rel=1e-8)
            np.testing.assert_allclose(twist, other, atol=1e-8 * whole)


def test_a_turned_box_is_as_exact_as_an_upright_one() -> None:
    """A cube on its edge, its edge d under the surface: a prism of area d²."""
    edge = (math.cos(math.pi / 8), math.sin(math.pi / 8), 0.0, 0.0)
    for d in (0.05, 0.3, 0.6):
        force, _ = push(Box((1.0, 1.0, 1.0)), (0.0, 0.0, math.sqrt(0.5) - d), edge, level=0.0)

        assert force[2] == pytest.approx(RHO * G * d * d, rel=1e-8)


def test_parts_of_a_compound_float_each_for_itself() -> None:
    ball = Sphere(0.5)
    pair = Compound((Part(shape=ball, position=(1.0, 0.0, 0.0)), Part(shape=ball, position=(-1.0, 0.0, 0.6))))
    force, torque = push(pair, (0.0, 0.0, -0.1), level=0.0)
    one, two = (push(ball, (0.0, 0.0, z), level=0.0)[0][2] for z in (-0.1, 0.5))

    assert force[2] == pytest.approx(one + two, rel=1e-9)
    assert torque[1] == pytest.approx(two - one, rel=1e-8)


@pytest.mark.parametrize(
    ("shape", "area"), [(Sphere(0.5), math.pi * 0.25), (Box((1.0, 2.0, 3.0)), 6.0), (Capsule(0.5, 2.0), None)]
)
def test_drag_is_quadratic_in_the_speed_through_the_fluid(shape: Shape, area: float | None) -> None:
    area = math.pi * 0.25 + 2.0 if area is None else area
    calm = push(shape, (0.0, 0.0, 0.0))[0]
    for speed in (0.5, 2.0):
        force, _ = push(shape, (0.0, 0.0, 0.0), velocity=(speed, 0.0, 0.0), drag_coefficient=0.8)

        assert force[0] == pytest.approx(0.5 * RHO * 0.8 * area * speed**2, rel=1e-6)
        assert force[2] == pytest.approx(calm[2], rel=1e-9)


def swim(**changes: Any) -> Any:
    body = RigidBody(name="body", mass=1.0, shape=Sphere(1.0), position=(0.0, 0.0, 0.0))
    scene = Scene(bodies=(body,), forces=(Fluid(name="sea", density=RHO),), gravity=(0.0, 0.0, -G))
    return simulate(scene, time_step=0.01, steps=1, **changes)


def test_a_fluid_needs_gravity_and_a_plain_method() -> None:
    with pytest.raises(SceneError, match="gravity"):
        Scene(
            bodies=(RigidBody(name="b", mass=1.0, shape=Sphere(1.0), position=(0, 0, 0)),),
            forces=(Fluid(name="sea", density=1.0),),
        )
    with pytest.raises(MethodError, match="'sea' does not follow"):
        swim(method=Method(composition="order4"))

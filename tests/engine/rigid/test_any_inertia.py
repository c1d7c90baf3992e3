"""Inertia about any axes: a tensor, and the sum of a compound's parts, against the same body in its principal axes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularMomentum,
    AngularVelocity,
    Ball,
    Box,
    Capsule,
    Compound,
    ConvexHull,
    Energy,
    Hinge,
    Method,
    Orientation,
    Part,
    Plane,
    Position,
    RigidBody,
    Scene,
    SceneError,
    Sphere,
    simulate,
)
from tests.oracles.rigid import product, rotation
from tests.scenes.seen import finals, traces

H = 0.01  # s
MOMENTS = (1.0, 2.0, 2.5)  # kg m²
TURN = np.array([0.8, 0.1, -0.5, 0.3]) / np.linalg.norm([0.8, 0.1, -0.5, 0.3])
OTHER = np.array([0.3, 0.9, 0.2, -0.1]) / np.linalg.norm([0.3, 0.9, 0.2, -0.1])
TENSOR = rotation(TURN) @ np.diag(MOMENTS) @ rotation(TURN).T
SPIN = (0.7, -2.0, 1.1)  # rad/s


def given(tensor: Any) -> Any:
    return tuple(tuple(float(x) for x in row) for row in 0.5 * (np.array(tensor) + np.array(tensor).T))


def body(principal: bool, **more: Any) -> RigidBody:
    """The same inertia in the world: about its principal axes, or as a tensor about others."""
    orientation = product(OTHER, TURN) if principal else OTHER
    return RigidBody(
        name="body",
        mass=1.5,
        inertia=MOMENTS if principal else given(TENSOR),
        position=(0.0, 0.0, 0.0),
        orientation=tuple(float(x) for x in orientation),  # type: ignore[arg-type]
        angular_velocity=SPIN,
        **more,
    )


SCENES = {
    "free": lambda b: Scene(bodies=(b,)),
    "on a pin": lambda b: Scene(
        bodies=(b,),
        constraints=(Ball(name="pin", between=(WORLD, "body"), at=(0.3, 0.1, 0.4), compliance=0.0),),
        gravity=(0.0, 0.0, -9.81),
    ),
    "on a hinge": lambda b: Scene(
        bodies=(b,),
        constraints=(Hinge(name="axle", between=(WORLD, "body"), axis=(0.0, 1.0, 0.0), at=(0.3, 0.0, 0.0)),),
        gravity=(0.0, 0.0, -9.81),
    ),
    "on a floor": lambda b: Scene(
        bodies=(b, RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, -0.55))),
        gravity=(0.0, 0.0, -9.81),
    ),
}
METHODS = {
    "plain": Method(),
    "half": Method(half_step_velocities=True),
    "order 4": Method(composition="order4"),
}


@pytest.mark.parametrize(
    ("scene", "method"),
    [(s, m) for s in SCENES for m in METHODS if not (s == "on a floor" and m == "order 4")],
)
def test_a_tensor_moves_as_its_principal_axes_do(scene: str, method: str) -> None:
    """Only names of axes differ, so all motion does by rounding at most, times the growth over fifty steps. Compositions take
    joint coordinates where a body's own axes are principal, and rows where they are not: steps of one order, h⁴ apart."""
    step, steps, apart = (H / 10.0, 500, 1e-12) if method == "order 4" and scene != "free" else (H, 50, 1e-10)
    shape = {"shape": Sphere(0.5)} if scene == "on a floor" else {}
    observe: dict[str, Any] = traces(
        w=AngularVelocity("body"), x=Position("body"), l=AngularMomentum(), energy=Energy()
    )
    runs = [
        simulate(
            SCENES[scene](body(p, **shape)),
            time_step=step,
            steps=steps,
            observe=observe,
            method=METHODS[method],
        )
        for p in (True, False)
    ]
    for name in observe:
        np.testing.assert_allclose(runs[1][name], runs[0][name], rtol=0.0, atol=apart)


def test_orientations_are_those_of_the_body_not_of_its_principal_axes() -> None:
    observe = finals(q=Orientation("body"))
    one, two = (
        simulate(SCENES["free"](body(p)), time_step=H, steps=30, observe=observe)["q"] for p in (True, False)
    )
    np.testing.assert_allclose(rotation(two) @ rotation(TURN), rotation(one), atol=1e-12)


def test_a_diagonal_tensor_is_its_moments_to_the_bit() -> None:
    tensor = RigidBody(name="b", mass=1.0, position=(0.0, 0.0, 0.0), inertia=given(np.diag(MOMENTS)))
    moments = RigidBody(name="b", mass=1.0, position=(0.0, 0.0, 0.0), inertia=MOMENTS)
    assert tensor == moments


def test_a_compound_sums_its_parts_by_steiner() -> None:
    """Against a sum over many small cubes of the same solids, and exactly for a box cut in two."""
    halves = Compound(tuple(Part(shape=Box((0.2, 0.4, 0.6)), position=(x, 0.0, 0.0)) for x in (-0.1, 0.1)))
    np.testing.assert_allclose(halves.inertia(3.0), Box((0.4, 0.4, 0.6)).inertia(3.0), rtol=1e-14)

    tilt = (math.cos(0.3), 0.0, math.sin(0.3), 0.0)
    parts = (
        Part(shape=Box((0.2, 0.1, 0.3)), position=(0.25, 0.1, -0.2), orientation=tilt),
        Part(
            shape=Capsule(0.05, 0.2),
            position=(0.0, 0.0, 0.3),
            orientation=(math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0),
        ),
    )
    volumes = np.array([part.shape.volume for part in parts])
    centre = volumes @ np.array([part.position for part in parts]) / volumes.sum()
    moved = Compound(
        tuple(
            Part(
                shape=p.shape,
                orientation=p.orientation,
                position=tuple(float(x) for x in np.array(p.position) - centre),
            )  # type: ignore[arg-type]
            for p in parts
        )
    )
    tensor, total = np.zeros((3, 3)), 0.0
    step = 0.005
    for part in moved.parts:
        reach = 0.25
        axis = np.arange(-reach + 0.5 * step, reach, step)
        grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        if isinstance(part.shape, Box):
            inside = np.all(np.abs(grid) <= 0.5 * np.array(part.shape.size), axis=1)
        else:
            assert isinstance(part.shape, Capsule)
            core = np.clip(grid[:, 2], -0.5 * part.shape.length, 0.5 * part.shape.length)
            inside = np.hypot(np.hypot(grid[:, 0], grid[:, 1]), grid[:, 2] - core) <= part.shape.radius
        places = grid[inside] @ rotation(np.array(part.orientation)).T + part.position
        tensor += (places**2).sum() * np.eye(3) - places.T @ places
        total += inside.sum()
    made = RigidBody(name="b", mass=2.0, position=(0.0, 0.0, 0.0), shape=moved)
    turn = rotation(np.array(made.inertia_axes))
    found = turn @ np.diag(made.inertia) @ turn.T
    # Cells of a twentieth of the smallest size: their edge is off by a share of it, and ten in a row are square.
    np.testing.assert_allclose(found, 2.0 / total * tensor, rtol=0.0, atol=0.02 * found.max())


def test_a_hull_beside_its_principal_axes_has_their_inertia() -> None:
    corners = np.array([(x, y, z) for x in (-0.3, 0.3) for y in (-0.2, 0.2) for z in (-0.5, 0.5)])
    tilted = ConvexHull(tuple(tuple(map(float, p)) for p in corners @ rotation(TURN).T))  # type: ignore[misc]
    hull = RigidBody(name="b", mass=3.0, position=(0.0, 0.0, 0.0), shape=tilted)
    turn = rotation(np.array(hull.inertia_axes))
    wanted = rotation(TURN) @ np.diag(Box((0.6, 0.4, 1.0)).inertia(3.0)) @ rotation(TURN).T
    assert hull.inertia is not None
    np.testing.assert_allclose(turn @ np.diag(hull.inertia) @ turn.T, wanted, atol=1e-14)
    both = Compound((Part(shape=tilted), Part(shape=Sphere(0.1))))  # one of its parts has a tensor
    share = 3.0 * tilted.volume / both.volume
    ball = np.eye(3) * Sphere(0.1).inertia(3.0 - share)[0]
    np.testing.assert_allclose(np.array(both.inertia(3.0)), wanted * share / 3.0 + ball, atol=1e-14)


def test_a_compound_beside_its_centre_of_mass_is_refused() -> None:
    off = Compound((Part(shape=Sphere(0.1)), Part(shape=Sphere(0.1), position=(1.0, 0.0, 0.0))))
    with pytest.raises(SceneError, match=r"centre of mass at \(0.5, 0, 0\) m"):
        RigidBody(name="b", mass=1.0, position=(0.0, 0.0, 0.0), shape=off)


@pytest.mark.parametrize("exponent", [-900, -550, -300, 300, 550, 900])
@pytest.mark.parametrize("principal", [True, False])
def test_a_free_turn_does_not_depend_on_the_unit_of_mass(principal: bool, exponent: int) -> None:
    """To the bit, from 1e-270 to 1e270 kg m²: its cubes are beyond what there are numbers for."""
    ends = []
    for scale in (1.0, 2.0**exponent):
        moments = tuple(scale * moment for moment in MOMENTS)
        tensor = rotation(TURN) @ np.diag(MOMENTS) @ rotation(TURN).T
        free = RigidBody(
            name="it",
            mass=1.0,
            inertia=moments if principal else given(scale * tensor),
            position=(0.0, 0.0, 0.0),
            angular_velocity=SPIN,
        )
        observe = finals(q=Orientation("it"))
        ends.append(simulate(Scene(bodies=(free,)), time_step=H, steps=100, observe=observe)["q"])

    np.testing.assert_array_equal(*ends)

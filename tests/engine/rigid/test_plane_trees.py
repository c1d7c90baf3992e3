"""Mechanisms in a plane of the world's axes: the steps of the dense oracle, and of the same mechanism in another plane."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from spook_tracker import engine
from spook_tracker.engine import WORLD, Hinge, Method, Prismatic, RigidBody, Scene, simulate
from spook_tracker.scalar_tests.mechanisms import swinging_door
from spook_tracker.scalar_tests.multibody import four_bars
from tests.engine.test_symmetries import rotation, turned
from tests.oracles.rigid_composition import STATE, assert_dense_steps

ORDER4, ORDER8 = Method(composition="order4"), Method(composition="order8")
# Quaternions: the world's axes in another order, and a turn of .4 rad about a direction that is none of them.
ACROSS = {"x": np.full(4, 0.5), "y": np.array([0.5, -0.5, -0.5, -0.5]), "z": np.array([1.0, 0.0, 0.0, 0.0])}
LEANING = np.array([np.cos(0.2), *(np.sin(0.2) * np.array([1.0, 2.0, 2.0]) / 3.0)])


def rod(name: str, begin: tuple[float, float], end: tuple[float, float], spin: float = 0.0) -> RigidBody:
    """A flat body in the plane across z."""
    x, y = 0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1])
    return RigidBody(
        name=name,
        mass=1.0 + 0.3 * len(name),
        inertia=(0.05, 0.07, 0.11),
        position=(x, y, 0.1 * len(name)),  # reach out of it does nothing
        angular_velocity=(0.0, 0.0, spin),
    )


def hinge(name: str, first: str, second: str, at: tuple[float, float], z: float = 0.0) -> Hinge:
    return Hinge(name=name, between=(first, second), at=(*at, z), axis=(0.0, 0.0, 1.0), compliance=0.0)


def made(bodies: list[RigidBody], rows: list[Any]) -> Scene:
    return Scene(bodies=tuple(bodies), constraints=tuple(rows), gravity=(0.7, -9.81, 2.0), contacts=False)


def chain() -> Scene:
    """Rods that branch: two on the first, one of them held the other way round; the first on two hinges."""
    bodies = [
        rod("a", (0, 0), (1, 0)),
        rod("bb", (1, 0), (1.6, 0.8)),
        rod("ccc", (1, 0), (2, -0.3)),
        rod("dddd", (2, -0.3), (2.5, -0.3)),
    ]
    rows = [
        hinge("0", WORLD, "a", (0, 0)),
        hinge("again", WORLD, "a", (0, 0), z=0.8),
        hinge("1", "a", "bb", (1, 0)),
        hinge("2", "ccc", "a", (1, 0)),
        hinge("3", "ccc", "dddd", (2, -0.3)),
    ]
    return made(bodies, rows)


def slider_crank() -> Scene:
    """A crank, a rod, and a piston on a rail that leans; and a slide on the crank, the first of its bodies."""
    lean = np.array([np.cos(0.2), np.sin(0.2), 0.0])
    bodies = [
        rod("crank", (0, 0), (0, 1)),
        rod("rod", (0, 1), (2, 0.5)),
        rod("piston", (1.8, 0.5), (2.2, 0.5)),
        rod("bead", (0.2, 0.4), (0.2, 0.6)),
    ]
    rows = [
        hinge("shaft", WORLD, "crank", (0, 0)),
        hinge("pin", "crank", "rod", (0, 1)),
        Prismatic(name="rail", between=(WORLD, "piston"), at=(2, 0.5, 0), axis=tuple(lean), compliance=0.0),
        hinge("wrist", "piston", "rod", (2, 0.5)),
        Prismatic(name="wire", between=("bead", "crank"), at=(0.2, 0.5, 0), axis=(0, 1, 0), compliance=0.0),
    ]
    return made(bodies, rows)


def bars() -> Scene:
    scene = dataclasses.replace(four_bars.scene(2, 0.02), gravity=(0.3, -9.81, 0.0))
    rows = tuple(dataclasses.replace(row, compliance=0.0) for row in scene.constraints)
    return dataclasses.replace(scene, constraints=rows)


SCENES = {"chain": chain(), "slider crank": slider_crank(), "two four-bars": bars()}


def placed(scene: Scene, turn: np.ndarray) -> Scene:
    """The whole scene turned about the origin by a quaternion, its joints rigid."""
    there = turned(scene, turn, np.zeros(3), np.zeros(3))
    rows = tuple(dataclasses.replace(row, compliance=0.0, damping=None) for row in there.constraints)
    return dataclasses.replace(there, constraints=rows)


def reasons(scene: Scene) -> dict[str, str]:
    program = engine.compile(scene, time_step=0.02, method=ORDER8)
    return {choice.stage: choice.reason for choice in program.explain()}


@pytest.mark.parametrize("name", SCENES)
def test_the_same_mechanism_in_another_plane_takes_the_same_steps(name: str) -> None:
    """Two ways to one map: numbers of the plane, and vectors of space; by steps so long that it shows which map it is."""
    scene = SCENES[name]
    leaning, lean = placed(scene, LEANING), rotation(LEANING)

    runs = [simulate(s, time_step=0.1, steps=5, method=ORDER4, observe=STATE) for s in (scene, leaning)]

    assert "in the plane across z" in reasons(scene)["solve_block"]
    assert "in the plane" not in reasons(leaning)["solve_block"]
    for quantity in ("x", "v", "w"):
        assert np.abs(runs[0][quantity] @ lean.T - runs[1][quantity]).max() < 1e-12, quantity


@pytest.mark.parametrize("axis", ACROSS)
@pytest.mark.parametrize("name", SCENES)
def test_numbers_of_the_plane_take_the_dense_steps(name: str, axis: str) -> None:
    """Against rows alone, which know of no plane; across each of the world's axes."""
    scene = placed(SCENES[name], ACROSS[axis])

    assert f"in the plane across {axis}" in reasons(scene)["solve_block"]
    assert_dense_steps(scene, 0.1, 2)


def test_what_could_wobble_stays_in_space() -> None:
    """A body whose spin leaves the plane, an axis that is off by what one can see: vectors of space."""
    door = swinging_door.scene()
    tilted = dataclasses.replace(door.bodies[0], orientation=(0.8, 0.36, 0.48, 0.0))
    scene = SCENES["chain"]
    off = dataclasses.replace(scene.constraints[2], axis=(1e-9, 0.0, 1.0))  # type: ignore[call-arg]

    assert "in the plane across z" in reasons(door)["solve_block"]
    assert "in the plane" not in reasons(dataclasses.replace(door, bodies=(tilted,)))["solve_block"]
    rows = (*scene.constraints[:2], off, *scene.constraints[3:])
    assert "in the plane" not in reasons(dataclasses.replace(scene, constraints=rows))["solve_block"]

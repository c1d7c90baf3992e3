"""T8: what holds a body at rest carries exactly its load: sags, hinge forces, beams, for every step and damping."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Box,
    ConstraintForce,
    Final,
    Hinge,
    Load,
    Lock,
    MaximumAbsolute,
    Position,
    RigidBody,
    Scene,
    Violation,
    simulate,
)
from tests.oracles.particles import Array

GRAVITY = 9.81  # m/s²
DOWN = (0.0, 0.0, -GRAVITY)


@pytest.mark.parametrize("h", [1e-3, 1 / 60, 0.1])
@pytest.mark.parametrize("damping", [0.01, 0.1])
def test_t8_a_locked_body_sags_by_compliance_times_force_in_every_degree(damping: float, h: float) -> None:
    """Six compliances, six loads: g = −eps F in each row, whatever h and tau are."""
    eps = (1e-5, 2e-5, 3e-5, 1e-6, 2e-6, 4e-6)
    force, torque = np.array([3.0, -5.0, 7.0]), np.array([0.4, -0.2, 0.3])
    body = RigidBody(name="body", mass=2.0, inertia=(0.1, 0.2, 0.25), position=(0.0, 0.0, 0.0))
    lock = Lock(name="lock", between=(WORLD, "body"), compliance=eps, damping=damping)
    load = Load(name="load", body="body", force=tuple(force), torque=tuple(torque))
    scene = Scene(bodies=(body,), constraints=(lock,), forces=(load,))
    observe = {"g": Final(quantity=Violation("lock")), "f": Final(quantity=ConstraintForce("lock"))}
    result = simulate(scene, time_step=h, duration=max(10.0, 1000.0 * h), observe=observe)
    carried = np.concatenate([force, torque])

    np.testing.assert_allclose(result["g"], np.array(eps) * carried, rtol=2e-5)
    np.testing.assert_allclose(result["f"], -carried, rtol=1e-5, atol=1e-6)


def door(count: int, compliance: float) -> Scene:
    """The thesis' door: 45 kg, hinged on one edge at evenly spaced heights, damping of two steps."""
    board = RigidBody(name="door", mass=45.0, shape=Box((1.0, 0.06, 2.0)), position=(0.5, 0.0, 1.0))
    heights = np.linspace(0.0, 2.0, count + 2)[1:-1]
    hinges = tuple(
        Hinge(
            name=f"hinge {i}",
            between=(WORLD, "door"),
            at=(0.0, 0.0, float(z)),
            axis=(0.0, 0.0, 1.0),
            compliance=compliance,
        )
        for i, z in enumerate(heights)
    )
    return Scene(bodies=(board,), constraints=hinges, gravity=(0.0, 0.0, -10.0))


def minimum_norm(count: int) -> Array:
    """(count, 6) force and torque on the door at each hinge: the smallest that balance it, by the pseudoinverse.

    The rows of a hinge are its three forces and the torques about the two axes it blocks; with equal compliance
    per row the elastic solution of a rigid door is the one of least norm.
    """
    heights = np.linspace(0.0, 2.0, count + 2)[1:-1]
    columns = []
    for z in heights:
        arm = np.array([-0.5, 0.0, z - 1.0])
        for direction in np.eye(3):
            columns.append(np.concatenate([direction, np.cross(arm, direction)]))
        for direction in np.eye(3)[:2]:
            columns.append(np.concatenate([np.zeros(3), direction]))
    needed = np.array([0.0, 0.0, 450.0, 0.0, 0.0, 0.0])
    least = (np.linalg.pinv(np.array(columns).T) @ needed).reshape(count, 5)
    return np.hstack([least, np.zeros((count, 1))])


@pytest.mark.parametrize("compliance", [1e-13, 1e-11])
@pytest.mark.parametrize("count", [1, 2, 3, 10, 60])
def test_hinges_share_a_door_as_the_minimum_norm_solution(count: int, compliance: float) -> None:
    observe = {str(i): Final(quantity=ConstraintForce(f"hinge {i}")) for i in range(count)}
    result = simulate(door(count, compliance), time_step=1 / 60, steps=600, observe=observe)
    found = np.array([result[str(i)] for i in range(count)])

    np.testing.assert_allclose(found, minimum_norm(count), rtol=0.0, atol=450.0 * 1e-9)


def beam(pieces: int, tip: float, stiffness: float = 4.84e6, length: float = 12.0) -> Scene:
    """A clamped beam of locked pieces, bending stiffness EI [N m²], tip load [N] at the last piece's far end.

    Per lock, rotation compliance dx/(EI) and shear compliance dx³/(12 EI); half a piece at the wall gives the
    nodes the deflections of Euler and Bernoulli's beam.
    """
    dx = length / pieces
    mass = 19.9 * dx
    bodies = tuple(
        RigidBody(name=f"piece {i}", mass=mass, inertia=(mass, mass, mass), position=(dx * (i + 1), 0.0, 0.0))
        for i in range(pieces)
    )
    soft, shear = dx / stiffness, dx**3 / (12.0 * stiffness)
    locks = tuple(
        Lock(
            name=f"lock {i}",
            between=(WORLD if i == 0 else f"piece {i - 1}", f"piece {i}"),
            at=(dx * (i + 0.5), 0.0, 0.0),
            compliance=(1e-12, shear, shear, soft, soft, soft),
            damping=0.1,
        )
        for i in range(pieces)
    )
    load = Load(name="tip", body=f"piece {pieces - 1}", force=(0.0, 0.0, -tip))
    return Scene(bodies=bodies, constraints=locks, forces=(load,))


@pytest.mark.parametrize("pieces", [2, 5, 10])
def test_a_cantilever_bends_as_euler_and_bernoulli_say(pieces: int) -> None:
    """Nodes at x = i dx sink by P x² (3 l − x)/(6 E I); a load small enough that second order is rounding."""
    tip, stiffness, length = 1e-4, 4.84e6, 12.0
    observe = {
        "x": Final(quantity=Position()),
        "moved": MaximumAbsolute(quantity=Position(), from_start=True),
    }
    result = simulate(beam(pieces, tip), time_step=0.05, steps=40_000 // pieces, observe=observe)
    x = length / pieces * np.arange(1, pieces + 1)
    exact = tip * x**2 * (3.0 * length - x) / (6.0 * stiffness)

    np.testing.assert_allclose(-result["x"][:, 2], exact, rtol=1e-9)
    assert result["moved"][:, 1].max() < 1e-15


def test_a_column_of_locks_carries_what_is_below_it() -> None:
    bodies = tuple(
        RigidBody(name=f"b{i}", mass=1.0 + i, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, -float(i)))
        for i in range(5)
    )
    locks = tuple(
        Lock(name=f"l{i}", between=(WORLD if i == 0 else f"b{i - 1}", f"b{i}"), compliance=0.0)
        for i in range(5)
    )
    observe = {f"l{i}": Final(quantity=ConstraintForce(f"l{i}")) for i in range(5)}
    result = simulate(
        Scene(bodies=bodies, constraints=locks, gravity=DOWN), time_step=1 / 60, steps=200, observe=observe
    )

    for i in range(5):
        weight = GRAVITY * sum(1.0 + j for j in range(i, 5))
        np.testing.assert_allclose(result[f"l{i}"], [0.0, 0.0, weight, 0.0, 0.0, 0.0], rtol=0.0, atol=1e-9)

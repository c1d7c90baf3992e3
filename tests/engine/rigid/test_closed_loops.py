"""Closed loops with more rows than they need: a ring of locks stays one body, Bricard's six hinges move as one."""

from __future__ import annotations

import math

import numpy as np

from spook_tracker.engine import WORLD, Energy, Hinge, JointCoordinate, RigidBody, Scene, Trace, simulate
from tests.oracles.particles import Array

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 0, -1), (1, -1, -1), (0, -1, -1), (0, -1, 0)], dtype=float)
AXES = ((0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0))


def bricard(compliance: float) -> Scene:
    """Six unit links along the edges of a cube (one of them the world), hinged square to their neighbours."""
    bars = []
    for i in range(5):
        along = np.abs(CORNERS[i + 1] - CORNERS[i])
        bars.append(
            RigidBody(
                name=f"bar {i}",
                mass=1.0,
                inertia=tuple(np.where(along > 0.5, 1e-3, 1.0 / 12.0)),
                position=tuple(0.5 * (CORNERS[i] + CORNERS[i + 1])),
            )
        )
    names = [WORLD, *(f"bar {i}" for i in range(5)), WORLD]
    hinges = tuple(
        Hinge(
            name=f"hinge {i}",
            between=(names[i], names[i + 1]),
            at=tuple(CORNERS[i]),
            axis=AXES[i],
            compliance=compliance,
        )
        for i in range(6)
    )
    return Scene(bodies=tuple(bars), constraints=hinges, gravity=(0.0, -9.81, 0.0))


def hinge_angles(h: float) -> tuple[Array, Array]:
    """(samples, 6) angles from the cube, and the energy, over 2 s."""
    observe = {f"{i}": Trace(quantity=JointCoordinate(f"hinge {i}")) for i in range(6)}
    result = simulate(
        bricard(1e-8), time_step=h, duration=2.0, observe=observe | {"e": Trace(quantity=Energy())}
    )
    return np.array([result[str(i)] for i in range(6)]).T, result["e"]


def test_bricards_mechanism_moves_as_geometry_allows() -> None:
    """Opposite angles stay equal and neighbours obey cos a + cos b + cos a cos b = 0 (trihedral Bricard linkage).

    Six hinges in a loop should be stiff: one motion is left, and the rows must not stop it. It swings through
    180° and back.
    """
    errors = []
    for h in (1 / 1000, 1 / 2000):
        angles, energy = hinge_angles(h)
        odd, even = angles[:, [0, 2, 4]] * (1.0, 1.0, -1.0), angles[:, [1, 3, 5]] * (1.0, -1.0, -1.0)
        a, b = np.cos(0.5 * math.pi - odd[:, 0]), np.cos(0.5 * math.pi + even[:, 0])
        errors.append(np.abs(a + b + a * b).max())
        assert np.ptp(odd, axis=1).max() < 3e-5
        assert np.ptp(even, axis=1).max() < 3e-5
        assert np.abs(even).max() > 3.1
        assert np.abs(energy - energy[0]).max() < 0.1  # J of 25 that change places

    assert errors[1] < 2e-5
    assert errors[1] < 0.5 * errors[0]

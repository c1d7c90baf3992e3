"""The total energy of what falls, leans and is lifted apart never rises, whatever solves it."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Box,
    Material,
    Method,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    simulate,
)
from tests.scenes.corpus import stack

GRAVITY = (0.0, 0.0, -9.81)


def test_a_stack_that_sinks_under_a_small_residual_is_unsettled() -> None:
    """Two hundred sweeps through two hundred boxes: no row is off by more than is allowed, and the stack sank by 1.5 m."""
    method = Method(solver="iterative", iterations=200)
    scene = stack(200)
    result = simulate(scene, time_step=1 / 60, steps=45, method=method)

    assert result.status == "unsettled"
    assert result.residual < method.residual_of("unsettled_residual", scene)


@pytest.mark.parametrize(("seed", "solver"), [(1000, "iterative"), (1544, "iterative")])
def test_what_merely_lies_near_pays_for_no_gain(seed: int, solver: str) -> None:
    """A heavy ball falls past a few cubes, and is looked at until it touches one. Weighed together with it, a solve of
    the cubes that stops early gained 1.4e-5 of their energy in a step.
    """
    rng, rough = np.random.default_rng(seed), Material(friction=0.8)
    mass, cubes = np.empty(4), []
    for k in range(4):
        mass[k], turn = 10 ** rng.uniform(-3, 6), rng.normal(size=4)
        cubes.append(
            RigidBody(
                name=f"cube {k}",
                mass=mass[k],
                shape=Box((0.4, 0.4, 0.4)),
                position=(*rng.uniform(-0.1, 0.1, 2), 0.4 + 0.72 * k),
                orientation=tuple(turn / np.linalg.norm(turn)),
                material=rough,
            )
        )
    start = (0.7, 0.0, rng.uniform(1, 2.5))
    ball = RigidBody(name="ball", mass=1e7, shape=Sphere(0.25), position=start, material=rough)
    floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0, 0, 0), material=rough)
    result = simulate(
        Scene(bodies=(floor, *cubes, ball), gravity=GRAVITY),
        time_step=1 / 60,
        steps=45,
        method=Method(solver=solver, iterations=1),
        observe={
            "x": Trace(quantity=Position()),
            "v": Trace(quantity=Velocity()),
            "w": Trace(quantity=AngularVelocity()),
        },
    )
    x, v, w = (result[key].reshape(-1, 6, 3) for key in "xvw")
    alone = np.abs(x[:, 5] - start)[:, :2].max(axis=1).cumsum() == 0.0
    square = (v**2).sum(axis=2) + 0.4**2 / 6 * (w**2).sum(axis=2)
    energy = ((0.5 * square - x @ GRAVITY)[:, 1:5] @ mass)[alone]

    assert result.status == "unsettled"
    assert len(energy) > 30
    assert np.diff(energy).max() <= 1e-9 * energy[0]

"""The total energy of what falls, leans and is lifted apart never rises, whatever solves it."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Box,
    Energy,
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
ROUGH = Material(friction=0.5)
GROUND = RigidBody(name="ground", motion="static", shape=Plane(), position=(0, 0, 0), material=ROUGH)
SOLVERS = ("direct", "iterative")


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_rigid_contact_that_opens_is_not_pushed_after_its_own_speed(solver: str) -> None:
    """A ball thrown up at a tenth of h g: the row asked for a nineteenth of its speed, and pushed to get it."""
    rise = 0.1 * 9.81 / 60
    ball = RigidBody(
        name="ball",
        mass=1.0,
        shape=Sphere(0.25),
        position=(0, 0, 0.25),
        velocity=(0, 0, rise),
        material=ROUGH,
    )
    result = simulate(
        Scene(bodies=(GROUND, ball), gravity=GRAVITY),
        time_step=1 / 60,
        steps=3,
        method=Method(solver=solver),
        observe={"energy": Trace(quantity=Energy())},
    )

    assert np.diff(result["energy"]).max() <= 1e-12
    assert result.final_state["ball"][9] == pytest.approx(0.0, abs=1e-12)


def test_a_stack_that_sinks_under_a_small_residual_is_unsettled() -> None:
    """Two hundred sweeps through two hundred boxes: no row is off by more than is allowed, and the stack sank by 1.5 m."""
    method = Method(solver="iterative", iterations=200)
    scene = stack(200)
    result = simulate(scene, time_step=1 / 60, steps=45, method=method)

    assert result.status == "unsettled"
    assert result.residual < method.residual_of("unsettled_residual", scene)


def test_a_stack_that_iterations_lift_apart_stands() -> None:
    """The same through a hundred, which sank by .8 m in 45 steps, parted once a step. No overlap is more than what the
    allowed .1 m/s close in a step.
    """
    result = simulate(
        stack(100),
        time_step=1 / 60,
        duration=2.0,
        method=Method(solver="iterative", iterations=200),
        observe={"energy": Trace(quantity=Energy()), "top": Trace(quantity=Position("box 99"))},
    )
    sunk = 99.5 - result["top"][:, 2]

    assert result.status == "completed"
    assert sunk.max() < 100 * 0.1 / 60
    assert np.diff(result["energy"]).max() <= 1e-12 * result["energy"][0]


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

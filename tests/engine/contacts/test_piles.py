"""Piles by sweeps: no overlap where the sweeps converge, an answer where they are few, no touch where none is."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import Method, Penetration, Plane, RigidBody, Scene, Sphere, Velocity, simulate
from spook_tracker.engine.bodies import Material
from spook_tracker.scalar_tests.stacks import falling_pile, pile
from tests.scenes.corpus import solid
from tests.scenes.seen import finals, traces

STEP = 1.0 / 60.0


@pytest.mark.parametrize("sweeps", [1, 5])
def test_a_pile_with_few_iterations_still_carries_its_weight(sweeps: int) -> None:
    """Whatever such a run says of its residual: nothing sinks in far, and no step wins energy."""
    found = pile.read(simulate, 160, Method(solver="iterative", iterations=sweeps), steps=120, last=30)
    assert found.overlap < 0.02 * pile.RADIUS
    assert abs(found.balance_error) < 1e-10
    assert found.energy_rise < 1e-9


def test_every_step_of_the_nightly_pile_settles() -> None:
    result = simulate(
        pile.scene(),
        time_step=pile.TIME_STEP,
        steps=pile.STEPS,
        method=pile.SWEEPS,
        observe=finals(depth=Penetration()),
    )
    assert result.completed, result.failure
    assert result["depth"] < 1e-3


def test_a_ball_that_passes_a_pile_keeps_every_bit_of_its_velocity() -> None:
    """One thousandth of a radius beside the pile's outermost sphere, without gravity: near is not touching."""
    smooth = Material(friction=0.5)
    rest = [
        solid(f"s{k}", Sphere(0.25), (0.5 * (k % 3), 0.5 * (k // 3), 0.25), material=smooth) for k in range(9)
    ]
    floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=smooth)
    pusher = solid("pusher", Sphere(0.25), (-0.6, 0.0, 0.25), velocity=(2.0, 0.0, 0.0), material=smooth)
    passer = solid(
        "passer", Sphere(0.25), (1.50025, -2.0, 0.25 + 1e-6), velocity=(0.3, 7.0, 0.1), material=smooth
    )
    result = simulate(
        Scene(bodies=(floor, *rest, pusher, passer)),
        time_step=STEP,
        steps=8,
        method=Method(solver="iterative"),
        observe=traces(v=Velocity("passer"), hit=Velocity("s1")),
    )
    assert (result["v"] == np.array([0.3, 7.0, 0.1])).all()
    assert np.abs(result["hit"]).max() > 0.1  # the pile itself was hit meanwhile


@pytest.mark.parametrize("seed", [8, 15, 121, 157])
def test_iterations_that_end_early_leave_nothing_in_the_ground(seed: int) -> None:
    """A pile at rest is hit, and 200 iterations leave centimetres a second: no energy lifts the boxes out of where that led."""
    fall = falling_pile.read(simulate, seed, 0.0, 0.4, falling_pile.SWEEPS)

    assert (fall.depth - fall.bent).max() < 1e-7

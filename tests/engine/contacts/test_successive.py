"""Successive blows within a step: in the order of their times whatever moves the bodies, and nothing gained on the way."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import Box, Lock, Material, Method, RigidBody, Scene, Sphere, Velocity, simulate
from tests.engine.contacts.test_impacts import meetings
from tests.scenes.corpus import fixed, solid
from tests.scenes.seen import finals

ELASTIC = Material(restitution=1.0)
GRAVITY = 9.81  # m/s²
STEPS = (1 / 60, 1 / 240, 1e-3)  # s
SIZE = 0.4  # m, of each ball
SUCCESSIVE = ["direct", "iterative"]


def ball(name: str, place: np.ndarray, velocity: np.ndarray, mass: float, material: Material) -> RigidBody:
    return solid(name, Sphere(0.5 * SIZE), tuple(place), mass, tuple(velocity), material=material)


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("psi", [0.3, 1.0])
def test_a_single_impact_is_the_same_in_either_order(psi: float, way: float, h: float) -> None:
    material = Material(restitution=psi)
    ends = []
    for impacts in ("simultaneous", "successive"):
        wall = fixed("wall", Box((4.0, 4.0, 1.0)), (0, 0, 0), material=material)
        place = np.array((0.0, 0.0, -way * (0.7 + 1.4 * h * 2.0)))
        thrown = ball("thrown", place, np.array((0.0, 0.0, 2.0 * way)), 1.0, material)
        run = simulate(
            Scene(bodies=(wall, thrown), gravity=(0.0, 0.0, -GRAVITY)),
            time_step=h,
            steps=4,
            method=Method(impacts=impacts),  # type: ignore[arg-type]
        )
        assert run.counters["impacts"] == 1
        ends.append(run.final_state["thrown"])
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("solver", SUCCESSIVE)
@pytest.mark.parametrize("seed", range(8))
def test_a_kinematic_body_hits_a_row_as_a_ball_of_any_mass_would(seed: int, solver: str) -> None:
    rng, h = np.random.default_rng(100 + seed), STEPS[seed % 3]
    count, speed = int(rng.integers(2, 5)), float(rng.uniform(0.5, 3.0))
    masses = np.concatenate(((1e15,), 10.0 ** rng.uniform(-0.7, 0.7, count)))
    places = np.concatenate(((0.0,), np.cumsum(SIZE + 10.0 ** rng.uniform(-6.0, -2.5, count))))
    places[0] -= rng.uniform(0.5, 2.5) * h * speed
    speeds = np.zeros(count + 1)
    speeds[0] = speed
    pusher = solid(
        "pusher",
        Sphere(0.5 * SIZE),
        (places[0], 0.0, 0.0),
        None,
        (speed, 0.0, 0.0),
        motion="kinematic",
        material=ELASTIC,
    )
    row = [
        ball(f"b{k}", np.array((places[k], 0.0, 0.0)), np.zeros(3), float(masses[k]), ELASTIC)
        for k in range(1, count + 1)
    ]
    run = simulate(
        Scene(bodies=(pusher, *row)),
        time_step=h,
        steps=8,
        method=Method(impacts="successive", solver=solver),  # type: ignore[arg-type]
        observe=finals(v=Velocity()),
    )
    after = meetings(places, speeds, masses, SIZE, 8 * h)
    assert np.abs(run["v"][:, 0] - after).max() < 1e-6 * np.abs(after).max()


@pytest.mark.parametrize("first", [0.2, 0.8])
@pytest.mark.parametrize("solver", SUCCESSIVE)
def test_impacts_at_both_ends_of_a_locked_pair_come_in_their_order(solver: str, first: float) -> None:
    """A joint is all that hangs them together: what strikes one end changes what strikes the other later in the step."""
    h, masses = STEPS[0], np.array((0.5, 2.0, 1.5))
    speeds = np.array((3.0, 0.0, -2.0))
    left, right = (1.0 + first) * h * speeds[0], (2.0 - first) * h * -speeds[2]
    places = np.array((-SIZE - left, 0.0, 2.0 * SIZE + right))  # of A, the pair's left ball, C
    bodies = (
        ball("a", np.array((places[0], 0, 0)), np.array((speeds[0], 0, 0)), masses[0], ELASTIC),
        ball("p", np.array((0.0, 0, 0)), np.zeros(3), 1.0, ELASTIC),
        ball("q", np.array((SIZE, 0, 0)), np.zeros(3), 1.0, ELASTIC),
        ball("c", np.array((places[2], 0, 0)), np.array((speeds[2], 0, 0)), masses[2], ELASTIC),
    )
    run = simulate(
        Scene(bodies=bodies, constraints=(Lock(name="lock", between=("p", "q"), compliance=0.0),)),
        time_step=h,
        steps=4,
        method=Method(impacts="successive", solver=solver, iterations=500),  # type: ignore[arg-type]
        observe=finals(v=Velocity()),
    )
    line = places - np.array((0.0, 0.0, SIZE))  # the pair is one ball
    after = meetings(line, speeds, masses, SIZE, 4 * h)
    np.testing.assert_allclose(run["v"][[0, 1, 3], 0], after, atol=1e-6)

"""Successive blows within a step: in the order of their times whatever moves the bodies, and nothing gained on the way."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    Box,
    Energy,
    Final,
    Lock,
    Material,
    Maximum,
    Method,
    Momentum,
    Penetration,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    simulate,
)
from tests.engine.contacts.test_impacts import meetings

ELASTIC = Material(restitution=1.0)
GRAVITY = 9.81  # m/s²
STEPS = (1 / 60, 1 / 240, 1e-3)  # s
SIZE = 0.4  # m, of each ball
SUCCESSIVE = ["direct", "iterative"]


def ball(name: str, place: np.ndarray, velocity: np.ndarray, mass: float, material: Material) -> RigidBody:
    return RigidBody(
        name=name,
        mass=mass,
        shape=Sphere(0.5 * SIZE),
        position=tuple(place),
        velocity=tuple(velocity),
        material=material,
    )


@pytest.mark.parametrize("solver", SUCCESSIVE)
@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("seed", range(12))
def test_balls_thrown_at_a_wall_keep_their_energy_whether_they_rise_or_fall(
    seed: int, way: float, solver: str
) -> None:
    """Rows of up to four balls at a ceiling, or a floor: on the parabolas they go along, with v + g h/2, blows take nothing. What
    rises was expected at the wall sooner than it came: no blow was found, and after a hundred tries all were answered at once."""
    rng, h = np.random.default_rng(seed), STEPS[seed % 3]
    count = 1 + seed % 4
    masses, speed = 10.0 ** rng.uniform(-0.5, 0.5, count), rng.uniform(1.0, 3.0)
    gaps = np.concatenate(
        ((0.5 + rng.uniform(0.2, 2.5) * h * speed,), 10.0 ** rng.uniform(-9.0, -4.0, count - 1))
    )
    places = np.cumsum(gaps + 0.5 * SIZE) + 0.5 * SIZE * np.arange(count)
    up = np.array((0.0, 0.0, way))
    bodies = [
        RigidBody(
            name="wall", motion="static", shape=Box((4.0, 4.0, 1.0)), position=(0, 0, 0), material=ELASTIC
        )
    ]
    bodies += [
        ball(f"b{k}", -x * up, speed * up, float(m), ELASTIC)
        for k, (x, m) in enumerate(zip(places, masses, strict=True))
    ]
    run = simulate(
        Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -GRAVITY)),
        time_step=h,
        steps=6,
        method=Method(impacts="successive", solver=solver),  # type: ignore[arg-type]
        observe={
            "energy": Trace(quantity=Energy()),
            "momentum": Trace(quantity=Momentum()),
            "deep": Maximum(quantity=Penetration()),
        },
    )

    change = np.diff(run["energy"] - 0.5 * h * GRAVITY * run["momentum"][:, 2])
    assert np.abs(change).max() < 1e-10 * masses.sum()
    assert float(run["deep"]) < 1e-9
    assert run.counters["impacts"] < 100


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("psi", [0.3, 1.0])
def test_a_single_impact_is_the_same_in_either_order(psi: float, way: float, h: float) -> None:
    material = Material(restitution=psi)
    ends = []
    for impacts in ("simultaneous", "successive"):
        wall = RigidBody(
            name="wall", motion="static", shape=Box((4.0, 4.0, 1.0)), position=(0, 0, 0), material=material
        )
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
    pusher = RigidBody(
        name="pusher",
        motion="kinematic",
        shape=Sphere(0.5 * SIZE),
        position=(places[0], 0.0, 0.0),
        velocity=(speed, 0.0, 0.0),
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
        observe={"v": Final(quantity=Velocity())},
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
        observe={"v": Final(quantity=Velocity())},
    )
    line = places - np.array((0.0, 0.0, SIZE))  # the pair is one ball
    after = meetings(line, speeds, masses, SIZE, 4 * h)
    np.testing.assert_allclose(run["v"][[0, 1, 3], 0], after, atol=1e-6)


@pytest.mark.parametrize("solver", SUCCESSIVE)
@pytest.mark.parametrize("seed", range(6))
def test_spinning_boxes_in_a_row_keep_their_momenta(seed: int, solver: str) -> None:
    """They are not led to the time of a blow: they would have to be turned to it as well."""
    rng, h = np.random.default_rng(seed), STEPS[seed % 3]
    bodies = [
        RigidBody(
            name=f"b{k}",
            mass=float(rng.uniform(0.5, 2.0)),
            shape=Box((0.4, 0.3, 0.3)),
            position=(k * (0.4 + 5e-3), *rng.uniform(-0.05, 0.05, 2)),
            velocity=(2.0 if k == 0 else 0.0, 0.0, 0.0),
            angular_velocity=tuple(rng.uniform(-0.4, 0.4, 3)),
            material=ELASTIC,
        )
        for k in range(4)
    ]
    run = simulate(
        Scene(bodies=tuple(bodies)),
        time_step=h,
        duration=0.1,
        method=Method(impacts="successive", solver=solver),  # type: ignore[arg-type]
        observe={"p": Trace(quantity=Momentum()), "l": Trace(quantity=AngularMomentum())},
    )
    assert run.counters["impacts"] >= 3
    assert np.abs(run["p"] - run["p"][0]).max() < 1e-12
    assert np.abs(run["l"] - run["l"][0]).max() < 1e-12

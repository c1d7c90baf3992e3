"""Rods between particles that say the same share the load evenly; rods that contradict each other are named."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    ConstraintForce,
    Distance,
    KineticEnergy,
    Method,
    Particle,
    Position,
    Result,
    Scene,
    Trace,
    compile,
    simulate,
)
from spook_tracker.engine.forces import End

GRAVITY = 9.81  # m/s²
TIME_STEP = 1 / 240  # s
ORIGIN = (0.0, 0.0, 0.0)
OBSERVE = {"x": Trace(quantity=Position()), "f": Trace(quantity=ConstraintForce())}
METHODS = {
    "plain": Method(),
    "half steps": Method(half_step_velocities=True, corrections=1),
    "curved": Method(corrections=2),
    "substeps": Method(substeps=3),
    "fourth order": Method(composition="order4"),
    "strings": Method(string_stiffness=True),
}


def pendulum(*rest_lengths: float | None, compliance: float = 0.0) -> Scene:
    """A bob that starts level with the world point from which it hangs by one rod for each rest length."""
    rods = tuple(
        Distance(name=f"rod {i}", between=(ORIGIN, "bob"), rest_length=length, compliance=compliance)
        for i, length in enumerate(rest_lengths)
    )
    bob = Particle(name="bob", mass=2.0, position=(1.0, 0.0, 0.0))
    return Scene(bodies=(bob,), constraints=rods, gravity=(0.0, 0.0, -GRAVITY))


def upright(*ends: tuple[End, End], compliance: float = 0.0) -> Scene:
    """Four particles of 1 kg, one under the other, hanging by the rods given."""
    bodies = tuple(Particle(name=f"b{i}", mass=1.0, position=(0.0, 0.0, -1.0 - i)) for i in range(4))
    rods = tuple(
        Distance(name=f"rod {i}", between=pair, compliance=compliance) for i, pair in enumerate(ends)
    )
    return Scene(bodies=bodies, constraints=rods, gravity=(0.0, 0.0, -GRAVITY))


CHAIN: tuple[tuple[End, End], ...] = ((ORIGIN, "b0"), ("b0", "b1"), ("b1", "b2"), ("b2", "b3"))
TWICE: tuple[End, End] = ("b0", "b1")
FLOOR: tuple[End, End] = ("b3", (0.0, 0.0, -5.0))


def run(scene: Scene, method: Method = METHODS["plain"], steps: int = 500) -> Result:
    return simulate(scene, time_step=TIME_STEP, steps=steps, method=method, observe=OBSERVE)


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_equal_rods_swing_as_one_and_carry_equal_shares(method: Method, count: int) -> None:
    one, many = run(pendulum(None), method), run(pendulum(*[None] * count), method)

    np.testing.assert_allclose(many["x"], one["x"], rtol=0.0, atol=1e-9)
    shares = np.repeat(one["f"], count, axis=1) / count
    np.testing.assert_allclose(many["f"], shares, rtol=1e-6, atol=1e-6 * np.abs(one["f"]).max())


@pytest.mark.parametrize(
    "ends",
    [(*CHAIN, TWICE), (*CHAIN, FLOOR), (*CHAIN, TWICE, FLOOR), (*CHAIN, TWICE, TWICE, FLOOR, FLOOR)],
    ids=["a link twice", "held at both ends", "both", "all of it twice and more"],
)
def test_what_hangs_still_is_carried_by_the_forces_of_least_norm(ends: tuple[tuple[End, End], ...]) -> None:
    """Forces on the particles are balanced; of all sets of tensions that do so, the smallest: a pseudo-inverse."""
    balance = np.zeros((4, len(ends)))  # upward force of a unit tension in each rod
    for rod, (first, second) in enumerate(ends):
        if isinstance(first, str):
            balance[int(first[1:]), rod] -= 1.0
        if isinstance(second, str):
            balance[int(second[1:]), rod] += 1.0
    smallest = np.linalg.pinv(balance) @ np.full(4, GRAVITY)
    result = run(upright(*ends))

    np.testing.assert_allclose(result["f"][1:], np.tile(smallest, (500, 1)), rtol=0.0, atol=1e-6)
    assert np.abs(result["x"] - result["x"][0]).max() < 1e-12


@pytest.mark.parametrize("lengths", [(1.0, 1.2), (1.0, 1.0, 1.2), (1.0, 1.001)], ids=str)
def test_rods_of_different_length_between_the_same_ends_contradict_each_other(
    lengths: tuple[float, ...],
) -> None:
    result = run(pendulum(*lengths))

    assert (result.status, result.failed_body, result.failed_step) == ("diverged", "bob", 1)
    assert "rows that contradict each other" in result.failure and "'bob'" in result.failure
    again = run(pendulum(*lengths, compliance=1e-6))
    assert again.completed  # as the sentence advises


def test_a_contradiction_inside_a_chain_names_a_body_at_it() -> None:
    scene = upright(*CHAIN)
    wrong = Distance(name="wrong", between=TWICE, rest_length=1.5, compliance=0.0)
    result = run(Scene(bodies=scene.bodies, constraints=(*scene.constraints, wrong), gravity=scene.gravity))

    assert result.failed_body in TWICE
    assert "contradict each other" in result.failure


@pytest.mark.parametrize("spin", [1.0, 20.0])
def test_a_spinning_braced_body_is_no_contradiction(spin: float) -> None:
    """All pairs of six particles: three rods too many, which disagree only by the curvature of a step."""
    places = np.random.default_rng(0).normal(size=(6, 3))
    places -= places.mean(axis=0)
    bodies = tuple(
        Particle(
            name=f"b{i}",
            mass=1.0 + 0.3 * i,
            position=tuple(map(float, place)),
            velocity=tuple(map(float, np.cross((0.3 * spin, 0.2 * spin, spin), place))),
        )
        for i, place in enumerate(places)
    )
    energies = []
    for compliance in (0.0, 1e-8):
        rods = tuple(
            Distance(name=f"rod {i} {j}", between=(f"b{i}", f"b{j}"), compliance=compliance)
            for i in range(6)
            for j in range(i + 1, 6)
        )
        observe = {"e": Trace(quantity=KineticEnergy())}
        result = simulate(
            Scene(bodies=bodies, constraints=rods), time_step=TIME_STEP, steps=480, observe=observe
        )
        energies.append(result["e"])

    np.testing.assert_allclose(*energies, rtol=1e-3)


def test_only_rigid_paths_held_at_both_ends_leave_the_fast_solver() -> None:
    def solver(scene: Scene) -> str:
        return next(stage for stage in compile(scene, time_step=TIME_STEP).stages if "solve" in stage)

    assert solver(upright(*CHAIN)) == solver(upright(*CHAIN, FLOOR, compliance=1e-8)) == "solve_path"
    assert solver(upright(*CHAIN, FLOOR)) == "solve_block"
    reasons = {c.stage: c.reason for c in compile(upright(*CHAIN, FLOOR), time_step=TIME_STEP).explain()}
    assert "held at both ends" in reasons["solve_path"] and "held at both ends" in reasons["solve_block"]

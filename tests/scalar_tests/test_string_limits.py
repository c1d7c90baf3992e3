"""What the limits of taut ropes and cables come from: eigenvalues of their links, without the engine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.ropes import falling_chain, hanging_cable, rope, taut_rope
from tests.scalar_tests.limits import measurement


def band(test: str, study: str) -> tuple[float, float]:
    found = next(one.expected for one in CATALOGUE[test].stability if one.name == study)
    assert found is not None
    return found


def across(tensions: Any, mass: float, length: float) -> tuple[Any, Any]:
    """Stiffness and mass of the joints of links under tension, moving across them: rods, so that a link's mass is
    shared out as (1/3, 1/6; 1/6, 1/3)."""
    count = len(tensions)
    stiff, inert = np.zeros((count + 1, count + 1)), np.zeros((count + 1, count + 1))
    for k, tension in enumerate(tensions):
        stiff[k : k + 2, k : k + 2] += tension / length * np.array(((1.0, -1.0), (-1.0, 1.0)))
        inert[k : k + 2, k : k + 2] += mass / 6.0 * np.array(((2.0, 1.0), (1.0, 2.0)))
    return stiff, inert


def test_modes_of_a_taut_rope_are_the_eigenvalues_of_its_links() -> None:
    c = taut_rope
    stiff, inert = across([c.PULL] * c.PIECES, c.MASS / c.PIECES, c.LENGTH / c.PIECES)
    found = np.sqrt(eigh(stiff[1:-1, 1:-1], inert[1:-1, 1:-1], eigvals_only=True))
    for mode in (*c.MODES, c.PIECES - 1):
        assert c.rate(mode) == pytest.approx(found[mode - 1], rel=1e-9)
    limits = {m.name: m.limit for m in measurement("taut_rope", "plain").metrics}
    # One step v₊ = v − h ω² x, x₊ = x + h v₊ turns by φ.
    h, w = c.TIME_STEP, found[0]
    turn = np.angle(np.linalg.eigvals(np.array(((1.0 - (h * w) ** 2, h), (-h * w * w, 1.0))))).max()
    faster = turn / h * c.LENGTH / math.pi / math.sqrt(c.PULL * c.LENGTH / c.MASS) - 1.0
    assert faster < limits["speed_error"] < 1.02 * faster
    # The end comes in and out twice a swing, and is pulled at by what moves: the rope and the slide.
    bent = c.SWAY * np.sin(c.MODES[-1] * math.pi * np.arange(c.PIECES + 1) / c.PIECES)
    link = c.LENGTH / c.PIECES
    short = float(np.sum(link - np.sqrt(link**2 - np.diff(bent) ** 2)))
    pulls = c.MASS * (1.0 + 1.0 / c.PIECES) * 2.0 * c.rate(c.MODES[-1]) ** 2 * short / c.PULL
    assert limits["mode_error"] == pytest.approx(pulls, rel=0.05)


def test_links_pull_less_than_a_smooth_cable_by_the_midpoint_rule() -> None:
    c = hanging_cable
    for count, _ in c.ASKED:
        (limit,) = (
            m.limit
            for one in CATALOGUE["hanging_cable"].measurements
            if one.parameters.get("N") == count
            for m in one.metrics
            if m.name == "catenary_error"
        )
        less = 1.0 - c.horizontal(count) / c.catenary()
        assert isinstance(limit, float) and less < limit < 1.03 * less


def fastest(count: int) -> float:
    """The highest frequency [rad/s] of a hanging cable of links, in its plane and across it."""
    c = hanging_cable
    pull, link, mass = c.horizontal(count), c.LENGTH / count, c.MASS / count
    angle = np.array(c.angles(count, pull))
    tension = pull / np.cos(angle)
    # In the plane by the links' angles: the middle of link i moves by its own half and all before it.
    reach = link * (np.tril(np.ones((count, count)), -1) + 0.5 * np.eye(count))
    moved = np.vstack((-reach * np.sin(angle), reach * np.cos(angle)))
    inert = mass * moved.T @ moved + mass * link**2 / 12.0 * np.eye(count)
    ends = link * np.vstack((-np.sin(angle), np.cos(angle)))  # both ends stay
    free = np.linalg.svd(ends)[2][2:].T
    within = eigh(free.T @ np.diag(tension * link) @ free, free.T @ inert @ free, eigvals_only=True)
    stiff, masses = across(tension, mass, link)
    beside = eigh(stiff[1:-1, 1:-1], masses[1:-1, 1:-1], eigvals_only=True)
    return math.sqrt(max(within[-1], beside[-1]))


def test_as_many_links_hang_still_as_swing_by_less_than_half_a_turn_a_step() -> None:
    c = hanging_cable
    low, high = band("hanging_cable", "finest")
    assert c.TIME_STEP * fastest(int(low)) < 2.0 < c.TIME_STEP * fastest(int(high) + 1)
    assert all(step * fastest(count) < 2.0 for count, step in c.ASKED)
    t = taut_rope
    stiff, inert = across([t.tightest()] * 10, t.MASS / 10, t.LENGTH / 10)
    shortest = eigh(stiff[1:-1, 1:-1], inert[1:-1, 1:-1], eigvals_only=True)[-1]
    assert t.TIME_STEP * math.sqrt(shortest) == pytest.approx(2.0, rel=1e-9)
    low, high = band("taut_rope", "tightest")
    assert low < t.tightest() < high


def test_a_rope_spins_as_fast_as_its_shortest_waves_swing_by_half_a_turn_a_step() -> None:
    length, mass = rope.LENGTH / rope.FEW, rope.MASS / rope.FEW
    ends = length * np.arange(rope.FEW + 1) - 0.5 * rope.LENGTH
    pulls = (
        0.5 * rope.MASS / rope.LENGTH * (0.25 * rope.LENGTH**2 - ends**2)
    )  # at 1 rad/s: what is outside of a joint
    flat = mass * length / 12.0  # a rod that spins lies down by itself: m l²/12 w² of moment a radian
    squares = eigh(*across(0.5 * (pulls[1:] + pulls[:-1]) + flat, mass, length), eigvals_only=True)
    # The rope turns about its middle, which tilts it as a whole at its own rate: the slowest swings are 0 and w.
    np.testing.assert_allclose(squares[:2], (0.0, 1.0), atol=1e-9)

    assert rope.TIME_STEP * rope.FASTEST * math.sqrt(squares[-1]) == pytest.approx(2.0, rel=1e-4)
    assert math.sqrt(8.0 / 3.0) / rope.FEW / rope.TIME_STEP == pytest.approx(rope.FASTEST, rel=0.03)
    low, high = band("rope", "fastest")
    assert low < rope.FASTEST < high


def test_an_end_that_turns_comes_in_by_what_its_path_bends_in_a_step() -> None:
    """A part turns about its middle by h v/length, v of a fall from the greatest height: how far its end leaves a line."""
    c = falling_chain
    height = c.DROP + c.LINKS * c.LENGTH
    for configuration, tall, long in (("plain", height, c.LENGTH), ("ragdoll", -c.FLOOR, 0.4)):
        limits = {m.name: m.limit for m in measurement("falling_chain", configuration).metrics}
        turn = math.sqrt(2.0 * c.GRAVITY * tall) * c.TIME_STEP / long
        assert limits["sunk"] == pytest.approx(0.5 * long * (1.0 - math.cos(turn)), rel=0.05)

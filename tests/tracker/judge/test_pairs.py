"""A change beside its base: an unchanged one is blocked once in a thousand at most, a slower one is found."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable, Iterator

import pytest

from spook_tracker.tracker.judge.pairs import BLOCKS, ERROR, LOOKS, Paired, at_least
from tests.histories.process_noise import NOISE, Process, decided

CHANGES = 2000


@pytest.mark.parametrize("name", NOISE)
def test_an_unchanged_change_is_blocked_once_in_a_thousand_at_most(name: str) -> None:
    """Of two thousand more than six, where two are allowed, comes once in two hundred."""
    blocked = [decided(NOISE[name], 0.0, random.Random(f"{name} {n}"))[0] == "slower" for n in range(CHANGES)]

    assert sum(blocked) <= 6


@pytest.mark.parametrize("name", NOISE)
def test_without_a_smallest_effect_chance_alone_still_keeps_the_bound(name: str) -> None:
    blocked = [
        decided(NOISE[name], 0.0, random.Random(f"{name} {n}"), smallest=0.0)[0] == "slower"
        for n in range(CHANGES)
    ]

    assert sum(blocked) <= 6


def test_five_per_cent_at_one_per_cent_of_noise_are_found() -> None:
    found = [decided(NOISE["normal, 1 %"], 0.05, random.Random(n))[0] == "slower" for n in range(500)]

    assert sum(found) >= 0.95 * len(found)


def test_a_clean_change_costs_little_more_than_one_process_of_either_side() -> None:
    taken = [decided(NOISE["normal, 1 %"], 0.0, random.Random(n))[1] for n in range(500)]

    assert sum(taken) / len(taken) < 3.0


def test_the_probability_is_that_of_every_order_counted() -> None:
    """All orders of two blocks, of two and of three processes a side, one by one."""
    counts: dict[int, int] = {}
    for first in itertools.combinations(range(4), 2):
        for second in itertools.combinations(range(6), 3):
            u = sum(
                a > b
                for size, ours in ((4, first), (6, second))
                for a in ours
                for b in {*range(size)} - {*ours}
            )
            counts[u] = counts.get(u, 0) + 1
    orders = sum(counts.values())

    for u in range(14):
        assert at_least((2, 3), u) == pytest.approx(sum(n for v, n in counts.items() if v >= u) / orders)


def test_the_order_that_is_drawn_bounds_the_error_whatever_the_noise() -> None:
    """Second looks included: over all orders of one set of numbers, however odd, the share called slower."""
    odd = random.Random(1)
    numbers = [odd.choice((1.0, 1.1)) * odd.paretovariate(1.0) for _ in range(2 * sum(BLOCKS))]
    called = 0
    for n in range(4000):
        draw, at = random.Random(n), iter(numbers)
        called += _decide(at, draw) == "slower"

    assert called <= 10, "4 are allowed"


def _decide(at: Iterator[float], draw: random.Random) -> str:
    paired = Paired(smallest=0.0, first=(1.0, 2.0))
    for size in BLOCKS:
        order = [0] * size + [1] * size
        draw.shuffle(order)
        block: tuple[list[float], list[float]] = ([], [])
        for side in order:
            block[side].append(next(at))
        paired.blocks.append(block)
        if (decision := paired.decision(1)) != "open":
            return decision
    return "not proven"


def test_more_run_times_under_test_ask_for_more_of_each() -> None:
    ahead = Paired(first=(1.0, 1.1), blocks=[([1.0] * BLOCKS[0], [1.1] * BLOCKS[0])])

    assert ahead.probability == pytest.approx(1 / 252)
    assert ahead.decision(1) == "open"
    ahead.blocks.append(([1.0] * BLOCKS[1], [1.1] * BLOCKS[1]))
    assert ahead.decision(1) == "slower"
    assert ahead.decision(math.ceil(ERROR / LOOKS / ahead.probability)) == "open"


def test_a_process_without_a_number_is_the_slowest_there_is() -> None:
    lost = Paired(first=(1.0, float("inf")), blocks=[([1.0] * n, [float("inf")] * n) for n in BLOCKS])
    both = Paired(
        first=(1.0, float("inf")), blocks=[([float("inf")] * n, [float("inf")] * n) for n in BLOCKS]
    )

    assert lost.worth_a_look
    assert lost.decision(1) == "slower"
    assert both.decision(1) == "not slower"


def test_a_level_of_the_process_is_no_change() -> None:
    """22.5 or 25.5 ms, by process: the first two looked like +13 %."""
    level: Callable[[random.Random], Process] = NOISE["two levels, 22.5 and 25.5 ms"]
    looked = [n for n in range(400) if decided(level, 0.0, random.Random(n))[1] > 1]

    assert len(looked) > 50, "otherwise this says nothing"
    assert all(decided(level, 0.0, random.Random(n))[0] != "slower" for n in looked)

"""Run times as fresh processes give them, one after the other: models of noise for changes beside their base."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping

from spook_tracker.tracker.judge.pairs import BLOCKS, SMALLEST, Decision, Paired

Process = Callable[[], float]  # the run time of the next process, 1 if nothing disturbed it


def normal(draw: random.Random, spread: float) -> Process:
    return lambda: math.exp(draw.gauss(0.0, spread))


def two_levels(draw: random.Random) -> Process:
    return lambda: draw.choice((1.0, 25.5 / 22.5)) * math.exp(draw.gauss(0.0, 0.01))


def heavy(draw: random.Random) -> Process:
    """Student's t of two degrees of freedom: no variance."""
    return lambda: math.exp(0.01 * draw.gauss(0.0, 1.0) / math.sqrt(draw.expovariate(1.0)))


def busy(draw: random.Random) -> Process:
    """A third of the processes beside another's work, which costs a tenth, by exponential chance."""
    return lambda: math.exp(
        abs(draw.gauss(0.0, 0.01)) + (draw.expovariate(10.0) if draw.random() < 1.0 / 3.0 else 0.0)
    )


def wandering(draw: random.Random) -> Process:
    """A machine that becomes slower and faster: each process remembers the one before."""
    state = [0.0]

    def process() -> float:
        state[0] = 0.95 * state[0] + draw.gauss(0.0, 0.02)
        return math.exp(state[0])

    return process


NOISE: Mapping[str, Callable[[random.Random], Process]] = {
    "normal, 1 %": lambda draw: normal(draw, 0.01),
    "normal, 3 %": lambda draw: normal(draw, 0.03),
    "two levels, 22.5 and 25.5 ms": two_levels,
    "t, two degrees of freedom, 1 %": heavy,
    "busy machine": busy,
    "wandering machine": wandering,
}


def decided(
    noise: Callable[[random.Random], Process], change: float, draw: random.Random, smallest: float = SMALLEST
) -> tuple[Decision, int]:
    """What one change that is so much slower comes to, and how many processes of either side it took."""
    process = noise(draw)

    def block(size: int) -> tuple[list[float], list[float]]:
        order = [0] * size + [1] * size
        draw.shuffle(order)
        found: tuple[list[float], list[float]] = ([], [])
        for side in order:
            found[side].append(process() * (1.0 + change if side else 1.0))
        return found

    (base,), (changed,) = block(1)
    paired = Paired(smallest=smallest, first=(base, changed))
    if not paired.worth_a_look:
        return "not slower", 1
    for number, size in enumerate(BLOCKS, start=1):
        paired.blocks.append(block(size))
        if (decision := paired.decision(1)) != "open":
            return decision, 1 + sum(BLOCKS[:number])
    raise AssertionError("the last look decides")

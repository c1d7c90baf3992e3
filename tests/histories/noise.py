"""Run times that are only noise, and run times in which something happened, to be put to any detector.

Each kind is a name, and a function from a generator of random numbers and a number of nights to run times round
one. What a calibration kernel would have seen of the machine comes with it where the machine is what moves.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
Draws = np.random.Generator
Kind = Callable[[Draws, int], Values]
KERNEL_NOISE = 0.003  # of the calibration kernel itself


def gauss(share: float) -> Kind:
    return lambda draws, nights: 1.0 + share * draws.standard_normal(nights)


def clusters(share: float, factor: float, noise: float = 0.01) -> Kind:
    """Drawn anew each night: so many of them are so much slower."""
    return lambda draws, nights: (
        gauss(noise)(draws, nights) * np.where(draws.random(nights) < share, factor, 1.0)
    )


def visits(length: int, factor: float, noise: float = 0.01) -> Kind:
    """Two levels by turns, each for so many nights."""
    return lambda draws, nights: (
        gauss(noise)(draws, nights) * np.where(np.arange(nights) // length % 2, factor, 1.0)
    )


def autoregressive(memory: float, share: float) -> Kind:
    """Each night remembers the one before; `share` is the standard deviation of the nights."""

    def values(draws: Draws, nights: int) -> Values:
        steps = draws.standard_normal(nights) * np.sqrt(1.0 - memory**2)
        found = np.empty(nights)
        state = draws.standard_normal()
        for night in range(nights):
            state = memory * state + steps[night]
            found[night] = state
        return 1.0 + share * found

    return values


def heavy(draws: Draws, nights: int) -> Values:
    return 1.0 + 0.01 * draws.standard_t(3, nights)


def lognormal(draws: Draws, nights: int) -> Values:
    return np.exp(0.05 * draws.standard_normal(nights) ** 2)  # interference only ever makes a run slower


STATIONARY: dict[str, Kind] = {
    "Gauss 1 %": gauss(0.01),
    "Gauss 5 %": gauss(0.05),
    "t, three degrees of freedom, 1 %": heavy,
    "lognormal 5 %": lambda draws, nights: np.exp(0.05 * draws.standard_normal(nights)),
    "only ever slower": lognormal,
    "AR(1) .5, 2 %": autoregressive(0.5, 0.02),
    "AR(1) .9, 5 %": autoregressive(0.9, 0.05),
    "one night in five × 1.5": clusters(0.2, 1.5),
    "clusters 8 % apart, 50/50": clusters(0.5, 1.08),
    "clusters 8 % apart, 80/20": clusters(0.2, 1.08),
    "clusters 8 % apart, 90/10": clusters(0.1, 1.08),
}
MACHINES: dict[str, Kind] = {  # what the machine does, times what the run does
    "seasons of ±5 %": lambda draws, nights: (
        1.0 + 0.05 * np.sin(2.0 * np.pi * (np.arange(nights) / 365.0 + draws.random()))
    ),
    "a walk of .3 % a night": lambda draws, nights: np.exp(0.003 * np.cumsum(draws.standard_normal(nights))),
}
STEPS: dict[str, tuple[Kind, float, int]] = {  # noise, step, nights until it must be found
    "+10 % at 1 % noise": (gauss(0.01), 1.10, 2),
    "+3 % at 1 % noise": (gauss(0.01), 1.03, 4),
    "+3 % at .2 % noise": (gauss(0.002), 1.03, 2),
    "+10 % on clusters 8 % apart": (clusters(0.5, 1.08), 1.10, 6),
}


def generator(name: str, series: int) -> Draws:
    """The draws of one series of one kind, the same for every detector."""
    digest = hashlib.sha256(f"{name}/{series}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "big"))


def noise(name: str, series: int, nights: int) -> Values:
    """Seconds, round a millisecond."""
    return 1e-3 * STATIONARY[name](generator(name, series), nights)


def machine(name: str, series: int, nights: int) -> tuple[Values, Values]:
    """Seconds of a run of 1 % noise, and of the calibration kernel, on a machine that moves."""
    draws = generator(name, series)
    moved = MACHINES[name](draws, nights)
    return 1e-3 * moved * gauss(0.01)(draws, nights), 1e-2 * moved * gauss(KERNEL_NOISE)(draws, nights)


def step(name: str, series: int, before: int, after: int) -> Values:
    """Seconds, with the step after `before` nights."""
    kind, factor, _ = STEPS[name]
    values = kind(generator(name, series), before + after)
    values[before:] *= factor
    return 1e-3 * values


def starts(red: Any, learning: int = 60) -> int:
    """How many stretches of red nights begin after the nights of learning."""
    marks = np.asarray(list(red), dtype=bool)
    return int(np.sum(marks[learning:] & ~marks[learning - 1 : -1]))

"""Do the books balance: energy with nothing that takes or gives any, and how far constraints are violated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import case
from .facts import BEYOND, PUSH, Asked, simulated, spread

LASTS = 1.0  # s
SAMPLES = 20


def _one(name: str, description: str, unit: str) -> case.Metric:
    return case.Metric(
        name=name, description=description, unit=unit, role="reported", better="smaller_magnitude"
    )


METRICS = (
    _one(
        "energy_drift",
        "energy won or lost in 1 s, over the most kinetic energy, with nothing that takes or gives any",
        "1",
    ),
    _one("violation", "largest violation of equality constraints and of joint limits, m or rad", "1"),
)


def measure(asked: Asked, simulate: case.Simulate) -> Mapping[str, float]:
    """A swing without damping, friction, contacts, limits, drag and actuation; and a run as the file has it."""
    end = min(LASTS, asked.duration)
    times = tuple(end * k / SAMPLES for k in range(SAMPLES + 1))

    def drift(refined: int = 1, **more: Any) -> float:
        found = simulated(simulate, asked, end, refined, samples=times, conservative=True, **more)
        potential, kinetic = np.asarray(found["energy"]).T
        most = float(kinetic.max())
        return float(potential[-1] + kinetic[-1] - potential[0] - kinetic[0]) / most if most else 0.0

    own, halved = drift(), drift(2)
    pushed = [drift(push=PUSH, seed=seed) for seed in (1, 2)]
    run = simulated(simulate, asked, end, samples=times)
    other = simulated(simulate, asked, end, samples=times, push=PUSH, seed=1)
    fine = simulated(simulate, asked, end, 2, samples=times)
    violation, moved, finer = (float(np.max(found["violation"])) for found in (run, other, fine))
    return {
        "energy_drift": case.Estimate(
            own, rounding=BEYOND * max(spread(own, pushed), PUSH), step_error=abs(halved - own), scale=1.0
        ),
        "violation": case.Estimate(
            violation,
            rounding=BEYOND * max(abs(moved - violation), PUSH),
            step_error=abs(finer - violation),
            scale=1.0,
        ),
    }

"""Robots gain no energy by joints that are led back, nor by overlaps they begin with."""

from __future__ import annotations

import numpy as np
import pytest

from bench import robots
from spook_tracker.engine import Energy, Trace, simulate


@pytest.mark.parametrize("number", [51, 255, 456, 465, 558, 663, 684, 1104, 1176])
def test_a_heap_on_joints_of_masses_a_hundred_times_apart_loses_energy(number: int) -> None:
    """In an impact a light link is turned by a radian in a step, or (456) jammed between heavy ones, as flat as a toggle joint; from
    558 on links begin inside each other where stops and hinges do not let them part."""
    scene, rate = robots.robot(number)

    observe = {"energy": Trace(quantity=Energy())}
    run = simulate(scene, time_step=1.0 / rate, duration=robots.DURATION, observe=observe)

    assert run.completed
    assert np.diff(run["energy"]).max() < 1e-9 * run["energy"].max()

"""Robots gain no energy by joints that are led back, nor by overlaps they begin with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench import robots
from spook_tracker.engine import Energy, Trace, simulate


@pytest.mark.parametrize("number", [51, 255, 456, 465, 558, 663, 1104, 1176])
def test_a_heap_on_joints_of_masses_a_hundred_times_apart_loses_energy(number: int) -> None:
    """In an impact a light link is turned by a radian in a step, or (456) jammed between heavy ones, as flat as a toggle joint; from
    558 on links begin inside each other where stops and hinges do not let them part."""
    scene, rate = robots.robot(number)

    observe = {"energy": Trace(quantity=Energy())}
    run = simulate(scene, time_step=1.0 / rate, duration=robots.DURATION, observe=observe)

    assert run.completed
    assert np.diff(run["energy"]).max() < 1e-9 * run["energy"].max()


@pytest.mark.parametrize("start", [1, 3, 10])
def test_a_jam_that_lets_go_gives_no_energy(start: int) -> None:
    """What was left open in it was led back once that took no more than a hundred times what it takes alone: 0.8 % of a heap's."""
    scene, rate = robots.robot(663)
    rng = np.random.default_rng(start)
    bodies = tuple(
        replace(body, velocity=tuple(1e-3 * rng.normal(size=3))) if body.motion == "dynamic" else body
        for body in scene.bodies
    )
    run = simulate(
        replace(scene, bodies=bodies),
        time_step=1.0 / rate,
        duration=robots.DURATION,
        observe={"energy": Trace(quantity=Energy())},
    )
    assert run.completed
    assert np.diff(run["energy"]).max() < 1e-6 * run["energy"].max()

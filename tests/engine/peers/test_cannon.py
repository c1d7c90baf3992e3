"""cannon-es behind the protocol: SPOOK by another hand gives our answers. Skipped, with the reason, without it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    ConstraintForce,
    Distance,
    MaximumAbsolute,
    Particle,
    Position,
    Scene,
    Trace,
    Violation,
    simulate,
)
from spook_tracker.engine.find import EngineMissing, find

try:
    CANNON = find("cannon")
except EngineMissing as reason:
    pytest.skip(str(reason), allow_module_level=True)

STEP = 1.0 / 60.0  # s
GRAVITY = (0.0, 0.0, -9.81)


def chain(links: int) -> Scene:
    """Links of 1 m along x, let go; damped as cannon's relaxation over two steps does."""
    weights = [Particle(name=f"{k}", mass=1.0, position=(k + 1.0, 0.0, 0.0)) for k in range(links)]
    rods = [
        Distance(
            name=f"rod {k}",
            between=((0.0, 0.0, 0.0) if k == 0 else f"{k - 1}", f"{k}"),
            compliance=0.0,
            damping=2.0 * STEP,
        )
        for k in range(links)
    ]
    return Scene(bodies=tuple(weights), constraints=tuple(rods), gravity=GRAVITY)


def both(scene: Scene, seconds: float) -> tuple[Any, Any]:
    observe = {"path": Trace(quantity=Position()), "stretch": MaximumAbsolute(quantity=Violation())}
    ours = simulate(scene, time_step=STEP, duration=seconds, observe=observe)
    return ours, CANNON.simulate(scene, time_step=STEP, duration=seconds, observe=observe)


def test_a_pendulum_is_the_same_in_two_implementations_of_the_method() -> None:
    """Nothing is shared but the equations: 22 s apart by rounding. The stretch is that of the method, not none."""
    ours, theirs = both(chain(1), 22.0)

    assert np.abs(ours["path"] - theirs["path"]).max() < 1e-11
    assert float(theirs["stretch"][0]) == pytest.approx(6.71786e-3, rel=1e-5)


def test_a_short_chain_is_the_same_as_long_as_iterations_solve_it() -> None:
    ours, theirs = both(chain(3), 1.0)

    assert np.abs(ours["path"] - theirs["path"]).max() < 1e-9


def test_the_tension_of_a_rod_is_that_of_the_method() -> None:
    observe = {"tension": Trace(quantity=ConstraintForce("rod 0"), first=1)}
    ours, theirs = (
        run(chain(1), time_step=STEP, duration=4.0, observe=observe)["tension"]
        for run in (simulate, CANNON.simulate)
    )

    assert ours.max() > 2.9 * 9.81, "three times the weight at the bottom, less what the method loses"
    assert np.abs(ours - theirs).max() < 1e-8

"""p2-es behind the protocol: SPOOK in a plane by another hand gives our answers. Skipped, with the reason, without it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import ConstraintForce, Distance, Particle, Position, Scene, Trace, simulate
from spook_tracker.engine.find import EngineMissing, find

try:
    P2 = find("p2")
except EngineMissing as reason:
    pytest.skip(str(reason), allow_module_level=True)

STEP = 1.0 / 60.0  # s


def defaults(scene: Scene, **options: Any) -> Any:
    return P2.simulate(scene, configuration="defaults", **options)


def slanted(links: int) -> Scene:
    """A chain let go in a plane that is no plane of the axes, damped as p2's relaxation over two steps does."""
    along, down = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, -9.81])
    weights = [
        Particle(name=f"{k}", mass=1.0, position=tuple(float(x) for x in (k + 1.0) * along + [0.5, 0.0, 0.0]))
        for k in range(links)
    ]
    rods = [
        Distance(
            name=f"rod {k}",
            between=((0.5, 0.0, 0.0) if k == 0 else f"{k - 1}", f"{k}"),
            compliance=0.0,
            damping=2.0 * STEP,
        )
        for k in range(links)
    ]
    return Scene(bodies=tuple(weights), constraints=tuple(rods), gravity=tuple(float(x) for x in down))


@pytest.mark.parametrize(("links", "seconds", "apart"), [(1, 22.0, 1e-10), (3, 1.0, 1e-8)])
def test_a_chain_is_the_same_in_two_implementations_of_the_method(
    links: int, seconds: float, apart: float
) -> None:
    path = {"path": Trace(quantity=Position()), "pull": Trace(quantity=ConstraintForce("rod 0"), first=1)}
    ours, theirs = (
        run(slanted(links), time_step=STEP, duration=seconds, observe=path) for run in (simulate, P2.simulate)
    )

    assert np.abs(ours["path"] - theirs["path"]).max() < apart
    assert np.abs(ours["pull"] - theirs["pull"]).max() < 1e3 * apart

"""Drake behind the protocol gives what Drake is known to give. Skipped, with the reason, where it is missing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import Distance, Particle, Position, Scene, Trace
from spook_tracker.engine.find import find
from tests.scenes import peer as peer_scenes

pytest.importorskip("pydrake", reason="the extra drake is not installed: pip install 'spook-tracker[drake]'")
STEP = 1.0 / 60.0  # s


def run(configuration: str) -> Any:
    def simulate(scene: Scene, **options: Any) -> Any:
        return find("drake").simulate(scene, configuration=configuration, **options)

    return simulate


def test_a_rod_is_a_hinge_in_joint_coordinates_and_yields_as_a_constraint() -> None:
    """Energies are those of semi-implicit Euler and of Runge-Kutta of order 3: an eighth at half the step."""
    hinge, fine = (peer_scenes.swung(run("rk3"), h) for h in (STEP, STEP / 2))
    discrete = peer_scenes.swung(run("sap"), STEP)

    assert max(hinge[0], discrete[0]) < 1e-12
    assert discrete[1] == pytest.approx(0.0233, abs=2e-4)
    assert hinge[1] == pytest.approx(4.5e-4, rel=0.05)
    assert fine[1] == pytest.approx(hinge[1] / 8.0, rel=0.05)

    weight, rod = peer_scenes.pendulum().bodies, peer_scenes.pendulum().constraints
    short = Scene(bodies=weight, constraints=rod, gravity=peer_scenes.GRAVITY)
    end = {"path": Trace(quantity=Position("weight"))}
    held = run("constraints")(short, time_step=STEP, duration=3.0, observe=end)
    stretch = np.abs(np.linalg.norm(held["path"], axis=1) - 1.0).max()
    assert 0.004 < stretch < 0.006


def test_speeds_at_the_start_are_those_of_the_scene() -> None:
    """A hinged body, one on a slide, one that is thrown and one on a rod are read back before any step."""
    rod = Particle(name="rod", mass=1.0, position=(0.0, 0.0, -1.0), velocity=(0.7, 0.2, 0.0))
    thrown = Particle(name="thrown", mass=1.0, position=(0.0, 1.0, 0.0), velocity=(0.0, 0.5, 2.0))
    line = Distance(name="line", between=((0.0, 0.0, 0.0), "rod"), compliance=0.0)
    found = peer_scenes.set_going(run("rk3"), bodies=(thrown, rod), joints=(line,))

    speeds = [(0.0, 2.0, 0.0), (3.0, 0.0, 0.0), thrown.velocity, rod.velocity]
    assert found[0] == pytest.approx(np.array(speeds), abs=1e-12)


def test_a_spinning_body_keeps_its_momentum_to_the_order_of_its_step() -> None:
    assert peer_scenes.momentum_lost(run("rk3"), 1 / 240) < 1e-6
    assert 1e-4 < peer_scenes.momentum_lost(run("sap"), 1 / 240) < 1e-2


def test_semi_implicit_euler_blows_up_on_a_chain_where_runge_kutta_does_not() -> None:
    blown, _, _ = peer_scenes.stretched_and_gained(run("sap"), 26, STEP, 12.0)
    _, stretch, energy = peer_scenes.stretched_and_gained(run("rk3"), 26, 1 / 240, 2.0)

    assert blown.status in ("not_finite", "diverged")
    assert stretch < 1e-9
    assert energy < 1e-4

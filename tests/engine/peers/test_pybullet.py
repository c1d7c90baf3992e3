"""PyBullet behind the protocol gives what Bullet is known to give. Skipped, with the reason, where it is missing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    ConstraintForce,
    Final,
    Material,
    Plane,
    Position,
    Scene,
    Sphere,
    Trace,
    Velocity,
)
from spook_tracker.engine.find import find
from spook_tracker.engine.peers.surfaces import shares
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests.friction import rolling_friction
from tests.scenes import peer as peer_scenes
from tests.scenes.corpus import fixed, solid

pytest.importorskip(
    "pybullet", reason="the extra pybullet is not installed: pip install 'spook-tracker[pybullet]'"
)
STEP = 1.0 / 60.0  # s


def run(configuration: str) -> Any:
    def simulate(scene: Scene, **options: Any) -> Any:
        return find("pybullet").simulate(scene, configuration=configuration, **options)

    return simulate


def test_how_far_a_contact_is_seen_is_not_left_to_the_next_world() -> None:
    """Bullet keeps it for the process; it is small only where bodies bounce."""
    alone = peer_scenes.sunk(run("joints"))
    peer_scenes.bounced(run("joints"), 0.8, 1 / 1000)
    assert peer_scenes.sunk(run("joints")) == alone


def test_the_tension_of_a_rod_that_swings_alone_is_told() -> None:
    """m (ω² l + g cos φ); what its sensors tell wrong is not asked (tests/engine/peers/test_conformance_lacks.py)."""
    tension, end = Final(quantity=ConstraintForce("rod")), Final(quantity=Position("weight"))
    swung = run("joints")(
        peer_scenes.pendulum(), time_step=1e-4, duration=0.4, observe={"f": tension, "x": end}
    )
    assert swung["f"] == pytest.approx(-3.0 * peer_scenes.G * swung["x"][2], rel=1e-3)


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
def test_semi_implicit_euler_blows_up_on_a_chain(time_step: float) -> None:
    """Every step is finite, every length exact: it is the energy that says so."""
    found, stretch, energy = peer_scenes.stretched_and_gained(run("joints"), 26, time_step, 22.0)

    assert found.status == "completed"
    assert stretch < 1e-9
    assert energy > 1e3


def test_rolling_and_spinning_are_braked_as_their_coefficients_say() -> None:
    """Steady torques: each step but the first takes the same speed, and what stands stays. Its contacts want 1/240 s."""
    h, last = 1 / 240, {"v": Trace(quantity=Velocity("ball")), "w": Trace(quantity=AngularVelocity("ball"))}
    rolled = run("joints")(rolling_friction.scene(), time_step=h, duration=3.0, observe=last)
    spun = run("joints")(rolling_friction.scene(0.0, 6.0), time_step=h, duration=2.0, observe=last)
    t = h * np.arange(721)

    speed = np.hypot(rolled["v"][:, 0], rolled["v"][:, 1])
    assert speed[2:] == pytest.approx(np.maximum(0.0, 0.5 - rolling_friction.BRAKE * t)[2:], abs=1e-9)
    spin = np.maximum(0.0, 6.0 - rolling_friction.SLOWING * t[:481])
    assert spun["w"][2:, 2] == pytest.approx(spin[2:], abs=1e-9)


def test_a_pair_has_the_larger_rolling_friction_or_is_not_supported() -> None:
    def balls(*of_rolling: float) -> Scene:
        def rough(rolling: float) -> Material:
            return Material(friction=0.25, rolling_friction=rolling)

        floor = fixed("floor", Plane(), (0.0, 0.0, 0.0), material=rough(0.02))
        made = [
            solid(f"{k}", Sphere(0.5), (2.0 * k, 0.0, 0.5), material=rough(rolling))
            for k, rolling in enumerate(of_rolling)
        ]
        return Scene(bodies=(floor, *made))

    found = shares(balls(0.01, 0.02), "rolling", "pybullet")
    for a, b in (("floor", "0"), ("floor", "1"), ("0", "1")):
        assert 0.5 * (found[a] + found[b]) == pytest.approx(0.02, rel=1e-9)
    assert shares(balls(0.0), "torsional", "pybullet") == {}
    with pytest.raises(NotSupported, match="different rolling friction"):
        shares(balls(0.01, 0.1, 0.1), "rolling", "pybullet")

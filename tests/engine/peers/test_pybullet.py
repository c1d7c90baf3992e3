"""PyBullet behind the protocol gives what Bullet is known to give. Skipped, with the reason, where it is missing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    ConstraintForce,
    Final,
    Fluid,
    Material,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
)
from spook_tracker.engine.find import find
from spook_tracker.engine.peers.surfaces import shares
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests import rolling_friction
from tests.scenes import peer as peer_scenes

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


def test_what_its_sensors_tell_wrong_is_not_asked() -> None:
    """The tension of a rod that swings alone is m (ω² l + g cos φ); of a chain at rest it is told, and not of one in motion."""
    tension, end = Final(quantity=ConstraintForce("rod")), Final(quantity=Position("weight"))
    swung = run("joints")(
        peer_scenes.pendulum(), time_step=1e-4, duration=0.4, observe={"f": tension, "x": end}
    )
    assert swung["f"] == pytest.approx(-3.0 * peer_scenes.G * swung["x"][2], rel=1e-3)
    moving = {"f": Final(quantity=ConstraintForce("rod 1"))}
    with pytest.raises(NotSupported, match=r"does not support the force of 'rod \d', which turns"):
        run("joints")(peer_scenes.chain(2), time_step=STEP, steps=5, observe=moving)
    spinning = replace(peer_scenes.nodding(), constraints=peer_scenes.nodding().constraints[:1])
    spinning = replace(spinning, bodies=spinning.bodies[:1])
    with pytest.raises(NotSupported, match="wrong for a ball joint"):
        run("joints")(
            spinning, time_step=STEP, steps=1, observe={"f": Final(quantity=ConstraintForce("ball 0"))}
        )


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
def test_semi_implicit_euler_blows_up_on_a_chain(time_step: float) -> None:
    """Every step is finite, every length exact: it is the energy that says so."""
    found, stretch, energy = peer_scenes.stretched_and_gained(run("joints"), 26, time_step, 22.0)

    assert found.status == "completed"
    assert stretch < 1e-9
    assert energy > 1e3


def test_the_hinges_of_a_door_carry_uneven_loads() -> None:
    """Two hinges bear 149 N each, sideways; of ten the first bears far more than the last."""
    for hinges in (2, 10):
        forces = {f"{k}": Final(quantity=ConstraintForce(f"{k}")) for k in range(hinges)}
        found = run("constraints")(peer_scenes.door(hinges), time_step=STEP, duration=1.0, observe=forces)
        loads = np.array([found[f"{k}"][:3] for k in range(hinges)])

        assert loads[:, 2].sum() == pytest.approx(45.0 * 9.81, rel=1e-6)
        if hinges == 10:
            assert abs(abs(loads[0, 0]) - abs(loads[9, 0])) > 15.0


def test_what_it_lacks_is_not_supported_by_name() -> None:
    ground, box = peer_scenes.box_on_ground(0.0).bodies
    fluid = Fluid(name="sea", density=1.0)
    sea = Scene(bodies=(ground, box), forces=(fluid,), gravity=peer_scenes.GRAVITY)
    with pytest.raises(NotSupported, match="the force fluid"):
        run("joints")(sea, time_step=STEP, steps=1)
    springy = [
        RigidBody(
            name=f"{e}",
            mass=1.0,
            shape=Sphere(0.5),
            position=(2.0 * e, 0, 1),
            material=Material(restitution=e),
        )
        for e in (0.2, 0.8)
    ]
    floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    with pytest.raises(NotSupported, match="different restitution"):
        run("joints")(Scene(bodies=(floor, *springy)), time_step=STEP, steps=1)


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

        floor = RigidBody(
            name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough(0.02)
        )
        made = [
            RigidBody(
                name=f"{k}",
                mass=1.0,
                shape=Sphere(0.5),
                position=(2.0 * k, 0.0, 0.5),
                material=rough(rolling),
            )
            for k, rolling in enumerate(of_rolling)
        ]
        return Scene(bodies=(floor, *made))

    found = shares(balls(0.01, 0.02), "rolling", "pybullet")
    for a, b in (("floor", "0"), ("floor", "1"), ("0", "1")):
        assert 0.5 * (found[a] + found[b]) == pytest.approx(0.02, rel=1e-9)
    assert shares(balls(0.0), "torsional", "pybullet") == {}
    with pytest.raises(NotSupported, match="different rolling friction"):
        shares(balls(0.01, 0.1, 0.1), "rolling", "pybullet")

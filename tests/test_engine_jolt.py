"""Jolt behind the protocol: what it has it does to single precision. Skipped, with the reason, without it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Ball,
    Capsule,
    CentralGravity,
    ConstraintForce,
    ContactForce,
    Final,
    Hinge,
    Load,
    Lock,
    Particle,
    Penetration,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Spring,
    Trace,
    Velocity,
)
from spook_tracker.engine.find import EngineMissing, find
from spook_tracker.engine.protocol import NotSupported
from tests import peer_scenes

try:
    JOLT = find("jolt")
except EngineMissing as reason:
    pytest.skip(str(reason), allow_module_level=True)

import spook_tracker.engine.peers.jolt as jolt

STEP = 1.0 / 60.0  # s


def defaults(scene: Scene, **options: Any) -> Any:
    return JOLT.simulate(scene, configuration="defaults", **options)


def test_a_smaller_step_stops_helping_where_single_precision_does() -> None:
    """A first-order step in double precision is g T h / 2 away: 0.02 m at 1/4000 s, and it always shrinks with h."""
    in_double = 0.5 * 9.81 * 20.0 / 4000.0

    assert peer_scenes.fall_error(JOLT.simulate, STEP) == pytest.approx(9.81 * STEP, abs=1e-4)
    assert abs(peer_scenes.fall_error(JOLT.simulate, 1 / 4000, seconds=20.0)) > 4.0 * in_double


def test_a_rod_loses_energy_however_often_it_is_iterated() -> None:
    """Two to four fifths of m g l in 22 s at 1/60 s: known of its distance constraint, and not a lack of iterations."""
    few, many = (peer_scenes.swung(run, STEP) for run in (defaults, JOLT.simulate))

    assert 0.004 < few[0] < 0.006
    assert many[0] < 1e-4, "the length is what iterations mend"
    assert 0.7 < few[1] < 0.75
    assert 0.7 < many[1] < 0.75


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("kind", [Ball, Hinge])
def test_the_force_of_a_joint_is_the_weight_it_holds(kind: Any, backwards: bool) -> None:
    force = {"force": Final(quantity=ConstraintForce("joint"))}
    run = JOLT.simulate(peer_scenes.hung(kind, backwards), time_step=STEP, duration=1.0, observe=force)

    assert run["force"] == pytest.approx(peer_scenes.load_on_joint(kind, backwards), abs=1e-4)


def test_the_tension_of_a_rod_at_rest_is_the_weight() -> None:
    still = peer_scenes.pendulum(at=(0.0, 0.0, -1.0), mass=2.0)
    pull = {"pull": Final(quantity=ConstraintForce("rod"))}
    run = JOLT.simulate(still, time_step=STEP, duration=1.0, observe=pull)

    assert float(run["pull"]) == pytest.approx(19.62, rel=1e-6)


@pytest.mark.parametrize("kind", [Ball, Hinge, Lock, Prismatic])
def test_a_joint_holds_its_body(kind: Any) -> None:
    assert peer_scenes.left_its_place(JOLT.simulate, kind) < 1e-5


@pytest.mark.parametrize("kind", ["ball", "hinge", "lock", "prismatic"])
def test_joints_between_moving_bodies_move_as_in_our_engine(kind: str) -> None:
    """Two bodies turned at random, from rest, for half a second: both engines converge to one motion."""
    assert peer_scenes.parted_from_ours(JOLT.simulate, kind) < 0.02


def test_a_hinged_body_swings_with_its_period() -> None:
    """To four parts in a thousand at 1/1000 s: the step is of first order and its numbers single."""
    assert peer_scenes.swings(JOLT.simulate, 1 / 1000) == pytest.approx(1.0, abs=4e-3)


def test_a_spinning_body_keeps_its_momentum_with_gyroscopic_torques_only() -> None:
    with_, without = (peer_scenes.momentum_lost(run, 1 / 240) for run in (JOLT.simulate, defaults))

    assert with_ < 5e-3
    assert without > 0.02


def test_friction_holds_below_its_coefficient_and_not_above() -> None:
    assert abs(peer_scenes.slid(JOLT.simulate, 0.3)) < 1e-6
    assert peer_scenes.slid(JOLT.simulate, 0.7) == pytest.approx(0.5 * 0.2 * 9.81 * 4.0, rel=0.02)


@pytest.mark.parametrize("shape", [None, Sphere(0.5), Capsule(0.25, 0.5)], ids=["box", "sphere", "capsule"])
def test_a_body_rests_where_it_touches(shape: Any) -> None:
    """A capsule stands on its end: its axis is the body's z, Jolt's own is y."""
    assert abs(peer_scenes.sunk(JOLT.simulate, shape)) < 1e-3


def test_a_ball_comes_back_by_its_restitution() -> None:
    assert peer_scenes.bounced(JOLT.simulate, 0.8, 1 / 1000) == pytest.approx(0.64, abs=0.01)


def test_the_depth_is_that_of_the_deepest_contact() -> None:
    ground, box = peer_scenes.box_on_ground(0.0).bodies
    assert isinstance(box, RigidBody)
    sunken = RigidBody(name="box", mass=1.0, shape=box.shape, position=(0.0, 0.0, 0.46))
    depth = {"depth": Trace(quantity=Penetration())}
    run = JOLT.simulate(Scene(bodies=(ground, sunken)), time_step=STEP, steps=5, observe=depth)

    assert run["depth"][1] == pytest.approx(0.04, abs=1e-6)
    assert run["depth"][5] < run["depth"][1]


def test_forces_act_at_every_step() -> None:
    moon = Particle(name="moon", mass=3.0, position=(2.0, 0.0, 0.0), velocity=(0.0, math.sqrt(0.5), 0.0))
    orbit = Scene(bodies=(moon,), forces=(CentralGravity(name="pull", strength=1.0),))
    path = {"path": Trace(quantity=Position("moon"))}
    run = JOLT.simulate(orbit, time_step=0.001, duration=5.0, observe=path)
    assert np.abs(np.linalg.norm(run["path"], axis=1) - 2.0).max() < 1e-3

    box = RigidBody(name="box", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    lift = Load(name="lift", body="box", force=(0.0, 0.0, 4.0 * 9.81))
    speed = {"speed": Final(quantity=Velocity("box"))}
    lifted = Scene(bodies=(box,), forces=(lift,), gravity=peer_scenes.GRAVITY)
    up = JOLT.simulate(lifted, time_step=0.01, steps=100, observe=speed)
    assert up["speed"][2] == pytest.approx(9.81, rel=1e-5)

    weight = Particle(name="weight", mass=3.0, position=(2.0, 0.0, 0.0))
    spring = Spring(name="spring", between=((0.0, 0.0, 0.0), "weight"), stiffness=30.0, rest_length=1.0)
    end = {"end": Final(quantity=Position("weight"))}
    run = JOLT.simulate(Scene(bodies=(weight,), forces=(spring,)), time_step=0.001, duration=1.0, observe=end)
    assert run["end"][0] == pytest.approx(1.0 + math.cos(math.sqrt(10.0)), abs=2e-3)


def test_locks_let_a_long_beam_fall() -> None:
    """The free end of eighty boxes falls as if nothing held it: ½ g t²."""
    assert peer_scenes.sag(defaults) > 1.1


def test_the_hinges_of_a_door_carry_uneven_loads() -> None:
    """Ten hinges: all of the weight together, but the top one bears far more than the last, sideways."""
    forces = {f"{k}": Final(quantity=ConstraintForce(f"{k}")) for k in range(10)}
    run = JOLT.simulate(peer_scenes.door(10), time_step=STEP, duration=2.0, observe=forces)
    loads = np.array([run[f"{k}"][:3] for k in range(10)])

    assert loads[:, 2].sum() == pytest.approx(45.0 * 9.81, rel=1e-4)
    assert abs(abs(loads[0, 0]) - abs(loads[9, 0])) > 20.0


def test_what_it_lacks_is_not_supported_by_name() -> None:
    force = {"force": Final(quantity=ContactForce("box"))}
    with pytest.raises(NotSupported, match="the observable contact force"):
        JOLT.simulate(peer_scenes.box_on_ground(0.0), time_step=STEP, steps=1, observe=force)


@pytest.mark.parametrize("kind", [Hinge, Prismatic])
def test_dry_friction_in_a_joint_brakes_it_until_it_stands_and_holds_it_then(kind: Any) -> None:
    assert peer_scenes.braked(JOLT.simulate, kind) == pytest.approx(peer_scenes.BRAKED, abs=5e-3)


def test_where_the_package_shows_no_fixed_body_one_of_ours_holds_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Packages before 1.1.0: played by a script that does not look for it."""
    text = jolt.SCRIPT.read_text(encoding="utf-8")
    shown = "J.JoltInterface.prototype.sGetFixedToWorldBody?.()"
    assert text.count(shown) == 1
    (tmp_path / "jolt.mjs").write_text(text.replace(shown, "undefined"), encoding="utf-8")
    (tmp_path / "loop.mjs").write_bytes(jolt.SCRIPT.with_name("loop.mjs").read_bytes())
    held = [JOLT.simulate(peer_scenes.hung(kind), time_step=STEP, steps=30) for kind in (Ball, Hinge)]
    monkeypatch.setattr(jolt, "SCRIPT", tmp_path / "jolt.mjs")
    alone = [JOLT.simulate(peer_scenes.hung(kind), time_step=STEP, steps=30) for kind in (Ball, Hinge)]

    assert [run.state_hash for run in held] == [run.state_hash for run in alone]

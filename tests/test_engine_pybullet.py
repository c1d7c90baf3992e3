"""PyBullet behind the protocol gives what Bullet is known to give. Skipped, with the reason, where it is missing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Ball,
    Capsule,
    CentralGravity,
    ConstraintForce,
    ContactCount,
    ContactForce,
    Final,
    Fluid,
    Hinge,
    Load,
    Lock,
    Material,
    Particle,
    Penetration,
    Plane,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Spring,
    Trace,
    Velocity,
)
from spook_tracker.engine.find import find
from spook_tracker.engine.peers.surfaces import shares
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests import rolling_friction
from tests import peer_scenes

pytest.importorskip(
    "pybullet", reason="the extra pybullet is not installed: pip install 'spook-tracker[pybullet]'"
)
STEP = 1.0 / 60.0  # s
BOTH = ("joints", "constraints")


def run(configuration: str) -> Any:
    def simulate(scene: Scene, **options: Any) -> Any:
        return find("pybullet").simulate(scene, configuration=configuration, **options)

    return simulate


@pytest.mark.parametrize("configuration", BOTH)
def test_a_fall_has_the_error_of_the_symplectic_step(configuration: str) -> None:
    assert peer_scenes.fall_error(run(configuration), STEP) == pytest.approx(9.81 * STEP, rel=1e-12)


def test_a_rod_is_a_hinge_in_joint_coordinates() -> None:
    """The length is exact; the energy is that of semi-implicit Euler, the same digits in every engine that has it."""
    length, energy = peer_scenes.swung(run("joints"), STEP)

    assert length < 1e-12
    assert energy == pytest.approx(0.0233, abs=2e-4)
    assert peer_scenes.swung(run("joints"), 1 / 240)[1] == pytest.approx(0.0057, abs=1e-4)


def test_a_rod_that_no_joint_can_stand_for_is_not_supported() -> None:
    with pytest.raises(NotSupported, match="no constraint of distance"):
        run("constraints")(peer_scenes.pendulum(), time_step=STEP, steps=1)


def test_the_tension_of_a_rod_at_rest_is_all_that_hangs_on_it() -> None:
    weights = tuple(Particle(name=f"{k}", mass=1.0 + k, position=(0.0, 0.0, -1.0 - k)) for k in range(2))
    rods = peer_scenes.chain(2).constraints
    observe = {f"{k}": Final(quantity=ConstraintForce(f"rod {k}")) for k in range(2)}
    scene = Scene(bodies=weights, constraints=rods, gravity=peer_scenes.GRAVITY)
    found = run("joints")(scene, time_step=STEP, duration=1.0, observe=observe)

    assert [float(found["0"]), float(found["1"])] == pytest.approx([29.43, 19.62], rel=1e-9)


@pytest.mark.parametrize("configuration", BOTH)
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("kind", [Ball, Hinge])
def test_the_force_of_a_joint_is_the_weight_it_holds(kind: Any, backwards: bool, configuration: str) -> None:
    force = {"force": Final(quantity=ConstraintForce("joint"))}
    scene = peer_scenes.hung(kind, backwards)
    found = run(configuration)(scene, time_step=STEP, duration=1.0, observe=force)

    assert found["force"] == pytest.approx(peer_scenes.load_on_joint(kind, backwards), abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "configuration"),
    [(kind, name) for kind in ("ball", "hinge", "lock", "prismatic") for name in BOTH][:-1],
)
def test_joints_between_moving_bodies_move_as_in_our_engine(kind: str, configuration: str) -> None:
    """Two bodies turned at random, from rest: both engines converge to one motion; impulses less well."""
    assert peer_scenes.parted_from_ours(run(configuration), kind) < 0.02


@pytest.mark.parametrize("configuration", BOTH)
def test_speeds_at_the_start_are_those_of_the_scene(configuration: str) -> None:
    """A hinged body and one on a slide, set going, are read back before any step."""
    found = peer_scenes.set_going(run(configuration), slides=configuration == "joints")

    assert found[0] == pytest.approx(np.array([[0.0, 2.0, 0.0], [3.0, 0.0, 0.0]]), abs=1e-12)
    assert found[1] == pytest.approx(found[0], abs=5e-3)


@pytest.mark.parametrize("configuration", ["joints", "constraints"])
def test_spins_at_the_start_are_those_of_the_scene(configuration: str) -> None:
    """Two bodies turned against the world on ball joints; each engine wants the spin of a joint in axes of its own."""
    assert peer_scenes.started(run(configuration)) == pytest.approx((0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("configuration", BOTH)
@pytest.mark.parametrize("kind", [Ball, Hinge, Lock, Prismatic])
def test_a_joint_holds_its_body(kind: Any, configuration: str) -> None:
    if kind is Prismatic and configuration == "constraints":
        with pytest.raises(NotSupported, match="a slide as a constraint"):
            peer_scenes.left_its_place(run(configuration), kind)
        return
    assert peer_scenes.left_its_place(run(configuration), kind) < 1e-9


@pytest.mark.parametrize("configuration", BOTH)
def test_a_hinged_body_swings_with_its_period(configuration: str) -> None:
    assert peer_scenes.swings(run(configuration), 1 / 1000) == pytest.approx(1.0, abs=1e-4)


def test_a_spinning_body_keeps_its_momentum_to_the_order_of_its_step() -> None:
    coarse, fine = (peer_scenes.momentum_lost(run("joints"), h) for h in (1 / 240, 1 / 960))

    assert coarse < 1e-3
    assert fine < 0.3 * coarse


def test_friction_holds_below_its_coefficient_and_not_above() -> None:
    """A box on a plane has few contact points in Bullet: it creeps by millimetres, and tilts where it slides."""
    assert abs(peer_scenes.slid(run("joints"), 0.3)) < 4e-3
    assert peer_scenes.slid(run("joints"), 0.7) == pytest.approx(0.5 * 0.2 * 9.81 * 4.0, rel=0.1)


@pytest.mark.parametrize("shape", [None, Sphere(0.5), Capsule(0.25, 0.5)], ids=["box", "sphere", "capsule"])
def test_a_body_rests_where_it_touches(shape: Any) -> None:
    assert abs(peer_scenes.sunk(run("joints"), shape)) < 1e-4


def test_the_ground_carries_the_weight_and_the_pull() -> None:
    observe = {
        "force": Final(quantity=ContactForce("box")),
        "ground": Final(quantity=ContactForce("ground", "box")),
        "depth": Final(quantity=Penetration()),
        "count": Final(quantity=ContactCount()),
    }
    found = run("joints")(peer_scenes.box_on_ground(0.3), time_step=STEP, duration=2.0, observe=observe)

    assert found["force"] == pytest.approx([-0.3 * 9.81, 0.0, 9.81], abs=1e-3)
    assert list(found["ground"]) == list(-found["force"])
    assert 0.0 < float(found["depth"]) < 1e-4
    assert 3 <= float(found["count"]) <= 4


def test_a_ball_bounces_at_large_steps_only() -> None:
    """Bullet sees a contact 2 cm before it is one: at small steps the ball is stopped there, and its speed is gone."""
    assert 0.5 < peer_scenes.bounced(run("joints"), 0.8, 1 / 60) < 0.85
    assert peer_scenes.bounced(run("joints"), 0.8, 1 / 1000) < 1e-3


def test_forces_act_at_every_step() -> None:
    moon = Particle(name="moon", mass=3.0, position=(2.0, 0.0, 0.0), velocity=(0.0, math.sqrt(0.5), 0.0))
    orbit = Scene(bodies=(moon,), forces=(CentralGravity(name="pull", strength=1.0),))
    path = {"path": Trace(quantity=Position("moon"))}
    found = run("joints")(orbit, time_step=0.001, duration=5.0, observe=path)
    assert np.abs(np.linalg.norm(found["path"], axis=1) - 2.0).max() < 1e-3

    box = RigidBody(name="box", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    lift = Load(name="lift", body="box", force=(0.0, 0.0, 4.0 * 9.81))
    speed = {"speed": Final(quantity=Velocity("box"))}
    lifted = Scene(bodies=(box,), forces=(lift,), gravity=peer_scenes.GRAVITY)
    assert run("joints")(lifted, time_step=0.01, steps=100, observe=speed)["speed"][2] == pytest.approx(9.81)

    weight = Particle(name="weight", mass=3.0, position=(2.0, 0.0, 0.0))
    spring = Spring(name="spring", between=((0.0, 0.0, 0.0), "weight"), stiffness=30.0, rest_length=1.0)
    end = {"end": Final(quantity=Position("weight"))}
    sprung = Scene(bodies=(weight,), forces=(spring,))
    found = run("joints")(sprung, time_step=0.001, duration=1.0, observe=end)
    assert found["end"][0] == pytest.approx(1.0 + math.cos(math.sqrt(10.0)), abs=1e-3)


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
def test_semi_implicit_euler_blows_up_on_a_chain(time_step: float) -> None:
    """Every step is finite, every length exact: it is the energy that says so."""
    found, stretch, energy = peer_scenes.stretched_and_gained(run("joints"), 26, time_step, 22.0)

    assert found.status == "completed"
    assert stretch < 1e-9
    assert energy > 1e3


def test_fixed_constraints_let_a_long_beam_fall_and_merged_bodies_do_not() -> None:
    assert peer_scenes.sag(run("constraints")) > 1.1
    assert abs(peer_scenes.sag(run("joints"))) < 1e-12


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


@pytest.mark.parametrize("kind", [Hinge, Prismatic])
def test_dry_friction_in_a_joint_brakes_it_until_it_stands_and_holds_it_then(kind: Any) -> None:
    assert peer_scenes.braked(find("pybullet").simulate, kind) == pytest.approx(peer_scenes.BRAKED, abs=5e-3)
    with pytest.raises(NotSupported, match="friction in a joint"):
        find("pybullet").simulate(
            peer_scenes.rough(kind), configuration="constraints", time_step=1e-3, duration=1.0
        )


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

"""Drake behind the protocol gives what Drake is known to give. Skipped, with the reason, where it is missing."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Ball,
    Capsule,
    CentralGravity,
    ConstraintForce,
    ContactForce,
    Distance,
    Final,
    Hinge,
    Load,
    Lock,
    Material,
    Particle,
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
from spook_tracker.engine.protocol import NotSupported
from tests import peer_scenes

pytest.importorskip("pydrake", reason="the extra drake is not installed: pip install 'spook-tracker[drake]'")
STEP = 1.0 / 60.0  # s


def run(configuration: str) -> Any:
    def simulate(scene: Scene, **options: Any) -> Any:
        return find("drake").simulate(scene, configuration=configuration, **options)

    return simulate


def test_a_fall_has_the_error_of_its_integrator() -> None:
    assert peer_scenes.fall_error(run("sap"), STEP) == pytest.approx(9.81 * STEP, rel=1e-12)
    assert abs(peer_scenes.fall_error(run("rk3"), STEP)) < 1e-11


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


def test_the_tension_of_a_rod_at_rest_is_all_that_hangs_on_it() -> None:
    weights = tuple(Particle(name=f"{k}", mass=1.0 + k, position=(0.0, 0.0, -1.0 - k)) for k in range(2))
    rods = peer_scenes.chain(2).constraints
    observe = {f"{k}": Final(quantity=ConstraintForce(f"rod {k}")) for k in range(2)}
    scene = Scene(bodies=weights, constraints=rods, gravity=peer_scenes.GRAVITY)

    for name in ("sap", "rk3"):
        found = run(name)(scene, time_step=STEP, duration=0.5, observe=observe)
        assert [float(found["0"]), float(found["1"])] == pytest.approx([29.43, 19.62], rel=1e-9)
    with pytest.raises(NotSupported, match="only those of joints"):
        run("constraints")(scene, time_step=STEP, steps=1, observe=observe)


@pytest.mark.parametrize("configuration", ["sap", "rk3"])
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("kind", [Ball, Hinge, Lock])
def test_the_force_of_a_joint_is_the_weight_it_holds(kind: Any, backwards: bool, configuration: str) -> None:
    force = {"force": Final(quantity=ConstraintForce("joint"))}
    scene = peer_scenes.hung(kind, backwards)
    found = run(configuration)(scene, time_step=STEP, duration=0.5, observe=force)

    assert found["force"] == pytest.approx(peer_scenes.load_on_joint(kind, backwards), abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "configuration"),
    [(kind, "rk3") for kind in ("ball", "hinge", "lock", "prismatic", "universal")]
    + [(kind, "constraints") for kind in ("ball", "hinge", "lock")],
)
def test_joints_between_moving_bodies_move_as_in_our_engine(kind: str, configuration: str) -> None:
    """Two bodies turned at random, from rest: both engines converge to one motion."""
    assert peer_scenes.parted_from_ours(run(configuration), kind) < 0.02


def test_speeds_at_the_start_are_those_of_the_scene() -> None:
    """A hinged body, one on a slide, one that is thrown and one on a rod are read back before any step."""
    rod = Particle(name="rod", mass=1.0, position=(0.0, 0.0, -1.0), velocity=(0.7, 0.2, 0.0))
    thrown = Particle(name="thrown", mass=1.0, position=(0.0, 1.0, 0.0), velocity=(0.0, 0.5, 2.0))
    line = Distance(name="line", between=((0.0, 0.0, 0.0), "rod"), compliance=0.0)
    found = peer_scenes.set_going(run("rk3"), bodies=(thrown, rod), joints=(line,))

    speeds = [(0.0, 2.0, 0.0), (3.0, 0.0, 0.0), thrown.velocity, rod.velocity]
    assert found[0] == pytest.approx(np.array(speeds), abs=1e-12)


@pytest.mark.parametrize("configuration", ["sap", "rk3", "constraints"])
def test_spins_at_the_start_are_those_of_the_scene(configuration: str) -> None:
    """Two bodies turned against the world on ball joints; each engine wants the spin of a joint in axes of its own."""
    assert peer_scenes.started(run(configuration)) == pytest.approx((0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("kind", [Ball, Hinge, Lock, Prismatic])
def test_a_joint_holds_its_body(kind: Any) -> None:
    assert peer_scenes.left_its_place(run("sap"), kind) < 1e-12
    if kind is not Prismatic:
        assert peer_scenes.left_its_place(run("constraints"), kind) < 1e-5


def test_a_hinged_body_swings_with_its_period() -> None:
    assert peer_scenes.swings(run("rk3"), 1 / 240) == pytest.approx(1.0, abs=3e-5)


def test_a_spinning_body_keeps_its_momentum_to_the_order_of_its_step() -> None:
    assert peer_scenes.momentum_lost(run("rk3"), 1 / 240) < 1e-6
    assert 1e-4 < peer_scenes.momentum_lost(run("sap"), 1 / 240) < 1e-2


def test_friction_holds_below_its_coefficient_and_not_above() -> None:
    assert abs(peer_scenes.slid(run("sap"), 0.3, seconds=1.0)) < 1e-3
    assert peer_scenes.slid(run("sap"), 0.7, seconds=1.0) == pytest.approx(0.5 * 0.2 * 9.81, rel=0.03)


@pytest.mark.parametrize("shape", [None, Sphere(0.5), Capsule(0.25, 0.5)], ids=["box", "sphere", "capsule"])
def test_a_body_rests_where_it_touches(shape: Any) -> None:
    assert abs(peer_scenes.sunk(run("sap"), shape)) < 1e-3


def test_the_ground_carries_the_weight_and_the_pull() -> None:
    observe = {
        "force": Final(quantity=ContactForce("box")),
        "ground": Final(quantity=ContactForce("ground", "box")),
    }
    found = run("sap")(peer_scenes.box_on_ground(0.3), time_step=STEP, duration=1.0, observe=observe)

    assert found["force"] == pytest.approx([-0.3 * 9.81, 0.0, 9.81], abs=1e-2)
    assert list(found["ground"]) == list(-found["force"])


@pytest.mark.parametrize("configuration", ["sap", "rk3"])
def test_forces_act_at_every_step(configuration: str) -> None:
    simulate = run(configuration)
    moon = Particle(name="moon", mass=3.0, position=(2.0, 0.0, 0.0), velocity=(0.0, math.sqrt(0.5), 0.0))
    orbit = Scene(bodies=(moon,), forces=(CentralGravity(name="pull", strength=1.0),))
    path = {"path": Trace(quantity=Position("moon"))}
    found = simulate(orbit, time_step=0.001, duration=5.0, observe=path)
    assert np.abs(np.linalg.norm(found["path"], axis=1) - 2.0).max() < (
        1e-3 if configuration == "sap" else 1e-9
    )

    box = RigidBody(name="box", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    lift = Load(name="lift", body="box", force=(0.0, 0.0, 4.0 * 9.81))
    speed = {"speed": Final(quantity=Velocity("box"))}
    lifted = Scene(bodies=(box,), forces=(lift,), gravity=peer_scenes.GRAVITY)
    assert simulate(lifted, time_step=0.01, steps=100, observe=speed)["speed"][2] == pytest.approx(9.81)

    weight = Particle(name="weight", mass=3.0, position=(2.0, 0.0, 0.0))
    spring = Spring(name="spring", between=((0.0, 0.0, 0.0), "weight"), stiffness=30.0, rest_length=1.0)
    end = {"end": Final(quantity=Position("weight"))}
    found = simulate(Scene(bodies=(weight,), forces=(spring,)), time_step=0.001, duration=1.0, observe=end)
    assert found["end"][0] == pytest.approx(1.0 + math.cos(math.sqrt(10.0)), abs=1e-3)


def test_semi_implicit_euler_blows_up_on_a_chain_where_runge_kutta_does_not() -> None:
    blown, _, _ = peer_scenes.stretched_and_gained(run("sap"), 26, STEP, 12.0)
    _, stretch, energy = peer_scenes.stretched_and_gained(run("rk3"), 26, 1 / 240, 2.0)

    assert blown.status in ("not_finite", "diverged")
    assert stretch < 1e-9
    assert energy < 1e-4


def test_weld_constraints_let_a_long_beam_fall_and_merged_bodies_do_not() -> None:
    assert peer_scenes.sag(run("constraints")) > 1.0
    assert abs(peer_scenes.sag(run("sap"))) < 1e-12


def test_what_it_lacks_is_not_supported_by_name() -> None:
    with pytest.raises(NotSupported, match="the shape box"):
        run("rk3")(peer_scenes.box_on_ground(0.0), time_step=STEP, steps=1)
    ground, box = peer_scenes.box_on_ground(0.0).bodies
    smooth = replace(box, material=Material(friction=0.1))  # type: ignore[arg-type]
    with pytest.raises(NotSupported, match="different friction"):
        run("sap")(Scene(bodies=(ground, smooth)), time_step=STEP, steps=1)

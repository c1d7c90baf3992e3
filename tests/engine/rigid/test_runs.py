"""Runs of rigid scenes: observables, signs, repeatability, bodies that are driven, systems that are singular."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    PLAIN,
    WORLD,
    AngularMomentum,
    AngularVelocity,
    Box,
    ConstraintForce,
    Distance,
    Final,
    Hinge,
    KineticEnergy,
    Load,
    Lock,
    Material,
    Method,
    Momentum,
    Orientation,
    Particle,
    Plane,
    Position,
    PotentialEnergy,
    RigidBody,
    Scene,
    SimulationFailed,
    Trace,
    Velocity,
    compile,
    simulate,
)
from tests.oracles.rigid import RigidOracle
from tests.scenes.corpus import solid
from tests.scenes.rigid import TIME_STEP, tree

GRAVITY = (0.0, 0.0, -9.81)


def body(name: str = "body", **changes: object) -> RigidBody:
    return RigidBody(
        **{"name": name, "mass": 2.0, "inertia": (0.3, 0.4, 0.5), "position": (0.0, 0.0, 0.0)} | changes  # type: ignore[arg-type]
    )


def test_energies_and_momenta_are_those_of_the_state() -> None:
    """½ m v² + ½ w·L − m g·x and x × m v + L, from positions, orientations and velocities of the same sample."""
    scene = tree(np.random.default_rng(2))
    asked = {
        "x": Position(),
        "v": Velocity(),
        "w": AngularVelocity(),
        "k": KineticEnergy(),
        "p": PotentialEnergy(),
        "m": Momentum(),
        "l": AngularMomentum((1.0, 0.0, -1.0)),
    }
    observe = {name: Trace(quantity=quantity) for name, quantity in asked.items()}
    run = simulate(scene, time_step=TIME_STEP, steps=10, observe=observe, method=PLAIN)
    oracle = RigidOracle(scene, TIME_STEP)
    for k in range(1, 11):
        oracle.step()
        spin = np.array([oracle.world_inertia(i) @ w for i, w in enumerate(run["w"][k])])
        mass = oracle.mass
        kinetic = 0.5 * mass @ np.sum(run["v"][k] ** 2, axis=1) + 0.5 * np.sum(spin * run["w"][k])
        arm = run["x"][k] - (1.0, 0.0, -1.0)
        assert run["k"][k] == pytest.approx(kinetic, rel=1e-12)
        assert run["p"][k] == pytest.approx(-(mass @ run["x"][k]) @ scene.gravity, rel=1e-12)
        assert run["m"][k] == pytest.approx(mass @ run["v"][k], rel=1e-12)
        assert run["l"][k] == pytest.approx(mass @ np.cross(arm, run["v"][k]) + spin.sum(axis=0), rel=1e-11)


def test_what_a_scene_does_not_need_is_left_out() -> None:
    spinning = Scene(bodies=(body(angular_velocity=(1.0, 2.0, 3.0)),))
    hanging = Scene(
        bodies=(body(),), constraints=(Lock(name="lock", between=(WORLD, "body")),), gravity=GRAVITY
    )

    assert compile(spinning, time_step=0.01).stages == ("integrate_positions", "integrate_rotations")
    assert compile(hanging, time_step=0.01).stages == (
        "apply_gravity",
        "assemble_rows",
        "solve_block",
        "integrate_positions",
        "integrate_rotations",
    )
    assert all(choice.reason for choice in compile(hanging, time_step=0.01).explain())


@pytest.mark.parametrize(
    ("options", "stage"),
    [
        ({"corrections": 1}, "correct_curvature"),
        ({"half_step_velocities": True}, "half_step"),
        ({"string_stiffness": True}, "string_stiffness"),
        ({"composition": "order4"}, "half_step"),
    ],
)
def test_an_option_is_a_stage_of_rigid_bodies_too(options: dict[str, object], stage: str) -> None:
    hanging = Scene(
        bodies=(body(),),
        constraints=(Hinge(name="hinge", between=(WORLD, "body"), at=(1.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0)),),
    )

    assert stage in compile(hanging, time_step=0.01, method=Method(**options)).stages  # type: ignore[arg-type]
    assert stage not in compile(hanging, time_step=0.01).stages


def test_a_particle_among_rigid_bodies_is_still_a_particle() -> None:
    """The same pendulum alone and beside a far rigid body."""
    bob = Particle(name="bob", mass=1.0, position=(1.0, 0.0, 0.0))
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "bob"))
    far = body("far", position=(50.0, 0.0, 0.0))
    observe = {"x": Trace(quantity=Position("bob"))}
    alone, beside = (
        simulate(
            Scene(bodies=bodies, constraints=(rod,), gravity=GRAVITY),
            time_step=0.01,
            steps=300,
            observe=observe,
        )["x"]
        for bodies in ((bob,), (bob, far))
    )

    assert np.abs(alone - beside).max() < 1e-11


def test_a_kinematic_body_moves_as_told_and_carries_others() -> None:
    """A turntable turns by w t exactly; a lock carries a body round with it; a belt drags a box to its speed."""
    table = solid("table", None, (0.0, 0.0, 0.0), None, spin=(0.0, 0.0, 2.0), motion="kinematic")
    rider = body(
        "rider", position=(0.5, 0.0, 0.0), velocity=(0.0, 1.0, 0.0), angular_velocity=(0.0, 0.0, 2.0)
    )
    scene = Scene(bodies=(table, rider), constraints=(Lock(name="lock", between=("table", "rider")),))
    observe = {"q": Trace(quantity=Orientation("table")), "x": Trace(quantity=Position("rider"))}
    run = simulate(scene, time_step=1e-3, steps=2000, observe=observe)
    t = run.sample_times["q"]

    assert np.abs(np.unwrap(2.0 * np.arctan2(run["q"][:, 3], run["q"][:, 0])) - 2.0 * t).max() < 1e-12
    assert np.abs(run["x"][:, :2] - 0.5 * np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)).max() < 2e-3
    rough = Material(friction=0.5)
    belt = solid("belt", Plane(), (0.0, 0.0, 0.0), None, (1.0, 0.0, 0.0), motion="kinematic", material=rough)
    box = solid("box", Box((0.2, 0.2, 0.1)), (0.0, 0.0, 0.05), material=rough)
    dragged = simulate(
        Scene(bodies=(belt, box), gravity=(0.0, 0.0, -10.0)),
        time_step=0.01,
        steps=50,
        observe={"v": Trace(quantity=Velocity("box"))},
    )["v"]

    assert dragged[:, 0] == pytest.approx(np.minimum(5.0 * 0.01 * np.arange(51), 1.0), abs=1e-8)


def test_singular_systems_are_solved() -> None:
    """Two rigid locks in one place share the weight evenly."""
    locks = tuple(Lock(name=f"lock {i}", between=(WORLD, "body"), compliance=0.0) for i in range(2))
    observe = {f"lock {i}": Final(quantity=ConstraintForce(f"lock {i}")) for i in range(2)}
    run = simulate(
        Scene(bodies=(body(),), constraints=locks, gravity=GRAVITY),
        time_step=1 / 60,
        steps=100,
        observe=observe,
    )

    for i in range(2):
        np.testing.assert_allclose(run[f"lock {i}"], [0.0, 0.0, 9.81, 0.0, 0.0, 0.0], rtol=0.0, atol=1e-8)


def test_rows_that_contradict_each_other_are_named_as_that() -> None:
    lock = Lock(name="lock", between=(WORLD, "body"), compliance=0.0)
    rod = Distance(name="rod", between=((0.0, 0.0, -1.0), "body"), rest_length=1.2, compliance=0.0)
    run = simulate(
        Scene(bodies=(body(),), constraints=(lock, rod)),
        time_step=1 / 60,
        steps=100,
        observe={"x": Final(quantity=Position())},
    )

    assert not run.completed
    assert "contradict" in run.failure and "'body'" in run.failure
    with pytest.raises(SimulationFailed):
        run["x"]


def test_a_runaway_names_body_and_step() -> None:
    load = Load(name="push", body="body", force=(1e99, 0.0, 0.0))
    calm = body("calm", position=(0.0, 5.0, 0.0))
    run = simulate(Scene(bodies=(calm, body()), forces=(load,)), time_step=1.0, steps=100)

    assert run.status == "diverged"
    assert run.failed_body == "body"
    assert "'body'" in run.failure and str(run.failed_step) in run.failure


def test_a_point_of_a_body_is_read_where_it_is() -> None:
    """A box on a fixed axis through its centre: a corner goes round at w × r, whatever way the box lay at the start."""
    half = math.sqrt(0.5)
    spun = RigidBody(
        name="box",
        mass=2.0,
        inertia=(1.0, 1.0, 1.0),
        position=(1.0, 2.0, 3.0),
        orientation=(half, half, 0.0, 0.0),  # body y is world z, body z is world −y
        velocity=(0.5, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, 2.0),
    )
    point = (0.4, 0.7, -0.3)  # world (0.4, 0.3, 0.7)
    observe = {
        "x": Trace(quantity=Position("box", point=point)),
        "v": Trace(quantity=Velocity("box", point=point)),
    }
    run = simulate(Scene(bodies=(spun,)), time_step=0.001, steps=1000, observe=observe)
    time = run.sample_times["x"]
    angle = 2.0 * time + math.atan2(0.3, 0.4)
    exact = np.column_stack(
        [1.0 + 0.5 * time + 0.5 * np.cos(angle), 2.0 + 0.5 * np.sin(angle), 3.7 + 0.0 * time]
    )
    speed = np.column_stack([0.5 - np.sin(angle), np.cos(angle), 0.0 * time])

    # The variational turn is fast by (h w)²/6 of the angle.
    assert np.abs(run["x"] - exact).max() < 0.5 * 2.0 * 0.002**2 / 6.0 * 1.01
    assert np.abs(run["v"] - speed).max() < 2.0 * 0.5 * 2.0 * 0.002**2 / 6.0 * 1.01

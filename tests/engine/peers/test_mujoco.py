"""MuJoCo behind the protocol gives what MuJoCo is known to give. Skipped, with the reason, where it is missing."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Ball,
    ConstraintForce,
    ContactForce,
    Cylinder,
    Distance,
    Energy,
    Final,
    Hinge,
    JointCoordinate,
    JointSpring,
    Limit,
    Lock,
    Material,
    MaximumAbsolute,
    Particle,
    Plane,
    Position,
    RigidBody,
    Scene,
    Trace,
    Violation,
    Wire,
)
from spook_tracker.engine.find import find
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests.friction import rolling_friction
from spook_tracker.scalar_tests.mechanisms import latch
from spook_tracker.scalar_tests.robots import humanoid
from spook_tracker.scalar_tests.stacks import resting_stack
from spook_tracker.scalar_tests.thesis.inclined_plane.scene import scene as inclined

pytest.importorskip("mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'")
GRAVITY = (0.0, 0.0, -9.81)


def simulate(scene: Scene, configuration: str, **options: Any) -> Any:
    return find("mujoco").simulate(scene, configuration=configuration, **options)


def pendulum() -> Scene:
    weight = Particle(name="weight", mass=1.0, position=(1.0, 0.0, 0.0))
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "weight"), compliance=0.0)
    return Scene(bodies=(weight,), constraints=(rod,), gravity=GRAVITY)


def test_boxes_at_rest_are_sunk_into_each_other_by_as_much_as_soft_contacts_let_them() -> None:
    """By springs: deep in the defaults, little in stiff contacts, and less than the whole stack has sunk."""
    (measure,) = (
        m.measure
        for m in resting_stack.TEST.measurements
        if "overlap" in {metric.name for metric in m.metrics}
    )

    def told(configuration: str) -> dict[str, float]:
        def bound(scene: Scene, **options: Any) -> Any:
            return simulate(scene, configuration, **options)

        return dict(measure(bound))  # type: ignore[arg-type]

    stiff, soft = told("rk4"), told("defaults")
    assert 0.0 < stiff["overlap"] < soft["overlap"] < soft["drift"]


def test_a_rod_is_a_hinge_in_joint_coordinates_and_soft_as_an_equality() -> None:
    observe = {
        "length": MaximumAbsolute(quantity=Violation("rod")),
        "energy": MaximumAbsolute(quantity=Energy(), from_start=True),
    }
    joints = simulate(pendulum(), "rk4", time_step=1 / 60, duration=22.0, observe=observe)
    rows = simulate(pendulum(), "equalities", time_step=1 / 60, duration=22.0, observe=observe)

    assert float(joints["length"]) < 1e-14
    assert float(joints["energy"]) / 9.81 < 3e-7
    assert 0.008 < float(rows["length"]) < 0.012


@pytest.mark.parametrize("holder", ["world", "post"])
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("kind", [Ball, Hinge])
def test_the_force_of_a_joint_is_on_its_second_end(kind: Any, backwards: bool, holder: str) -> None:
    """A body held beside its joint: the joint carries the weight, and a hinge its moment, too."""
    post = RigidBody(name="post", motion="static", position=(0.0, 0.0, 0.5))
    body = RigidBody(name="arm", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, -1.0))
    ends = ("arm", holder) if backwards else (holder, "arm")
    options = {"axis": (0.0, 1.0, 0.0)} if kind is Hinge else {}
    joint = kind(name="joint", between=ends, at=(0.0, 0.0, 0.0), compliance=0.0, **options)
    scene = Scene(bodies=(post, body), constraints=(joint,), gravity=GRAVITY)
    observe = {"force": Final(quantity=ConstraintForce("joint"))}
    weight = np.array([0.0, 0.0, -19.62 if backwards else 19.62])

    for configuration in ("rk4", "equalities"):
        result = simulate(scene, configuration, time_step=0.01, duration=5.0, observe=observe)
        assert result["force"][:3] == pytest.approx(weight, abs=1e-3), configuration
        assert result["force"][3:] == pytest.approx(np.zeros(3), abs=1e-3), configuration


def test_a_box_on_a_slope_is_held_by_what_holds_it() -> None:
    """Gravity tilted by atan(0.3): the sum of the contact forces is minus the weight once it stands."""
    scene = inclined(0.3)
    observe = {"force": Final(quantity=ContactForce("box"))}

    result = simulate(scene, "rk4", time_step=1 / 240, duration=5.0, observe=observe)

    assert result["force"] == pytest.approx(-np.array(scene.gravity), abs=0.05)


def test_semi_implicit_euler_blows_up_on_a_chain_and_says_so() -> None:
    links = 26
    bodies = tuple(Particle(name=f"p{i}", mass=1.0, position=(i + 1.0, 0.0, 0.0)) for i in range(links))
    rods = tuple(
        Distance(name=f"r{i}", between=((0.0, 0.0, 0.0) if i == 0 else f"p{i - 1}", f"p{i}"), compliance=0.0)
        for i in range(links)
    )
    scene = Scene(bodies=bodies, constraints=rods, gravity=GRAVITY)

    euler = simulate(scene, "defaults", time_step=1 / 60, duration=22.0)
    rk4 = simulate(
        scene,
        "rk4",
        time_step=1 / 240,
        duration=2.0,
        observe={"e": Final(quantity=Energy(), from_start=True)},
    )

    assert euler.status == "diverged"
    assert "badqacc" in euler.failure
    assert abs(float(rk4["e"])) < 1e-4


def test_locked_bodies_are_one_body_in_joint_coordinates() -> None:
    bodies = tuple(
        RigidBody(name=f"b{i}", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.5 * i, 0.0, 0.0))
        for i in range(4)
    )
    locks = tuple(
        Lock(name=f"l{i}", between=("world" if i == 0 else f"b{i - 1}", f"b{i}"), compliance=0.0)
        for i in range(4)
    )
    scene = Scene(bodies=bodies, constraints=locks, gravity=GRAVITY)
    observe = {"end": Final(quantity=Position("b3"))}

    merged = simulate(scene, "rk4", time_step=1 / 60, duration=1.0, observe=observe)
    welded = simulate(scene, "equalities", time_step=1 / 60, duration=1.0, observe=observe)

    assert list(merged["end"]) == [1.5, 0.0, 0.0]
    assert -0.1 < welded["end"][2] < -1e-6
    assert math.isfinite(welded.seconds)


def test_default_friction_creeps_where_the_box_should_stand() -> None:
    """At tan θ = 0.3, below µ = 0.5: centimetres in ten seconds with soft pyramids, a ten-thousandth with care."""

    def crept(configuration: str) -> float:
        path = {"path": Trace(quantity=Position("box"), first=60)}
        run = simulate(inclined(0.3), configuration, time_step=1 / 60, duration=11.0, observe=path)
        return float(np.abs(run["path"][-1] - run["path"][0]).max())

    assert 0.01 < crept("defaults") < 0.04
    assert crept("rk4") < 1e-6


def test_friction_of_rolling_and_turning_brakes_a_ball_as_it_should() -> None:
    """Elliptic cones hold sliding and rolling friction in one: slower by (f/µN)²/2, f = (2/7) ρ N/r, a few 1e-4."""

    def told(of: Any, configuration: str = "rk4") -> dict[str, float]:
        return dict(of(lambda scene, **o: simulate(scene, configuration, **o)))

    lost = (
        0.5
        * (2.0 / 7.0 * rolling_friction.ROLLING / rolling_friction.RADIUS / rolling_friction.FRICTION) ** 2
    )
    step = rolling_friction.BRAKE * rolling_friction.TIME_STEP
    assert told(rolling_friction.roll)["speed_error"] < 2.0 * lost * rolling_friction.SPEED + step
    spinning = told(rolling_friction.turn)
    assert spinning["spin_error"] < 2.0 * rolling_friction.SLOWING * rolling_friction.TIME_STEP
    assert spinning["walked"] < 1e-3


def test_a_coin_on_its_face_rests_and_stands_on_half_its_length() -> None:
    coin = RigidBody(name="coin", mass=1.0, shape=Cylinder(0.3, 0.1), position=(0.0, 0.0, 0.05))
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    scene = Scene(bodies=(ground, coin), gravity=GRAVITY)
    place = simulate(
        scene, "rk4", time_step=1e-3, duration=1.0, observe={"x": Final(quantity=Position("coin"))}
    )["x"]

    assert place == pytest.approx([0.0, 0.0, 0.05], abs=1e-4)


def test_a_slow_run_is_ended_near_its_limit_though_nothing_is_recorded_between() -> None:
    """Three hundred boxes welded in a row: a thousand steps between two looks at the clock would be minutes."""
    boxes = [
        RigidBody(name=f"{k}", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(float(k), 0.0, 0.0))
        for k in range(300)
    ]
    locks = [Lock(name=f"lock {k}", between=(f"{k}", f"{k + 1}")) for k in range(299)]
    scene = Scene(bodies=tuple(boxes), constraints=tuple(locks), gravity=GRAVITY)
    run = simulate(scene, "equalities", time_step=1 / 60, steps=1_000_000, time_limit=0.3)

    assert run.status == "timed_out"
    assert run.steps < 1000


def test_a_wire_over_two_points_of_the_world_is_atwood_s_machine() -> None:
    """(m − M) g / (m + M) down, 2 m M g / (m + M) in the wire, which may go slack or may not."""
    places = {"heavy": (0.0, 0.0, -1.0), "light": (1.0, 0.0, -1.0)}
    weights = tuple(
        Particle(name=name, mass=mass, position=places[name])
        for name, mass in (("heavy", 3.0), ("light", 1.0))
    )
    through = (
        ("heavy", places["heavy"]), ("world", (0.0, 0.0, 0.0)), ("world", (1.0, 0.0, 0.0)), ("light", places["light"]),
    )  # fmt: skip
    seen = {"z": Final(quantity=Position("heavy")), "pull": Final(quantity=ConstraintForce("wire"))}
    for slack in (True, False):
        wire = Wire(name="wire", through=through, slack=slack, compliance=0.0)
        scene = Scene(bodies=weights, constraints=(wire,), gravity=(0.0, 0.0, -9.81))
        run = simulate(scene, "rk4", time_step=1e-3, duration=0.5, observe=seen)
        assert float(run["z"][2]) == pytest.approx(-1.0 - 0.125 * 0.5 * 9.81, abs=2e-4)
        assert float(run["pull"]) == pytest.approx(1.5 * 9.81, rel=1e-3)


def test_nothing_hangs_on_a_kinematic_body_and_none_turns_about_a_place_that_moves() -> None:
    """Of those MuJoCo has the surface alone, which stands."""
    plane = RigidBody(
        name="k", motion="kinematic", shape=Plane(), position=(0.0,) * 3, velocity=(1.0, 0.0, 0.0),
        material=Material(friction=0.5),
    )  # fmt: skip
    body = RigidBody(name="b", mass=1.0, inertia=(1.0,) * 3, position=(1.0, 0.0, 0.0))
    tie = Lock(name="tie", between=("k", "b"))
    for scene in (
        Scene(bodies=(plane, body), constraints=(tie,)),
        Scene(bodies=(replace(plane, shape=None, material=Material()), body)),
        Scene(bodies=(replace(plane, angular_velocity=(0.0, 0.0, 1.0)), body)),
    ):
        with pytest.raises(NotSupported, match="the kinematic 'k'"):
            simulate(scene, "rk4", time_step=0.01, steps=1)
    assert simulate(Scene(bodies=(plane, body)), "rk4", time_step=0.01, steps=1).status == "completed"


@pytest.mark.parametrize("backwards", [False, True])
def test_a_spring_carries_an_arm_and_a_stop_ends_its_fall(backwards: bool) -> None:
    """A level rod of 1 kg and 1 m: its weight's moment is that of the spring's rest, and without one it falls by 0.3 rad."""
    sign, joint = (
        -1.0 if backwards else 1.0,
        Hinge(
            name="axle",
            between=("arm", "wall") if backwards else ("wall", "arm"),
            at=(0.0, 0.0, 0.0),
            axis=(0.0, 1.0, 0.0),
            compliance=0.0,
        ),
    )
    wall = RigidBody(name="wall", motion="static", position=(0.0, 0.0, 0.0))
    arm = RigidBody(name="arm", mass=1.0, inertia=(0.01, 0.1, 0.1), position=(0.5, 0.0, 0.0))
    for held, angle in (
        (JointSpring(stiffness=20.0, rest=-sign * 0.5 * 9.81 / 20.0), 0.0),
        (Limit(lower=-0.3, upper=0.3, compliance=0.0), sign * 0.3),
    ):
        one = replace(joint, spring=held) if isinstance(held, JointSpring) else replace(joint, limit=held)
        scene = Scene(bodies=(wall, arm), constraints=(one,), gravity=GRAVITY)
        observe = {"q": Final(quantity=JointCoordinate("axle"))}
        found = simulate(scene, "implicit", time_step=1 / 240, duration=2.0, observe=observe)
        assert float(found["q"]) == pytest.approx(angle, abs=2e-3)


def test_a_humanoid_stands_and_a_latch_holds_with_the_forces_of_statics() -> None:
    ours = functools.partial(simulate, configuration="implicit")
    standing, held = humanoid.rest(ours), latch.hold(ours)

    assert standing["stood"] == humanoid.STANDS
    assert standing["load_error"] < 1e-4 and standing["torque_error"] < 1e-2
    assert held["held_error"] < 1e-4 and held["hinge_error"] < 1e-4

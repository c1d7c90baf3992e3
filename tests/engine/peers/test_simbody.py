"""Simbody, by OpenSim, behind the protocol: closed forms. Skipped, with the reason, where it is missing."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Ball,
    Box,
    CentralGravity,
    ContactForce,
    Distance,
    Final,
    Hinge,
    Load,
    Lock,
    MaximumAbsolute,
    Particle,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Spring,
    Violation,
)
from spook_tracker.engine.find import find
from spook_tracker.scalar_tests.mechanisms import lock_ring
from spook_tracker.scalar_tests.ropes import loaded_rods
from tests.scenes import peer as peer_scenes

pytest.importorskip(
    "opensim", reason="the extra simbody is not installed: pip install 'spook-tracker[simbody]'"
)
SETTINGS = ("merson", "held-step", "defaults", "cpodes")
STEP = 1.0 / 60.0  # s


def run(configuration: str) -> Any:
    return partial(find("simbody").simulate, configuration=configuration)


@pytest.mark.parametrize("configuration", SETTINGS)
def test_a_fall_and_a_load_are_exact_to_what_its_integrator_holds(configuration: str) -> None:
    close = 1e-6 if configuration == "cpodes" else 1e-11
    body = RigidBody(name="b", mass=2.0, inertia=(1.0, 2.0, 2.5), position=(1.0, 2.0, 3.0))
    load = Load(name="l", body="b", force=(2.0, 0.0, 0.0), torque=(0.0, 0.0, 5.0))
    seen = {"x": Final(quantity=Position("b")), "w": Final(quantity=AngularVelocity("b"))}
    pushed = run(configuration)(
        Scene(bodies=(body,), forces=(load,), gravity=(0.0, 0.0, 0.0)),
        time_step=0.01,
        duration=1.0,
        observe=seen,
    )

    assert abs(peer_scenes.fall_error(run(configuration), STEP)) < close
    np.testing.assert_allclose(pushed["x"], (1.5, 2.0, 3.0), atol=close)
    np.testing.assert_allclose(pushed["w"], (0.0, 0.0, 2.0), atol=close)


def test_a_held_step_errs_by_its_fourth_power_and_angles_of_euler_cost_it_where_they_end() -> None:
    """A body that turns about its y axis comes past the place where its three angles are two; a chosen step shortens there."""
    coarse, fine = (peer_scenes.swung(run("held-step"), h)[1] for h in (1 / 30, 1 / 60))

    assert 2.0**3.5 < coarse / fine < 2.0**6.5
    assert 1e-3 < peer_scenes.momentum_lost(run("held-step"), 1 / 60) < 1e-2
    assert peer_scenes.momentum_lost(run("merson"), 1 / 60) < 1e-7


def test_a_rod_is_a_hinge_and_a_chain_keeps_its_energy() -> None:
    long, energy = peer_scenes.swung(run("held-step"), 1 / 120)
    found, _, gained = peer_scenes.stretched_and_gained(run("merson"), 26, STEP, 1.0)

    assert (long < 1e-14, energy < 1e-6) == (True, True)
    assert (found.status, gained < 1e-6) == ("completed", True)


@pytest.mark.parametrize("configuration", SETTINGS)
def test_a_spring_swings_and_a_planet_comes_round(configuration: str) -> None:
    """Damped, of half a metre about its length of 1.5 m, and a circle of 1 m in 2 π s."""
    ball = Particle(name="b", mass=2.0, position=(2.0, 0.0, 0.0))
    spring = Spring(name="s", between=((0.0, 0.0, 0.0), "b"), stiffness=50.0, rest_length=1.5, viscosity=1.0)
    planet = Particle(name="b", mass=2.0, position=(1.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.0))
    still, end = {"gravity": (0.0, 0.0, 0.0)}, {"x": Final(quantity=Position("b"))}
    swung = Scene(bodies=(ball,), forces=(spring,), **still)  # type: ignore[arg-type]
    circled = Scene(bodies=(planet,), forces=(CentralGravity(name="sun", strength=1.0),), **still)  # type: ignore[arg-type]
    ask, pace = run(configuration), math.sqrt(25.0 - 0.25**2)

    x = ask(swung, time_step=1e-3, duration=1.0, observe=end)["x"][0]
    assert x == pytest.approx(
        1.5 + 0.5 * math.exp(-0.25) * (math.cos(pace) + 0.25 / pace * math.sin(pace)), abs=1e-6
    )
    x, y, _ = ask(circled, time_step=2e-3 * math.pi, steps=1000, observe=end)["x"]
    assert (x, y) == pytest.approx((1.0, 0.0), abs=1e-4)


@pytest.mark.parametrize("configuration", SETTINGS)
def test_bodies_start_with_the_speeds_of_the_scene(configuration: str) -> None:
    assert max(peer_scenes.started(run(configuration))) < 1e-12
    rod = Particle(name="rod", mass=1.0, position=(0.0, 0.0, -1.0), velocity=(0.7, 0.2, 0.0))
    line = Distance(name="line", between=((0.0, 0.0, 0.0), "rod"), compliance=0.0)
    found = peer_scenes.set_going(run(configuration), bodies=(rod,), joints=(line,))
    assert found[0] == pytest.approx(np.array([(0.0, 2.0, 0.0), (3.0, 0.0, 0.0), rod.velocity]), abs=1e-12)


@pytest.mark.parametrize("kind", [Ball, Hinge, Lock])
def test_what_closes_a_loop_is_projected(kind: Any) -> None:
    """A body that two joints hold rests; two rods let a weight swing as one of their height does."""
    (body,), (joint,) = (peer_scenes.hung(kind).bodies, peer_scenes.hung(kind).constraints)
    more = {"axis": joint.axis} if kind is Hinge else {}
    again = kind(name="again", between=("world", "arm"), at=(0.0, 0.0, 0.3), compliance=0.0, **more)
    held = {"v": MaximumAbsolute(quantity=Violation("again")), "x": Final(quantity=Position("arm"))}
    found = run("merson")(
        Scene(bodies=(body,), constraints=(joint, again), gravity=peer_scenes.GRAVITY),
        time_step=STEP, duration=1.0, observe=held,
    )  # fmt: skip
    assert np.max(found["v"]) < 1e-8
    assert found["x"] == pytest.approx(body.position, abs=1e-8)

    ball = Particle(name="ball", mass=1.0, position=(1.0, 0.0, -1.0))
    rods = tuple(
        Distance(name=name, between=(point, "ball"), compliance=0.0)
        for name, point in (("one", (0.0, 0.0, 0.0)), ("two", (2.0, 0.0, 0.0)))
    )
    sideways = Scene(bodies=(ball,), constraints=rods, gravity=(0.0, 1.0, -9.81))
    end = {"x": Final(quantity=Position("ball"))}
    alone = Scene(
        bodies=(Particle(name="ball", mass=1.0, position=(0.0, 0.0, -1.0)),),
        constraints=(Distance(name="r", between=((0.0, 0.0, 0.0), "ball"), compliance=0.0),),
        gravity=(0.0, 1.0, -9.81),
    )
    both, one = (run("merson")(s, time_step=0.01, duration=2.0, observe=end)["x"] for s in (sideways, alone))
    assert both - one == pytest.approx((1.0, 0.0, 0.0), abs=1e-7)


@pytest.mark.parametrize("configuration", ["merson", "defaults"])
def test_corners_stick_below_their_friction_and_slide_above(configuration: str) -> None:
    free = 0.5 * 0.2 * peer_scenes.G * 2.0**2

    assert 0.0 < peer_scenes.slid(run(configuration), 0.3) < 2e-4
    assert peer_scenes.slid(run(configuration), 0.7) == pytest.approx(free, rel=0.01)
    assert -1e-4 < peer_scenes.sunk(run(configuration)) < 1e-12


@pytest.mark.parametrize("configuration", ["merson", "defaults", "cpodes"])
def test_a_ball_sinks_as_hertz_says_and_two_carry_each_other(configuration: str) -> None:
    """As stiff as a heavy ball of that size needs to sink by 1e-4 of its radius: 5e-5 m, and two on one by 2^2/3 of it."""
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    balls = tuple(
        RigidBody(name=f"{k}", mass=1.0, shape=Sphere(0.5), position=(0.0, 0.0, 0.5 + k)) for k in range(2)
    )
    seen = {"x": Final(quantity=Position()), "f": Final(quantity=ContactForce("ground"))}
    found = run(configuration)(
        Scene(bodies=(ground, *balls), gravity=peer_scenes.GRAVITY),
        time_step=STEP,
        duration=2.0,
        observe=seen,
    )

    close = 0.3 if configuration == "defaults" else 2e-3
    assert peer_scenes.sunk(run(configuration), Sphere(0.5)) == pytest.approx(-5e-5, rel=close)
    assert found["f"] == pytest.approx((0.0, 0.0, -2.0 * peer_scenes.G), rel=close, abs=1e-6)
    assert found["x"][1, 2] - 0.5 == pytest.approx(-5e-5 * 2.0 ** (2.0 / 3.0), rel=close)


def test_a_ball_rolls_and_the_ground_carries_a_box_and_its_pull() -> None:
    pushed = {"f": Final(quantity=ContactForce("ground"))}
    found = run("merson")(peer_scenes.box_on_ground(0.3), time_step=STEP, duration=1.0, observe=pushed)
    assert found["f"] == pytest.approx((0.3 * peer_scenes.G, 0.0, -peer_scenes.G), rel=1e-3, abs=1e-6)

    flat, cube = peer_scenes.box_on_ground(0.3).bodies
    ball = RigidBody(
        name="ball", mass=1.0, shape=Sphere(0.5), position=(0.0, 0.0, 0.5), material=flat.material
    )  # type: ignore[union-attr]
    down = Scene(bodies=(flat, ball), gravity=(0.3 * peer_scenes.G, 0.0, -peer_scenes.G))
    end = {"x": Final(quantity=Position("ball"))}
    rolled = run("cpodes")(down, time_step=STEP, duration=2.0, observe=end)["x"][0]
    assert rolled == pytest.approx(0.5 * 0.3 * peer_scenes.G / 1.4 * 2.0**2, rel=1e-3)
    assert isinstance(cube.shape, Box)  # type: ignore[union-attr]


def test_what_it_cannot_answer_is_an_outcome_with_its_reason() -> None:
    late = run("merson")(peer_scenes.chain(26), time_step=STEP, duration=100.0, time_limit=0.1)
    assert (late.status, late.failure[:23]) == ("timed_out", "the time limit of 0.1 s")
    stuck = run("cpodes")(loaded_rods.scene(), time_step=STEP, steps=10)
    assert (stuck.status, stuck.failure[:14]) == ("diverged", "std::exception")
    ring = run("merson")(
        lock_ring.scene(12), time_step=STEP, steps=10
    )  # turns once too often for its projection
    assert (ring.status, "initialize" in ring.failure) == ("diverged", True)

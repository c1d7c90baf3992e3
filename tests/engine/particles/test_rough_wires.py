"""Wires that rub where they bend and wind on drums, against Euler and Eytelwein's law and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Box,
    ConstraintForce,
    Final,
    Hinge,
    MaximumAbsolute,
    Method,
    MethodError,
    Motor,
    Particle,
    Plane,
    Position,
    RigidBody,
    Scene,
    SceneError,
    Sphere,
    Velocity,
    Wire,
    simulate,
)
from tests.scenes.coupling import H, Y, masses
from tests.scenes.seen import finals, traces

GRAVITY = 10.0  # m/s²


def hung(
    one: float, two: float, eyes: int = 1, friction: Any = 0.2, turns: Any = 0.0, compliance: float = 0.0
) -> Scene:
    """Two weights over `eyes` points in a row, which bend the wire by π in all."""
    xs = np.linspace(-1.0, 1.0, eyes) if eyes > 1 else np.zeros(1)
    ends = {"one": (float(xs[0]), 0.0, 0.0), "two": (float(xs[-1]), 0.0, -1.0)}
    through = (("one", ends["one"]), *((WORLD, (float(x), 0.0, 5.0)) for x in xs), ("two", ends["two"]))
    wire = Wire(name="wire", through=through, friction=friction, turns=turns, compliance=compliance)
    weights = (
        Particle(name="one", mass=one, position=ends["one"]),
        Particle(name="two", mass=two, position=ends["two"]),
    )
    return Scene(bodies=weights, constraints=(wire,), gravity=(0.0, 0.0, -GRAVITY))


@pytest.mark.parametrize(
    ("one", "two", "eyes", "friction", "turns"),
    [
        (3.0, 1.0, 1, 0.2, 0.0),
        (1.0, 3.0, 1, 0.2, 0.0),  # the other way round
        (9.6, 1.0, 3, 0.2, 0.0),  # half a quarter here and there: no bend in the middle eye
        (1.0, 300.0, 1, 0.5, 1.0),  # and a whole turn
        (1.0, 200.0, 2, 0.25, 0.5),
        (5.0, 1.0, 2, (0.3, 0.1), (0.0, 0.25)),
    ],
)
def test_a_wire_that_slips_pulls_e_to_the_mu_phi_times_as_hard_behind(
    one: float, two: float, eyes: int, friction: Any, turns: Any
) -> None:
    observe = traces(v=Velocity("two"), pull=ConstraintForce("wire"))
    result = simulate(hung(one, two, eyes, friction, turns), time_step=H, steps=20, observe=observe)
    bends = [math.pi] if eyes == 1 else [0.5 * math.pi, *[0.0] * (eyes - 2), 0.5 * math.pi]
    each = [value if isinstance(value, tuple) else (value,) * eyes for value in (friction, turns)]
    ratio = math.exp(sum(m * (b + 2 * math.pi * t) for m, t, b in zip(*each, bends, strict=True)))
    heavy, light = max(one, two), min(one, two)
    falls = (heavy - ratio * light) * GRAVITY / (heavy + ratio * light)
    pull = one * (GRAVITY + (falls if one < two else -falls))

    assert falls > 0.0
    sign = 1.0 if one > two else -1.0
    np.testing.assert_allclose(result["v"][:, 2], sign * falls * H * np.arange(21), rtol=0, atol=1e-9)
    np.testing.assert_allclose(result["pull"][1:], pull, rtol=1e-9)


@pytest.mark.parametrize(("over", "holds"), [(0.999, True), (1.001, False)])
@pytest.mark.parametrize("heavier", ["one", "two"])
def test_it_holds_up_to_that(over: float, holds: bool, heavier: str) -> None:
    heavy = over * math.exp(0.4 * 3.0 * math.pi)
    one, two = (heavy, 1.0) if heavier == "one" else (1.0, heavy)
    observe = finals(v=Velocity("one"))
    result = simulate(hung(one, two, friction=0.4, turns=1.0), time_step=H, steps=20, observe=observe)

    slid = abs(float(result["v"][2]))
    assert slid < 1e-9 if holds else slid > 1e-4


def test_without_friction_nothing_of_it_is_there() -> None:
    smooth, observe = masses(), traces(v=Velocity())
    rough = replace(smooth, constraints=(replace(smooth.constraints[0], friction=0.0, turns=2.0),))
    results = [simulate(scene, time_step=H, steps=10, observe=observe) for scene in (smooth, rough)]

    assert results[0]["v"].tobytes() == results[1]["v"].tobytes()


def test_a_body_that_hangs_in_the_bight_is_held_by_both_sides() -> None:
    """A ring on a rope between two fixed ends stays where friction is enough, and slides where it is not."""
    ring = Particle(name="ring", mass=1.0, position=(1.0, 0.0, 0.0))
    slope = 1.2  # rad, up to the left; it goes on to the right at a smaller one
    rope = Wire(
        name="rope",
        through=(
            (WORLD, (1.0 - 3.0 * math.cos(slope), 0.0, 3.0 * math.sin(slope))),
            ("ring", (1.0, 0.0, 0.0)),
            (WORLD, (5.0, 0.0, 1.0)),
        ),
        compliance=0.0,
        friction=5.0,
    )
    scene = Scene(bodies=(ring,), constraints=(rope,), gravity=(0.0, 0.0, -GRAVITY))
    held = simulate(scene, time_step=H, steps=20, observe=finals(v=Velocity("ring")))
    free = simulate(
        replace(scene, constraints=(replace(rope, friction=0.1),)),
        time_step=H,
        steps=20,
        observe=finals(v=Velocity("ring")),
    )

    assert float(np.abs(held["v"]).max()) < 1e-9
    assert float(np.abs(free["v"]).max()) > 0.1


@pytest.mark.parametrize("compliance", [0.0, 1e-6])
def test_iterations_and_contacts_come_to_the_same_a_step_late(compliance: float) -> None:
    scene = hung(3.0, 1.0, compliance=compliance)
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, -9.0))
    block = RigidBody(name="block", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(9.0, 0.0, -8.5))
    touching = replace(scene, bodies=(*scene.bodies, ground, block))
    falls = (3.0 - math.exp(0.2 * math.pi)) * GRAVITY / (3.0 + math.exp(0.2 * math.pi))
    for asked, method in (
        (touching, Method()),
        (scene, Method(solver="iterative", iterations=2000, residual_tolerance=1e-13)),
    ):
        observe = traces(v=Velocity("two"))
        result = simulate(asked, time_step=H, steps=40, method=method, observe=observe)

        assert result.completed
        np.testing.assert_allclose(np.diff(result["v"][25:, 2]) / H, falls, rtol=1e-5)


def test_a_weight_in_a_wall_is_separated_from_it_and_its_wire_pulls_as_before() -> None:
    """Positions that part overlaps leave rows alone that hold no place: friction is no lock."""
    ball = RigidBody(name="one", mass=1.0, shape=Sphere(0.1), position=(0.0, 0.0, 0.0))
    wall = RigidBody(name="wall", motion="static", shape=Box((1.0, 9.0, 9.0)), position=(0.59, 0.0, 0.0))
    given = hung(1.0, 1.0)
    scene = replace(given, bodies=(ball, given.bodies[1], wall))
    observe = {
        "x": Final(quantity=Position("one")),
        "v": MaximumAbsolute(quantity=Velocity()),
        "pull": Final(quantity=ConstraintForce("wire")),
    }
    result = simulate(scene, time_step=H, steps=100, observe=observe)

    assert result.completed
    assert float(result["x"][0]) == pytest.approx(-0.01, abs=1e-4)
    assert float(result["v"].max()) < 0.05
    assert float(result["pull"]) == pytest.approx(10.0, rel=0.01)


def winch(**changes: Any) -> Scene:
    """A drum of .2 m with a motor and 10 kg on its wire."""
    drive: Any = {"speed": 2.0} | changes
    drum = RigidBody(name="drum", mass=4.0, inertia=(0.08, 0.08, 0.08), position=(0.0, 0.0, 5.0))
    load = Particle(name="load", mass=10.0, position=(0.2, 0.0, 0.0))
    axle = Hinge(name="axle", between=(WORLD, "drum"), axis=Y, compliance=0.0, motor=Motor(**drive))
    wire = Wire(
        name="wire",
        through=(("load", (0.2, 0.0, 0.0)), (WORLD, (0.2, 0.0, 5.0))),
        wound=(("axle", 0.2),),
        compliance=0.0,
    )
    return Scene(bodies=(drum, load), constraints=(axle, wire), gravity=(0.0, 0.0, -GRAVITY))


def test_a_winch_lifts_with_radius_times_speed_and_stalls_where_its_torque_ends() -> None:
    observe = finals(v=Velocity("load"), pull=ConstraintForce("wire"), x=Position("load"))
    lifts = simulate(winch(), time_step=H, steps=100, observe=observe)
    stalls = simulate(winch(max_force=20.0), time_step=H, steps=100, observe=observe)
    weak = simulate(winch(max_force=15.0), time_step=H, steps=100, observe=observe)

    assert float(lifts["v"][2]) == pytest.approx(0.2 * 2.0, abs=1e-9)
    assert float(lifts["pull"]) == pytest.approx(100.0, abs=1e-8)
    assert float(stalls["v"][2]) == pytest.approx(0.0, abs=1e-9)  # 20 N m hold 100 N at .2 m, and no more
    # (m g r − τ)/(m r + I/r) downwards
    sinks = (10.0 * GRAVITY * 0.2 - 15.0) / (10.0 * 0.2 + 0.08 / 0.2)
    assert float(weak["v"][2]) == pytest.approx(-sinks * 1.0, rel=1e-8)


def test_what_a_scene_or_a_method_cannot_do_with_it_is_refused() -> None:
    scene = winch()
    with pytest.raises(SceneError, match="there is no hinge named 'wire'; there is 'axle'"):
        replace(
            scene, constraints=(scene.constraints[0], replace(scene.constraints[1], wound=(("wire", 1.0),)))
        )
    taut = hung(1.0, 2.0)
    taut = replace(taut, constraints=(replace(taut.constraints[0], slack=False),))
    with pytest.raises(MethodError, match="'wire' has a wire with friction"):
        simulate(taut, time_step=H, steps=1, method=Method(half_step_velocities=True))

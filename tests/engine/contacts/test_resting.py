"""Rest on contacts: depth and loads against statics, for every shape and any ratio of masses."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pytest
from scipy.optimize import nnls

from spook_tracker.engine import (
    WORLD,
    Box,
    Capsule,
    Compound,
    ContactCount,
    ContactForce,
    Energy,
    Final,
    Load,
    Lock,
    Material,
    MaximumAbsolute,
    Method,
    Motor,
    Part,
    Penetration,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    simulate,
)
from spook_tracker.engine.joints import Constraint
from tests.scenes.contact import DOWN, GRAVITY, TIME_STEP, ball, cube, ground
from tests.scenes.corpus import fixed, solid
from tests.scenes.seen import finals, traces


@pytest.mark.parametrize("time_step", [1 / 240, 1 / 60])
@pytest.mark.parametrize("relaxation", [0.5, 2.0, 4.5])
def test_resting_depth_is_compliance_times_load(time_step: float, relaxation: float) -> None:
    """Whatever time step and damping: g = −eps m g/n, and the contact forces sum to the weight."""
    eps, mass = 1e-4, 3.0
    soft = Material(compliance=eps, damping=relaxation * time_step)
    box = cube("box", (0, 0, 0.5), mass=mass, material=soft)
    stiff = Material(damping=relaxation * time_step)
    result = simulate(
        Scene(bodies=(ground(stiff), box), gravity=DOWN),
        time_step=time_step,
        duration=12.0,
        observe=finals(
            z=Position("box"), force=ContactForce("box"), depth=Penetration(), count=ContactCount()
        ),
    )

    assert result["z"][2] - 0.5 == pytest.approx(-eps * mass * GRAVITY / 4.0, abs=1e-12)
    assert result["depth"] == pytest.approx(eps * mass * GRAVITY / 4.0, abs=1e-12)
    assert result["count"] == 4
    np.testing.assert_allclose(result["force"], (0, 0, mass * GRAVITY), rtol=0, atol=1e-8)


def test_feet_share_a_load_as_statics_says() -> None:
    """A slab on rigid balls, loaded off centre: the shares of least norm, by non-negative least squares."""
    feet = [(-0.8, -0.6), (0.7, -0.5), (0.6, 0.7), (-0.5, 0.6), (0.1, 0.05)]
    torque = (1.5, -2.0, 0.0)
    bodies = [RigidBody(name="slab", position=(0, 0, 0.05), mass=2.0, shape=Box((2, 2, 0.1)))]
    bodies += [
        RigidBody(name=f"foot{k}", position=(x, y, -0.3), shape=Sphere(0.3), motion="static")
        for k, (x, y) in enumerate(feet)
    ]
    scene = Scene(
        bodies=tuple(bodies), gravity=DOWN, forces=(Load(name="couple", body="slab", torque=torque),)
    )
    result = simulate(
        scene,
        time_step=TIME_STEP,
        steps=200,
        observe={f"f{k}": Final(quantity=ContactForce("slab", f"foot{k}")) for k in range(len(feet))},
    )

    # Balance of force and both moments; a touch of ridge picks the least norm, weighted like the engine's relief
    # by each foot's own inverse mass.
    inertia = 2.0 * (4.0 + 0.01) / 12.0
    weight = np.array([math.sqrt(1 / 2.0 + (x * x + y * y) / inertia) for x, y in feet])
    balance = np.array([[1.0, y, -x] for x, y in feet]).T
    right = np.array([2.0 * GRAVITY, -torque[0], -torque[1]])
    ridge = 1e-6
    reference, _ = nnls(
        np.vstack((balance, ridge * np.diag(weight))), np.concatenate((right, np.zeros(len(feet))))
    )
    assert np.all(reference > 0.1)
    forces = np.array([result[f"f{k}"][2] for k in range(len(feet))])
    np.testing.assert_allclose(forces, reference, rtol=0, atol=1e-6)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_every_contact_of_a_stack_carries_what_stands_on_it(friction: float) -> None:
    """Twenty boxes: contact i carries (N − i + 1) m g to 1e-9, nothing moves, and no energy is gained in 10 s."""
    count, mass, rough = 20, 2.0, Material(friction=friction)
    bodies = [ground(rough)]
    bodies += [cube(f"box{k}", (0, 0, 0.5 + k), mass=mass, material=rough) for k in range(count)]
    below = ["ground", *(f"box{k}" for k in range(count))]
    result = simulate(
        Scene(bodies=tuple(bodies), gravity=DOWN),
        time_step=TIME_STEP,
        duration=10.0,
        observe={f"f{k}": Trace(quantity=ContactForce(f"box{k}", below[k]), first=1) for k in range(count)}
        | {
            "energy": Trace(quantity=Energy()),
            "moved": MaximumAbsolute(quantity=Position(), from_start=True),
        },
    )

    for k in range(count):
        load = (count - k) * mass * GRAVITY
        assert np.abs(result[f"f{k}"][:, 2] / load - 1.0).max() < 1e-9
    assert result["moved"].max() < 1e-9
    assert (result["energy"] - result["energy"][0]).max() < 1e-9


@pytest.mark.parametrize(
    ("shape", "ratio", "loads", "moved"),
    [(Sphere(0.5), ratio, 1e-12, 1e-11) for ratio in (1e3, 1e6, 1e9, 1e12)]
    + [
        (Box((1, 1, 1)), ratio, 1e-9, 1e-3) for ratio in (1e6, 1e9)
    ],  # rounding alone holds faces without friction
    ids=str,
)
def test_a_heavy_body_rests_on_a_light_one(
    shape: Sphere | Box, ratio: float, loads: float, moved: float
) -> None:
    """Whatever the ratio of masses, both contacts carry what stands on them and nothing sinks."""
    bodies = (ground(), ball("light", 0.5, shape=shape), ball("heavy", 1.5, mass=ratio, shape=shape))
    result = simulate(
        Scene(bodies=bodies, gravity=DOWN),
        time_step=TIME_STEP,
        duration=3.0,
        observe={
            "low": Trace(quantity=ContactForce("light", "ground"), first=1),
            "high": Trace(quantity=ContactForce("heavy", "light"), first=1),
            "z": Final(quantity=Position()),
        },
    )

    np.testing.assert_allclose(result["low"][:, 2], (1.0 + ratio) * GRAVITY, rtol=loads)
    np.testing.assert_allclose(result["high"][:, 2], ratio * GRAVITY, rtol=loads)
    np.testing.assert_allclose(result["z"][1:, 2], (0.5, 1.5), rtol=0, atol=moved)


@pytest.mark.parametrize("pile", ["balls", "cylinders", "boxes"])
def test_a_beam_of_locked_boxes_rests_on_its_piles(pile: str) -> None:
    """Eighty boxes on one, two or four frictionless points at each end: straight to 1e-12 % of the length."""
    count, width = 80, 0.125
    half = width * (count - 1) / 2
    shape, turn = {
        "balls": (Sphere(0.5), (1.0, 0.0, 0.0, 0.0)),
        "cylinders": (Capsule(0.5, 0.1), (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)),
        "boxes": (Box((width, 0.1, 1.0)), (1.0, 0.0, 0.0, 0.0)),
    }[pile]
    boxes = [solid(f"box{k}", Box((width, 0.1, 0.1)), (width * k - half, 0, 0.05), 2.5) for k in range(count)]
    piles = [
        RigidBody(name=name, position=(x, 0, -0.5), shape=shape, orientation=turn, motion="static")
        for name, x in (("left", -half), ("right", half))
    ]
    locks = [
        Lock(
            name=f"lock{k}",
            between=(f"box{k}", f"box{k + 1}"),
            at=(width * (k + 0.5) - half, 0, 0.05),
            compliance=0.0,
        )
        for k in range(count - 1)
    ]
    result = simulate(
        Scene(bodies=(*boxes, *piles), constraints=tuple(locks), gravity=DOWN),
        time_step=TIME_STEP,
        steps=300,
        observe={
            "x": Trace(quantity=Position(), first=1, from_start=True),
            "left": Final(quantity=ContactForce("left")),
        },
    )

    assert 100.0 * np.abs(result["x"][:, :count, 2]).max() / (count * width) < 1e-12
    assert result["left"][2] == pytest.approx(-count * 2.5 * GRAVITY / 2.0, rel=1e-10)


def test_every_shape_rests_on_every_other() -> None:
    """Each pair of shapes, the upper one free to move along z only by symmetry: it rests where geometry says."""
    lying = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)  # z along x
    shapes = {
        "sphere": (Sphere(0.5), (1.0, 0, 0, 0), 0.5, 0.5),
        "box": (Box((2, 2, 1)), (1.0, 0, 0, 0), 0.5, 0.5),
        "capsule": (Capsule(0.25, 1.0), lying, 0.25, 0.25),
        "compound": (
            Compound(
                (
                    Part(shape=Box((2, 2, 0.5)), position=(0, 0, 0.25)),
                    Part(shape=Sphere(0.5), position=(0, 0, 0.0)),
                )
            ),
            (1.0, 0, 0, 0),
            0.5,
            0.5,
        ),
    }
    for below, (low_shape, low_turn, top, _) in shapes.items():
        for above, (high_shape, high_turn, _, bottom) in shapes.items():
            lower = fixed("lower", low_shape, (0, 0, 0), orientation=low_turn)
            upper = solid(
                "upper", high_shape, (0, 0, top + bottom + 0.05), inertia=(1, 1, 1), orientation=high_turn
            )
            result = simulate(
                Scene(bodies=(lower, upper), gravity=DOWN),
                time_step=TIME_STEP,
                steps=40,
                observe=finals(x=Position("upper"), f=ContactForce("upper", "lower")),
            )

            assert result["x"] == pytest.approx((0, 0, top + bottom), abs=1e-9), (below, above)
            assert result["f"] == pytest.approx((0, 0, GRAVITY), abs=1e-7), (below, above)


def test_a_lift_carries_its_load() -> None:
    """On a kinematic platform that rises steadily the load rises with it, pressed by its weight."""
    lift = solid("lift", Box((2, 2, 1)), (0, 0, -0.5), None, (0, 0, 0.7), motion="kinematic")
    result = simulate(
        Scene(bodies=(lift, cube("load", (0, 0, 0.5))), gravity=DOWN),
        time_step=TIME_STEP,
        duration=2.0,
        observe=finals(v=Velocity("load"), z=Position("load"), f=ContactForce("load")),
    )

    assert result["v"][2] == pytest.approx(0.7, abs=1e-10)
    assert result["z"][2] == pytest.approx(0.5 + 1.4, abs=1e-9)
    assert result["f"][2] == pytest.approx(GRAVITY, abs=1e-7)


# Overlap ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("gap", [1e-8, 1e-6, 1e-3])
@pytest.mark.parametrize("held", ["free", "rail", "lock"])
def test_what_joints_hold_lands_as_what_is_free(
    held: str, gap: float, solver: Literal["direct", "iterative"]
) -> None:
    """From a hair above the floor: the gap closes in a step, no more, though only the weight brings it there."""
    box, above = cube("box", (0, 0, 0.5 + gap)), cube("above", (0, 0, 1.5 + gap))
    joints: dict[str, Constraint] = {
        "rail": Prismatic(name="rail", between=(WORLD, "box"), axis=(0, 0, 1), compliance=0.0),
        "lock": Lock(name="lock", between=("box", "above"), at=(0, 0, 1.0 + gap), compliance=0.0),
    }
    result = simulate(
        Scene(
            bodies=(ground(), box, above) if held == "lock" else (ground(), box),
            constraints=(joints[held],) if held in joints else (),
            gravity=DOWN,
            no_contact=(("box", "above"),) if held == "lock" else (),
        ),
        time_step=TIME_STEP,
        steps=40,
        method=Method(solver=solver, iterations=400),
        observe=traces(z=Position("box")) | finals(force=ContactForce("box")),
    )

    assert float(result["z"][:, 2].min()) == pytest.approx(0.5, abs=1e-9)
    np.testing.assert_allclose(
        result["force"], (0, 0, 2.0 * GRAVITY if held == "lock" else GRAVITY), atol=1e-5
    )


@pytest.mark.parametrize("driven", [False, True])
def test_a_load_presses_a_slide_to_a_wall_in_the_step_it_begins(driven: bool) -> None:
    """At rest a hair from it, pushed sideways by a force, or by a drive."""
    push = Load(name="push", body="slide", force=(20.0, 0.0, 0.0))
    motor = Motor(speed=1.0, max_force=20.0) if driven else None
    rail = Prismatic(name="rail", between=(WORLD, "slide"), axis=(1, 0, 0), compliance=0.0, motor=motor)
    wall = RigidBody(name="wall", motion="static", shape=Box((0.1, 1, 1)), position=(0.55 + 1e-6, 0, 0))
    result = simulate(
        Scene(
            bodies=(wall, cube("slide", (0, 0, 0), mass=2.0)),
            constraints=(rail,),
            forces=() if driven else (push,),
        ),
        time_step=TIME_STEP,
        steps=10,
        observe=traces(x=Position("slide")) | finals(force=ContactForce("slide")),
    )

    assert float(result["x"][:, 0].max()) == pytest.approx(1e-6, abs=1e-12)
    assert result["force"][0] == pytest.approx(-20.0, abs=1e-8)

"""Contacts: impact, rest, overlap, stacks, piles, against closed forms and statics."""

from __future__ import annotations

import math

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
    Distance,
    Energy,
    Final,
    KineticEnergy,
    Load,
    Lock,
    Material,
    Maximum,
    Method,
    Momentum,
    Orientation,
    Part,
    Penetration,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    explain,
    simulate,
)

TIME_STEP = 1.0 / 60.0  # s
GRAVITY = 9.81  # m/s²
DOWN = (0.0, 0.0, -GRAVITY)
SMOOTH = Material()


def ground(material: Material = SMOOTH) -> RigidBody:
    return RigidBody(name="ground", position=(0, 0, 0), shape=Plane(), motion="static", material=material)


def ball(name: str = "ball", height: float = 0.5, material: Material = SMOOTH, **fields: object) -> RigidBody:
    given = {"position": (0.0, 0.0, height), "mass": 1.0, "shape": Sphere(0.5), "material": material} | fields
    return RigidBody(name=name, **given)  # type: ignore[arg-type]


def cube(name: str, position: tuple[float, float, float], **fields: object) -> RigidBody:
    return RigidBody(name=name, position=position, **({"mass": 1.0, "shape": Box((1, 1, 1))} | fields))  # type: ignore[arg-type]


# Impact -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("psi", [0.0, 0.25, 0.5, 1.0])
@pytest.mark.parametrize("solver", ["direct", "iterative", "hybrid"])
def test_one_contact_returns_psi_times_the_approach(psi: float, solver: str) -> None:
    """Without gravity, touching at the start: v₊ = −psi v₋ along the normal, unchanged across it."""
    scene = Scene(
        bodies=(ground(Material(restitution=psi)), ball(velocity=(0.3, -0.2, -4.0))),
    )
    result = simulate(
        scene,
        time_step=TIME_STEP,
        steps=1,
        method=Method(solver=solver),
        observe={"v": Final(quantity=Velocity("ball"))},
    )

    np.testing.assert_allclose(result["v"], (0.3, -0.2, 4.0 * psi), rtol=0, atol=1e-14)


def test_two_free_balls_exchange_momentum_and_keep_their_energy() -> None:
    """A central elastic collision: velocities by the two conservation laws, total momentum to rounding."""
    light = ball(
        "light", position=(0, 0, 0), velocity=(2.0, 0, 0), mass=1.0, material=Material(restitution=1.0)
    )
    heavy = ball("heavy", position=(1.5, 0, 0), mass=3.0)
    result = simulate(
        Scene(bodies=(light, heavy)),
        time_step=TIME_STEP,
        duration=1.0,
        observe={
            "v": Final(quantity=Velocity()),
            "p": Trace(quantity=Momentum()),
            "e": Final(quantity=KineticEnergy()),
        },
    )

    assert result["v"][0, 0] == pytest.approx(2.0 * (1 - 3) / (1 + 3), abs=1e-13)
    assert result["v"][1, 0] == pytest.approx(2.0 * 2 / (1 + 3), abs=1e-13)
    assert np.abs(result["p"] - result["p"][0]).max() < 1e-13
    assert result["e"] == pytest.approx(2.0, abs=1e-12)


def test_a_jointed_body_takes_part_in_the_impact() -> None:
    """A rod pinned at one end, struck at the other: nothing but its moment of inertia about the pin resists."""
    rod = RigidBody(name="rod", position=(0.5, 0, 0), mass=2.0, shape=Box((1.0, 0.1, 0.1)))
    hammer = RigidBody(
        name="hammer",
        position=(0.9, 0, 0.1),
        mass=0.5,
        shape=Sphere(0.05),
        velocity=(0, 0, -3.0),
        material=Material(restitution=1.0),
    )
    pin = Lock(name="pin", between=(WORLD, "rod"), at=(0, 0, 0), compliance=(0, 0, 0, 1e9, 1e9, 1e9))
    result = simulate(
        Scene(bodies=(rod, hammer), constraints=(pin,)),
        time_step=TIME_STEP,
        steps=1,
        observe={"v": Final(quantity=Velocity("hammer"))},
    )

    about_pin = 2.0 * (1.0**2 + 0.1**2) / 12.0 + 2.0 * 0.5**2
    effective = 1.0 / (1.0 / 0.5 + 0.9**2 / about_pin)  # reduced mass at the point struck
    assert result["v"][2] == pytest.approx(-3.0 + 2.0 * effective * 3.0 / 0.5, abs=1e-6)


def test_bounces_reach_e_to_the_2n_of_the_height_at_first_order() -> None:
    """Heights h0 e^{2n} and stop time t0 (1 + e)/(1 − e), both with an error proportional to the time step."""
    e, height = 0.5, 1.0
    material = Material(restitution=e)
    scene = Scene(bodies=(ground(material), ball(height=0.5 + height, material=material)), gravity=DOWN)
    errors = []
    for time_step in (1e-3, 2.5e-4):
        result = simulate(
            scene,
            time_step=time_step,
            duration=2.0,
            observe={"z": Trace(quantity=Position("ball")), "v": Trace(quantity=Velocity("ball"))},
        )
        z, v = result["z"][:, 2] - 0.5, result["v"][:, 2]
        tops = np.flatnonzero((v[1:] <= 0.0) & (v[:-1] > 0.0))
        expected = height * e ** (2.0 * np.arange(1, 4))
        errors.append(np.abs(z[tops[:3]] - expected).max())
        moving = np.flatnonzero(np.abs(v) > 1e-9)
        stop = math.sqrt(2.0 * height / GRAVITY) * (1.0 + e) / (1.0 - e)
        assert moving[-1] * time_step == pytest.approx(stop, abs=40.0 * time_step)
        assert z.min() > -1e-12

    assert errors[0] < 4e-3
    assert errors[1] < 0.35 * errors[0]


def test_a_fast_body_neither_enters_nor_rebounds() -> None:
    """Three metres per step onto a wall of 2 cm: it stops at the surface, exactly, with no speed left."""
    wall = RigidBody(name="wall", position=(0, 0, 0), shape=Box((4, 4, 0.02)), motion="static")
    result = simulate(
        Scene(bodies=(wall, ball(height=3.0, velocity=(0, 0, -180.0)))),
        time_step=TIME_STEP,
        steps=30,
        observe={
            "z": Trace(quantity=Position("ball")),
            "depth": Maximum(quantity=Penetration()),
            "v": Trace(quantity=Velocity("ball")),
        },
    )

    assert result["z"][:, 2].min() == pytest.approx(0.51, abs=1e-13)
    assert result["depth"] < 1e-13
    assert np.abs(result["v"][3:, 2]).max() < 1e-12


# Rest -------------------------------------------------------------------------------------------------------


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
        observe={
            "z": Final(quantity=Position("box")),
            "force": Final(quantity=ContactForce("box")),
            "depth": Final(quantity=Penetration()),
            "count": Final(quantity=ContactCount()),
        },
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


def test_every_contact_of_a_stack_carries_what_stands_on_it() -> None:
    """Twenty boxes: contact i carries (N − i + 1) m g to 1e-9, and no energy is gained in 10 s."""
    count, mass = 20, 2.0
    bodies = [ground(Material(friction=0.5))]
    bodies += [
        cube(f"box{k}", (0, 0, 0.5 + k), mass=mass, material=Material(friction=0.5)) for k in range(count)
    ]
    below = ["ground", *(f"box{k}" for k in range(count))]
    result = simulate(
        Scene(bodies=tuple(bodies), gravity=DOWN),
        time_step=TIME_STEP,
        duration=10.0,
        observe={f"f{k}": Trace(quantity=ContactForce(f"box{k}", below[k]), first=1) for k in range(count)}
        | {"energy": Trace(quantity=Energy())},
    )

    for k in range(count):
        load = (count - k) * mass * GRAVITY
        assert np.abs(result[f"f{k}"][:, 2] / load - 1.0).max() < 1e-9
    assert (result["energy"] - result["energy"][0]).max() < 1e-9


@pytest.mark.parametrize("ratio", [1e3, 1e6, 1e9, 1e12])
def test_a_heavy_ball_rests_on_a_light_one(ratio: float) -> None:
    """Whatever the ratio of masses, both contacts carry what stands on them and nothing sinks."""
    bodies = (ground(), ball("light", 0.5), ball("heavy", 1.5, mass=ratio))
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

    np.testing.assert_allclose(result["low"][:, 2], (1.0 + ratio) * GRAVITY, rtol=1e-12)
    np.testing.assert_allclose(result["high"][:, 2], ratio * GRAVITY, rtol=1e-12)
    np.testing.assert_allclose(result["z"][1:, 2], (0.5, 1.5), rtol=0, atol=1e-11)


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
    boxes = [
        RigidBody(
            name=f"box{k}", position=(width * k - half, 0, 0.05), mass=2.5, shape=Box((width, 0.1, 0.1))
        )
        for k in range(count)
    ]
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
            lower = RigidBody(
                name="lower", position=(0, 0, 0), shape=low_shape, orientation=low_turn, motion="static"
            )
            upper = RigidBody(
                name="upper",
                position=(0, 0, top + bottom + 0.05),
                mass=1.0,
                inertia=(1, 1, 1),
                shape=high_shape,
                orientation=high_turn,
            )
            result = simulate(
                Scene(bodies=(lower, upper), gravity=DOWN),
                time_step=TIME_STEP,
                steps=40,
                observe={
                    "x": Final(quantity=Position("upper")),
                    "f": Final(quantity=ContactForce("upper", "lower")),
                },
            )

            assert result["x"] == pytest.approx((0, 0, top + bottom), abs=1e-9), (below, above)
            assert result["f"] == pytest.approx((0, 0, GRAVITY), abs=1e-7), (below, above)


def test_a_lift_carries_its_load() -> None:
    """On a kinematic platform that rises steadily the load rises with it, pressed by its weight."""
    lift = RigidBody(
        name="lift", position=(0, 0, -0.5), shape=Box((2, 2, 1)), motion="kinematic", velocity=(0, 0, 0.7)
    )
    result = simulate(
        Scene(bodies=(lift, cube("load", (0, 0, 0.5))), gravity=DOWN),
        time_step=TIME_STEP,
        duration=2.0,
        observe={
            "v": Final(quantity=Velocity("load")),
            "z": Final(quantity=Position("load")),
            "f": Final(quantity=ContactForce("load")),
        },
    )

    assert result["v"][2] == pytest.approx(0.7, abs=1e-10)
    assert result["z"][2] == pytest.approx(0.5 + 1.4, abs=1e-9)
    assert result["f"][2] == pytest.approx(GRAVITY, abs=1e-7)


# Overlap ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("depth", [1e-3, 0.1, 0.4])
def test_overlapping_bodies_part_without_being_launched(depth: float) -> None:
    """Two balls, free in space, start `depth` inside each other: they part and stay at rest."""
    result = simulate(
        Scene(bodies=(ball("low", 0.0), ball("high", 1.0 - depth))),
        time_step=TIME_STEP,
        duration=5.0,
        observe={
            "x": Final(quantity=Position()),
            "v": Trace(quantity=Velocity()),
            "e": Maximum(quantity=KineticEnergy()),
        },
    )

    assert result["x"][1, 2] - result["x"][0, 2] == pytest.approx(1.0, abs=1e-7)
    assert result["e"] < 1e-15
    assert abs(result["x"][:, 2].sum() - (1.0 - depth)) < 1e-12  # the centre of mass stays


def test_a_box_sunk_into_the_ground_rises_and_rests() -> None:
    result = simulate(
        Scene(bodies=(ground(), cube("box", (0, 0, 0.2)), cube("lid", (0.1, 0, 1.0))), gravity=DOWN),
        time_step=TIME_STEP,
        duration=5.0,
        observe={
            "x": Final(quantity=Position()),
            "v": Trace(quantity=Velocity()),
            "e": Maximum(quantity=KineticEnergy()),
        },
    )

    assert result["x"][1, 2] == pytest.approx(0.5, abs=1e-6)
    assert result["x"][2, 2] == pytest.approx(1.5, abs=1e-6)
    assert result["e"] < 1e-9


# Who touches whom -------------------------------------------------------------------------------------------


def test_collision_is_left_out_when_nothing_can_touch() -> None:
    falling = ball(height=5.0)
    scenes = {
        "alone": Scene(bodies=(falling,), gravity=DOWN),
        "contacts off": Scene(bodies=(ground(), falling), gravity=DOWN, contacts=False),
        "listed": Scene(bodies=(ground(), falling), gravity=DOWN, no_contact=(("ball", "ground"),)),
        "tied": Scene(
            bodies=(ground(), falling),
            gravity=DOWN,
            constraints=(Lock(name="lock", between=("ground", "ball")),),
        ),
    }
    for name, scene in scenes.items():
        kept = {choice.stage for choice in explain(scene, time_step=TIME_STEP, observe={}) if choice.kept}
        assert not kept & {"collision", "impact", "pivot", "friction", "tangents"}, name
    kept = {
        choice.stage
        for choice in explain(
            Scene(bodies=(ground(), falling), gravity=DOWN), time_step=TIME_STEP, observe={}
        )
        if choice.kept
    }
    assert {"collision", "impact", "pivot"} <= kept
    assert "friction" not in kept


def test_bodies_that_must_not_touch_pass_through_each_other() -> None:
    scene = Scene(bodies=(ground(), ball(height=0.6)), gravity=DOWN, no_contact=(("ground", "ball"),))
    result = simulate(
        scene, time_step=TIME_STEP, duration=1.0, observe={"z": Final(quantity=Position("ball"))}
    )

    assert result["z"][2] < -3.0


# Many -------------------------------------------------------------------------------------------------------


def heap(count: int, friction: float = 0.4) -> Scene:
    """Mixed shapes above the ground, slightly out of line, some tied in pairs."""
    rough = Material(friction=friction, restitution=0.2)
    shapes = (Sphere(0.4), Box((0.7, 0.6, 0.5)), Capsule(0.2, 0.5))
    side = math.ceil(count ** (1 / 3))
    bodies = [ground(rough)]
    for k in range(count):
        i, j, level = k % side, k // side % side, k // side**2
        shake = 0.05 * math.sin(7.0 * k), 0.05 * math.cos(11.0 * k)
        bodies.append(
            RigidBody(
                name=f"b{k}",
                position=(i + shake[0], j + shake[1], 0.6 + 1.1 * level),
                mass=1.0,
                shape=shapes[k % 3],
                material=rough,
            )
        )
    ties = tuple(
        Distance(name=f"tie{k}", between=(f"b{k}", f"b{k + 1}"), compliance=1e-6)
        for k in range(0, count - 1, 10)
    )
    return Scene(bodies=tuple(bodies), constraints=ties, gravity=DOWN)


@pytest.mark.parametrize("solver", ["direct", "iterative", "hybrid"])
def test_equal_input_gives_equal_bits(solver: str) -> None:
    runs = [simulate(heap(12), time_step=TIME_STEP, steps=90, method=Method(solver=solver)) for _ in range(2)]

    assert runs[0].completed and runs[1].completed
    assert runs[0].state_hash == runs[1].state_hash
    assert runs[0].counters == runs[1].counters


def test_a_heap_comes_to_rest_and_gains_no_energy() -> None:
    result = simulate(
        heap(64),
        time_step=TIME_STEP,
        duration=4.0,
        method=Method(solver="iterative"),
        observe={
            "e": Trace(quantity=Energy()),
            "k": Trace(quantity=KineticEnergy()),
            "depth": Maximum(quantity=Penetration()),
            "x": Final(quantity=Position()),
        },
    )

    assert np.diff(result["e"]).max() < 1e-2 * result["k"].max()
    assert result["e"].max() <= result["e"][0] * (1.0 + 1e-12)
    assert result["depth"] < 0.05  # the fastest body goes 0.08 m in a step
    assert result["x"][1:, 2].min() > 0.15  # nothing fell through


@pytest.mark.parametrize("shape", [Sphere(0.5), Box((1, 1, 1))], ids=["balls", "boxes"])
def test_a_thousand_bodies_stay_a_pile(shape: Sphere | Box) -> None:
    rough = Material(friction=0.5)
    bodies = [ground(rough)]
    for k in range(1000):
        place = (
            1.05 * (k % 10) + 0.01 * math.sin(k),
            1.05 * (k // 10 % 10) + 0.01 * math.cos(3 * k),
            0.55 + 1.05 * (k // 100),
        )
        bodies.append(RigidBody(name=f"b{k}", position=place, mass=1.0, shape=shape, material=rough))
    result = simulate(
        Scene(bodies=tuple(bodies), gravity=DOWN),
        time_step=TIME_STEP,
        steps=45,
        method=Method(solver="iterative", iterations=30),
        observe={
            "e": Trace(quantity=Energy()),
            "depth": Maximum(quantity=Penetration()),
            "x": Final(quantity=Position()),
            "q": Final(quantity=Orientation()),
        },
    )

    assert result["e"].max() <= result["e"][0] * (1.0 + 1e-12)
    assert result["depth"] < 0.02
    assert result["x"][1:, 2].min() > 0.45

"""What every engine behind the protocol is asked of what drives, carries and flies: scenes where one motor, belt or part
bears on the others. Rows and bounds as in test_conformance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Box,
    CentralGravity,
    Compound,
    Distance,
    Final,
    Hinge,
    JointCoordinate,
    Load,
    Material,
    Motor,
    Part,
    Particle,
    Plane,
    Position,
    Prismatic,
    Relation,
    RigidBody,
    Scene,
    Sphere,
    Spring,
    Velocity,
)
from tests.engine.peers.test_conformance import (
    BOX,
    BOX_AS_IT_COMES,
    BULLET,
    CANNON,
    DART,
    DART_LOOSE,
    JOLT,
    MERSON,
    MOTRIX,
    MUJOCO,
    MUJOCO_AS_IT_COMES,
    MUJOCO_IMPLICIT,
    P2,
    P2_AS_IT_COMES,
    RAPIER,
    RAPIER_JS,
    RAPIER_JS_AS_IT_COMES,
    RAPIER_MANY,
    RK3,
    SAP,
    TGS,
    Asked,
    engine,
    rows,
)
from tests.scenes import peer as peer_scenes
from tests.scenes.corpus import solid
from tests.scenes.seen import finals, traces

G = 9.81  # m/s²
Z = (0.0, 0.0, 1.0)
ROUGH = Material(friction=0.5)
STEP = 1.0 / 240.0  # s


def hinge(name: str, first: str, second: str, x: float, speed: float | None = None) -> Hinge:
    motor = None if speed is None else Motor(speed=speed)
    return Hinge(name=name, between=(first, second), at=(x, 0.0, 0.0), axis=Z, motor=motor, compliance=0.0)


def body(name: str, mass: float, inertia: float, x: float, **more: object) -> RigidBody:
    return RigidBody(name=name, mass=mass, inertia=(inertia,) * 3, position=(x, 0.0, 0.0), **more)  # type: ignore[arg-type]


@rows(
    {
        MUJOCO: 0.01,  # some of the way in a step
        **dict.fromkeys((MUJOCO_IMPLICIT, MUJOCO_AS_IT_COMES), 2e-3),
        BOX: 5e-3,
        DART: 1e-8,
        JOLT: 0.06,  # by a hundred sweeps
    }
)
def test_each_motor_of_a_chain_turns_what_is_behind_it(asked: Asked, owed: float) -> None:
    """Six links of a metre, from rest, each hinge driven at 1 rad/s: each has turned by 1 rad after a second."""
    names = ["world", *(f"link {k}" for k in range(6))]
    links = tuple(
        RigidBody(name=name, mass=1.0, inertia=(0.01, 0.1, 0.1), position=(0.5 + k, 0.0, 0.0))
        for k, name in enumerate(names[1:])
    )
    joints = tuple(hinge(f"{k}", names[k], names[k + 1], float(k), 1.0) for k in range(6))
    seen = {joint.name: Final(quantity=JointCoordinate(joint.name)) for joint in joints}
    found = engine(asked)(Scene(bodies=links, constraints=joints), time_step=STEP, duration=1.0, observe=seen)

    assert [float(found[name]) for name in seen] == pytest.approx([1.0] * 6, abs=owed)


@rows({MUJOCO: 5e-3, MUJOCO_IMPLICIT: 1e-4, JOLT: 0.01})
def test_a_motor_drives_what_its_gears_and_rods_drive(asked: Asked, owed: float) -> None:
    """On a light wheel, geared to one a thousand times heavier; and on a crank whose rod pushes 50 kg along a slide."""
    simulate = engine(asked)
    wheels = body("light", 1.0, 0.01, 0.0), body("heavy", 1.0, 10.0, 2.0)
    held = hinge("A", "world", "light", 0.0, 3.0), hinge("C", "world", "heavy", 2.0)
    gear = Relation(name="gear", terms=(("A", 1.0), ("C", 1.0)), compliance=0.0)
    seen = {name: Final(quantity=AngularVelocity(name)) for name in ("light", "heavy")}
    geared = Scene(bodies=wheels, constraints=(*held, gear))
    found = simulate(geared, time_step=STEP, duration=0.5, observe=seen)
    assert [float(found[name][2]) for name in seen] == pytest.approx([3.0, -3.0], rel=owed)

    slide = Prismatic(name="slide", between=("world", "block"), axis=(1.0, 0.0, 0.0), compliance=0.0)
    rod = Distance(
        name="rod", between=("crank", "block"), anchors=((0.0, 0.5, 0.0), (0.0, 0.0, 0.0)), compliance=0.0
    )
    parts = body("crank", 0.1, 0.001, 0.0), body("block", 50.0, 1.0, 2.0)
    loop = Scene(bodies=parts, constraints=(hinge("A", "world", "crank", 0.0, 3.0), slide, rod))
    turned = finals(turned=JointCoordinate("A"))
    found = simulate(loop, time_step=STEP, duration=1.0, observe=turned)
    assert float(found["turned"]) == pytest.approx(3.0, rel=owed)


@rows(
    {
        MUJOCO: 0.02,
        MUJOCO_IMPLICIT: 1e-3,
        MUJOCO_AS_IT_COMES: 1e-3,
        **dict.fromkeys((DART, BULLET, BOX, JOLT, RAPIER_MANY, RAPIER_JS, TGS), 0.02),
    }
)
def test_a_motor_keeps_its_speed_under_gravity(asked: Asked, owed: float) -> None:
    """An arm that its hinge, tilted, turns at 3 rad/s through its highest and lowest place, for 2 s; its turns are counted
    though nothing between is read."""
    arm = solid("arm", None, (1.0, 0.0, 0.0), 2.0, inertia=(0.5, 0.3, 0.4), orientation=(0.8, 0.0, 0.6, 0.0))
    joint = Hinge(
        name="j", between=("world", "arm"), at=(0.0,) * 3, axis=(0.0, 0.6, 0.8), motor=Motor(speed=3.0),
        compliance=0.0,
    )  # fmt: skip
    seen = finals(turned=JointCoordinate("j"))
    scene = Scene(bodies=(arm,), constraints=(joint,), gravity=(0.0, 0.0, -G))
    found = engine(asked)(scene, time_step=STEP, duration=2.0, observe=seen)

    assert float(found["turned"]) == pytest.approx(6.0, abs=owed)


@rows(dict.fromkeys((MUJOCO, DART, BULLET, JOLT), 1e-4) | dict.fromkeys((BOX, RAPIER, TGS), 1e-3))
@pytest.mark.parametrize("speed", [-100.0, 5.0])
def test_whole_turns_are_counted_where_only_the_end_is_read(asked: Asked, owed: float, speed: float) -> None:
    wheel = body("wheel", 1.0, 0.5, 0.0, angular_velocity=(0.0, 0.0, speed))
    scene = Scene(bodies=(wheel,), constraints=(hinge("axle", "world", "wheel", 0.0),))
    seen = {
        "end": Final(quantity=JointCoordinate("axle")),
        "early": Final(quantity=JointCoordinate("axle"), last=240),
    }
    found = engine(asked)(scene, time_step=STEP, duration=3.0, observe=seen)

    assert [float(found["early"]), float(found["end"])] == pytest.approx([speed, 3.0 * speed], rel=owed)


@rows(dict.fromkeys((MUJOCO, BOX, BOX_AS_IT_COMES, RAPIER_MANY, DART, BULLET, JOLT, RAPIER_JS, TGS), 2e-3))
def test_a_damper_without_stiffness_brakes(asked: Asked, owed: float) -> None:
    """A mass of 1 kg by 2 N s/m for half a second: to 1/e of its speed."""
    weight = Particle(name="p", mass=1.0, position=(2.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
    damper = Spring(name="s", between=((0.0, 0.0, 0.0), "p"), stiffness=0.0, rest_length=1.0, viscosity=2.0)
    seen = finals(v=Velocity("p"))
    found = engine(asked)(
        Scene(bodies=(weight,), forces=(damper,)), time_step=1e-3, duration=0.5, observe=seen
    )

    assert float(found["v"][0]) == pytest.approx(math.exp(-1.0), abs=owed)


@rows(dict.fromkeys((MUJOCO, DART, BULLET, BOX, BOX_AS_IT_COMES, RAPIER, RAPIER_MANY), 1e-5))
def test_what_is_fast_goes_as_far_as_it_is_fast(asked: Asked, owed: float) -> None:
    bullet = Particle(name="p", mass=1.0, position=(0.0, 0.0, 0.0), velocity=(600.0, 0.0, 0.0))
    seen = finals(x=Position("p"))
    found = engine(asked)(Scene(bodies=(bullet,)), time_step=1 / 60, duration=1.0, observe=seen)

    assert float(found["x"][0]) == pytest.approx(600.0, rel=owed)


@rows(dict.fromkeys((MUJOCO_AS_IT_COMES, BOX, RAPIER, JOLT), 0.02))
def test_belts_carry_along_their_own_direction(asked: Asked, owed: float) -> None:
    """Downhill on a tilted plane with gravity across it, and on a box that is turned a quarter: 2 m/s in its own axes."""
    up, lean = (0.6, 0.0, 0.8), math.atan2(0.6, 0.8)
    tilted = RigidBody(
        name="belt", motion="static", shape=Plane(normal=up), position=(0.0,) * 3, material=ROUGH,
        surface_velocity=(1.6, 0.0, -1.2),
    )  # fmt: skip
    quarter = RigidBody(
        name="belt", motion="static", shape=Box((20.0, 20.0, 1.0)), position=(0.0, 0.0, -0.5), material=ROUGH,
        orientation=(math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)), surface_velocity=(2.0, 0.0, 0.0),
    )  # fmt: skip
    for belt, normal, turn, expected in (
        (tilted, up, (math.cos(0.5 * lean), 0.0, math.sin(0.5 * lean), 0.0), (1.6, 0.0, -1.2)),
        (quarter, Z, (1.0, 0.0, 0.0, 0.0), (0.0, 2.0, 0.0)),
    ):
        cube = RigidBody(
            name="cube", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=tuple(0.5 * x for x in normal),
            orientation=turn, material=ROUGH,
        )  # fmt: skip
        scene = Scene(bodies=(belt, cube), gravity=tuple(-G * x for x in normal))
        seen = finals(v=Velocity("cube"))
        found = engine(asked)(scene, time_step=STEP, duration=1.5, observe=seen)
        assert found["v"] == pytest.approx(np.array(expected), abs=owed)


@rows(dict.fromkeys((MUJOCO, BOX, JOLT, RAPIER, RAPIER_JS_AS_IT_COMES), 2e-3))
def test_a_compound_spins_about_its_own_centre_of_mass(asked: Asked, owed: float) -> None:
    """Two balls beside the centre, further on one side: it flies as a point does, without wobble, turning at 2 rad/s."""
    parts = tuple(Part(shape=Sphere(0.1), position=(x, 0.0, 0.0)) for x in (1.0, -0.5))
    dumbbell = RigidBody(
        name="d", mass=3.0, inertia=(0.05, 1.5, 1.5), shape=Compound(parts), position=(0.0, 0.0, 5.0),
        angular_velocity=(0.0, 2.0, 0.0),
    )  # fmt: skip
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    seen = finals(x=Position("d"), v=Velocity("d"), w=AngularVelocity("d"))
    scene = Scene(bodies=(ground, dumbbell), gravity=(0.0, 0.0, -G))
    found = engine(asked)(scene, time_step=1e-3, duration=0.5, observe=seen)

    assert found["x"] == pytest.approx(np.array([0.0, 0.0, 5.0 - G / 8.0]), abs=1.5 * owed)
    assert found["v"] == pytest.approx(np.array([0.0, 0.0, -0.5 * G]), abs=owed)
    assert found["w"] == pytest.approx(np.array([0.0, 2.0, 0.0]), abs=owed)


@rows(
    dict.fromkeys(
        (
            MUJOCO,
            MUJOCO_AS_IT_COMES,
            DART,
            DART_LOOSE,
            BULLET,
            JOLT,
            BOX,
            RAPIER,
            RAPIER_JS,
            SAP,
            CANNON,
            MERSON,
            MOTRIX,
        ),
        0.02,
    )
)
def test_pairs_kept_apart_pass_through_each_other(asked: Asked, owed: float) -> None:
    """Two balls fall, one of which must not touch the other, which lies on the ground; and one that must not touch that."""
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    low, high, through = (
        RigidBody(name=name, mass=1.0, shape=Sphere(0.5), position=(x, 0.0, z))
        for name, x, z in (("low", 0.0, 0.5), ("high", 0.0, 1.2), ("through", 5.0, 0.5))
    )
    scene = Scene(
        bodies=(ground, low, high, through),
        gravity=(0.0, 0.0, -G),
        no_contact=(("high", "low"), ("ground", "through")),
    )
    seen = finals(z=Position())
    found = engine(asked)(scene, time_step=STEP, duration=1.0, observe=seen)["z"][1:, 2]

    assert found[:2] == pytest.approx([0.5, 0.5], abs=owed)
    assert found[2] == pytest.approx(0.5 - 0.5 * G, abs=1.5 * G * STEP)


@rows(dict.fromkeys((JOLT, P2_AS_IT_COMES, RAPIER_JS_AS_IT_COMES), 4.0))
def test_a_smaller_step_stops_helping_where_single_precision_does(asked: Asked, owed: float) -> None:
    """A first-order step in double precision is g T h / 2 away: 0.02 m at 1/4000 s, and it always shrinks with h."""
    assert abs(peer_scenes.fall_error(engine(asked), 1 / 4000, seconds=20.0)) > owed * 0.5 * G * 20.0 / 4000.0


@rows(dict.fromkeys((CANNON, MUJOCO, JOLT, BOX, RAPIER_JS), 1e-2))
def test_equal_runs_are_equal(asked: Asked, owed: float) -> None:
    """To the bit, of a box that friction holds against a tenth of its weight."""
    seen = finals(place=Position("box"))
    one, two = (
        engine(asked)(peer_scenes.box_on_ground(0.1), time_step=STEP, duration=2.0, observe=seen)
        for _ in range(2)
    )

    assert abs(one["place"][0]) < owed
    assert one.state_hash == two.state_hash


@rows(
    {
        DART: (1e-3, 1e-6, 1e-3),
        BULLET: (1e-3, 1e-6, 1e-3),
        SAP: (1e-3, 1e-6, 1e-3),
        RK3: (1e-9, 1e-6, 1e-3),
        MERSON: (1e-8, 1e-9, 1e-8),
        JOLT: (1e-3, 1e-5, 2e-3),
        **dict.fromkeys((CANNON, P2), (1e-3, 1e-9, None)),
        BOX: (2e-3, 1e-5, 2e-3),
        RAPIER: (2e-3, 1e-5, 2e-3),
        RAPIER_JS_AS_IT_COMES: (2e-3, 1e-5, 2e-3),
    }
)
def test_forces_act_at_every_step(asked: Asked, owed: tuple[float, float, float | None]) -> None:
    """A circular orbit stays one, a load of twice the weight lifts, and a spring swings by its cosine."""
    simulate, (round_, lift, swing) = engine(asked), owed
    moon = Particle(name="moon", mass=3.0, position=(2.0, 0.0, 0.0), velocity=(0.0, math.sqrt(0.5), 0.0))
    orbit = Scene(bodies=(moon,), forces=(CentralGravity(name="pull", strength=1.0),))
    path = traces(path=Position("moon"))
    found = simulate(orbit, time_step=0.001, duration=5.0, observe=path)
    assert np.abs(np.linalg.norm(found["path"], axis=1) - 2.0).max() < round_

    box = RigidBody(name="box", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    lifted = Scene(
        bodies=(box,),
        forces=(Load(name="lift", body="box", force=(0.0, 0.0, 4.0 * G)),),
        gravity=peer_scenes.GRAVITY,
    )
    speed = finals(speed=Velocity("box"))
    found = simulate(lifted, time_step=0.01, steps=100, observe=speed)
    assert found["speed"][2] == pytest.approx(G, rel=lift)

    if swing is not None:
        weight = Particle(name="weight", mass=3.0, position=(2.0, 0.0, 0.0))
        spring = Spring(name="spring", between=((0.0, 0.0, 0.0), "weight"), stiffness=30.0, rest_length=1.0)
        end = finals(end=Position("weight"))
        found = simulate(
            Scene(bodies=(weight,), forces=(spring,)), time_step=0.001, duration=1.0, observe=end
        )
        assert found["end"][0] == pytest.approx(1.0 + math.cos(math.sqrt(10.0)), abs=swing)

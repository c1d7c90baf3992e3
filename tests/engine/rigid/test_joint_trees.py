"""Compositions in joint coordinates take the steps of the dense oracle, which knows rows only, to rounding."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker import engine
from spook_tracker.engine import (
    WORLD,
    Cylindrical,
    Distance,
    Final,
    Hinge,
    Method,
    Particle,
    Planar,
    PointOnLine,
    Position,
    Prismatic,
    Scene,
    Trace,
    simulate,
)
from spook_tracker.scalar_tests.multibody import four_bars
from tests.engine.test_symmetries import turned
from tests.oracles.rigid_composition import STATE, TreeOracle, assert_dense_steps
from tests.scenes import rigid as rigid_scenes

ORDER4 = Method(composition="order4")


def rigid(scene: Scene) -> Scene:
    rows = tuple(dataclasses.replace(row, compliance=0.0) for row in scene.constraints)
    return dataclasses.replace(scene, constraints=rows)


def hung(*kinds: str, twice: bool = False) -> Scene:
    """A branching tree of joints from the world, in both directions; `twice`: the first body on a second hinge."""
    rng = np.random.default_rng(len(kinds))
    bodies = [rigid_scenes.rigid_body(rng, i) for i in range(len(kinds))]
    rows = []
    for i, kind in enumerate(kinds):
        parent = (i - 1) // 2
        ends = (f"b{parent}" if i else WORLD, f"b{i}")
        at = rigid_scenes.between(bodies, parent, i) if i else (0.5, 0.0, 0.0)
        rows.append(rigid_scenes.joint(rng, kind, *(ends[::-1] if i % 2 else ends), at))
    if twice:
        first = rows[0]
        assert isinstance(first, Hinge) and first.at is not None and first.axis is not None
        along = np.asarray(first.axis, dtype=float) / np.linalg.norm(first.axis)
        x, y, z = (np.asarray(first.at) + 0.7 * along).tolist()
        rows.append(dataclasses.replace(first, name="second hinge", at=(x, y, z)))
    return rigid(Scene(bodies=tuple(bodies), constraints=tuple(rows), gravity=rigid_scenes.GRAVITY))


def floating(*kinds: str, gravity: tuple[float, float, float] = rigid_scenes.GRAVITY) -> Scene:
    """The same tree with nothing that holds it to the world."""
    scene = hung(*kinds)
    return dataclasses.replace(scene, constraints=scene.constraints[1:], gravity=gravity)


def leaning(scene: Scene) -> Scene:
    """Out of the planes of the world's axes, in which numbers of the plane would do (tests/engine/rigid/test_plane_trees.py)."""
    turn = np.array([0.8, 0.36, 0.48, 0.0])
    return turned(scene, turn, np.zeros(3), np.zeros(3))


SCENES = {
    "what floats": floating("ball", "hinge", "prismatic", "ball"),
    "hinges": hung("hinge", "hinge", "hinge", "hinge"),
    "every joint": hung("prismatic", "ball", "hinge", "lock", "ball"),
    "a hinge too many": hung("hinge", "ball", "prismatic", twice=True),
    "a loop": rigid(leaning(dataclasses.replace(four_bars.scene(2, 0.02), gravity=(0.3, -9.81, 0.0)))),
    "a ring, held twice": rigid(rigid_scenes.loop(np.random.default_rng(3))),
}


@pytest.mark.parametrize("name", SCENES)
def test_joint_coordinates_take_the_dense_steps(name: str) -> None:
    assert_dense_steps(SCENES[name], 0.1, 2, oracle=TreeOracle)  # so long that every order-2 map shows


@pytest.mark.parametrize(
    ("name", "coordinates", "rows"),
    [("hinges", 4, 0), ("what floats", 11, 0), ("a hinge too many", 5, 0), ("a loop", 5, 4)],
)
def test_explain_says_where_joint_coordinates_run(name: str, coordinates: int, rows: int) -> None:
    program = engine.compile(SCENES[name], time_step=0.02, method=ORDER4)
    reasons = {choice.stage: choice.reason for choice in program.explain()}

    assert f"{coordinates} joint coordinates, {rows} rows to close loops" in reasons["solve_block"]
    assert "joint coordinates" in reasons["correct_curvature"]
    plain = engine.compile(SCENES[name], time_step=0.02)
    assert not any("joint coordinates" in choice.reason for choice in plain.explain())


@pytest.mark.parametrize("kind", [Cylindrical, Planar, PointOnLine])
def test_freer_joints_move_as_their_rows_have_it(kind: type[Any]) -> None:
    """A particle on a distance elsewhere makes the rows of all be solved, which other tests hold to the equations; their turns
    are of another map, the same to order four."""
    free, axis = hung("ball", "hinge"), np.array([0.6, 0.0, 0.8])
    slide = kind(name="slide", between=(WORLD, "b0"), at=(0.5, 0.0, 0.0), axis=tuple(axis), compliance=0.0)
    scene = dataclasses.replace(free, constraints=(slide, free.constraints[1]))
    dot = Particle(name="dot", mass=1.0, position=(50.0, 0.0, 0.0))
    pin = Distance(name="pin", between=((50.0, 0.0, 1.0), "dot"), compliance=0.0)
    beside = dataclasses.replace(scene, bodies=(*scene.bodies, dot), constraints=(*scene.constraints, pin))

    trees, rows = (
        simulate(s, time_step=0.005, steps=100, method=ORDER4, observe=STATE) for s in (scene, beside)
    )

    assert trees.state_hash != rows.state_hash
    for quantity in STATE:
        assert np.abs(trees[quantity] - rows[quantity][:, :2]).max() < 1e-9, quantity


def test_far_from_the_origin_nothing_is_lost() -> None:
    """Joint coordinates are differences: a thousand kilometres away the same motion, to the digits that places have."""
    near = hung("hinge", "ball", "prismatic")
    away = np.array([1e6, -2e6, 0.0])

    def moved(point: object) -> tuple[float, float, float]:
        x, y, z = (np.asarray(point, dtype=float) + away).tolist()
        return (x, y, z)

    far = Scene(
        bodies=tuple(dataclasses.replace(b, position=moved(b.position)) for b in near.bodies),
        constraints=tuple(dataclasses.replace(j, at=moved(j.at)) for j in near.constraints),  # type: ignore[arg-type]
        gravity=near.gravity,
    )
    observe = {"x": Final(quantity=Position())}
    ends = [
        simulate(scene, time_step=0.02, steps=100, method=ORDER4, observe=observe)["x"]
        for scene in (near, far)
    ]

    assert np.abs(ends[1] - away - ends[0]).max() < 1e-8


def test_a_slide_goes_far() -> None:
    """A coordinate without an end: 490 m of fall along an axis, against the closed form."""
    body = rigid_scenes.rigid_body(np.random.default_rng(1), 0)
    still = dataclasses.replace(body, velocity=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 0.0))
    rail = Prismatic(
        name="rail", between=(WORLD, "b0"), at=still.position, axis=(0.0, 0.0, 1.0), compliance=0.0
    )
    scene = Scene(bodies=(still,), constraints=(rail,), gravity=(0.0, 0.0, -9.81))
    observe = {"x": Final(quantity=Position("b0"))}

    end = simulate(scene, time_step=0.1, steps=100, method=ORDER4, observe=observe)["x"]

    assert end[2] - still.position[2] == pytest.approx(-0.5 * 9.81 * 100.0, rel=1e-13)


def five_bars(light: float | None) -> Scene:
    """Hung aslant on ball joints, or each on three hinges through two bodies as light as that."""
    along, half, inertia = np.array([0.96, 0.0, -0.28]), 0.15, 1.0 * 0.3**2 / 12.0
    bodies: list[Any] = []
    joints: list[Any] = []
    at, before = np.zeros(3), WORLD
    for k in range(5):
        bar = engine.RigidBody(
            name=f"bar {k}",
            mass=1.0,
            inertia=(inertia, inertia, 0.5 * inertia),
            position=tuple(at + half * along),
        )
        if light is None:
            joints.append(
                engine.Ball(name=f"ball {k}", between=(before, bar.name), at=tuple(at), compliance=0.0)
            )
        else:
            gimbals = [
                engine.RigidBody(name=f"{k}{a}", mass=light, inertia=(0.01 * light,) * 3, position=tuple(at))
                for a in "xy"
            ]
            bodies += gimbals
            names = [before, *(gimbal.name for gimbal in gimbals), bar.name]
            joints += [
                Hinge(name=f"hinge {k}{a}", between=names[a : a + 2], at=tuple(at), axis=axis, compliance=0.0)
                for a, axis in enumerate(np.eye(3).tolist())
            ]
        bodies.append(bar)
        at, before = at + 2.0 * half * along, bar.name
    return Scene(bodies=tuple(bodies), constraints=tuple(joints), gravity=(3.0, 2.0, -9.81))


def test_three_hinges_through_light_bodies_are_a_ball_joint() -> None:
    """In rows the impulses of a chain throw such bodies about: 92 steps of these 40 were halved at 1e-7 kg."""

    def end(light: float | None) -> Any:
        run = simulate(
            five_bars(light),
            time_step=1 / 200,
            duration=0.2,
            method=Method(composition="order6"),
            observe={"end": Final(quantity=Position("bar 4"))},
        )
        assert run.counters["halved_steps"] == 0
        return run["end"]

    ideal = end(None)
    coarse, fine = (float(np.abs(end(light) - ideal).max()) for light in (1e-5, 1e-7))
    assert fine < 1e-9 and coarse / fine == pytest.approx(100.0, rel=0.05)


def parallelogram(cranks: float, rotor: float, angle: float) -> tuple[Scene, float, float]:
    """Two cranks of 1 kg and that length, a coupler of 2 kg level; with a rotor in each of four hinges. Its inertia, and what pulls."""
    turn = (math.cos(0.5 * angle), 0.0, math.sin(0.5 * angle), 0.0)
    down = cranks * np.array([-math.sin(angle), 0.0, -math.cos(angle)])
    bodies, joints = [], []
    for k in (0, 1):
        at = np.array([float(k), 0.0, 0.0])
        bodies.append(
            engine.RigidBody(
                name=f"crank {k}",
                mass=1.0,
                inertia=(0.02, 0.02, 0.01),
                position=tuple(at + 0.5 * down),
                orientation=turn,
            )
        )
        joints.append((f"a{k}", (WORLD, f"crank {k}"), at))
        joints.append((f"b{k}", (f"crank {k}", "coupler"), at + down))
    bodies.append(
        engine.RigidBody(
            name="coupler",
            mass=2.0,
            inertia=(0.1, 0.2, 0.2),
            position=tuple(np.array([0.5, 0.0, 0.0]) + down),
        )
    )
    scene = Scene(
        bodies=tuple(bodies),
        constraints=tuple(
            Hinge(
                name=name, between=between, at=tuple(at), axis=(0.0, 1.0, 0.0), compliance=0.0, armature=rotor
            )
            for name, between, at in joints
        ),
        gravity=(0.0, 0.0, -9.81),
    )
    inertia = 2.0 * (0.02 + 0.25 * cranks**2) + 2.0 * cranks**2 + 4.0 * rotor
    return scene, inertia, 9.81 * cranks * (1.0 + 2.0)


@pytest.mark.parametrize("rotor", [0.0, 0.3])
def test_rotors_in_a_loop_are_held_at_the_order_of_the_composition(rotor: float) -> None:
    scene, inertia, pull = parallelogram(0.5, rotor, 1.0)
    reference = solve_ivp(
        lambda _, s: [s[1], -pull * math.sin(s[0]) / inertia],
        (0.0, 1.0),
        [1.0, 0.0],
        rtol=1e-13,
        atol=1e-14,
        method="DOP853",
    ).y[0, -1]
    seen = {"coupler": Final(quantity=Position("coupler"))}
    errors = []
    for steps in (20, 40):
        run = simulate(
            scene, time_step=1 / steps, duration=1.0, method=Method(composition="order4"), observe=seen
        )
        errors.append(abs(float(run["coupler"][2]) + 0.5 * math.cos(reference)))
    assert errors[1] < 2e-6
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)


def test_a_composition_shows_what_joints_carry_beside_springs() -> None:
    """A cart on a rail that a spring pulls, a bob that hangs from it: both accelerate from rest."""
    cart, bob, moment, arm, stiffness, stretched = 3.0, 1.0, 0.05, 0.6, 40.0, 0.25
    bodies = (
        engine.RigidBody(name="cart", mass=cart, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0)),
        engine.RigidBody(name="bob", mass=bob, inertia=(moment, moment, moment), position=(0.0, 0.0, -arm)),
    )
    twist = 6.0  # N m/rad
    joints = (
        Prismatic(
            name="rail", between=(WORLD, "cart"), axis=(1.0, 0.0, 0.0), compliance=0.0,
            spring=engine.JointSpring(stiffness=stiffness, rest=stretched, damping=0.0),
        ),
        Hinge(
            name="pin", between=("cart", "bob"), at=(0.0, 0.0, 0.0), axis=(0.0, -1.0, 0.0), compliance=0.0,
            spring=engine.JointSpring(stiffness=twist, rest=0.2, damping=0.0),
        ),
    )  # fmt: skip
    x, phi = np.linalg.solve(
        [[cart + bob, bob * arm], [bob * arm, moment + bob * arm**2]], [stiffness * stretched, twist * 0.2]
    )
    run = simulate(
        Scene(bodies=bodies, constraints=joints, gravity=(0.0, 0.0, -9.81)),
        time_step=0.01,
        duration=0.01,
        method=Method(composition="order4"),
        observe={"pin": Trace(quantity=engine.ConstraintForce("pin"))},
    )
    force = run["pin"][0]
    assert abs(force[0]) == pytest.approx(abs(bob * (x + arm * phi)), rel=1e-6)
    assert force[2] == pytest.approx(bob * 9.81, rel=1e-9)

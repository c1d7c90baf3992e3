"""Rows over more than two moving bodies beside rows that let go, against dense enumeration and closed forms."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Box,
    ConstraintForce,
    Cylinder,
    Final,
    Hinge,
    Limit,
    Load,
    Material,
    Method,
    Motor,
    Plane,
    Position,
    Prismatic,
    Relation,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    Wire,
    simulate,
)
from tests.scenes.corpus import fixed, solid

GRAVITY = 10.0  # m/s²
STEP = 0.01  # s
Z = (0.0, 0.0, 1.0)
MASSES = (1.0, 2.0, 0.5, 3.0)  # kg
SHARES = (1.0, 2.0, -1.5, 1.0)  # of the relation


def weight(name: str, mass: float, x: float, z: float = 0.0, **more: Any) -> RigidBody:
    return RigidBody(name=name, mass=mass, inertia=(1.0, 1.0, 1.0), position=(x, 0.0, z), **more)


def guided(forces: np.ndarray, speed: float, bound: float) -> Scene:
    """Four weights on upright guides, all at rest. The first is driven, the second at its lower limit, the third lies
    on a floor; a relation ties all, and a wire just taut the last three."""
    names = "abcd"
    bodies = [weight(name, mass, float(k)) for k, (name, mass) in enumerate(zip(names, MASSES, strict=True))]
    bodies[2] = weight("c", MASSES[2], 2.0, shape=Sphere(radius=0.1))
    drives: dict[str, dict[str, Any]] = {
        "a": {"motor": Motor(speed=speed, max_force=bound)},
        "b": {"limit": Limit(lower=0.0, upper=1.0, compliance=0.0)},
    }
    guides = [
        Prismatic(name=f"{n} guide", between=(WORLD, n), axis=Z, compliance=0.0, **drives.get(n, {}))
        for n in names
    ]
    up = 5.0
    way = (("b", 1.0, 0.0), (WORLD, 1.0, up), (WORLD, 2.0, up), ("c", 2.0, 0.0), (WORLD, 2.0, up))
    way += ((WORLD, 3.0, up), ("d", 3.0, 0.0))
    return Scene(
        bodies=(
            weight("stray", 1.0, -5.0, shape=Sphere(radius=0.1)),  # another island, before theirs
            *bodies,
            RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, -0.1)),
        ),
        constraints=(
            *guides,
            Relation(
                name="sum",
                terms=tuple((f"{n} guide", share) for n, share in zip(names, SHARES, strict=True)),
                compliance=0.0,
            ),
            Wire(name="wire", through=tuple((n, (x, 0.0, z)) for n, x, z in way), compliance=0.0),
        ),
        forces=tuple(
            Load(name=f"load {n}", body=n, force=(0.0, 0.0, float(f)))
            for n, f in zip((*names, "stray"), (*forces, -5.0), strict=True)
        ),
    )


def enumerated(forces: np.ndarray, speed: float, bound: float) -> np.ndarray:
    """v of M v = h f + Gᵀ z with lower <= z <= upper and G v − r = 0 inside, >= 0 at the lower, <= 0 at the upper
    bound: every choice of bounds is tried. Motor, limit, floor, relation, wire; masses move along one line each."""
    rows = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], SHARES, [0, -1, -2, -1]], dtype=float)
    right = np.array([speed, 0, 0, 0, 0.0])
    lower = np.array([-STEP * bound, 0, 0, -np.inf, -np.inf])
    upper = np.array([STEP * bound, np.inf, np.inf, np.inf, 0])
    kept = []
    for state in itertools.product((-1, 0, 1), (-1, 0), (-1, 0), (0,), (0, 1)):
        free = np.array(state) == 0
        z = np.where(np.array(state) < 0, lower, upper)
        z[free] = 0.0
        push = STEP * forces + rows.T @ z
        system = np.block(
            [[np.diag(MASSES), -rows[free].T], [rows[free], np.zeros((free.sum(), free.sum()))]]
        )
        answer = np.linalg.lstsq(system, np.concatenate([push, right[free]]), rcond=None)[0]
        if np.abs(system @ answer - np.concatenate([push, right[free]])).max() > 1e-10:
            continue
        z[free] = answer[4:]
        w = rows @ answer[:4] - right
        held = (z >= lower - 1e-9) & (z <= upper + 1e-9)
        wanted = np.where(free, True, np.where(np.array(state) < 0, w >= -1e-9, w <= 1e-9))
        if held.all() and wanted.all():
            kept.append(answer[:4])
    assert kept
    assert np.ptp(kept, axis=0).max() < 1e-8  # the velocities are one, whatever the impulses
    return kept[0]


@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_bounded_rows_beside_a_relation_over_four_bodies_solve_their_complementarity(solver: str) -> None:
    method = (
        Method(solver="direct")
        if solver == "direct"
        else Method(solver="iterative", iterations=4000, residual_tolerance=1e-13)
    )
    random, patterns = np.random.default_rng(11), set()
    for _ in range(30 if solver == "direct" else 5):
        forces = random.uniform(-30.0, 30.0, 4)
        speed, bound = random.uniform(-0.2, 0.2), random.uniform(0.0, 20.0)
        observe = {n: Final(quantity=Velocity(n)) for n in "abcd"}
        result = simulate(
            guided(forces, speed, bound), time_step=STEP, steps=1, method=method, observe=observe
        )
        wanted = enumerated(forces, speed, bound)
        v = np.array([result[n][2] for n in "abcd"])
        np.testing.assert_allclose(v, wanted, rtol=0.0, atol=1e-11 if solver == "direct" else 1e-8)
        patterns.add((abs(v[1]) < 1e-6, abs(v[2]) < 1e-6, abs(v[1] + 2 * v[2] + v[3]) < 1e-6))
    assert len(patterns) >= (5 if solver == "direct" else 2)  # of what holds and what lets go


def test_three_weights_on_one_slack_rope_fall_by_the_law_of_atwood() -> None:
    masses = {"a": 1.0, "b": 3.0, "c": 1.5}
    folds = {"a": 1.0, "b": 2.0, "c": 1.0}
    way = (("a", 0.0, 0.0), (WORLD, 0.0, 9.0), (WORLD, 1.0, 9.0), ("b", 1.0, 0.0), (WORLD, 1.0, 9.0))
    way += ((WORLD, 2.0, 9.0), ("c", 2.0, 0.0))
    scene = Scene(
        bodies=tuple(weight(n, m, float(k)) for k, (n, m) in enumerate(masses.items())),
        constraints=(Wire(name="rope", through=tuple((n, (x, 0.0, z)) for n, x, z in way), compliance=0.0),),
        gravity=(0.0, 0.0, -GRAVITY),
    )
    observe = {n: Trace(quantity=Velocity(n)) for n in masses}
    observe["pull"] = Trace(quantity=ConstraintForce("rope"))
    result = simulate(scene, time_step=STEP, steps=50, observe=observe)
    pull = GRAVITY * sum(folds.values()) / sum(f * f / masses[n] for n, f in folds.items())
    np.testing.assert_allclose(result["pull"][1:], pull, rtol=1e-11)
    times = STEP * np.arange(51)
    for n in masses:
        wanted = (folds[n] * pull / masses[n] - GRAVITY) * times
        np.testing.assert_allclose(result[n][:, 2], wanted, rtol=0.0, atol=1e-11)


def test_a_rope_over_three_weights_is_slack_in_flight_and_snaps_taut_with_its_momentum() -> None:
    masses = {"a": 1.0, "b": 3.0, "c": 1.5}
    folds = np.array([1.0, 2.0, 1.0])
    speeds = np.array([2.0, 0.5, 1.0])  # upwards: the rope comes loose by 4 m/s
    way = (("a", 0.0, 0.0), (WORLD, 0.0, 9.0), (WORLD, 1.0, 9.0), ("b", 1.0, 0.0), (WORLD, 1.0, 9.0))
    way += ((WORLD, 2.0, 9.0), ("c", 2.0, 0.0))
    scene = Scene(
        bodies=tuple(
            weight(n, m, float(k), velocity=(0.0, 0.0, float(speeds[k])))
            for k, (n, m) in enumerate(masses.items())
        ),
        constraints=(Wire(name="rope", through=tuple((n, (x, 0.0, z)) for n, x, z in way), compliance=0.0),),
        gravity=(0.0, 0.0, -GRAVITY),
    )
    observe = {n: Trace(quantity=Velocity(n)) for n in masses}
    observe["pull"] = Trace(quantity=ConstraintForce("rope"))
    result = simulate(scene, time_step=STEP, steps=60, observe=observe)
    v = np.array([result[n][:, 2] for n in masses])
    when = int(np.argmax(result["pull"] > 0.0))  # taut again: after 2 · 4/(4 g) s of flight
    assert abs(when * STEP - 2.0 * folds @ speeds / (folds.sum() * GRAVITY)) <= 2.0 * STEP
    free = speeds - GRAVITY * STEP * (when - 1)
    np.testing.assert_allclose(v[:, when - 1], free, rtol=0.0, atol=1e-12)
    # Two steps later the rope holds: its impulse and that of gravity have made the change, and its rate is zero.
    m = np.array(list(masses.values()))
    change = m * (v[:, when + 2] - free + 3 * STEP * GRAVITY) / folds
    np.testing.assert_allclose(change, change[0], rtol=1e-10)
    assert abs(folds @ v[:, when + 2]) < 1e-3 * abs(folds @ free)


def test_an_open_differential_gives_both_wheels_half_the_torque_whichever_slips() -> None:
    """One wheel on the floor, one on ice: it spins up by its own inertia, and the car by the same torque over I + M r²."""
    radius, torque, spin = 0.3, 0.5, {"left": 0.2, "right": 0.2, "carrier": 0.1}
    mass = {"left": 5.0, "right": 5.0, "carrier": 4.0, "car": 60.0, "sled": 6.0}
    turned = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)  # z to −y: the wheels' axles lie across
    wheels = tuple(
        solid(
            name,
            Cylinder(radius=radius, length=0.1),
            (0.0, y, radius),
            mass[name],
            inertia=(0.15, 0.15, spin[name]),
            orientation=turned,
            material=Material(friction=friction),
        )
        for name, y, friction in (("left", 1.0, 0.0), ("right", -1.0, 1.0))
    )
    plain = tuple(
        RigidBody(name=name, mass=mass[name], inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, radius))
        for name in ("carrier", "car", "sled")
    )
    y = (0.0, 1.0, 0.0)
    scene = Scene(
        bodies=(*wheels, *plain, fixed("floor", Plane(), (0.0, 0.0, 0.0), material=Material(friction=1.0))),
        constraints=(
            Prismatic(name="ahead", between=(WORLD, "sled"), axis=(1.0, 0.0, 0.0), compliance=0.0),
            Prismatic(name="height", between=("sled", "car"), axis=Z, compliance=0.0),
            *(Hinge(name=f"{n} axle", between=("car", n), axis=y, compliance=0.0) for n in spin),
            Relation(
                name="differential",
                terms=(("left axle", 1.0), ("right axle", 1.0), ("carrier axle", -2.0)),
                compliance=0.0,
            ),
        ),
        forces=(Load(name="engine", body="carrier", torque=(0.0, torque, 0.0)),),
        gravity=(0.0, 0.0, -GRAVITY),
    )
    observe = {n: Trace(quantity=AngularVelocity(n)) for n in spin} | {"car": Trace(quantity=Velocity("car"))}
    steps = 50
    result = simulate(scene, time_step=STEP, steps=steps, observe=observe)
    driven = spin["right"] + sum(mass.values()) * radius**2
    # Both wheels get λ: I α = λ, (I + M r²) α = λ; the carrier I α = τ − 2 λ with the mean of both.
    each = torque / (2.0 + 0.5 * spin["carrier"] * (1.0 / spin["left"] + 1.0 / driven))
    times = STEP * np.arange(steps + 1)
    off = 1e-9
    np.testing.assert_allclose(result["left"][:, 1], each / spin["left"] * times, rtol=0.0, atol=off)
    np.testing.assert_allclose(result["right"][:, 1], each / driven * times, rtol=0.0, atol=off)
    np.testing.assert_allclose(result["car"][:, 0], radius * each / driven * times, rtol=0.0, atol=off)


def test_a_rough_wire_over_a_hung_pulley_drags_a_block_along_a_table() -> None:
    """Three moving bodies on one wire with friction, and a surface that rubs: a = g (m − µ M e^(νφ))/(m + M e^(νφ))."""
    hanging, block, table, grip = 3.0, 2.0, 0.25, 0.3
    half = 0.2
    scene = Scene(
        bodies=(
            weight("hanging", hanging, 0.0, -2.0),
            weight("pulley", 1.0, 0.0, half),
            weight(
                "block",
                block,
                -3.0,
                half,
                shape=Box(size=(2 * half, 2 * half, 2 * half)),
                material=Material(friction=table),
            ),
            fixed("table", Plane(), (0.0, 0.0, 0.0), material=Material(friction=table)),
        ),
        constraints=(
            Prismatic(
                name="mount",
                between=(WORLD, "pulley"),
                axis=Z,
                limit=Limit(lower=0.0, upper=0.0, compliance=0.0),
                compliance=0.0,
            ),
            Wire(
                name="wire",
                through=(
                    ("hanging", (0.0, 0.0, -2.0)),
                    ("pulley", (0.0, 0.0, half)),
                    ("block", (-3.0, 0.0, half)),
                ),
                friction=grip,
                compliance=0.0,
            ),
        ),
        gravity=(0.0, 0.0, -GRAVITY),
    )
    observe = {"hanging": Trace(quantity=Velocity("hanging")), "at": Final(quantity=Position("pulley"))}
    result = simulate(scene, time_step=STEP, steps=40, observe=observe)
    ratio = math.exp(grip * 0.5 * math.pi)
    falls = GRAVITY * (hanging - ratio * table * block) / (hanging + ratio * block)
    gained = np.diff(result["hanging"][:, 2])
    np.testing.assert_allclose(
        gained[10:], -falls * STEP, rtol=1e-6
    )  # bounds follow a step late beside contacts
    np.testing.assert_allclose(result["at"], (0.0, 0.0, half), atol=1e-9)

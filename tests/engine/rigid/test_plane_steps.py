"""Plain, half-step and corrected steps by numbers of a plane: those of the dense oracle and of the rows in space; refusals, too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from spook_tracker import engine
from spook_tracker.engine import (
    PLAIN,
    WORLD,
    AngularVelocity,
    Ball,
    Box,
    ConstraintForce,
    Energy,
    Hinge,
    Load,
    Lock,
    Method,
    Motor,
    Plane,
    Position,
    Result,
    RigidBody,
    Scene,
    Spring,
    Trace,
    Velocity,
    Violation,
    simulate,
)
from spook_tracker.engine.observe import Observable
from spook_tracker.scalar_tests.multibody import four_bars
from tests.oracles.rigid import RigidOracle
from tests.scenes.plane import mechanism
from tests.scenes.seen import finals, traces

HALF = Method(half_step_velocities=True)
METHODS = {
    "plain": PLAIN,
    "half-step": HALF,
    "corrected": Method(corrections=1),
    "half-step, corrected": Method(corrections=2, half_step_velocities=True),
}


def in_rows_of_space(method: Method = PLAIN) -> Method:
    """The same by the general path."""
    return replace(method, force_stages=("solve_block",))


def solves_in_plane(scene: Scene, method: Method = PLAIN) -> bool:
    choices = engine.explain(scene, time_step=0.01, method=method)
    return "in the plane" in next(c.reason for c in choices if c.stage == "solve_block")


def state(result: Result) -> np.ndarray:
    return np.concatenate(list(result.final_state.values()))


def both(scene: Scene, h: float, steps: int, method: Method = PLAIN) -> tuple[Result, Result]:
    """By numbers of the plane, and by rows of space."""
    plane, space = (
        simulate(scene, time_step=h, steps=steps, method=m) for m in (method, in_rows_of_space(method))
    )
    return plane, space


@pytest.mark.parametrize("loops", [0, 1])
@pytest.mark.parametrize("seed", range(6))
def test_steps_are_those_of_the_dense_oracle(seed: int, loops: int) -> None:
    """Trees of every joint and chains of hinges held at both ends; steps so long that another map would show."""
    rng, h, steps = np.random.default_rng(seed), 0.1, 4
    scene = mechanism(rng, 3, 0) if not loops else mechanism(rng, 4, loops, chain=True, joints=(Hinge,))
    observe: dict[str, Observable] = traces(x=Position(), v=Velocity(), w=AngularVelocity())
    for row in scene.constraints:
        observe[f"force {row.name}"] = Trace(quantity=ConstraintForce(row.name))
        observe[f"off {row.name}"] = Trace(quantity=Violation(row.name))

    run = simulate(scene, time_step=h, steps=steps, observe=observe, method=PLAIN)

    assert solves_in_plane(scene)
    oracle = RigidOracle(scene, h)
    for k in range(1, steps + 1):
        oracle.step()
        assert np.abs(run["x"][k] - oracle.x).max() < 1e-11
        assert np.abs(run["v"][k] - oracle.v).max() < 1e-10
        assert np.abs(run["w"][k] - oracle.angular_velocity()).max() < 1e-10
        for joint, load in zip(oracle.joints, oracle.loads, strict=True):
            name = joint.constraint.name
            assert np.abs(run[f"force {name}"][k] - load).max() < 1e-10 * (1.0 + np.abs(load).max()), name
            off = joint.violation(oracle.x, oracle.q, oracle)
            assert np.abs(run[f"off {name}"][k] - off).max() < 1e-11, name


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])  # m
def test_steps_are_those_of_rows_in_space(size: float, method: Method) -> None:
    """Sixty mechanisms each: masses of six decades, compliance from none to 1 m/N, loops that fit no motion."""
    kinds = []
    for seed in range(60):
        rng = np.random.default_rng([seed, round(1e3 * size)])
        compliances = ((1e-8,), (0.0,), (0.0, 1e-12, 1e-4, 1.0))[seed % 3]
        bodies, loops, chain = 1 + seed % 5, int(rng.integers(3)), bool(rng.integers(2))
        speed, h = float(rng.choice([0.0, 1.0, 10.0])), float(rng.choice([1e-3, 1 / 60, 0.1]))
        scene = mechanism(
            rng, bodies, loops, chain=chain, decades=3.0, compliances=compliances, reach=size, speed=speed
        )
        plane, space = both(scene, h * min(1.0, size**0.5), 12, method)
        kinds.append((solves_in_plane(scene, method), plane.status))

        told = [(r.status, r.failed_body, r.failed_step, r.failure) for r in (plane, space)]
        assert told[0] == told[1], seed
        if plane.completed:
            scale = np.abs(state(space)).max()
            assert np.abs(state(plane) - state(space)).max() < 1e-11 * scale, seed
    assert kinds.count((True, "completed")) > 20 and kinds.count((True, "diverged")) > 1


def four_bar(compliance: float = 1e-8, **changes: object) -> Scene:
    scene = four_bars.scene(2, 0.01)
    rows = tuple(replace(row, compliance=compliance) for row in scene.constraints)
    return replace(scene, constraints=rows, **changes)  # type: ignore[arg-type]


def rods(count: int, load: float = 1.0, compliance: float = 1e-8) -> Scene:
    """Rods of 1 m and 1 kg in a row from the world, the last of `load` kg."""
    bodies = tuple(
        RigidBody(
            name=f"rod {k}",
            mass=1.0 if k + 1 < count else load,
            inertia=(0.01, 1 / 12, 1 / 12),
            position=(k + 0.5, 0.0, 0.0),
        )
        for k in range(count)
    )
    rows = tuple(
        Hinge(
            name=f"pin {k}",
            between=(f"rod {k - 1}" if k else WORLD, f"rod {k}"),
            at=(k, 0.0, 0.0),
            compliance=compliance,
        )
        for k in range(count)
    )
    return Scene(bodies=bodies, constraints=rows, gravity=(0.0, -9.81, 0.0), contacts=False)


@pytest.mark.parametrize("compliance", [0.0, 1e-12, 1e-8])
def test_loops_are_watched_for_rows_that_lock_as_often_as_in_space(compliance: float) -> None:
    """And through the horizontal, where the rows of the plane are dependent and space takes over."""
    plane, space = both(four_bar(compliance), 1 / 240, 300)

    assert solves_in_plane(four_bar(compliance))
    assert (plane.status, plane.failed_step, plane.failure) == (
        space.status,
        space.failed_step,
        space.failure,
    )
    assert plane.counters["redundancy_looks"] == space.counters["redundancy_looks"] > 3
    assert np.abs(state(plane) - state(space)).max() < 1e-9


def test_a_divergence_names_step_body_and_cause_as_in_space() -> None:
    plane, space = both(rods(6, load=1e5), 1 / 60, 400)

    assert solves_in_plane(rods(6, load=1e5))
    assert plane.status == "diverged" and "tension" in plane.failure
    assert (plane.failed_step, plane.failed_body, plane.failure) == (
        space.failed_step,
        space.failed_body,
        space.failure,
    )


def test_a_rod_whose_swing_pulls_more_than_a_step_can_follow_is_named() -> None:
    """At 3 rad a step the rows that stand still in it no longer guide it round its hinge."""
    scene = rods(2)
    spun = replace(scene.bodies[1], angular_velocity=(0.0, 0.0, 300.0))
    plane, space = both(replace(scene, bodies=(scene.bodies[0], spun)), 0.01, 5)

    assert plane.failure == space.failure and "tension" in plane.failure
    assert (plane.failed_step, plane.failed_body) == (space.failed_step, space.failed_body)


def test_joint_forces_and_energy_are_those_of_space() -> None:
    scene = mechanism(np.random.default_rng(5), 4)
    observe: dict[str, Observable] = {
        row.name: Trace(quantity=ConstraintForce(row.name)) for row in scene.constraints
    }
    observe["energy"] = Trace(quantity=Energy())
    for method in METHODS.values():
        plane, space = (
            simulate(scene, time_step=0.02, steps=30, method=m, observe=observe)
            for m in (method, in_rows_of_space(method))
        )
        for name in observe:
            scale = 1.0 + np.abs(space[name]).max()
            assert np.abs(plane[name] - space[name]).max() < 1e-10 * scale, name


def on_a_floor(scene: Scene) -> Scene:
    floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, -9.0, 0.0))
    box = RigidBody(name="box", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(9.0, 0.0, 0.0))
    return replace(scene, bodies=(*scene.bodies, floor, box), contacts=True)


def with_first(scene: Scene, **changes: object) -> Scene:
    return replace(scene, bodies=(replace(scene.bodies[0], **changes), *scene.bodies[1:]))  # type: ignore[arg-type]


def with_joint(scene: Scene, joint: object) -> Scene:
    return replace(scene, constraints=(joint, *scene.constraints[1:]))  # type: ignore[arg-type]


BESIDE: dict[str, Callable[[Scene], Scene]] = {
    "gravity leaves the plane": lambda s: replace(s, gravity=(0.0, -9.81, 1e-9)),
    "a joint beside it": lambda s: with_joint(s, replace(s.constraints[0], at=(0.0, 0.0, 1e-9))),
    "an axis that leans": lambda s: with_joint(s, replace(s.constraints[0], axis=(1e-9, 0.0, 1.0))),
    "a body that would wobble": lambda s: with_first(s, orientation=(0.8, 0.36, 0.48, 0.0)),
    "a speed out of it": lambda s: with_first(s, velocity=(0.0, 0.0, 1e-9)),
    "a spin out of it": lambda s: with_first(s, angular_velocity=(1e-9, 0.0, 0.0)),
    "a ball": lambda s: with_joint(s, Ball(name="pin 0", between=(WORLD, "rod 0"), at=(0, 0, 0))),
    "a motor": lambda s: with_joint(s, replace(s.constraints[0], motor=Motor(speed=1.0))),
    "twice the same hinge": lambda s: replace(
        s, constraints=(*s.constraints, replace(s.constraints[0], name="again"))
    ),
    "nothing holds it": lambda s: replace(s, constraints=s.constraints[1:]),
    "a spring": lambda s: replace(
        s, forces=(Spring(name="pull", between=("rod 0", "rod 1"), stiffness=1.0, rest_length=1.0),)
    ),
    "a torque that tips": lambda s: replace(
        s, forces=(Load(name="tip", body="rod 0", torque=(1.0, 0.0, 0.0)),)
    ),
    "a surface": on_a_floor,
}


@pytest.mark.parametrize("name", BESIDE)
def test_what_may_leave_the_plane_is_solved_in_space(name: str) -> None:
    assert solves_in_plane(rods(2))
    assert not solves_in_plane(BESIDE[name](rods(2)))


@pytest.mark.parametrize(
    "method",
    [
        Method(string_stiffness=True),
        Method(solver="iterative"),
        Method(force_stages=("solve_block",)),
        Method(force_stages=("collision",)),
    ],
)
def test_so_is_what_asks_for_more_than_the_step(method: Method) -> None:
    assert solves_in_plane(rods(2), Method(refinements=3))
    assert not solves_in_plane(rods(2), method)


def test_a_load_heavier_than_its_rods_can_tell_is_solved_in_space() -> None:
    assert solves_in_plane(rods(3, load=100.0, compliance=0.0))
    assert not solves_in_plane(rods(3, load=1e6, compliance=0.0))
    assert solves_in_plane(rods(3, load=1e6, compliance=1e-6))  # where rows give, no pivot is small


def test_more_refinements_are_heard() -> None:
    """Of locks as small as a millimetre the sums of one pass keep eleven digits."""
    lock = Lock(name="lock", between=("rod 0", "rod 1"), at=(1.0, 0.0, 0.0))
    scene = replace(rods(2), constraints=(rods(2).constraints[0], lock))
    observe: dict[str, Observable] = finals(x=Position())
    ends = [
        simulate(scene, time_step=0.1, steps=20, method=Method(refinements=r), observe=observe)["x"]
        for r in (0, 1, 2)
    ]

    assert np.abs(ends[0] - ends[2]).max() < 1e-9 and np.abs(ends[1] - ends[2]).max() < 1e-13


def test_a_step_in_the_plane_is_one_factorisation_and_a_block_for_each_pair_of_joints() -> None:
    work = simulate(rods(3), time_step=0.01, steps=10).counters

    assert (work["factorisations"], work["block_operations"]) == (10, 50)


def test_a_static_body_holds_as_the_world_does() -> None:
    wall = RigidBody(name="wall", motion="static", position=(-1.0, 0.0, 0.0))
    scene = rods(2)
    pin = replace(scene.constraints[0], between=("wall", "rod 0"))
    held = replace(scene, bodies=(*scene.bodies, wall), constraints=(pin, *scene.constraints[1:]))

    assert solves_in_plane(held)
    plane, space = both(held, 0.02, 20)
    assert np.abs(state(plane) - state(space)).max() < 1e-12

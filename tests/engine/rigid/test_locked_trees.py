"""Bodies locked to each other in trees are solved link by link: the dense solve of the SPOOK equations all the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Box,
    ConstraintForce,
    Load,
    Lock,
    Method,
    Plane,
    Program,
    RigidBody,
    Scene,
    compile,
    start,
)
from tests.engine.rigid.test_oracle import largest_differences
from tests.scenes.rigid import GRAVITY, TIME_STEP, between, rigid_body, vector

LINKED = "link by link"  # what explain says of it


def locked(seed: int, root: str, spins: bool = False) -> Scene:
    """A random tree of random bodies on locks, softer along than about, named from either end."""
    rng, count = np.random.default_rng(seed), 6
    bodies = [rigid_body(rng, i) for i in range(count)]
    rows = []
    for i in range(count):
        if i == 0 and root == "floats":
            continue
        parent = int(rng.integers(max(0, i - 3), i)) if i else -1
        ends = (f"b{parent}" if i else "ground" if root != "world" else WORLD, f"b{i}")
        along, about = rng.choice([0.0, 1e-9, 1e-6, 1e-4, 1e-2], 2)
        rows.append(
            Lock(
                name=f"lock {i}",
                between=ends if rng.random() < 0.5 else ends[::-1],
                at=between(bodies, parent, i) if i else (0.5, 0.0, 0.0),  # type: ignore[arg-type]
                compliance=(float(along),) * 3 + (float(about),) * 3,
                damping=(0.03,) * 3 + (0.01,) * 3,
            )
        )
    ground = RigidBody(
        name="ground",
        motion="kinematic" if root == "driven" else "static",
        position=(0.0, 0.0, 0.0),
        velocity=(0.3, -0.2, 0.1) if root == "driven" else (0.0, 0.0, 0.0),
        angular_velocity=(0.5, 0.7, -0.4) if spins else (0.0, 0.0, 0.0),
    )
    push = Load(name="push", body="b2", force=vector(rng, 2.0), torque=vector(rng, 0.5))
    return Scene(bodies=(ground, *bodies), constraints=tuple(rows), forces=(push,), gravity=GRAVITY)


def solving(program: Program) -> str:
    """What explain says of the solve."""
    return next(choice.reason for choice in program.explain() if choice.stage == "solve_block")


def end(program: Program, steps: int) -> np.ndarray:
    return np.array(list(program.run(steps).final_state.values()))


@pytest.mark.parametrize(("seed", "root"), list(enumerate(["world", "static", "driven", "floats"])))
def test_a_tree_of_locks_is_the_dense_solve(seed: int, root: str) -> None:
    scene = locked(seed, root)

    assert LINKED in solving(compile(scene, time_step=TIME_STEP))
    worst = largest_differences(scene, steps=6)
    assert max(worst.values()) < 1e-10, worst


@pytest.mark.parametrize("spins", [False, True])
def test_a_branch_softer_in_one_direction_goes_the_general_way_to_the_same_place(spins: bool) -> None:
    """Ten decimals of a compliance apart, the two ways agree to what those decimals do."""
    scene = locked(3, "driven", spins)
    first = scene.constraints[0]
    assert isinstance(first, Lock)
    skewed = replace(first, compliance=(1e-6 * (1 + 1e-10), *(1e-6,) * 5))
    even = replace(scene, constraints=(replace(first, compliance=1e-6), *scene.constraints[1:]))
    odd = replace(scene, constraints=(skewed, *scene.constraints[1:]))
    ways = [compile(s, time_step=TIME_STEP) for s in (even, odd)]

    assert [LINKED in solving(way) for way in ways] == [True, False]
    ends = [end(way, 50) for way in ways]
    np.testing.assert_allclose(ends[0], ends[1], rtol=0.0, atol=1e-10)


@pytest.mark.parametrize(
    "options", [{"half_step_velocities": True}, {"string_stiffness": True}, {"corrections": 1}]
)
def test_more_than_plain_steps_go_the_general_way(options: dict[str, object]) -> None:
    program = compile(locked(4, "world"), time_step=TIME_STEP, method=Method(**options))  # type: ignore[arg-type]

    assert LINKED not in solving(program)


def test_a_ring_and_a_beam_held_at_both_ends_go_the_general_way() -> None:
    scene = locked(5, "world")
    for extra in (
        Lock(name="second", between=(WORLD, "b5"), compliance=1e-6),
        Lock(name="ring", between=("b0", "b5"), compliance=1e-6),
    ):
        closed = replace(scene, constraints=(*scene.constraints, extra))

        assert LINKED not in solving(compile(closed, time_step=TIME_STEP))


def test_more_refinements_change_less_than_rounding_adds_up_to() -> None:
    scene = locked(6, "world")
    ends = [end(compile(scene, time_step=TIME_STEP, method=Method(refinements=n)), 40) for n in (0, 1, 2)]

    np.testing.assert_allclose(ends[0], ends[1], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(ends[1], ends[2], rtol=0.0, atol=1e-12)


def test_what_a_lock_carries_does_not_depend_on_how_many_steps_are_taken_at_once() -> None:
    """Bodies that fall in the first of them and touch in the last: contacts are solved with other rows."""
    box, ground = (
        Box((0.2, 0.2, 0.2)),
        RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0)),
    )
    pair = [
        RigidBody(name=n, mass=1.0, shape=box, position=(x, 0.0, 0.35)) for n, x in (("a", 0.0), ("b", 0.2))
    ]
    post = RigidBody(name="post", motion="static", shape=Box((0.2, 0.2, 0.1)), position=(0.25, 0.0, 0.05))
    scene = Scene(
        bodies=(ground, post, *pair),
        constraints=(Lock(name="lock", between=("a", "b"), at=(0.1, 0.0, 0.35)),),
        gravity=(0.0, 0.0, -9.81),
    )

    def carried(steps: int) -> np.ndarray:
        with start(scene, time_step=1 / 60, observe={"force": ConstraintForce("lock")}) as run:
            for _ in range(12 // steps):
                run.step(steps)
            return np.array(run["force"])

    each = carried(1)
    assert np.abs(each).max() > 1.0
    for steps in (2, 6, 12):
        np.testing.assert_array_equal(carried(steps), each)

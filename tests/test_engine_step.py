"""The native step is the SPOOK step: it follows a dense solve of the equations on chains, trees and loops."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from engine import (
    CentralGravity,
    ConstraintForce,
    Distance,
    Load,
    Method,
    Particle,
    Position,
    Scene,
    Spring,
    Trace,
    Velocity,
    Violation,
    simulate,
)
from tests.oracle import Oracle

TIME_STEP = 0.01  # s
STEPS = 60


def cloud(seed: int, count: int) -> tuple[np.random.Generator, list[Particle]]:
    """Particles about one metre apart with random masses and slow random velocities."""
    rng = np.random.default_rng(seed)
    bodies = [
        Particle(
            name=f"p{i}",
            mass=float(rng.uniform(0.5, 3.0)),
            position=(float(i) + rng.uniform(-0.2, 0.2), rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3)),
            velocity=tuple(rng.uniform(-0.3, 0.3, 3)),
        )
        for i in range(count)
    ]
    return rng, bodies


def rod(rng: np.random.Generator, first: object, second: object, *, rigid: bool = False) -> Distance:
    return Distance(
        name=f"{first} to {second}",
        between=(first, second),  # type: ignore[arg-type]
        compliance=1e-13 if rigid else float(10.0 ** rng.uniform(-9.0, -3.0)),
        damping=None if rng.random() < 0.3 else float(rng.uniform(0.5, 3.0) * TIME_STEP),
    )


def chain(seed: int) -> Scene:
    rng, bodies = cloud(seed, 6)
    rows = [rod(rng, (-1.0, 0.0, 0.0), "p0"), *(rod(rng, f"p{i}", f"p{i + 1}") for i in range(5))]
    return Scene(bodies=bodies, constraints=rows, gravity=(0.0, 0.0, -9.81))


def tree(seed: int) -> Scene:
    rng, bodies = cloud(seed, 8)
    rows = [rod(rng, (0.0, 2.0, 0.0), "p3")]
    rows += [rod(rng, f"p{int(rng.integers(0, i))}", f"p{i}") for i in range(1, 8)]
    return Scene(bodies=bodies, constraints=rows, gravity=(0.0, -9.81, 0.0))


def loop(seed: int) -> Scene:
    rng, bodies = cloud(seed, 6)
    rows = [rod(rng, f"p{i}", f"p{(i + 1) % 6}") for i in range(6)]
    rows += [rod(rng, "p0", "p3"), rod(rng, (0.0, 0.0, 3.0), "p2")]
    return Scene(bodies=bodies, constraints=rows, gravity=(1.0, 2.0, -9.81))


def two_chains_and_a_loner(seed: int) -> Scene:
    rng, bodies = cloud(seed, 7)
    rows = [rod(rng, "p1", "p0"), rod(rng, "p2", "p1"), rod(rng, "p4", "p5"), rod(rng, (5.0, 1.0, 1.0), "p5")]
    return Scene(bodies=bodies, constraints=rows, gravity=(0.0, 0.0, -9.81))


def everything(seed: int) -> Scene:
    rng, bodies = cloud(seed, 5)
    rows = [rod(rng, (-1.0, 0.0, 0.0), "p0"), rod(rng, "p0", "p1"), rod(rng, "p1", "p2")]
    forces = (
        Spring(name="damped", between=("p2", "p3"), stiffness=40.0, rest_length=0.8, viscosity=0.5),
        Spring(name="soft", between=((0.0, 1.0, 0.0), "p4"), stiffness=3.0),
        CentralGravity(name="star", strength=2.0, centre=(2.0, 5.0, 0.0)),
        Load(name="push", body="p1", force=(0.0, 1.5, -0.5)),
    )
    return Scene(bodies=bodies, constraints=rows, forces=forces, gravity=(0.0, 0.0, -1.0))


SCENES = {f.__name__: f for f in (chain, tree, loop, two_chains_and_a_loner, everything)}


def compare(scene: Scene, method: Method, steps: int = STEPS, tolerance: float = 1e-11) -> None:
    observe = {
        "x": Trace(quantity=Position()),
        "v": Trace(quantity=Velocity()),
        "f": Trace(quantity=ConstraintForce()),
        "g": Trace(quantity=Violation()),
    }
    found = simulate(scene, time_step=TIME_STEP, steps=steps, method=method, observe=observe)
    oracle = Oracle(scene, TIME_STEP, method)
    for sample, (x, v, force) in enumerate(oracle.samples(steps)):
        np.testing.assert_allclose(found["x"][sample], x, rtol=0.0, atol=tolerance)
        np.testing.assert_allclose(found["v"][sample], v, rtol=0.0, atol=100.0 * tolerance)
        np.testing.assert_allclose(found["g"][sample], oracle.violation(x), rtol=0.0, atol=2.0 * tolerance)
        if not method.half_step_velocities:  # a force is λ/h, positive where it pushes; tension pulls
            np.testing.assert_allclose(found["f"][sample], -force, rtol=1e-8, atol=1e-7)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("kind", SCENES)
def test_every_step_equals_the_dense_solve(kind: str, seed: int) -> None:
    compare(SCENES[kind](seed), Method())


@pytest.mark.parametrize("kind", SCENES)
def test_substeps_are_smaller_steps(kind: str) -> None:
    compare(SCENES[kind](4), Method(substeps=3), steps=20)


@pytest.mark.parametrize("corrections", [1, 2])
@pytest.mark.parametrize("kind", SCENES)
def test_curved_constraints_equal_the_dense_solve(kind: str, corrections: int) -> None:
    compare(SCENES[kind](5), Method(corrections=corrections), tolerance=1e-10)


@pytest.mark.parametrize("kind", SCENES)
def test_half_step_velocities_equal_the_dense_solve(kind: str) -> None:
    scene = SCENES[kind](6)
    at_rest = [dataclasses.replace(body, velocity=(0.0, 0.0, 0.0)) for body in scene.bodies]
    compare(dataclasses.replace(scene, bodies=at_rest), Method(half_step_velocities=True), tolerance=1e-10)


def test_the_block_solver_gives_what_the_path_solver_gives() -> None:
    """Forcing the general solver on a chain changes the rounding only."""
    scene = chain(7)
    observe = {"x": Trace(quantity=Position())}
    path = simulate(scene, time_step=TIME_STEP, steps=STEPS, observe=observe)
    forced = Method(force_stages=("solve_block",))
    block = simulate(scene, time_step=TIME_STEP, steps=STEPS, observe=observe, method=forced)

    assert "solve_path" in path.stages and "solve_block" in block.stages
    np.testing.assert_allclose(block["x"], path["x"], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("kind", ["chain", "tree", "loop"])
def test_the_iterative_solver_converges_to_the_direct_one(kind: str) -> None:
    scene = SCENES[kind](8)
    observe = {"x": Trace(quantity=Position())}
    direct = simulate(scene, time_step=TIME_STEP, steps=20, observe=observe)
    sweeps = Method(solver="iterative", iterations=100_000, residual_tolerance=1e-15)
    iterated = simulate(scene, time_step=TIME_STEP, steps=20, observe=observe, method=sweeps)

    np.testing.assert_allclose(iterated["x"], direct["x"], rtol=0.0, atol=1e-9)
    assert iterated.counters["sweeps"] > 20


def test_a_wrong_equation_would_be_seen() -> None:
    """The comparison is sharp: another damping in one row parts the two at once."""
    scene = chain(1)
    first = scene.constraints[0]
    assert isinstance(first, Distance)
    other = Distance(
        name=first.name, between=first.between, compliance=first.compliance, damping=2.5 * TIME_STEP
    )
    changed = Scene(bodies=scene.bodies, constraints=(other, *scene.constraints[1:]), gravity=scene.gravity)
    end = simulate(changed, time_step=TIME_STEP, steps=1, observe={"x": Trace(quantity=Position())})["x"][-1]
    oracle = Oracle(scene, TIME_STEP)
    oracle.step()

    assert np.abs(end - oracle.x).max() > 1e-7

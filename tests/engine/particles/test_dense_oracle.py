"""The native step is the dense solve of the SPOOK equations: on chains, trees, loops, with every force and option."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spook_tracker import engine
from spook_tracker.engine import (
    AngularMomentum,
    ConstraintForce,
    Distance,
    KineticEnergy,
    Method,
    Momentum,
    Particle,
    Position,
    PotentialEnergy,
    Scene,
    Trace,
    Velocity,
    Violation,
)
from tests.oracles import simulate as oracle_simulate
from tests.scenes.particle import GRAVITY, KINDS, TIME_STEP, chain, tie

QUANTITIES = {
    "position": Position(),
    "velocity": Velocity(),
    "violation": Violation(),
    "tension": ConstraintForce(),
    "kinetic": KineticEnergy(),
    "potential": PotentialEnergy(),
    "momentum": Momentum(),
    "spin": AngularMomentum(about=(1.0, -2.0, 0.5)),
}


def largest_differences(scene: Scene, method: Method, steps: int) -> dict[str, float]:
    """Largest difference of each quantity over all samples, relative to its largest value (at least 1)."""
    observe = {name: Trace(quantity=quantity) for name, quantity in QUANTITIES.items()}
    native = engine.simulate(scene, time_step=TIME_STEP, steps=steps, method=method, observe=observe)
    dense = oracle_simulate.simulate(scene, time_step=TIME_STEP, steps=steps, method=method, observe=observe)
    return {
        name: float(np.max(np.abs(native[name] - dense[name]), initial=0.0))
        / max(1.0, float(np.max(np.abs(dense[name]), initial=0.0)))
        for name in QUANTITIES
    }


def assert_equal(scene: Scene, method: Method, steps: int = 40, tolerance: float = 1e-11) -> None:
    differences = largest_differences(scene, method, steps)
    assert max(differences.values()) < tolerance, differences


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", KINDS)
def test_the_step_is_the_dense_solve(kind: str, seed: int) -> None:
    assert_equal(KINDS[kind](np.random.default_rng(seed)), Method())


@pytest.mark.parametrize("kind", KINDS)
def test_substeps_are_smaller_steps(kind: str) -> None:
    assert_equal(KINDS[kind](np.random.default_rng(11)), Method(substeps=3), steps=15)


@pytest.mark.parametrize("corrections", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
def test_curved_rows_are_the_averaged_law(kind: str, corrections: int) -> None:
    assert_equal(KINDS[kind](np.random.default_rng(12)), Method(corrections=corrections))


def test_the_cap_bounds_the_curvature() -> None:
    """A fast short row reaches the cap in its first step."""
    stone = Particle(name="stone", mass=1.0, position=(0.1, 0.0, 0.0), velocity=(0.0, 9.0, 0.0))
    scene = Scene(bodies=(stone,), constraints=(Distance(name="row", between=((0.0, 0.0, 0.0), "stone")),))
    tight, loose = (Method(corrections=2, correction_cap=cap) for cap in (0.05, 1.0))

    assert_equal(scene, tight, steps=5)
    assert_equal(scene, loose, steps=5)
    ends = [
        engine.simulate(scene, time_step=TIME_STEP, steps=5, method=m).final_state["stone"][0]
        for m in (tight, loose)
    ]
    assert abs(ends[0] - ends[1]) > 1e-3


@pytest.mark.parametrize("kind", KINDS)
def test_half_step_velocities_from_rest(kind: str) -> None:
    """At rest the half kick is free of the choice how Ġ v is found, so both agree to rounding."""
    scene = KINDS[kind](np.random.default_rng(13))
    rest = [Particle(name=b.name, mass=b.mass or 1.0, position=b.position) for b in scene.bodies]
    still = Scene(bodies=rest, constraints=scene.constraints, forces=scene.forces, gravity=scene.gravity)
    assert_equal(still, Method(half_step_velocities=True))


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    parents=st.lists(st.integers(0, 10**6), min_size=1, max_size=12),
    extra=st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 10**6)), max_size=3),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_graph_of_rows(parents: list[int], extra: list[tuple[int, int]], seed: int) -> None:
    """Any forest rooted in the world, and loops closed at will by compliant rows."""
    rng = np.random.default_rng(seed)
    count = len(parents)
    bodies = [
        Particle(
            name=f"p{i}",
            mass=float(rng.uniform(0.5, 2.0)),
            position=(3.0 * i + rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)),
        )
        for i in range(count)
    ]
    rows: list[Distance] = []
    for i, parent in enumerate(parents):
        above = parent % (i + 1)  # 0 is the world
        rows.append(tie(rng, (0.0, 5.0, 0.0) if above == 0 else f"p{above - 1}", f"p{i}"))
    known = {frozenset(map(str, row.between)) for row in rows}
    for first, second in extra:
        pair = (f"p{first % count}", f"p{second % count}")
        if pair[0] != pair[1] and frozenset(pair) not in known:
            known.add(frozenset(pair))
            rows.append(Distance(name="+".join(pair), between=pair, compliance=1e-5))
    assert_equal(Scene(bodies=bodies, constraints=rows, gravity=GRAVITY), Method(), steps=8)


def test_forcing_the_general_solver_changes_rounding_only() -> None:
    scene = chain(np.random.default_rng(14))
    general = Method(force_stages=("solve_block",))

    assert "solve_path" in engine.compile(scene, time_step=TIME_STEP).stages
    assert "solve_block" in engine.compile(scene, time_step=TIME_STEP, method=general).stages
    assert_equal(scene, general)


@pytest.mark.parametrize("kind", ["chain", "tree"])
def test_iterations_converge_to_the_dense_solve(kind: str) -> None:
    sweeps = Method(solver="iterative", iterations=20_000, residual_tolerance=1e-15)
    assert_equal(KINDS[kind](np.random.default_rng(15)), sweeps, steps=10, tolerance=1e-9)


def test_the_comparison_is_sharp() -> None:
    """Five per cent more damping in one row of six parts the two in a single step."""
    scene = chain(np.random.default_rng(16))
    first = scene.constraints[0]
    assert isinstance(first, Distance)
    damped = [
        Distance(name=first.name, between=first.between, compliance=1e-8, damping=damping)
        for damping in (0.02, 0.021)
    ]
    scenes = [
        Scene(bodies=scene.bodies, constraints=(row, *scene.constraints[1:]), gravity=GRAVITY)
        for row in damped
    ]
    observe = {"x": Trace(quantity=Position())}
    native = engine.simulate(scenes[0], time_step=TIME_STEP, steps=1, observe=observe)
    dense = oracle_simulate.simulate(scenes[1], time_step=TIME_STEP, steps=1, observe=observe)

    assert np.abs(native["x"] - dense["x"]).max() > 1e-6

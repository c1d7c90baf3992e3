"""Work counters are exact, hashes repeat and notice the last bit, time limits and failures are results."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    CentralGravity,
    Distance,
    Energy,
    Final,
    Maximum,
    Method,
    Particle,
    Position,
    RigidBody,
    Scene,
    SimulationFailed,
    Spring,
    Trace,
    simulate,
)
from tests.scenes.particle import KINDS, TIME_STEP, chain, loop, tree


def test_counters_follow_the_size_of_the_work() -> None:
    scene = chain(np.random.default_rng(1), count=6)  # six rows
    for steps in (1, 7, 100):
        counters = simulate(scene, time_step=TIME_STEP, steps=steps).counters
        assert counters["steps"] == counters["substeps"] == steps
        assert counters["rows_assembled"] == 6 * steps
        assert counters["sweeps"] == counters["contacts"] == counters["samples"] == 0
    once = simulate(scene, time_step=TIME_STEP, steps=10).counters
    thrice = simulate(scene, time_step=TIME_STEP, steps=10, method=Method(substeps=3)).counters
    assert thrice["substeps"] == 30
    assert thrice["rows_assembled"] == 3 * once["rows_assembled"]
    assert thrice["block_operations"] == 3 * once["block_operations"]


def test_rigid_bodies_report_the_names_that_particles_report() -> None:
    """What did not happen is 0, not left out: so counters can be compared from version to version."""
    bodies = tuple(
        RigidBody(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0), position=(x, 0.0, 0.0))
        for name, x in (("a", 1.0), ("b", 2.0))
    )
    forces = (
        Spring(name="spring", between=("a", "b"), stiffness=1.0),
        CentralGravity(name="sun", strength=1.0),
    )
    particles = simulate(chain(np.random.default_rng(1)), time_step=TIME_STEP, steps=1)
    plain = simulate(Scene(bodies=bodies), time_step=TIME_STEP, steps=10).counters
    pulled = simulate(
        Scene(bodies=bodies, forces=forces), time_step=TIME_STEP, steps=10, method=Method(substeps=2)
    ).counters

    assert set(particles.counters) <= set(plain)
    assert plain["contacts"] == plain["sweeps"] == plain["force_evaluations"] == 0
    assert pulled["force_evaluations"] == 20 * (1 + 2)


def test_each_correction_is_one_more_back_substitution() -> None:
    scene = chain(np.random.default_rng(1))
    counts = [
        simulate(scene, time_step=TIME_STEP, steps=10, method=Method(corrections=n)).counters
        for n in (0, 1, 2)
    ]
    substitutions = [count["back_substitutions"] for count in counts]

    assert substitutions[2] - substitutions[1] == substitutions[1] - substitutions[0] > 0
    assert counts[0]["rows_assembled"] == counts[2]["rows_assembled"]


def test_work_on_a_chain_and_on_a_tree_grows_with_its_length_only() -> None:
    rng = np.random.default_rng(2)
    for build in (chain, tree):
        work = [
            simulate(build(rng, count), time_step=TIME_STEP, steps=1).counters["block_operations"]
            for count in (50, 100, 200)
        ]
        assert work[2] < 4.4 * work[0], (build.__name__, work)


def test_samples_are_counted_as_they_are_read() -> None:
    scene = chain(np.random.default_rng(1))

    def samples(**observe: object) -> int:
        return simulate(scene, time_step=TIME_STEP, steps=100, observe=observe).counters["samples"]  # type: ignore[arg-type]

    assert samples() == 0
    assert samples(end=Final(quantity=Energy())) == 1
    assert samples(all=Maximum(quantity=Energy())) == 101
    assert samples(some=Maximum(quantity=Energy(), first=90)) <= 12


@pytest.mark.parametrize("kind", KINDS)
def test_a_hair_more_mass_gives_another_hash(kind: str) -> None:
    scene = KINDS[kind](np.random.default_rng(4))
    first = simulate(scene, time_step=TIME_STEP, steps=60)
    body = scene.bodies[0]
    nudged = Particle(
        name=body.name,
        mass=(body.mass or 1.0) * (1.0 + 1e-13),
        position=body.position,
        velocity=body.velocity,
    )
    other = Scene(
        bodies=(nudged, *scene.bodies[1:]),
        constraints=scene.constraints,
        forces=scene.forces,
        gravity=scene.gravity,
    )

    assert simulate(other, time_step=TIME_STEP, steps=60).state_hash != first.state_hash


def exploding(stiffness: float = 1e4) -> Scene:
    """A calm body and one whose spring is far too stiff for a step of a second."""
    calm = Particle(name="calm", mass=1.0, position=(5.0, 0.0, 0.0))
    wild = Particle(name="wild", mass=1.0, position=(1.0, 0.0, 0.0))
    spring = Spring(name="spring", between=((0.0, 0.0, 0.0), "wild"), stiffness=stiffness)
    return Scene(bodies=(calm, wild), forces=(spring,))


def test_a_runaway_names_the_step_in_which_a_bound_was_crossed() -> None:
    """Symplectic Euler with h w = 100: the bound 1e100 is crossed where the plain recursion crosses it."""
    x, v, step = 1.0, 0.0, 0
    while max(abs(x), abs(v)) <= 1e100:
        v -= 1e4 * x
        x += v
        step += 1
    observe = {"x": Trace(quantity=Position("wild")), "end": Final(quantity=Position("wild"))}
    result = simulate(exploding(), time_step=1.0, steps=1000, observe=observe)

    assert (result.status, result.failed_body, result.failed_step) == ("diverged", "wild", step)
    assert result.steps == step - 1
    assert "'wild'" in result.failure and f"step {step}" in result.failure
    assert result.partial["x"].shape == (step, 3) and np.isfinite(result.partial["x"]).all()
    with pytest.raises(SimulationFailed) as failed:
        result["end"]
    assert failed.value.result is result


@pytest.mark.parametrize("huge", [1e150, 1e308])
def test_values_that_overflow_end_the_run(huge: float) -> None:
    result = simulate(exploding(stiffness=huge), time_step=1.0, steps=100)

    assert result.status in ("diverged", "not_finite")
    assert result.failed_body == "wild"
    assert result.failed_step is not None and result.failed_step <= 3


def test_a_row_that_loses_its_direction_ends_the_run() -> None:
    """A body flies exactly into its anchor: the row has no direction there, and the run says so."""
    body = Particle(name="body", mass=1.0, position=(1.0, 0.0, 0.0), velocity=(-0.5, 0.0, 0.0))
    row = Distance(name="row", between=((0.0, 0.0, 0.0), "body"), compliance=1e300, damping=0.0)
    result = simulate(Scene(bodies=(body,), constraints=(row,)), time_step=1.0, steps=10)

    assert result.status == "not_finite"
    assert result.failed_body == "body"
    assert result.failed_step == 3


def test_a_time_limit_ends_a_run_with_what_was_seen() -> None:
    scene = loop(np.random.default_rng(1))
    observe = {"x": Trace(quantity=Position("p0"), every=1000)}
    result = simulate(scene, time_step=1e-5, steps=10_000_000, time_limit=0.1, observe=observe)

    assert result.status == "timed_out"
    assert result.failed_body is None
    assert 0.09 < result.seconds < 2.0
    assert 0 < result.steps < 10_000_000
    assert len(result.partial["x"]) == result.steps // 1000 + 1
    assert "0.1 s" in result.failure
    with pytest.raises(SimulationFailed, match="time limit"):
        result["x"]

"""What is computed from a recorded trajectory is what the native recorder computes in its loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    AngularVelocity,
    ConstraintForce,
    Energy,
    Final,
    JointCoordinate,
    KineticEnergy,
    Maximum,
    MaximumAbsolute,
    Mean,
    MethodError,
    Minimum,
    Momentum,
    Orientation,
    Position,
    PotentialEnergy,
    Scene,
    Trace,
    Velocity,
    Violation,
    simulate,
)
from spook_tracker.engine.joints import AxialJoint
from spook_tracker.engine.observe import ContactCount, ContactForce, Observable, Quantity
from spook_tracker.engine.recording import Recording, needs_every_step, observed, wanted_samples
from tests.scenes import particle as particle_scenes
from tests.scenes import rigid as rigid_scenes

STEPS = 40
STATE = (Position(), Orientation(), Velocity(), AngularVelocity())


def recorded(scene: Scene, time_step: float) -> Recording:
    """The native engine's own trajectory, as an adapter would hand it over."""
    particles = all(not hasattr(body, "orientation") for body in scene.bodies)
    asked = STATE[::2] if particles else STATE
    result = simulate(
        scene, time_step=time_step, steps=STEPS, observe={str(q): Trace(quantity=q) for q in asked}
    )
    traces = [result[str(q)] for q in asked]
    if particles:
        n = len(scene.bodies)
        upright = np.tile([1.0, 0.0, 0.0, 0.0], (STEPS + 1, n, 1))
        traces = [traces[0], upright, traces[1], np.zeros((STEPS + 1, n, 3))]
    positions, orientations, velocities, spins = traces
    return Recording(
        samples=np.arange(STEPS + 1),
        positions=positions,
        orientations=orientations,
        velocities=velocities,
        angular_velocities=spins,
        steps=STEPS,
        seconds=0.0,
    )


def agree(scene: Scene, time_step: float, asked: list[Quantity]) -> None:
    """Every reduction of every quantity, from the recording and from the native loop."""
    reductions = {
        "trace": Trace(quantity=asked[0], first=3, every=4),
        "final": Final(quantity=asked[0]),
        "maximum": Maximum(quantity=asked[0], first=5, last=30),
        "minimum": Minimum(quantity=asked[0], from_start=True),
        "largest": MaximumAbsolute(quantity=asked[0], from_start=True),
        "mean": Mean(quantity=asked[0], first=10, last=20),
    }
    observe: dict[str, Observable] = {
        f"{name} {quantity}": replace(what, quantity=quantity)
        for name, what in reductions.items()
        for quantity in asked
    }
    native = simulate(scene, time_step=time_step, steps=STEPS, observe=observe)

    values, times = observed(scene, recorded(scene, time_step), observe, time_step)

    assert set(values) == set(observe)
    for name in observe:
        assert values[name].shape == np.shape(native[name]), name
        scale = 1.0 + float(np.abs(native[name]).max())
        assert values[name] == pytest.approx(native[name], abs=1e-12 * scale, rel=0.0), name
    assert {name: list(t) for name, t in times.items()} == {
        name: list(t) for name, t in native.sample_times.items()
    }


def test_of_particles_with_every_force() -> None:
    scene = particle_scenes.everything(np.random.default_rng(1))
    names: list[Quantity] = [Violation(c.name) for c in scene.constraints]

    agree(
        scene,
        particle_scenes.TIME_STEP,
        [
            *(Position(), Velocity("p2"), KineticEnergy(), PotentialEnergy(), Energy(), Momentum()),
            *(AngularMomentum(), AngularMomentum((0.3, -0.2, 0.1)), Violation(), *names),
        ],
    )


@pytest.mark.parametrize("kind", sorted(rigid_scenes.JOINTS))
def test_of_every_joint_between_bodies_that_tumble(kind: str) -> None:
    scene = rigid_scenes.one_joint(np.random.default_rng(2), kind, bodies=2)
    joint = scene.constraints[0]
    asked: list[Quantity] = [*STATE, Energy(), Momentum(), AngularMomentum((1.0, 2.0, 3.0))]
    asked += [Violation(joint.name)]
    asked += [JointCoordinate(joint.name)] if isinstance(joint, AxialJoint) else []

    agree(scene, rigid_scenes.TIME_STEP, asked)


def test_of_trees_and_of_everything_at_once() -> None:
    for scene in (
        rigid_scenes.tree(np.random.default_rng(3)),
        rigid_scenes.everything(np.random.default_rng(4)),
    ):
        agree(
            scene,
            rigid_scenes.TIME_STEP,
            [
                *STATE,
                *(KineticEnergy(), PotentialEnergy(), Energy(), AngularMomentum()),
                *(Violation(c.name) for c in scene.constraints),
            ],
        )


def test_forces_come_from_the_engine_or_not_at_all() -> None:
    scene = rigid_scenes.one_joint(np.random.default_rng(5), "ball", bodies=2)
    name, force = scene.constraints[0].name, np.arange(6.0 * (STEPS + 1)).reshape(STEPS + 1, 6)
    bare = recorded(scene, rigid_scenes.TIME_STEP)
    shown = replace(bare, constraint_forces={name: force}, contact_forces={("b0", "b1"): force[:, :3]})
    observe: dict[str, Observable] = {
        "joint": Final(quantity=ConstraintForce(name)),
        "first": Final(quantity=ContactForce("b0")),
        "second": Final(quantity=ContactForce("b1", "b0")),
        "itself": Final(quantity=ContactForce("b0", "b0")),
    }

    values, _ = observed(scene, shown, observe, rigid_scenes.TIME_STEP)

    assert list(values["joint"]) == list(force[-1])
    assert list(values["first"]) == list(force[-1, :3])
    assert list(values["second"]) == list(-force[-1, :3])
    assert list(values["itself"]) == [0.0, 0.0, 0.0]
    with pytest.raises(MethodError, match="ContactCount"):
        observed(scene, bare, {"count": Final(quantity=ContactCount())}, 0.01)


def test_a_run_that_ended_early_has_no_value_for_samples_it_never_reached() -> None:
    scene = particle_scenes.chain(np.random.default_rng(6))
    whole = recorded(scene, particle_scenes.TIME_STEP)
    short = replace(whole, samples=whole.samples[:5], positions=whole.positions[:5])

    values, _ = observed(scene, short, {"late": Maximum(quantity=Position("p0"), first=9)}, 0.01)

    assert np.isnan(values["late"]).all()


def test_only_a_value_between_start_and_end_needs_every_step() -> None:
    end, middle = Final(quantity=Energy()), Final(quantity=Energy(), last=7)

    assert not needs_every_step({"end": end}, 9)
    assert not needs_every_step({}, 9)
    assert needs_every_step({"middle": middle}, 9)
    assert needs_every_step({"largest": Maximum(quantity=Energy())}, 9)


def test_only_the_samples_that_something_reads_are_kept_and_say_the_same() -> None:
    scene = particle_scenes.chain(np.random.default_rng(6))
    observe = {
        "some": Trace(quantity=Position("p0"), first=2, every=3),
        "late": Maximum(quantity=Position("p0"), first=8),
        "one": Final(quantity=Position("p0"), last=4, from_start=True),
    }
    whole = recorded(scene, particle_scenes.TIME_STEP)
    steps = int(whole.samples[-1])
    wanted = wanted_samples(observe, steps)
    parts = ("samples", "positions", "orientations", "velocities", "angular_velocities")
    few = replace(whole, **{name: getattr(whole, name)[wanted] for name in parts})
    got, times = observed(scene, few, observe, particle_scenes.TIME_STEP)
    right, right_times = observed(scene, whole, observe, particle_scenes.TIME_STEP)

    assert set(wanted) == {0, 4, *range(2, steps + 1, 3), *range(8, steps + 1)}
    for name in observe:
        assert np.array_equal(got[name], right[name])
    assert np.array_equal(times["some"], right_times["some"])
    assert list(wanted_samples({}, 9)) == [0, 9]

"""Observables: reductions equal NumPy's of the trace, signs are as stated, and nothing else is computed."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    AngularVelocity,
    Box,
    CentralGravity,
    ConstraintForce,
    Distance,
    Energy,
    Final,
    Hinge,
    JointCoordinate,
    KineticEnergy,
    Maximum,
    MaximumAbsolute,
    Mean,
    Method,
    MethodError,
    Minimum,
    Momentum,
    Orientation,
    Particle,
    Position,
    PotentialEnergy,
    RigidBody,
    Scene,
    Spring,
    Trace,
    Velocity,
    Violation,
    simulate,
)
from spook_tracker.engine.observe import Quantity
from tests.scenes import rigid as rigid_scenes
from tests.scenes.particle import TIME_STEP, chain, everything

OF_ALL = (
    Position(),
    KineticEnergy(),
    PotentialEnergy(),
    Energy(),
    Momentum(),
    AngularMomentum((1.0, 0.0, 2.0)),
)


def observed(of: str) -> tuple[Scene, tuple[Quantity, ...]]:
    """A scene with something of everything, and what it has to show."""
    if of == "particles":
        own = (Position("p2"), Velocity("p0"), Violation(), ConstraintForce())
        return everything(np.random.default_rng(3)), (*OF_ALL, *own)
    scene = rigid_scenes.everything(np.random.default_rng(3))
    hinge = next(c.name for c in scene.constraints if isinstance(c, Hinge))
    turning = (Orientation("b0"), Velocity("dot"), AngularVelocity(), JointCoordinate(hinge))
    rows = tuple(kind(name) for kind in (Violation, ConstraintForce) for name in (hinge, "leash"))
    return scene, (*OF_ALL, *turning, *rows)


REDUCTIONS = {
    Final: lambda samples: samples[-1],
    Maximum: lambda samples: samples.max(axis=0),
    Minimum: lambda samples: samples.min(axis=0),
    MaximumAbsolute: lambda samples: np.abs(samples).max(axis=0),
    Mean: lambda samples: sum(samples[1:], start=samples[0]) / len(samples),
}


@pytest.mark.parametrize("method", [Method(), Method(half_step_velocities=True)], ids=["plain", "half-step"])
@pytest.mark.parametrize("window", [(0, None), (7, 31), (40, 40)], ids=str)
@pytest.mark.parametrize("from_start", [False, True])
@pytest.mark.parametrize("of", ["particles", "rigid bodies"])
def test_reductions_equal_those_of_the_trace(
    of: str, window: tuple[int, int | None], from_start: bool, method: Method
) -> None:
    """To the bit: the loop keeps a running value, the trace every sample."""
    first, last = window
    scene, quantities = observed(of)
    observe = {}
    for i, quantity in enumerate(quantities):
        observe[f"trace {i}"] = Trace(quantity=quantity)
        for kind in REDUCTIONS:
            observe[f"{kind.__name__} {i}"] = kind(
                quantity=quantity, first=first, last=last, from_start=from_start
            )
    result = simulate(scene, time_step=TIME_STEP, steps=40, observe=observe, method=method)

    assert simulate(scene, time_step=TIME_STEP, steps=40, method=method).state_hash == result.state_hash
    for i in range(len(quantities)):
        samples = result[f"trace {i}"]
        samples = samples - samples[0] if from_start else samples
        chosen = samples[first : None if last is None else last + 1]
        for kind, reduce in REDUCTIONS.items():
            np.testing.assert_array_equal(result[f"{kind.__name__} {i}"], reduce(chosen))


def test_a_thinned_trace_is_a_slice_of_the_trace() -> None:
    observe = {
        "all": Trace(quantity=Position()),
        "some": Trace(quantity=Position(), first=3, last=33, every=5),
        "moved": Trace(quantity=Position(), first=3, last=33, every=5, from_start=True),
    }
    result = simulate(chain(np.random.default_rng(1)), time_step=TIME_STEP, steps=40, observe=observe)

    np.testing.assert_array_equal(result["some"], result["all"][3:34:5])
    np.testing.assert_array_equal(result["moved"], result["all"][3:34:5] - result["all"][0])
    np.testing.assert_allclose(result.sample_times["some"], TIME_STEP * np.arange(3, 34, 5), rtol=1e-15)


def test_what_is_observed_does_not_change_the_run() -> None:
    scene, quantities = observed("particles")
    everything_seen = {str(i): Trace(quantity=quantity) for i, quantity in enumerate(quantities)}
    for method in (Method(), Method(half_step_velocities=True, corrections=1), Method(substeps=2)):
        quiet = simulate(scene, time_step=TIME_STEP, steps=50, method=method)
        watched = simulate(scene, time_step=TIME_STEP, steps=50, method=method, observe=everything_seen)
        assert quiet.state_hash == watched.state_hash


def test_each_observable_has_the_stated_sign() -> None:
    """One body, everything by hand: m = 2, x = (3, 4, 0), v = (0, 1, 0)."""
    body = Particle(name="b", mass=2.0, position=(3.0, 4.0, 0.0), velocity=(0.0, 1.0, 0.0))
    scene = Scene(
        bodies=(body,),
        constraints=(Distance(name="row", between=((0.0, 0.0, 0.0), "b"), rest_length=4.5, compliance=0.25),),
        forces=(
            CentralGravity(name="sun", strength=10.0),
            Spring(name="spring", between=((3.0, 0.0, 0.0), "b"), stiffness=6.0, rest_length=1.0),
        ),
        gravity=(0.0, -10.0, 0.0),
    )
    asked = {
        "kinetic": KineticEnergy(),
        "potential": PotentialEnergy(),
        "energy": Energy(),
        "violation": Violation("row"),
        "momentum": Momentum(),
        "spin": AngularMomentum(),
        "spin elsewhere": AngularMomentum((1.0, 0.0, 0.0)),
        "tension": ConstraintForce("row"),
    }
    observe = {name: Trace(quantity=quantity) for name, quantity in asked.items()}
    start = {
        name: v[0] for name, v in simulate(scene, time_step=1e-9, steps=1, observe=observe).partial.items()
    }

    assert start["kinetic"] == pytest.approx(1.0)
    assert start["potential"] == pytest.approx(2.0 * 10.0 * 4.0 - 2.0 * 10.0 / 5.0 + 0.5 * 6.0 * 3.0**2)
    assert start["energy"] == pytest.approx(start["kinetic"] + start["potential"])
    assert start["violation"] == pytest.approx(0.5)
    assert start["momentum"] == pytest.approx([0.0, 2.0, 0.0])
    assert start["spin"] == pytest.approx([0.0, 0.0, 6.0])
    assert start["spin elsewhere"] == pytest.approx([0.0, 0.0, 4.0])
    assert start["tension"] == 0.0  # forces belong to the step that ended


def test_a_rod_in_tension_has_a_positive_force_and_a_strut_a_negative_one() -> None:
    for height, sign in ((-1.0, 1.0), (1.0, -1.0)):
        body = Particle(name="b", mass=2.0, position=(0.0, 0.0, height))
        row = Distance(name="row", between=("b", (0.0, 0.0, 0.0)))
        scene = Scene(bodies=(body,), constraints=(row,), gravity=(0.0, 0.0, -10.0))
        observe = {"f": Final(quantity=ConstraintForce("row"))}
        assert simulate(scene, time_step=0.01, steps=200, observe=observe)["f"] == pytest.approx(sign * 20.0)


def test_shapes_are_those_stated() -> None:
    scene = chain(np.random.default_rng(2), count=4)
    observe = {str(q): Trace(quantity=q, every=2) for q in (Position(), Violation(), Energy(), Momentum())}
    observe["one row"] = Trace(quantity=Violation(scene.constraints[0].name))
    result = simulate(scene, time_step=TIME_STEP, steps=10, observe=observe)

    assert [value.shape for value in result.partial.values()] == [(6, 4, 3), (6, 4), (6,), (6, 3), (11,)]
    assert {state.shape for state in result.final_state.values()} == {(13,)}


def test_an_observable_that_was_not_asked_for_is_an_error_that_says_what_was() -> None:
    result = simulate(
        chain(np.random.default_rng(2)),
        time_step=TIME_STEP,
        steps=1,
        observe={"heat": Final(quantity=Energy())},
    )
    with pytest.raises(KeyError, match="heat"):
        result["weather"]


def test_every_quantity_says_its_shape_and_what_it_costs() -> None:
    for kind in Quantity.__subclasses__():
        assert all(word in (kind.__doc__ or "") for word in ("shape (", "Costs")), kind


@pytest.mark.parametrize("kind", [Violation, ConstraintForce])
def test_all_distances_of_a_scene_that_has_other_constraints_alone_are_refused(kind: type[Quantity]) -> None:
    """It gave an array without a value, in silence."""
    door = RigidBody(name="door", mass=1.0, shape=Box((1.0, 0.1, 1.0)), position=(0.5, 0.0, 0.0))
    hinge = Hinge(name="hinge", between=("world", "door"), at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    scene = Scene(bodies=(door,), constraints=(hinge,))

    with pytest.raises(MethodError, match=r"has none; name one of its constraints, as in \w+\('hinge'\)"):
        simulate(scene, time_step=TIME_STEP, steps=1, observe={"x": Final(quantity=kind())})
    named = simulate(scene, time_step=TIME_STEP, steps=1, observe={"x": Final(quantity=kind("hinge"))})
    assert named["x"].size in (5, 6)

"""Exudyn behind the protocol gives what Exudyn is known to give. Skipped, with the reason, where it is missing."""

from __future__ import annotations

import time
import warnings
from typing import Any

import pytest

from spook_tracker.engine import (
    Distance,
    Hinge,
    MaximumAbsolute,
    Particle,
    RigidBody,
    Scene,
    SimulationFailed,
    Violation,
)
from spook_tracker.engine.find import find

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # it warns when it is imported, and warnings are errors here
    pytest.importorskip(
        "exudyn", reason="the extra exudyn is not installed: pip install 'spook-tracker[exudyn]'"
    )
GRAVITY = (0.0, 0.0, -9.81)


def simulate(scene: Scene, configuration: str, **options: Any) -> Any:
    return find("exudyn").simulate(scene, configuration=configuration, **options)


def test_a_rod_is_kept_on_position_level_and_drifts_on_velocity_level() -> None:
    weight = Particle(name="weight", mass=1.0, position=(1.0, 0.0, 0.0))
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "weight"), compliance=0.0)
    scene = Scene(bodies=(weight,), constraints=(rod,), gravity=GRAVITY)
    observe = {"length": MaximumAbsolute(quantity=Violation("rod"))}

    tight = simulate(scene, "generalised-alpha", time_step=1 / 60, duration=22.0, observe=observe)
    loose = simulate(scene, "trapezoidal", time_step=1 / 60, duration=22.0, observe=observe)

    assert float(tight["length"]) < 1e-8
    assert float(loose["length"]) == pytest.approx(6.8e-4, rel=0.05)


def test_its_time_limit_ends_it_within_its_own_loop(capfd: pytest.CaptureFixture[str]) -> None:
    weight = Particle(name="weight", mass=1.0, position=(1.0, 0.0, 0.0))
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "weight"), compliance=0.0)
    scene = Scene(bodies=(weight,), constraints=(rod,), gravity=GRAVITY)
    began = time.monotonic()

    with pytest.raises(SimulationFailed, match=r"0\.2 s was reached") as failed:
        simulate(scene, "trapezoidal", time_step=1e-5, duration=100.0, time_limit=0.2)["anything"]

    assert failed.value.result.status == "timed_out"
    assert time.monotonic() - began < 20.0  # the whole takes minutes
    assert "FAILED" not in "".join(capfd.readouterr())


def test_redundant_hinges_are_an_outcome_with_its_reason() -> None:
    door = RigidBody(name="door", mass=45.0, inertia=(15.0, 18.0, 4.0), position=(0.5, 0.0, 0.0))
    hinges = tuple(
        Hinge(name=f"h{z}", between=("world", "door"), at=(0.0, 0.0, z), axis=(0.0, 0.0, 1.0), compliance=0.0)
        for z in (-0.75, 0.75)
    )
    scene = Scene(bodies=(door,), constraints=hinges, gravity=GRAVITY)

    result = simulate(scene, "generalised-alpha", time_step=1 / 60, duration=1.0)

    assert result.status == "diverged"
    assert "factorized" in result.failure and ".py" not in result.failure

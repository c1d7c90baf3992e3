"""A run that has completed holds no value that is none: what ran away is said, whatever was asked for."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import Energy, Particle, RigidBody, Scene, Sphere, simulate
from spook_tracker.engine.result import SimulationFailed
from tests.scenes.seen import finals


def body(name: str, **more: object) -> RigidBody:
    return RigidBody(
        name=name, **{"position": (0.0, 0.0, 0.0), "mass": 1.0, "inertia": (1.0, 1.0, 1.0)} | more
    )  # type: ignore[arg-type]


@pytest.mark.parametrize("spin", [1e150, 1e160, 1e200])
def test_a_kinematic_body_that_spins_beyond_arithmetic_has_not_completed(spin: float) -> None:
    driven = body("driven", motion="kinematic", angular_velocity=(0.0, 0.0, spin), shape=Sphere(0.1))
    scene = Scene(bodies=(driven, body("free", position=(3.0, 0.0, 0.0))))

    result = simulate(scene, time_step=0.01, steps=3)

    finite = np.isfinite(result.final_state["driven"]).all()
    assert result.status == ("completed" if finite else "not_finite")
    if not finite:
        assert "body 'driven' has a value that is not finite after step 3" in result.failure


def test_an_energy_beyond_arithmetic_has_not_completed() -> None:
    heavy = Particle(name="heavy", position=(0.0, 0.0, 0.0), velocity=(1e99, 0.0, 0.0), mass=1e200)

    result = simulate(Scene(bodies=(heavy,)), time_step=1e-3, steps=3, observe=finals(energy=Energy()))

    assert result.status == "not_finite"
    assert "the observable 'energy' is infinite" in result.failure
    with pytest.raises(SimulationFailed):
        result["energy"]


def test_numbers_that_are_only_large_complete() -> None:
    fast = Particle(name="fast", position=(0.0, 0.0, 0.0), velocity=(1e99, 0.0, 0.0), mass=1.0)

    result = simulate(Scene(bodies=(fast,)), time_step=1e-3, steps=3, observe=finals(energy=Energy()))

    assert result.status == "completed"
    assert result["energy"] == pytest.approx(0.5e198)

"""MotrixSim behind the protocol: closed forms to single precision. Skipped, with the reason, without it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Ball,
    ContactCount,
    Final,
    Hinge,
    Load,
    Lock,
    Position,
    RigidBody,
    Scene,
)
from spook_tracker.engine.find import find
from spook_tracker.scalar_tests.friction import rolling_friction
from tests.scenes import peer as peer_scenes

pytest.importorskip(
    "motrixsim", reason="the extra motrixsim is not installed: pip install 'spook-tracker[motrixsim]'"
)
SETTINGS = ("many-iterations", "defaults", "equalities")


def run(configuration: str) -> Any:
    return partial(find("motrixsim").simulate, configuration=configuration)


def test_a_pendulum_keeps_its_length_and_errs_by_its_step() -> None:
    (long, coarse), (_, fine) = (peer_scenes.swung(run("defaults"), h) for h in (1 / 240, 1 / 960))

    assert long < 1e-6  # joint coordinates, single precision
    assert coarse / fine == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize("kind", [Ball, Hinge, Lock])
def test_equalities_hold_to_a_millimetre_or_two(kind: type) -> None:
    assert 1e-5 < peer_scenes.left_its_place(run("equalities"), kind) < 2e-3


@pytest.mark.parametrize("configuration", SETTINGS)
def test_a_box_lies_on_four_points(configuration: str) -> None:
    lies = {"n": Final(quantity=ContactCount())}
    found = run(configuration)(peer_scenes.box_on_ground(0.0), time_step=1 / 60, duration=1.0, observe=lies)
    assert found["n"] == 4


def test_friction_of_turning_is_exact_and_that_of_rolling_leads_aside() -> None:
    """By a pyramid of the directions, as MuJoCo's default has it: a ball that rolls askew leaves its line."""
    asked = run("many-iterations")
    turned, rolled = (
        dict(of(lambda scene, **o: asked(scene, **o)))
        for of in (rolling_friction.turn, rolling_friction.roll)
    )

    assert turned["spin_error"] < 1.01 * rolling_friction.SLOWING * rolling_friction.TIME_STEP
    assert 0.01 < rolled["speed_error"] < 0.15 < rolling_friction.SPEED  # m/s


def test_what_it_panics_over_is_an_outcome(capfd: pytest.CaptureFixture[str]) -> None:
    """A chain of 100 links that falls from the level: its factorization meets a pivot that is not positive."""
    found, _, _ = peer_scenes.stretched_and_gained(run("defaults"), 100, 1 / 60, 22.0)

    assert (found.status, found.failure[:31]) == ("diverged", "motrixsim panics: LTL factoriza")
    assert capfd.readouterr() == ("", "")


def test_a_load_pushes_and_turns() -> None:
    body = RigidBody(name="b", mass=2.0, inertia=(1.0, 2.0, 2.5), position=(1.0, 2.0, 3.0))
    load = Load(name="l", body="b", force=(2.0, 0.0, 0.0), torque=(0.0, 0.0, 5.0))
    seen = {"x": Final(quantity=Position("b")), "w": Final(quantity=AngularVelocity("b"))}
    found = run("defaults")(
        Scene(bodies=(body,), forces=(load,), gravity=(0.0, 0.0, 0.0)),
        time_step=1e-3,
        duration=1.0,
        observe=seen,
    )

    np.testing.assert_allclose(found["x"], (1.5, 2.0, 3.0), atol=1e-3)  # half a time step late
    np.testing.assert_allclose(found["w"], (0.0, 0.0, 2.0), atol=1e-3)

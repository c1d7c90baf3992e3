"""Jolt behind the protocol: what it has it does to single precision. Skipped, with the reason, without it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from spook_tracker.engine import Ball, Hinge, Penetration, RigidBody, Scene, Trace
from spook_tracker.engine.find import EngineMissing, find
from tests.scenes import peer as peer_scenes

try:
    JOLT = find("jolt")
except EngineMissing as reason:
    pytest.skip(str(reason), allow_module_level=True)

import spook_tracker.engine.peers.jolt as jolt

STEP = 1.0 / 60.0  # s


def defaults(scene: Scene, **options: Any) -> Any:
    return JOLT.simulate(scene, configuration="defaults", **options)


def test_a_rod_loses_energy_however_often_it_is_iterated() -> None:
    """Two to four fifths of m g l in 22 s at 1/60 s: known of its distance constraint, and not a lack of iterations."""
    few, many = (peer_scenes.swung(run, STEP) for run in (defaults, JOLT.simulate))

    assert 0.004 < few[0] < 0.006
    assert many[0] < 1e-4, "the length is what iterations mend"
    assert 0.7 < few[1] < 0.75
    assert 0.7 < many[1] < 0.75


def test_a_spinning_body_keeps_its_momentum_with_gyroscopic_torques_only() -> None:
    with_, without = (peer_scenes.momentum_lost(run, 1 / 240) for run in (JOLT.simulate, defaults))

    assert with_ < 5e-3
    assert without > 0.02


def test_the_depth_is_that_of_the_deepest_contact() -> None:
    ground, box = peer_scenes.box_on_ground(0.0).bodies
    assert isinstance(box, RigidBody)
    sunken = RigidBody(name="box", mass=1.0, shape=box.shape, position=(0.0, 0.0, 0.46))
    depth = {"depth": Trace(quantity=Penetration())}
    run = JOLT.simulate(Scene(bodies=(ground, sunken)), time_step=STEP, steps=5, observe=depth)

    assert run["depth"][1] == pytest.approx(0.04, abs=1e-6)
    assert run["depth"][5] < run["depth"][1]


def test_where_the_package_shows_no_fixed_body_one_of_ours_holds_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Packages before 1.1.0: played by a script that does not look for it."""
    text = jolt.SCRIPT.read_text(encoding="utf-8")
    shown = "J.JoltInterface.prototype.sGetFixedToWorldBody?.()"
    assert text.count(shown) == 1
    (tmp_path / "jolt.mjs").write_text(text.replace(shown, "undefined"), encoding="utf-8")
    (tmp_path / "loop.mjs").write_bytes(jolt.SCRIPT.with_name("loop.mjs").read_bytes())
    held = [JOLT.simulate(peer_scenes.hung(kind), time_step=STEP, steps=30) for kind in (Ball, Hinge)]
    monkeypatch.setattr(jolt, "SCRIPT", tmp_path / "jolt.mjs")
    alone = [JOLT.simulate(peer_scenes.hung(kind), time_step=STEP, steps=30) for kind in (Ball, Hinge)]

    assert [run.state_hash for run in held] == [run.state_hash for run in alone]

"""MuJoCo Warp behind the protocol: MuJoCo to single precision. Skipped, with the reason, without it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from spook_tracker.engine import Ball, Cylinder, Final, Hinge, Lock, Penetration, Scene
from spook_tracker.engine.find import find
from tests.scenes import peer as peer_scenes

pytest.importorskip(
    "mujoco_warp", reason="the extra mujoco_warp is not installed: pip install 'spook-tracker[mujoco_warp]'"
)


def run(configuration: str, engine: str = "mujoco_warp") -> Any:
    return partial(find(engine).simulate, configuration=configuration)


@pytest.mark.parametrize(("configuration", "off"), [("rk4", 1e-5), ("defaults", 1e-5)])
def test_a_pendulum_gains_what_mujoco_s_gains_and_keeps_its_length(configuration: str, off: float) -> None:
    """The same equations in single precision: what differs is rounding, a millionth of m g l a second at most."""
    theirs = peer_scenes.swung(run(configuration, "mujoco"), 1 / 240)
    length, energy = peer_scenes.swung(run(configuration), 1 / 240)

    assert length < 1e-12  # joint coordinates
    assert energy == pytest.approx(theirs[1], abs=off)
    assert energy > 1e-7  # in double precision Runge-Kutta's is 2e-9


@pytest.mark.parametrize(("configuration", "off"), [("rk4", 1e-4), ("defaults", 1e-3)])
def test_joints_and_shapes_are_held_as_by_mujoco(configuration: str, off: float) -> None:
    for kind in (Ball, Hinge, Lock):
        assert peer_scenes.left_its_place(run(configuration), kind) < 1e-6
    for shape in (None, Cylinder(0.2, 1.0)):
        assert peer_scenes.sunk(run(configuration), shape) == pytest.approx(
            peer_scenes.sunk(run(configuration, "mujoco"), shape), abs=1e-5
        )
    slid = peer_scenes.slid(run(configuration), 0.7)
    assert slid == pytest.approx(peer_scenes.slid(run(configuration, "mujoco"), 0.7), abs=100.0 * off)


def test_a_box_shows_how_deep_it_lies() -> None:
    deep = {"d": Final(quantity=Penetration())}
    found = run("defaults")(peer_scenes.box_on_ground(0.0), time_step=1 / 60, duration=1.0, observe=deep)
    assert 1e-5 < found["d"] < 1e-3


def test_more_contacts_than_there_is_room_for_are_an_outcome(monkeypatch: pytest.MonkeyPatch) -> None:
    """It would leave them out and go on, so that boxes fall through each other."""
    from spook_tracker.engine.peers import warp_graph

    monkeypatch.setattr(warp_graph, "LEAST_ROOM", 2)
    monkeypatch.setattr(warp_graph, "CONTACTS_PER_BODY", 1)
    ground, box = peer_scenes.box_on_ground(0.0).bodies
    above = replace(box, position=(0.0, 0.0, 0.6))
    found = run("defaults")(
        Scene(bodies=(ground, above), gravity=peer_scenes.GRAVITY), time_step=1 / 60, steps=60
    )
    assert (found.status, found.failure[:36]) == ("diverged", "it ran out of room (NARROWPHASE) by ")

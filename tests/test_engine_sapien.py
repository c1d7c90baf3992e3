"""PhysX 5 behind the protocol, by SAPIEN's package: closed forms to single precision. Skipped, with the reason, without it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Ball,
    Capsule,
    ContactForce,
    Cylinder,
    Final,
    Hinge,
    Lock,
    Prismatic,
)
from spook_tracker.engine.find import find
from spook_tracker.engine.protocol import NotSupported
from tests import peer_scenes

pytest.importorskip("sapien", reason="the extra sapien is not installed: pip install 'spook-tracker[sapien]'")
BOTH = ("tgs", "pgs")


def run(configuration: str) -> Any:
    return partial(find("sapien").simulate, configuration=configuration)


@pytest.mark.parametrize("configuration", BOTH)
def test_a_fall_has_the_error_of_the_symplectic_step(configuration: str) -> None:
    assert peer_scenes.fall_error(run(configuration), 1 / 60) == pytest.approx(9.81 / 60.0, abs=1e-4)


@pytest.mark.parametrize("configuration", BOTH)
@pytest.mark.parametrize("kind", [Ball, Hinge, Lock, Prismatic])
def test_a_joint_holds_its_body(kind: Any, configuration: str) -> None:
    assert peer_scenes.left_its_place(run(configuration), kind) < 1e-6


@pytest.mark.parametrize("configuration", BOTH)
@pytest.mark.parametrize("kind", ["ball", "hinge", "lock", "prismatic"])
def test_joints_between_bodies_turned_at_random_move_as_in_our_engine(kind: str, configuration: str) -> None:
    assert peer_scenes.parted_from_ours(run(configuration), kind) < 1e-3


@pytest.mark.parametrize("configuration", BOTH)
def test_a_hinged_body_swings_with_its_period(configuration: str) -> None:
    assert peer_scenes.swings(run(configuration), 1 / 1000) == pytest.approx(1.0, abs=5e-4)


def test_a_rod_keeps_its_length_better_the_smaller_the_step() -> None:
    coarse, fine = (peer_scenes.swung(run("tgs"), h) for h in (1 / 60, 1 / 1000))

    assert fine[0] < 2e-5 < coarse[0]
    assert fine[1] < 0.25 * coarse[1]


@pytest.mark.parametrize("configuration", BOTH)
def test_friction_holds_below_its_coefficient_and_slides_by_the_closed_form_above(configuration: str) -> None:
    assert abs(peer_scenes.slid(run(configuration), 0.3)) < 1e-3
    assert peer_scenes.slid(run(configuration), 0.7) == pytest.approx(0.5 * 0.2 * 9.81 * 4.0, rel=0.01)


@pytest.mark.parametrize(
    ("shape", "height"), [(None, 0.5), (Capsule(0.2, 0.6), 0.5), (Cylinder(0.2, 1.0), 0.5)]
)
def test_shapes_rest_where_they_touch(shape: Any, height: float) -> None:
    assert abs(peer_scenes.sunk(run("tgs"), shape, height)) < 1e-5


def test_a_ball_comes_back_to_restitution_squared() -> None:
    assert peer_scenes.bounced(run("tgs"), 0.5, 1e-3) == pytest.approx(0.25, abs=2e-3)


def test_a_contact_without_friction_shows_the_weight_it_carries_and_one_with_it_is_not_asked() -> None:
    force = {"f": Final(quantity=ContactForce("box"))}
    found = run("tgs")(peer_scenes.box_on_ground(0.0, 0.0), time_step=1 / 60, duration=1.0, observe=force)
    assert found["f"] == pytest.approx([0.0, 0.0, 9.81], abs=1e-3)
    with pytest.raises(NotSupported, match="our adapter cannot ask sapien for a contact force with friction"):
        run("tgs")(peer_scenes.box_on_ground(0.0), time_step=0.01, steps=1, observe=force)


def test_settings_of_one_world_are_not_left_to_the_next() -> None:
    """PhysX takes them for the process: a world by another solver in between changes nothing."""
    alone = peer_scenes.swung(run("pgs"), 1 / 240)
    peer_scenes.swung(run("tgs"), 1 / 240)
    assert np.array_equal(alone, peer_scenes.swung(run("pgs"), 1 / 240))

"""What engines behind the protocol are asked of joints: gears, rods, slides and what a hinge carries, by closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import AngularVelocity, ConstraintForce, Distance, Final, Orientation, simulate
from tests.engine.peers.test_conformance import (
    BOX,
    BOX_AS_IT_COMES,
    BULLET,
    BULLET_LOOSE,
    DART,
    DART_LOOSE,
    DRAKE_LOOSE,
    JOLT,
    JOLT_AS_IT_COMES,
    MERSON,
    MOTRIX,
    MOTRIX_LOOSE,
    MOTRIX_MANY,
    MUJOCO,
    MUJOCO_AS_IT_COMES,
    MUJOCO_LOOSE,
    P2_AS_IT_COMES,
    PGS,
    RAPIER,
    RAPIER_JS,
    RAPIER_MANY,
    SAP,
    TGS,
    Asked,
    engine,
    rows,
)
from tests.scenes import peer as peer_scenes
from tests.scenes import peer_joints
from tests.scenes.seen import finals


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("ratio", [-3.0, -1.0, 0.5, 1.0])
@rows({MUJOCO: 1e-6, JOLT: 1e-4})
def test_gears_share_what_turns_them_by_their_ratio(
    asked: Asked, owed: float, ratio: float, backwards: bool
) -> None:
    found, exact = peer_joints.geared(engine(asked), ratio, backwards)
    assert found == pytest.approx(exact, rel=owed)


@rows(dict.fromkeys((BULLET, JOLT, BOX, MUJOCO), 0.02))
def test_the_torque_of_a_hinge_has_what_brakes_it_and_what_turns_its_body(asked: Asked, owed: float) -> None:
    seen = finals(f=ConstraintForce("j"), w=AngularVelocity("b"), q=Orientation("b"))
    found = engine(asked)(peer_joints.spun(3.0), time_step=1e-3, steps=100, observe=seen)
    exact = peer_joints.load_on_spun(found["q"], float(found["w"][2]), 3.0)

    assert found["w"][2] < 4.9
    assert found["f"] == pytest.approx([0.0, 0.0, 0.0, *exact], abs=owed * float(np.linalg.norm(exact)))


@rows(dict.fromkeys((MUJOCO, JOLT, BOX, TGS, PGS), 2e-3))
def test_a_rod_holds_points_beside_centres_at_its_length(asked: Asked, owed: float) -> None:
    """As our engine does, which keeps 1 m to the point half a metre aside; and a rod longer than the start's distance."""
    aside = Distance(name="rod", between=((0, 0, 0), "b"), anchors=((0, 0, 0), (-0.5, 0, 0)), compliance=0.0)
    longer = Distance(name="rod", between=("b", (0, 0, 0)), rest_length=1.6, compliance=0.0)
    expected = peer_joints.rodded(simulate, aside)
    assert peer_joints.rodded(engine(asked), aside) == pytest.approx(expected, abs=owed)
    assert np.linalg.norm(peer_joints.rodded(engine(asked), longer)) == pytest.approx(1.6, abs=owed)


@rows(dict.fromkeys((MUJOCO, DART, BULLET, JOLT, BOX, TGS, PGS, RAPIER, RAPIER_JS), 1e-4))
def test_a_slide_leaves_a_body_as_it_is_turned_about_its_axis(asked: Asked, owed: float) -> None:
    way, turned = peer_joints.slid_turned(engine(asked))
    assert way == pytest.approx(1.0, abs=owed)
    assert np.abs(turned).max() < owed


@rows(dict.fromkeys((BOX_AS_IT_COMES, BOX), 0.02))
@pytest.mark.parametrize("backwards", [False, True])
def test_the_force_of_a_slide_is_in_world_axes(asked: Asked, owed: float, backwards: bool) -> None:
    """A loaded body, turned, on a slanted slide beside its centre: what holds it, on the second end and about its point."""
    found, exact = peer_joints.held_on_a_slide(engine(asked), backwards)
    for part in (slice(0, 3), slice(3, 6)):
        assert found[part] == pytest.approx(exact[part], abs=owed * float(np.linalg.norm(exact[part])))


@rows(
    dict.fromkeys(
        (MUJOCO, MUJOCO_AS_IT_COMES, DART, BULLET, SAP, MERSON, JOLT, BOX, RAPIER, TGS, MOTRIX, MOTRIX_MANY),
        5e-3,
    )
)
@pytest.mark.parametrize("backwards", [False, True])
def test_a_load_acts_at_the_centre_of_a_body_on_a_hinge(asked: Asked, owed: float, backwards: bool) -> None:
    found, exact = peer_joints.pushed_arm(engine(asked), backwards)
    assert found == pytest.approx(exact, rel=owed)


@rows(
    dict.fromkeys(
        (MOTRIX_LOOSE, DART_LOOSE, BULLET_LOOSE, DRAKE_LOOSE, BOX, JOLT, RAPIER_MANY, TGS, PGS), 1e-3
    )
)
@pytest.mark.parametrize("still", [False, True])
def test_a_lock_holds_a_body_that_is_turned_against_the_other(asked: Asked, owed: float, still: bool) -> None:
    moved, turned = peer_joints.locked_askew(engine(asked), still)
    assert moved < owed
    assert turned < owed


@rows(dict.fromkeys((MUJOCO, DART, BULLET, SAP, JOLT, BOX, RAPIER, RAPIER_JS, TGS, PGS, MERSON), 0.01))
@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
def test_joints_hold_and_drive_at_every_scale(asked: Asked, owed: float, scale: float) -> None:
    """Lengths, masses as their cube and times as their root: an arm that falls, and a wheel by a bounded motor."""
    fallen, exact = peer_joints.fallen_arm(engine(asked), scale)
    assert fallen == pytest.approx(exact, abs=owed)
    if asked not in (SAP, MERSON):  # no motors
        assert peer_joints.driven_wheel(engine(asked), scale) == pytest.approx(1.0, rel=owed)


@rows(
    {
        **dict.fromkeys((DART, BULLET, SAP, MERSON, MUJOCO), (-1e-12, 1e-12)),  # merged into one body
        **dict.fromkeys((BULLET_LOOSE, JOLT_AS_IT_COMES, MUJOCO_LOOSE), (1.1, 1.3)),  # ½ g t² is 1.23 m
        **dict.fromkeys((DRAKE_LOOSE, P2_AS_IT_COMES), (1.0, 1.3)),
    }
)
def test_locks_that_are_merged_hold_a_long_beam_and_those_that_are_iterated_let_it_fall(
    asked: Asked, owed: tuple[float, float]
) -> None:
    assert owed[0] < peer_scenes.sag(engine(asked)) < owed[1]


@rows({JOLT: (2.0, 1e-4, 20.0), BULLET_LOOSE: (1.0, 1e-6, 15.0)})
def test_the_hinges_of_a_door_carry_uneven_loads(asked: Asked, owed: tuple[float, float, float]) -> None:
    """Two hinges bear 149 N each, sideways; of ten the first bears far more than the last: all of the weight together."""
    seconds, close, apart = owed
    for hinges in (2, 10):
        forces = {f"{k}": Final(quantity=ConstraintForce(f"{k}")) for k in range(hinges)}
        found = engine(asked)(peer_scenes.door(hinges), time_step=1 / 60, duration=seconds, observe=forces)
        loads = np.array([found[f"{k}"][:3] for k in range(hinges)])

        assert loads[:, 2].sum() == pytest.approx(45.0 * 9.81, rel=close)
        if hinges == 10:
            assert abs(abs(loads[0, 0]) - abs(loads[9, 0])) > apart

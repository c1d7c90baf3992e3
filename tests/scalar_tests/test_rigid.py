"""What the rigid scenes are held to agrees with what is known from elsewhere, and a broken engine is seen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import PLAIN, RigidBody, Scene, simulate
from spook_tracker.engine.joints import Joint
from spook_tracker.scalar_tests.case import Measurement, Simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.stacks import resting_box, resting_stack
from spook_tracker.scalar_tests.thesis.beam import scene as beam_scene
from spook_tracker.scalar_tests.thesis.cantilever import scene as cantilever
from spook_tracker.scalar_tests.thesis.cantilever import statics
from tests.toys.broken_engines import lopsided, off_by, with_scene

SLOW = {("beam", 2000.0)}  # a beam of 250 m takes seconds; every night runs it


def measurements(test: str) -> list[Measurement]:
    return [m for m in CATALOGUE[test].measurements if (test, m.parameters.get("N")) not in SLOW]


def test_a_box_on_soft_ground_lies_as_deep_as_its_weight_pushes_it() -> None:
    """Each of four contact points carries a quarter of the weight, by the compliance of both surfaces: c m g / 2."""
    on_plane = resting_box.depth(with_scene(yielding), "plane")

    assert on_plane == pytest.approx(1e-7 * resting_box.MASS * resting_box.GRAVITY / 2.0, rel=1e-6)
    assert resting_box.depth(with_scene(yielding), "box") == pytest.approx(on_plane, rel=1e-6)


def test_the_overlap_of_a_stack_is_that_of_its_boxes_and_none_where_they_have_fallen() -> None:
    """Floor, three boxes: the first sinks 3 mm into the floor, the second 1 mm into it, the third 2 mm into that."""
    moved = np.zeros((4, 3))
    moved[1:, 2] = -0.003, -0.004, -0.006
    assert resting_stack.deepest(moved) == pytest.approx(0.002, abs=1e-15)

    moved[3] = 0.9, 0.0, -2.0
    assert np.isnan(resting_stack.deepest(moved)), "beside the stack and on the floor"


# --- a broken engine ------------------------------------------------------------------------------------


def with_joints(**fields: Any) -> Simulate:
    """An engine whose joints have other numbers than it was given."""
    return with_scene(
        lambda scene: replace(
            scene,
            constraints=tuple(replace(c, **fields) if isinstance(c, Joint) else c for c in scene.constraints),
        )
    )


def yielding(scene: Scene) -> Scene:
    bodies = [
        replace(b, material=replace(b.material, compliance=1e-7)) if isinstance(b, RigidBody) else b
        for b in scene.bodies
    ]
    return replace(scene, bodies=tuple(bodies))


BROKEN: dict[str, Simulate] = {
    "beam": with_joints(compliance=1e-13),  # hidden softness in the locks
    "door": off_by(0.999, "gravity"),
    "friction": off_by(0.99, "friction"),
    "cantilever": off_by(1.0001, "force"),
    "force_ratio": off_by(0.99, "friction"),
    "slip_angle": off_by(0.99, "friction"),
    "bouncing_ball": off_by(0.97, "restitution"),
    "rotating_box": with_scene(lopsided),
    "swinging_door": off_by(0.97, "gravity"),
    "spinning_top": off_by(0.97, "gravity"),
    "loaded_rods": off_by(0.97, "gravity"),
    "motor": off_by(1 + 1e-6, "speed"),
    "lock_ring": with_joints(compliance=1e-6),
    "resting_box": with_scene(yielding),
    "resting_ball": off_by(0.999, "gravity"),
    "resting_stack": off_by(0.999, "gravity"),
    "rolling_sphere": off_by(0.999, "gravity"),
    "slope_grid": off_by(0.99, "friction"),
    "resting_grid": off_by(0.97, "gravity"),
    "bounce_grid": off_by(0.97, "restitution"),
}


@pytest.mark.parametrize("test", BROKEN)
def test_a_broken_engine_turns_a_gate_red(test: str) -> None:
    found = []
    for measurement in measurements(test):
        gates = [metric for metric in measurement.metrics if metric.role == "gate"]
        if gates:
            values = measurement.measure(BROKEN[test])
            found += [metric.passes(values[metric.name]) for metric in gates]

    assert found and not all(found)


def test_an_engine_without_refinement_is_caught_by_name() -> None:
    """One refinement against the true equations is worth five digits where rows are redundant."""

    def rough(scene: Scene, **options: Any) -> Any:
        method = replace(options.pop("method", PLAIN), refinements=0)
        return simulate(scene, method=method, **options)

    split = next(m for m in CATALOGUE["door"].measurements if m.metrics[0].name == "split_error")
    ring = next(m for m in CATALOGUE["lock_ring"].measurements if m.parameters.get("N") == 200)

    for measurement in (split, ring):
        good, bad = measurement.measure(simulate), measurement.measure(rough)
        metric = measurement.metrics[0]
        assert metric.passes(good[metric.name])
        assert not metric.passes(bad[metric.name]), metric.name


# --- the references themselves --------------------------------------------------------------------------


def test_the_statics_of_the_beam_bends_as_known() -> None:
    assert abs(beam_scene.sag_of_compliant_beam() - 2.134e-7) < 2.134e-10


def test_the_elastica_is_right_to_leading_order_and_the_pieces_approach_it() -> None:
    exact = statics.elastica_tip() / cantilever.TIP - 1.0

    assert abs(exact - cantilever.LARGE_DEFLECTION) < 5e-8
    assert abs(statics.chain_tip(320) / statics.elastica_tip() - 1.0) < 5e-7


def test_statics_of_a_small_load_is_the_linear_beam() -> None:
    tip = statics.chain_tip(20, load=1e-3 * cantilever.LOAD)
    ends_free = 1.0 / (4.0 * 20.0**2)  # a rigid last half piece: the tip lies below the curve's tangent

    assert abs(tip / (1e-3 * cantilever.TIP) - 1.0) < ends_free

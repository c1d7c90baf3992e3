"""What the default compliance of joints yields, in the numbers that engine/joints.py tells."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from spook_tracker.engine import Hinge, Scene, joints, simulate
from spook_tracker.scalar_tests.beam import scene as beam
from spook_tracker.scalar_tests.multibody import squeezer


def told(number: str) -> float:
    """A number of the module's text, which must hold it."""
    assert number in (joints.__doc__ or "")
    return float(number.split()[0])


def test_a_long_beam_sags() -> None:
    sag = -beam.heights(simulate, compliance=joints.COMPLIANCE).min()

    assert sag == pytest.approx(beam.sag_of_compliant_beam(beam.COUNT, joints.COMPLIANCE), rel=1e-3)
    assert 1e3 * sag == pytest.approx(told("2.1 mm"), abs=0.05)


def test_a_small_mechanism_leaves_its_path() -> None:
    def at_default(scene: Scene, **options: Any) -> Any:
        softer = tuple(
            dataclasses.replace(row, compliance=joints.COMPLIANCE) if isinstance(row, Hinge) else row
            for row in scene.constraints
        )
        return simulate(dataclasses.replace(scene, constraints=softer), **options)

    assert 100.0 * squeezer.answers(at_default, 1e-5)["library_error"] == pytest.approx(
        told("0.4 %"), abs=0.05
    )
    assert 100.0 * squeezer.answers(simulate, 1e-5)["library_error"] < 0.03  # by the time step alone

"""What the default compliance of joints yields, and why it is not smaller: the numbers docs/explanation/compliance.md tells.

The three numbers that matter most stand here, too: a page that tells others, or an engine that yields more, is red."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import Distance, Hinge, Lock, Orientation, Position, Scene, Trace, joints, simulate
from spook_tracker.scalar_tests.multibody import bricard, squeezer
from spook_tracker.scalar_tests.multibody.library import turned
from spook_tracker.scalar_tests.thesis.beam import scene as beam
from tests.places import ROOT

PAGE = (ROOT / "docs" / "explanation" / "compliance.md").read_text(encoding="utf-8")


def told(row: str) -> list[str]:
    """The cells of the row of a table that begins so."""
    line = next(line for line in PAGE.splitlines() if line.startswith(f"| {row}"))
    return [cell.strip() for cell in line.strip("|").split("|")][1:]


def number(cell: str) -> float:
    found = re.match(r"[0-9.e-]+", cell)
    assert found, cell
    return float(found.group())


def test_every_default_is_the_one_number() -> None:
    assert f"has {joints.COMPLIANCE:.0e}".replace("e-08", "e-8") in PAGE
    assert Distance(name="d", between=("a", "b")).compliance == joints.COMPLIANCE
    assert Lock(name="l", between=("a", "b")).compliance == joints.COMPLIANCE


def test_a_long_beam_sags() -> None:
    soft, rigid = told("eighty locked boxes")
    sag = -beam.heights(simulate, compliance=joints.COMPLIANCE).min()

    assert sag == pytest.approx(beam.sag_of_compliant_beam(beam.COUNT, joints.COMPLIANCE), rel=1e-3)
    assert soft == "2.1 mm"
    assert 1e3 * sag == pytest.approx(2.1, abs=0.05)
    assert -1e3 * beam.heights(simulate, compliance=0.0).min() == pytest.approx(number(rigid), abs=0.05)


def test_a_small_mechanism_leaves_its_path() -> None:
    def with_compliance(compliance: float) -> float:
        def changed(scene: Scene, **options: Any) -> Any:
            rows = tuple(
                dataclasses.replace(row, compliance=compliance) if isinstance(row, Hinge) else row
                for row in scene.constraints
            )
            return simulate(dataclasses.replace(scene, constraints=rows), **options)

        return 100.0 * squeezer.answers(changed, 1e-5)["library_error"]

    soft, rigid = told("Andrews' mechanism")
    assert (soft, rigid) == ("0.4 %", "0.02 %")
    assert with_compliance(joints.COMPLIANCE) == pytest.approx(0.4, abs=0.05)
    assert with_compliance(0.0) == pytest.approx(0.02, abs=0.005)
    assert 100.0 * squeezer.answers(simulate, 1e-5)["library_error"] < 0.03  # by the time step alone


@pytest.mark.parametrize("h", [1 / 60, 1 / 240])
def test_a_smaller_one_stops_a_mechanism_that_moves(h: float) -> None:
    observe = {"centre": Trace(quantity=Position("rod 3")), "turn": Trace(quantity=Orientation("rod 3"))}
    compliances = [number(cell) for cell in told("time step")]
    for compliance, cell in zip(compliances, told(f"1/{round(1 / h)} s"), strict=True):
        run = simulate(bricard.scene(h, compliance), time_step=h, duration=1.0, observe=observe)
        if cell == "refused":
            assert run.status == "diverged" and "locked by redundant joints" in run.failure
            continue
        third = run["centre"][-1] + turned(run["turn"][-1:], (0.0, 0.0, 0.5))[0]
        off = float(np.linalg.norm(third - bricard.EXACT[1.0]))
        assert cell.endswith("mm off")
        assert 1e3 * off == pytest.approx(number(cell), abs=0.5)

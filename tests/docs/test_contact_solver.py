"""What the page on the method counts of contacts is what the engine counts."""

from __future__ import annotations

import re

import pytest

from spook_tracker.engine import PLAIN, Method, simulate
from spook_tracker.scalar_tests.stacks import pile, resting_stack
from tests.docs.test_site import DOCS

SAID = " ".join((DOCS / "explanation" / "method.md").read_text(encoding="utf-8").split())
STEPS = 240


def test_a_stack_at_rest_is_factored_as_often_as_is_said() -> None:
    found = re.search(
        r"of (\d+) steps of a stack of (\d+) boxes at rest, one is factored, with (\d+) factorisations", SAID
    )
    assert found
    steps, boxes, factorisations = map(int, found.groups())
    after_one, after_all = (
        simulate(resting_stack.scene(boxes), time_step=1.0 / 60.0, steps=count).counters["factorisations"]
        for count in (1, steps)
    )

    assert after_one == after_all == factorisations


@pytest.mark.parametrize(("method", "least", "most"), [(PLAIN, 0.0, 1e-8), (pile.SWEEPS, 1e-2, 0.1)])
def test_spheres_are_solved_as_far_as_is_said(method: Method, least: float, most: float) -> None:
    assert "1000 dropped spheres are solved in each of 240 steps to less than 1e-8 m/s" in SAID
    assert "fifty iterations leave up to a tenth of a metre a second" in SAID

    result = simulate(pile.scene(), time_step=pile.TIME_STEP, steps=STEPS, method=method)

    assert result.completed
    assert least < result.residual < most

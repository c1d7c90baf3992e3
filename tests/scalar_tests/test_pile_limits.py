"""What a pile's floor carries, found again on springs and dashpots, without the engine."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.stacks import pile
from tests.oracles.pile import missing_loads

COUNTS = {
    pile.COUNT: (pile.MISSING_LOAD, pile.SPREAD),
    pile.LADDER_COUNT: (pile.LADDER_MISSING_LOAD, pile.LADDER_SPREAD),
}
STARTS = 8


@pytest.mark.parametrize("count", COUNTS)
def test_a_pile_on_springs_slows_down_by_as_much_as_is_said(count: int) -> None:
    """The mean of some starts is where the limit has its middle, and all are inside; four spreads are no wide gate."""
    middle, spread = COUNTS[count]
    found = missing_loads(count, STARTS)

    assert abs(found.mean() - middle) < 3.0 * spread / np.sqrt(STARTS)
    assert np.abs(found - middle).max() < pile.STARTS * spread
    assert spread < 2.0 * found.std(ddof=1)


def test_the_limit_of_a_pile_is_that_of_its_springs() -> None:
    (limit,) = (
        m.limit for asked in CATALOGUE["pile"].measurements for m in asked.metrics if m.name == "missing_load"
    )
    off = pile.STARTS * pile.SPREAD

    assert limit == (pile.MISSING_LOAD - off, pile.MISSING_LOAD + off)


def test_stiffer_springs_in_smaller_steps_carry_the_same() -> None:
    found = missing_loads(pile.COUNT, 2, step=5e-4, stiffness=1e5, drag=300.0)

    assert np.abs(found - pile.MISSING_LOAD).max() < pile.STARTS * pile.SPREAD


def test_a_floor_that_carries_a_hundredth_less_is_red() -> None:
    (metric,) = (
        m for asked in CATALOGUE["pile"].measurements for m in asked.metrics if m.name == "missing_load"
    )

    assert metric.passes(pile.MISSING_LOAD)
    assert not metric.passes(pile.MISSING_LOAD + 0.01) and not metric.passes(pile.MISSING_LOAD - 0.01)

"""The examples in the engine's documentation run as they stand."""

from __future__ import annotations

import doctest

from spook_tracker import engine
from spook_tracker.engine import run


def test_the_documented_example_runs() -> None:
    result = doctest.testmod(engine, optionflags=doctest.ELLIPSIS)

    assert result.attempted > 10
    assert result.failed == 0


def test_the_example_of_a_run_one_holds_runs() -> None:
    result = doctest.testmod(run)

    assert result.attempted >= 5
    assert result.failed == 0

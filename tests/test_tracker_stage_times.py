"""Where the time of a step goes."""

from __future__ import annotations

import pytest

from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.stage_times import stage_times
from tests.synthetic_history import history


def test_shares_are_of_the_longest_run_and_add_up() -> None:
    test = next(t for t in book(history(2)).tests if t.name == "beam")

    plain, half = stage_times(test)

    assert (plain.configuration, half.configuration) == ("plain", "half-step")
    assert [(part.stage, part.share) for part in plain.parts] == [
        ("solve_path", "75 %"),
        ("apply_gravity", "25 %"),
    ]
    assert sum(float(part.width) for part in plain.parts) == pytest.approx(100.0)
    assert plain.time_step == "0.00625 s"
    assert plain.total == "200\u202fns"


def test_without_clocks_there_are_no_bars() -> None:
    test = book(history(1)).tests[0]
    test.trends = test.gates()

    assert stage_times(test) == []

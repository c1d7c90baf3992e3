"""Where the nights that are looked at again begin."""

from __future__ import annotations

from spook_tracker.tracker.judge.lane import SPARSE, looked_at_again


def test_one_more_night_seldom_moves_where_the_nights_looked_at_begin() -> None:
    """So that it changes nothing of what was said, and no page of what is over."""
    moved = []
    for count in range(1, 400):
        now, then = looked_at_again(count + 1, 60), looked_at_again(count, 60)
        assert {*range(max(0, count - 59), count + 1)} <= {*now}
        assert len(now) <= 60 + SPARSE + count // SPARSE
        moved.append(now != [*then, count])

    assert sum(moved) == (400 - 60) // SPARSE

"""What an overlap costs in other engines: asked at the longest step that keeps it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bench.overlaps as overlaps
from spook_tracker.engine import EngineError
from spook_tracker.scalar_tests.case import Ladder


class Peer:
    """Never moves: what its ladder says counts."""

    def simulate(self, **_: Any) -> None: ...


def sinking(**speeds: float) -> Ladder:
    """An overlap of the setting's speed [m/s] times the step; without one the run is lost."""

    def error(simulate: Any, time_step: float, method: Any) -> float:
        if not (speed := speeds[simulate.keywords["configuration"]]):
            raise EngineError("lost")
        return speed * time_step

    _, ladder = next(overlaps.asked(["grasp"]))
    return replace(ladder, error=error)


def found(**speeds: float) -> list[tuple[str, float]]:
    ways = overlaps.within(sinking(**speeds), Peer(), tuple(speeds))
    return [(one.setting, round(1.0 / one.time_step)) for one in ways]


def test_each_setting_that_keeps_the_overlap_is_asked_at_its_longest_step() -> None:
    assert found(fine=0.005, soft=0.03, lost=0.0, never=10.0) == [("fine", 60), ("soft", 480)]


def test_where_none_keeps_it_the_one_that_comes_nearest_is_told_at_the_finest_step() -> None:
    assert found(far=20.0, near=10.0, lost=0.0) == [("near", 15360)]

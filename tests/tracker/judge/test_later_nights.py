"""What is said of a night stays said: no night after it changes the verdict."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from spook_tracker.tracker.document.run_document import Point, SeriesDefinition, Timing
from spook_tracker.tracker.judge.series_history import judge_history
from tests.histories.synthetic import MACHINE, sample, series
from tests.tracker.judge.test_one_judge import night, seconds


@st.composite
def times(draw: Any) -> tuple[SeriesDefinition, list[Point]]:
    """Nights of one run time: steps, noise, machines by turns, a kernel that comes later, tolerances of both sorts."""
    definition = replace(
        seconds(1.0)[0][0],
        tolerance=draw(st.sampled_from([0.0, 0.0, 3e-5, 3e-4])),
        relative_tolerance=draw(st.sampled_from([0.0, 0.0, 0.05])),
    )
    calibrated = draw(st.integers(0, 40))
    level, points = 1e-3, []
    machines = [replace(MACHINE, fingerprint=name) for name in "mn"]
    for n in range(draw(st.integers(2, 45))):
        level *= draw(st.sampled_from([1.0] * 12 + [1.1, 0.8, 1.5, 10.0]))
        value = level * (1.0 + 0.01 * draw(st.floats(-2.0, 2.0)))
        value = draw(st.sampled_from([value] * 20 + [math.nan]))
        kernel = 1e-3 * draw(st.sampled_from([1.0, 1.0, 1.02, 1.3]))
        timing = Timing(
            seconds=(value, value),
            runs_per_repeat=1,
            cpu_seconds=(value, value),
            calibration=(kernel, kernel),
        )
        found = sample(definition, value, timing=timing if n >= calibrated and math.isfinite(value) else None)
        run = night(n, [(definition, found)], machine=draw(st.sampled_from([machines[0]] * 4 + machines[1:])))
        points.append(Point(run, found, definition.test_version))
    return definition, points


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(times())
def test_a_later_night_changes_no_verdict_on_a_run_time(told: tuple[SeriesDefinition, list[Point]]) -> None:
    definition, points = told
    every = judge_history(definition.key, definition, points)
    for count in range(1, len(points), 3):
        then = judge_history(definition.key, definition, points[:count])[-1]
        now = every[count - 1]
        assert (then.state, then.verdict, then.time) == (now.state, now.verdict, now.time) or (
            math.isnan(then.time) and then.state == now.state
        )


def test_an_absolute_tolerance_is_of_the_level_of_its_time() -> None:
    """Half a millisecond of one millisecond is much, of the ten milliseconds of a year later nothing: each by itself."""
    definition = replace(
        series("t", "time", kind="time", better="smaller", unit="s"), time_step=None, tolerance=5e-4
    )
    values = [1e-3] * 10 + [1.4e-3] * 10 + [1e-2] * 40

    def states(values: list[float]) -> list[str]:
        points = []
        for n, value in enumerate(values):
            found = sample(definition, value)
            points.append(Point(night(n, [(definition, found)]), found, definition.test_version))
        return [judged.state for judged in judge_history(definition.key, definition, points)]

    assert set(states(values)[:20]) == {"green"}  # 40 % of 1 ms: tolerated
    assert states(values)[24] == "detected"
    assert states(values[:20]) == states(values)[:20]
    assert states([1e-2] * 30 + [1.4e-2] * 3)[-1] == "detected"  # 4 ms of 10 are more

"""Over all series of a night few alarms are false, because every alarm is rarer than RARE by itself.

So it makes no difference how many series are asked about. Counted here after a hundred nights of learning.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy import stats

from spook_tracker.tracker.judge.normal_nights import exceeded, student
from spook_tracker.tracker.judge.run_times import judge_noisy
from spook_tracker.tracker.judge.shifts import RARE
from tests.histories import noise as battery

LEARNING, NIGHTS, EACH = 100, 140, 8


@cache
def starts(name: str, series: int, slower: float) -> list[int]:
    """Nights after those of learning on which a red stretch begins, where it becomes so much slower after them."""
    values = np.array(battery.noise(name, series, NIGHTS))
    values[LEARNING:] *= slower
    red = [night.state == "detected" for night in judge_noisy([float(value) for value in values])]
    return [n for n in range(LEARNING, len(red)) if red[n] and not red[n - 1]]


def of_all_kinds(slower: dict[int, float]) -> list[list[int]]:
    """Alarms of a eighty-eight series of every kind of noise, some of which become slower after learning."""
    return [
        starts(name, 500 + series, slower.get(kind * EACH + series, 1.0))
        for kind, name in enumerate(battery.STATIONARY)
        for series in range(EACH)
    ]


def test_if_nothing_happened_nineteen_nights_in_twenty_are_silent_over_all_series() -> None:
    told = of_all_kinds({})

    nights = {night for alarms in told for night in alarms}
    assert len(nights) <= (NIGHTS - LEARNING) // 20


def test_of_the_alarms_after_some_series_became_slower_at_most_one_in_twenty_is_false() -> None:
    slower = {kind * EACH + series: 1.4 for kind in range(6) for series in range(4)}  # gauss, tails, memory
    told = of_all_kinds(slower)

    true = [alarms for place, alarms in enumerate(told) if alarms and place in slower]
    false = [alarms for place, alarms in enumerate(told) if alarms and place not in slower]
    assert len(true) >= 0.9 * len(slower)
    assert len(false) <= (len(true) + len(false)) / 20


def test_two_nights_that_chance_explains_are_suspected_until_a_third_makes_them_rare() -> None:
    few = [1.0, 1.01, 0.99, 1.005, 0.995]
    told = judge_noisy([*few, 1.06, 1.06, 1.06])

    assert [night.state for night in told[5:]] == ["suspected", "suspected", "detected"]
    assert told[-1].first_bad == 5
    thirty = [float(value) for value in 1.0 + 0.005 * np.random.default_rng(1).standard_normal(30)]
    many = judge_noisy([*thirty, 1.06, 1.06])  # what five nights cannot tell thirty can
    assert many[-1].state == "detected"


@pytest.mark.parametrize("freedom", [5, 8, 30, 200])
def test_the_tail_of_students_t_is_that_of_the_tables(freedom: int) -> None:
    for probability in (1e-2, 1e-4, RARE):
        t = float(stats.t.isf(probability, freedom))
        assert exceeded(t, freedom) == pytest.approx(probability, rel=0.25)
    assert exceeded(student(freedom), freedom) == pytest.approx(1e-5, rel=0.01)

"""Level segments of run times: the right commit, one fast night, old levels, and a second regression."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from bench.detectors import AT, MIXES, one_step
from spook_tracker.tracker.judge.noisy import Noisy
from spook_tracker.tracker.judge.run_times import judge_noisy, judged_and_segments
from spook_tracker.tracker.judge.segments import earlier_level
from spook_tracker.tracker.judge.slower import worse_by


def told_of(values: Any, **options: Any) -> list[Noisy]:
    return judge_noisy([float(value) for value in values], **options)


def noise(seed: int, share: float, nights: int) -> Any:
    return 1.0 + share * np.random.default_rng(seed).standard_normal(nights)


@pytest.mark.parametrize(("share", "step"), MIXES)
def test_the_commit_that_is_named_is_as_often_right_as_of_a_split_that_is_told_there_is_one_step(
    share: float, step: float
) -> None:
    series, ours, best, accused = 60, [], [], []
    for seed in range(series):
        values = 1000.0 * noise(seed, share, 60)
        values[AT:] *= 1.0 + step
        night = told_of(values)[-1]
        if night.state != "detected":
            continue
        assert night.worse_at is not None and night.accused is not None
        ours.append(abs(night.worse_at - AT))
        best.append(abs(one_step(values) - AT))
        accused.append(night.accused[0] < AT <= night.accused[1])

    assert len(ours) >= 0.85 * series
    for within in (0, 1):
        right = [np.mean(np.array(off) <= within) for off in (ours, best)]
        assert right[0] >= right[1] - 0.03
    assert np.mean(accused) >= 0.98  # of sixty; `make detectors` counts four hundred


@pytest.mark.parametrize(
    ("share", "step", "fast"),
    [(0.01, 1.12, 0.9), (0.015, 1.10, 0.95), (0.005, 1.05, 0.98), (0.01, 1.3, 1.0), (0.01, 2.0, 1.0)],
)
def test_one_fast_night_ends_no_red_and_two_hundred_red_nights_are_news_once(
    share: float, step: float, fast: float
) -> None:
    for seed in range(20):
        values = 1000.0 * noise(seed, share, 90)
        values[40:] *= step
        values[70] *= fast / step
        told = told_of(values)

        assert {night.state for night in told[44:]} == {"detected"}
        assert sum(night.news for night in told) == 1
        assert told[-1].worse_at == 40


@pytest.mark.parametrize("second", [2.0, 10.0])
def test_a_second_regression_on_a_red_run_time_is_news_and_blamed_on_its_own_commit(second: float) -> None:
    """Said on its own night, ten after the first; news and blamed when another one confirms it."""
    for seed in range(10):
        values = noise(seed, 0.005, 43)
        values[30:] *= 1.1
        values[40:] *= second
        told = told_of(values)

        assert [night.news for night in told[40:]] == [False, True, False]
        on_top = re.search(
            r"; tonight \+([\d.]+) % for the worse on top of that, to be", told[40].verdict.sentence
        )
        assert on_top is not None
        assert float(on_top[1]) == pytest.approx(100.0 * (second - 1.0), rel=0.1)
        assert not any("on top of that" in night.verdict.sentence for night in [*told[30:40], *told[41:]])
        assert (told[39].worse_at, told[-1].worse_at, told[-1].first_bad) == (30, 40, 30)
        assert told[-1].accused == (39, 40)
        alone = re.search(r"; the last step alone is \+([\d.]+) %$", told[-1].verdict.sentence)
        assert alone is not None and float(alone[1]) == pytest.approx(100.0 * (second - 1.0), rel=0.05)
        assert not any("alone" in night.verdict.sentence for night in told[30:41])


OLD_LEVELS = {
    "seven nights of speed-ups, then seventy flat ones": [2.0, 1.9, 1.7, 1.5, 1.4, 1.2, 1.1, *[1.0] * 70],
    "a fortnight between .71 and 1.0, then sixty flat ones": [
        *[0.96] * 3,
        *[1.0] * 3,
        *[0.71, 0.78, 0.72] * 3,
        *[0.785] * 60,
    ],
    "four nights half as slow again": [*[1.0] * 20, *[1.5] * 4, *[1.0] * 76],
    "a drift to nine tenths": [1.0 - 0.001 * night for night in range(100)],
}


@pytest.mark.parametrize("name", OLD_LEVELS)
def test_an_old_level_hides_no_change(name: str) -> None:
    old = OLD_LEVELS[name]
    for seed in range(10):
        values = np.array([*old, *[1.25 * old[-1]] * 20]) * noise(seed, 0.005, len(old) + 20)
        red = [night.state == "detected" for night in told_of(values)[len(old) :]]

        assert any(red[:3])
        assert red[-1]


FIRST_NIGHTS = {
    "three slow nights, six on the way": [1.82, 1.83, 1.62, 0.8, 0.87, 0.81, 0.9, 0.915, 0.9, *[1.0] * 45],
    "three slow nights, six by turns": [1.82, 1.83, 1.62, *[0.85, 0.95] * 3, *[1.0] * 45],
    "eight nights more than three times as slow": [1.0, 1.1, 1.2, 1.2, 1.2, 1.05, 0.85, 0.85, *[0.29] * 30],
}


@pytest.mark.parametrize("name", FIRST_NIGHTS)
def test_the_first_nights_of_a_project_hide_no_change(name: str) -> None:
    """However much slower they were: twice as fast is as far from a level as twice as slow."""
    old = FIRST_NIGHTS[name]
    for seed in range(10):
        values = np.array([*old, *[1.18 * old[-1]] * 4]) * noise(seed, 0.01, len(old) + 4)

        assert any(night.news for night in told_of(values)[len(old) :])


def test_few_first_nights_are_an_older_level_where_chance_seldom_puts_them_on_one_side() -> None:
    """Three of 140 are the slowest once in 447 580 draws; of 60 once in 34 220, which is not rare."""
    for nights, older in ((60, None), (140, 3)):
        values = noise(1, 0.01, nights)
        values[:3] *= 1.5

        assert earlier_level(values) == earlier_level(2.0 - values) == older
    assert earlier_level(noise(1, 0.01, 140)) is None
    assert earlier_level(np.linspace(1.0, 2.0, 140)) is None  # a way, and no two levels


def test_what_is_printed_is_what_the_percentage_says() -> None:
    draws, said = np.random.default_rng(3), 0
    for _ in range(30):
        values, level = [], 1.0
        for _ in range(120):
            level *= float(draws.choice([1.0, 0.7, 1.3, 1.06], p=[0.94, 0.02, 0.02, 0.02]))
            values.append(level * (1.0 + 0.01 * draws.standard_normal()))
        for larger in (False, True):
            for night in told_of(values, larger_is_better=larger):
                found = re.match(r"([+-][\d.]+) %", night.verdict.sentence)
                if found and night.levels:
                    before, now = night.levels
                    change = 100.0 * (now / before - 1.0) * (-1.0 if larger else 1.0)
                    assert change == pytest.approx(float(found[1]), abs=0.051)
                    said += night.state == "detected"
    assert said > 100


def test_segments_cover_every_night_once_and_the_last_tells_the_present_level() -> None:
    values = np.concatenate([noise(1, 0.01, 40), 1.2 * noise(2, 0.01, 30), 0.9 * noise(3, 0.01, 30)])
    segments = judged_and_segments([float(value) for value in values])[1]

    assert [(one.first, one.last, one.standing) for one in segments] == [
        (0, 39, "usual"), (40, 69, "red"), (70, 99, "recovered"),
    ]  # fmt: skip
    assert segments[-1].level == pytest.approx(0.9, rel=0.01)
    assert all(one.spread < 0.02 for one in segments)


def test_a_level_only_half_mended_stays_red() -> None:
    values = [*noise(1, 0.005, 40), *1.4 * noise(2, 0.005, 20), *1.1 * noise(3, 0.005, 20)]
    told = told_of(values)

    assert {night.state for night in told[41:]} == {"detected"}
    assert told[-1].levels == pytest.approx((1.0, 1.1), rel=0.005)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("exponent", [1020, -1060])
@pytest.mark.parametrize("larger", [False, True])
def test_values_at_the_ends_of_the_doubles_are_judged_as_any_others(exponent: int, larger: bool) -> None:
    step = 0.8 if larger else 1.25
    values = [*noise(1, 0.005, 40), *step * noise(2, 0.005, 20), 1.0, *step * noise(3, 0.005, 9)]
    coarse = [float(np.round(256 * value) / 256) for value in values]  # so that few bits hold them
    far = [float(np.ldexp(value, exponent)) for value in coarse]
    near, told = told_of(coarse, larger_is_better=larger), told_of(far, larger_is_better=larger)

    assert [night.state for night in told] == [night.state for night in near]
    assert [night.verdict.sentence for night in told] == [night.verdict.sentence for night in near]
    assert told[-1].levels == tuple(float(np.ldexp(level, exponent)) for level in near[-1].levels)  # type: ignore[union-attr]
    assert told[-1].state == "detected"


@pytest.mark.parametrize("values", [[0.0] * 24 + [3.0] * 6, [0.0] * 24 + [*(1e-7 * noise(4, 0.01, 6))]])
def test_what_begins_at_0_is_blamed_on_the_night_it_begins(values: list[float]) -> None:
    told = told_of(values)

    assert {night.state for night in told[25:]} == {"detected"}
    assert {night.accused for night in told[25:]} == {(23, 24)}
    assert told[-1].verdict.sentence.startswith("from 0 for the worse")
    assert told[-1].levels is not None and told[-1].levels[0] == 0.0


def test_a_rate_that_falls_to_0_is_slower_and_none_that_is_not_finite() -> None:
    told = told_of([*(5.0 * noise(5, 0.01, 20)), 0.0, 0.0, 0.0], larger_is_better=True)

    assert told[-1].state == "detected"
    assert told[-1].verdict.name == "slower"
    assert told[-1].verdict.sentence.startswith("+100.0 % for the worse")


@pytest.mark.parametrize("larger", [False, True])
def test_negative_values_are_judged_as_their_mirror_is(larger: bool) -> None:
    values = [*noise(6, 0.01, 30), *(1.3 * noise(7, 0.01, 10))]
    near, told = (
        told_of(values, larger_is_better=larger),
        told_of([-v for v in values], larger_is_better=not larger),
    )

    assert [night.state for night in told] == [night.state for night in near]
    assert [night.verdict.sentence for night in told] == [night.verdict.sentence for night in near]
    assert told[-1].levels == tuple(-level for level in near[-1].levels)  # type: ignore[union-attr]
    assert (told[-1].state == "detected") != larger
    assert worse_by(-100.0, -70.0, larger) == pytest.approx(-0.3 if larger else 0.3)  # as compare asks

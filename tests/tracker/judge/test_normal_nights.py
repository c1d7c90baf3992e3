"""What independent normal nights do by chance, held to SciPy and to draws that no threshold was chosen by."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from spook_tracker.tracker.document.run_document import Point, Timing
from spook_tracker.tracker.judge import normal_nights, run_times, series_history, shifts
from spook_tracker.tracker.judge.normal_nights import chance, independent_and_normal
from spook_tracker.tracker.judge.run_times import judge_noisy, judged_and_segments
from tests.histories import noise as battery
from tests.histories.synthetic import sample
from tests.tracker.judge.test_one_judge import night, seconds


@pytest.mark.parametrize("count", [40, 61, 100])
def test_the_scores_of_skewness_and_kurtosis_are_those_of_scipy(count: int) -> None:
    for draws in (
        np.random.default_rng(count).standard_normal(count),
        np.random.default_rng(1).random(count) ** 4,
    ):
        skewed = normal_nights.skewness_score(float(stats.skew(draws)), count)
        heavy = normal_nights.kurtosis_score(float(stats.kurtosis(draws, fisher=False)), count)

        assert skewed == pytest.approx(stats.skewtest(draws).statistic)
        assert heavy == pytest.approx(stats.kurtosistest(draws).statistic)


def test_one_in_eight_of_independent_normal_histories_seems_another_and_most_others_do() -> None:
    """A tenth by memory to the next night, fewer by that to the fifth beside it, a hundredth by each score."""
    draws = np.random.default_rng(11)
    normal = np.mean([independent_and_normal(draws.standard_normal(60)) for _ in range(1000)])

    assert 0.9 * 0.9 * 0.98 - 0.04 < normal < 0.9 * 0.99 + 0.02
    for name, most in (("only ever slower", 0.02), ("AR(1) .5, 2 %", 0.03), ("AR(1) .9, 5 %", 0.01), ("one night in five × 1.5", 0.05)):  # fmt: skip
        seems = [independent_and_normal(battery.noise(name, 3000 + series, 100)) for series in range(100)]
        assert np.mean(seems) <= most, name


def test_heavy_tails_on_both_sides_are_not_normal() -> None:
    half = 0.1 + np.abs(np.random.default_rng(3).standard_t(2, 30))
    both = np.random.default_rng(4).permutation([*half, *-half])

    assert abs(stats.skew(both)) < 1e-9
    assert stats.kurtosistest(both).statistic > 3.0
    assert not independent_and_normal(both)


def test_chance_is_students_where_no_night_is_far_off_and_never_less() -> None:
    base = np.random.default_rng(2).standard_normal(60)
    assert independent_and_normal(base)
    for rise in (1.0, 1.5, 2.0):
        t = (rise - np.mean(base)) / (np.std(base, ddof=1) * math.sqrt(1 / 4 + 1 / 60))
        assert chance(base, np.full(4, rise)) == pytest.approx(stats.t.sf(t, 59), rel=0.05)
    assert chance(base, np.full(4, 3.5 * np.std(base) + 1.0)) == chance(base, np.full(4, 99.0))
    assert chance(base, np.full(4, -1.0)) == 1.0
    assert chance(base[:39], np.full(4, 2.0)) == 1.0  # too few to tell how they are distributed
    assert chance(np.ones(60), np.full(4, 2.0)) == 1.0


def test_of_nights_without_a_change_no_more_are_rare_than_their_probability_says() -> None:
    draws = np.random.default_rng(12)
    found = np.array([chance(draws.standard_normal(60), draws.standard_normal(4)) for _ in range(8000)])

    for size in (0.02, 0.005):
        assert np.mean(found < size) <= size + 3.0 * math.sqrt(size / len(found))


def test_two_accidents_in_four_nights_are_no_shift_and_four_slow_nights_are() -> None:
    """Two nights half as slow again, of which nothing was seen before, between two usual ones."""
    for seed in range(20):
        usual = list(map(float, 1.0 + 0.01 * np.random.default_rng(seed).standard_normal(60)))
        assert shifts.shift([*usual, 1.0, 1.5, 1.0, 1.5], age=60) is None
        assert shifts.shift([*usual, *[1.035] * 4], age=60) is not None


def test_what_a_series_spends_falls_with_its_nights_and_a_thousand_cost_no_more_than_before() -> None:
    """One in 100 000 of each of two spans is what was spent; their windows overlap, so three quarters of it."""
    spent = [shifts.spent(age) for age in range(1, 1001)]

    assert spent[:60] == [5e-5] * 60
    assert all(after <= before for before, after in itertools.pairwise(spent))
    assert spent[119] == pytest.approx(2.5e-5)
    assert spent[299:] == [pytest.approx(1e-5)] * 701
    assert sum(spent) <= 0.75 * 2 * 1000 * 1e-5
    assert shifts.spent(0) == shifts.RARE


def test_a_shift_is_told_by_a_young_series_that_an_old_one_takes_for_chance() -> None:
    """The same nights, one in 30 000 by chance, after sixty and at the end of a thousand of which they are the last."""
    base = np.random.default_rng(2).standard_normal(60)
    rise = float(np.mean(base)) + stats.t.isf(1 / 30_000, 59) * np.std(base, ddof=1) * math.sqrt(
        1 / 4 + 1 / 60
    )
    values = [float(1.0 + 0.01 * off) for off in [*base, rise - 0.2, rise + 0.2, rise - 0.2, rise + 0.2]]

    young = judge_noisy(values)
    old = judge_noisy(values, ages=[0, *range(937, 1000)])
    accepted = [night == 1 for night in range(65)]  # with it a series begins anew
    anew = judge_noisy([0.3 * values[0], *values], ages=[0, *range(937, 1001)], accepted=accepted)
    assert anew[-1].state == "detected"
    assert young[-1].state == "detected"
    assert young[-1].first_bad == 60
    assert old[-1].state == "green"


def test_nights_that_are_not_looked_at_again_make_a_series_no_younger(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    definition = seconds(1.0)[0][0]
    found = sample(definition, 1.0, timing=Timing(seconds=(1.0, 1.0), runs_per_repeat=1))
    points = [Point(night(n, [(definition, found)]), found, definition.test_version) for n in range(100)]
    asked = []

    def judged(values: Any, *, ages: Any, **options: Any) -> Any:
        asked.append(list(ages))
        return judged_and_segments(values, ages=ages, **options)

    monkeypatch.setattr(series_history, "NOISY_NIGHTS", 70)
    monkeypatch.setattr(series_history, "judged_and_segments", judged)
    series_history.judge_history(definition.key, definition, points)

    assert asked == [[0, *range(16, 100)]]  # where the last ones begin moves by sixteen


def test_a_step_off_two_clusters_is_seen_though_one_of_them_is_visited() -> None:
    """Where one cluster is usual and the other is visited, nights above both seemed a visit for as long as they came."""
    found = 0
    for series in range(40):
        values = list(map(float, battery.step("+10 % on clusters 8 % apart", 5000 + series, 60, 6)))
        found += "detected" in [night.state for night in judge_noisy(values)[60:]]

    assert found >= 37

    young = 0  # after thirty nights, where the rule above both clusters finds what no other does
    for series in range(100):
        values = list(map(float, battery.step("+10 % on clusters 8 % apart", series, 30, 8)))
        young += "detected" in [night.state for night in judge_noisy(values)[30:]]
    assert young >= 88


def test_two_clusters_are_learnt_in_a_month_whatever_segments_they_seemed_to_make() -> None:
    """First nights by chance of one cluster make a level that the other is clear of: no red outlives what shows both."""
    started = lasting = 0
    for series in range(150):
        values = list(map(float, battery.step("+10 % on clusters 8 % apart", 5000 + series, 60, 0)))
        red = [night.state == "detected" for night in judge_noisy(values)]
        started += battery.starts(red, 30)
        lasting += any(red[30:])

    assert started <= 1
    assert lasting <= 2


def test_nights_drawn_from_two_levels_are_told_from_a_step_and_from_visits() -> None:
    nights = battery.noise("clusters 8 % apart, 50/50", 1, 40)
    drawn = sum(
        shifts.drawn_anew(battery.noise("clusters 8 % apart, 50/50", series, 40), 4) for series in range(200)
    )

    assert drawn >= 180
    assert shifts.drawn_anew(nights, 4)
    assert not shifts.drawn_anew(np.sort(nights), 4)  # a step
    assert not shifts.drawn_anew(battery.visits(5, 1.08)(battery.generator("visits", 1), 40), 4)
    assert not shifts.drawn_anew(battery.noise("Gauss 1 %", 1, 40), 4)
    for change in (0.95, 1.05):  # neither level is where the last nights lie
        assert not shifts.drawn_anew(np.concatenate([nights[:36], change * nights[36:]]), 4)


def test_five_per_cent_is_found_where_weekends_are_slower_as_where_no_two_levels_are_joined(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two nights in seven 8 % slower are not drawn anew; joined as such they hid a step that lies between the levels."""

    def found() -> int:
        count = 0
        for series in range(40):
            draws, place = battery.generator("weekends", series), np.arange(80)
            values = battery.gauss(0.01)(draws, 80) * np.where(place % 7 > 4, 1.08, 1.0)
            values[63:] *= 1.05
            told = judge_noisy(list(map(float, values)))
            count += any(night.news for night in told[63:75])
        return count

    joined = found()
    monkeypatch.setattr(run_times, "drawn_anew", lambda nights, last: False)

    assert joined >= found() >= 10


def test_a_red_of_two_clusters_that_both_moved_stays_red() -> None:
    """+3 %, clusters 8 % apart: the nights of both clusters fall into two again, and yet are no draws of the old ones."""
    kept = 0
    for series in range(40):
        values = battery.clusters(0.5, 1.08)(battery.generator("both moved", series), 100)
        values[60:] *= 1.03
        kept += sum(night.state == "detected" for night in judge_noisy(list(map(float, values)))[60:])

    assert kept >= 15 * 40


def test_a_step_and_its_mending_and_a_step_again_are_no_draws() -> None:
    """Twenty-five nights each: red both times, green between, though the nights lie in two clusters."""
    values = battery.visits(25, 1.08, noise=0.01)(battery.generator("twice", 0), 100)

    told = [night.state for night in judge_noisy(list(map(float, values)))]

    assert told[30:50] == told[80:100] == ["detected"] * 20
    assert "detected" not in told[55:75]


@pytest.mark.parametrize("series", [20148, 20180, 20381, 20398])
def test_a_visit_hides_no_step(series: int) -> None:
    """In these the step seemed a visit to the slower cluster from its second night on."""
    values = list(map(float, battery.step("+10 % on clusters 8 % apart", series, 60, 6)))

    assert "detected" in [night.state for night in judge_noisy(values)[60:]]


@pytest.mark.parametrize("series", [20115, 20148, 20180, 20381, 20398])
def test_no_night_of_a_step_off_two_clusters_is_the_last_good_one(series: int) -> None:
    """In these its first nights were green at first, as usual or as a visit: red with the rest, they blame no later one."""
    values = list(map(float, battery.step("+10 % on clusters 8 % apart", series, 60, 6)))

    red = [night for night in judge_noisy(values) if night.state == "detected"]

    assert red
    for told in red:
        assert told.last_good is not None and told.first_bad is not None
        assert told.last_good < told.first_bad
        assert told.against == told.last_good

"""Silence where there is only noise of any kind, and steps found in it: the battery that `make detectors` scores.

The bounds are those that the product promises, in alarms (starts of red stretches) per 10 000 night-values after
sixty nights of learning; here a part of the battery is put, in which a bound broken tenfold cannot hide.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import special, stats

from bench import detectors
from spook_tracker.tracker.judge import shifts
from spook_tracker.tracker.judge.normal_nights import student
from spook_tracker.tracker.judge.run_times import judge_noisy
from spook_tracker.tracker.judge.shifts import permutation_probability, remembered, standard_error
from tests.histories import noise as battery
from tests.places import ROOT

SERIES, NIGHTS = 5, 460  # of each kind: 2000 night-values after the nights of learning


def red(values: Any) -> list[bool]:
    return [night.state == "detected" for night in judge_noisy([float(value) for value in values])]


def test_stationary_noise_of_every_kind_raises_no_more_than_one_alarm_in_ten_thousand_values() -> None:
    alarms = {
        name: sum(battery.starts(red(battery.noise(name, s, NIGHTS))) for s in range(SERIES))
        for name in battery.STATIONARY
    }

    assert sum(alarms.values()) <= 2, alarms  # of 22 000 values


@pytest.mark.parametrize("name", battery.MACHINES)
def test_a_machine_that_moves_is_silent_once_the_calibration_kernel_sees_it_move(name: str) -> None:
    alarms = 0
    for series in range(SERIES):
        seconds, kernel = battery.machine(name, series, NIGHTS)
        alarms += battery.starts(red(seconds / kernel))

    assert alarms <= 2  # of 2000 values; without the kernel there are more


def test_a_level_that_wanders_raises_no_more_alarms_than_the_judge_ever_did() -> None:
    """Twenty in 10 000 values; thirty-one where a rise is held to the noise of one night to the next alone."""
    walks = [battery.machine("a walk of .3 % a night", series, 560)[0] for series in range(20)]

    assert sum(battery.starts(red(seconds)) for seconds in walks) <= 20


def test_a_step_on_a_level_that_wanders_is_found() -> None:
    """5 % after two hundred nights, told within twenty."""
    found = 0
    for series in range(40):
        seconds = battery.machine("a walk of .3 % a night", 500 + series, 220)[0]
        seconds[200:] *= 1.05
        found += any(red(seconds)[200:])

    assert found >= 30


@pytest.mark.parametrize(("ramp", "nights", "flat"), [(-0.2, 200, 60), (-0.05, 100, 30)])
def test_a_series_that_became_faster_little_by_little_is_no_blinder(
    ramp: float, nights: int, flat: int
) -> None:
    """Then flat for a month or two, then 3 % slower, at 1 % noise."""
    found = 0
    for series in range(20):
        faster = 1.0 + ramp * np.arange(nights) / nights
        levels = np.concatenate([faster, np.full(flat, 1.0 + ramp), np.full(20, 1.03 * (1.0 + ramp))])
        told = red(levels * (1.0 + 0.01 * np.random.default_rng(series).standard_normal(len(levels))))
        found += any(told[-20:])

    assert found >= 17


def test_steps_that_were_told_make_a_series_no_blinder_to_the_next() -> None:
    """Three of 10 % for the worse, mended each, thirty nights apart; sixty flat nights; then 3 %, at 1 % noise."""
    found = 0
    for series in range(10):
        levels = np.repeat([1.0, 1.1, 1.0, 1.1, 1.0, 1.1, 1.0, 1.0, 1.03], 30)
        told = red(levels * (1.0 + 0.01 * np.random.default_rng(series).standard_normal(len(levels))))
        found += any(told[240:250])

    assert found >= 9


def newly_red(values: Any, since: int) -> bool:
    """Whether a red stretch begins at or after that night."""
    return battery.starts(red(values), since) > 0


@pytest.mark.parametrize(("share", "factor"), [(0.04, 1.3), (0.05, 5.0)])
def test_a_night_in_twenty_that_is_slow_makes_a_series_no_blinder(share: float, factor: float) -> None:
    """5 % after two hundred nights of 1 % noise; by sums of twenty nights 28 and 24 of forty were found."""
    found = 0
    for series in range(40):
        draws = np.random.default_rng(series)
        values = (1.0 + 0.01 * draws.standard_normal(220)) * np.where(draws.random(220) < share, factor, 1.0)
        values[200:] *= 1.05
        found += newly_red(values, 200)

    assert found >= 38


def test_a_level_that_once_wandered_is_no_blinder_when_it_has_long_stood_still() -> None:
    """A walk of .5 % a night for three hundred nights, four months at one level, then 3 %."""
    found = 0
    for series in range(40):
        draws = np.random.default_rng(series)
        level = np.exp(0.005 * np.cumsum(draws.standard_normal(300)))
        values = np.concatenate([level, np.repeat(level[-1], 120), np.repeat(1.03 * level[-1], 20)])
        found += newly_red(values * (1.0 + 0.01 * draws.standard_normal(len(values))), 420)

    assert found >= 19


def test_after_a_year_of_seasons_a_tenth_is_told() -> None:
    """Within twenty nights, as a red that begins; not held to how nights move, half of the series are red by then."""
    found = 0
    for series in range(40):
        seconds = battery.machine("seasons of ±5 %", series, 385)[0]
        seconds[365:] *= 1.10
        found += newly_red(seconds, 365)

    assert found >= 36


@pytest.mark.parametrize("draw", ["visits", "vis2", "vis3", "d"])
def test_a_level_that_the_machine_visits_for_ten_nights_is_known_from_the_third_visit_on(draw: str) -> None:
    """Also where a night of a visit strays, where visits were never red, and where one begins in its noise."""
    late = []
    for series in range(20):
        told = red(1e-3 * battery.visits(10, 1.08)(battery.generator(draw, series), NIGHTS + 100))

        assert battery.starts(told, 1) <= 2
        late.append(battery.starts(told, 50))

    assert sum(late) == 0


def test_a_step_above_a_level_that_is_visited_is_seen_during_a_visit() -> None:
    for series in range(5):
        values = 1e-3 * battery.visits(10, 1.08)(battery.generator("above", series), 90)
        values[73:] *= 1.10
        told = red(values)

        assert battery.starts(told[:73], 50) == 0
        assert any(told[73:83])


def test_a_visit_that_does_not_end_is_red_since_it_came() -> None:
    values = 1e-3 * battery.visits(10, 1.08)(battery.generator("stays", 0), 60)
    stays = 1.08e-3 * battery.gauss(0.01)(battery.generator("stays", 1), 40)
    told = judge_noisy([*map(float, values), *[float(v) / 1.08 for v in stays[:10]], *map(float, stays[10:])])

    late = [night for night in told[70:] if night.state == "detected"]
    assert late
    assert late[0].first_bad == 70
    assert told[-1].state == "detected"


FOUND = {  # the least share of forty series
    "+10 % at 1 % noise": 1.0,
    "+3 % at .2 % noise": 1.0,
    "+3 % at 1 % noise": 0.8,
    "+10 % on clusters 8 % apart": 0.85,
}


def test_no_detector_that_looks_every_night_finds_more_than_the_bound() -> None:
    """One that knows level and noise and looks at the last night, at the last two, three and four, every night."""
    draws = np.random.default_rng(7)

    def told(values: Any) -> Any:
        sums, red = np.cumsum(values, axis=-1), values > 3.6
        for nights in (2, 3, 4):
            red[..., nights:] |= sums[..., nights:] - sums[..., :-nights] > 3.6 * math.sqrt(nights)
        return red

    red = told(draws.standard_normal(1_000_000))
    rate = np.sum(red[1:] & ~red[:-1]) / len(red)
    after = told(draws.standard_normal((100_000, 8)) + 3.0 * (np.arange(8) >= 4))
    found = np.mean(np.any(after[:, 4:] & ~after[:, 3:4], axis=1))
    bound = detectors.best_of_nights(rate)[0]

    assert 1e-4 < rate < 1e-3
    assert bound - 0.02 < found < bound


def test_what_no_detector_exceeds_is_what_the_best_test_of_all_the_nights_finds() -> None:
    """By draws: the mean of four nights, its critical value from draws too, at a size that draws can tell."""
    draws = np.random.default_rng(8)
    before, nights = draws.standard_normal((40_000, 60)), draws.standard_normal((40_000, 4))

    def student(nights: Any) -> Any:
        freedom = before.shape[1] + nights.shape[1] - 2
        squares = np.sum((before.T - before.mean(1)) ** 2, 0) + np.sum((nights.T - nights.mean(1)) ** 2, 0)
        return (nights.mean(1) - before.mean(1)) / np.sqrt(squares / freedom * (1 / 60 + 1 / 4))

    known, learnt, both = detectors.best_of_nights(0.01, apart=1.0)
    assert np.mean(nights.mean(1) + 1.0 > np.quantile(nights.mean(1), 0.96)) == pytest.approx(known, abs=0.02)
    off = nights.mean(1) - before.mean(1)
    assert np.mean(off + 1.0 > np.quantile(off, 0.96)) == pytest.approx(learnt, abs=0.02)
    assert np.mean(student(nights + 1.0) > np.quantile(student(nights), 0.96)) == pytest.approx(
        both, abs=0.02
    )
    assert detectors.best_on_clusters(1e-4, factor=1.0, step=1.03, nights=4) == pytest.approx(
        detectors.best_of_nights(1e-4)[0], abs=3e-3
    )


@pytest.mark.parametrize("name", battery.STEPS)
def test_steps_are_found_within_their_nights_as_often_as_the_page_tells(name: str) -> None:
    """`docs/detectors.md` says of ours what is found in these forty series."""
    nights = battery.STEPS[name][2]
    told = [red(battery.step(name, series, 60, 15)) for series in range(40)]
    share = sum(any(found[60 : 60 + nights]) for found in told) / 40
    page = (ROOT / "docs" / "detectors.md").read_text(encoding="utf-8")
    (row,) = [line for line in page.splitlines() if line.startswith(f"| {name}, within {nights} nights |")]

    assert sum(any(found[30:60]) for found in told) <= 1  # while it learns
    assert share >= FOUND[name]
    assert row.split("|")[2].split("(")[0].strip() == f"{100.0 * share:.0f} %"


def test_a_shift_that_several_nights_found_is_blamed_on_its_first_and_ends_where_it_ends() -> None:
    for series in range(10):
        values = battery.step("+3 % at 1 % noise", series, 60, 12)
        back = 1e-3 * battery.gauss(0.01)(battery.generator("back", series), 8)
        told = judge_noisy([float(v) for v in [*values, *back]])
        found = [place for place, night in enumerate(told) if night.state == "detected"]

        if found and found[0] <= 66:
            assert 58 <= told[found[0]].first_bad <= 62
            assert told[found[0]].verdict.name == "slower"
            assert "by chance once in" in told[found[0]].verdict.sentence
        assert told[-1].state == "green"


def test_a_rate_that_fell_is_told_as_the_time_that_rose() -> None:
    for series in range(3):
        step = battery.step("+3 % at 1 % noise", series, 60, 12)
        back = 1e-3 * battery.gauss(0.01)(battery.generator("back", series), 8)
        told = judge_noisy([float(1.0 / v) for v in [*step, *back]], larger_is_better=True)
        found = [night for night in told if night.state == "detected"]

        assert found
        assert "for the worse" in found[0].verdict.sentence
        assert told[-1].state == "green"


def test_a_rate_that_collapses_is_told_however_far_apart_its_first_nights_lay() -> None:
    """A rate falls by a hundred per cent at most: what stands clear is asked of the time that it stands for."""
    first = [1.0, 1.5, 1.0, 1.4, 0.8, 1.3, 0.7, 1.0]
    told = judge_noisy([1.0 / time for time in (*first, 5.0, 5.0)], larger_is_better=True)

    assert [night.state for night in told[-2:]] == ["suspected", "detected"]


def test_two_clusters_are_told_from_one_hump_cut_in_two() -> None:
    for series in range(5):
        two = battery.clusters(0.3, 1.08)(battery.generator("two", series), 60)
        low, high = shifts.clusters(two) or (0.0, 0.0)
        assert abs(low - 1.0) < 0.01
        assert abs(high - 1.08) < 0.01
        for name in ("Gauss 1 %", "Gauss 5 %", "lognormal 5 %", "AR(1) .5, 2 %"):
            assert shifts.clusters(battery.noise(name, series, 60)) is None
    assert shifts.clusters(np.array([*np.full(58, 1.0), 1.5, 1.5])) is None  # spikes are no cluster


def test_a_night_in_the_other_cluster_is_no_shift_away_from_both() -> None:
    nights = battery.clusters(0.5, 1.08)(battery.generator("more", 0), 60)
    slow = 1.08 * battery.gauss(0.01)(battery.generator("more", 1), 6)

    assert shifts._apart_from_clusters(nights, slow) is None
    assert shifts._apart_from_clusters(nights, 1.1 * slow) is not None


def test_red_nights_do_not_become_usual() -> None:
    told = red(battery.step("+3 % at .2 % noise", 1, 60, 60))

    assert all(told[61:])


def test_the_permutation_test_counts_choices_exactly() -> None:
    """Ten values 0, two values 1, of three more: the largest sum, and the two largest in three."""
    base = np.array([0.0] * 9 + [1.0] * 2)

    assert math.isclose(
        permutation_probability(base, np.array([1.0, 1.0])), math.comb(4, 2) / math.comb(13, 2)
    )
    one = permutation_probability(base, np.array([0.0, 1.0]))
    assert math.isclose(one, (math.comb(3, 2) + 3 * 10) / math.comb(13, 2))
    assert permutation_probability(np.ones(20), np.ones(4)) == 1.0


def test_the_permutation_test_agrees_with_draws() -> None:
    draws = np.random.default_rng(4)
    base, last = draws.exponential(size=40), draws.exponential(size=4) + 0.8
    drawn = stats.permutation_test(
        (last, base),
        lambda x, y: np.mean(x) - np.mean(y),
        alternative="greater",
        n_resamples=20000,
        rng=draws,
    ).pvalue

    assert abs(permutation_probability(base, last) - drawn) < 4.0 * math.sqrt(drawn / 20000) + 2e-3


def test_a_share_that_is_enough_is_told_early_and_none_is_told_for_more_than_it_is() -> None:
    draws, early, rare = np.random.default_rng(5), 0, 0
    for rise in np.linspace(0.0, 3.0, 300):
        base, last = draws.exponential(size=40), draws.exponential(size=4) + rise
        whole, told = (permutation_probability(base, last, enough) for enough in (math.inf, 1e-3))
        assert told <= whole
        assert (told < 1e-3) == (whole < 1e-3)
        early, rare = early + (told < whole), rare + (told < 1e-3)

    assert early > 30 and rare > 30
    base, last = np.array([0.0] * 8 + [0.45] + [1.0] * 2), np.array([0.0, 1.0])  # three reach its mean
    assert permutation_probability(base, last, 1e-9) == math.comb(3, 2) / math.comb(13, 2)


@pytest.mark.parametrize("freedom", [3.0, 5.0, 15.0, 60.0, 1000.0])
def test_the_quantile_of_students_t_is_that_of_scipy_or_a_little_more(freedom: float) -> None:
    assert -0.001 < student(freedom) / special.stdtrit(freedom, 1.0 - 1e-5) - 1.0 < 1.0 / freedom


def test_nights_that_remember_each_other_need_more_to_be_a_shift() -> None:
    white = battery.gauss(0.01)(battery.generator("white", 0), 100)
    close = battery.autoregressive(0.9, 0.01)(battery.generator("close", 0), 100)

    assert remembered(white) == 0.0
    assert 0.7 < remembered(close) <= 0.98
    assert remembered(np.full(50, 1e-6)) == 0.0
    assert standard_error(close, 4) > 2.0 * standard_error(white, 4)
    expected = student(99.0) * np.std(white, ddof=1) * math.sqrt(1 / 4 + 1 / 100)
    assert math.isclose(standard_error(white, 4), expected)


def test_earlier_nights_tell_what_few_remember_unless_these_tell_otherwise() -> None:
    """Of a segment of forty nights: nights cut off it, and a wandering before a level that stands still."""
    alone = together = contradicted = 0
    for series in range(100):
        draws = battery.generator("earlier", series)
        nights = battery.autoregressive(0.5, 0.02)(draws, 200)
        alone += remembered(nights[160:]) > 0.0
        together += remembered(nights[160:], list(nights[:160] - 1.0)) > 0.0
        walk = np.cumsum(draws.standard_normal(160))
        contradicted += remembered(battery.gauss(0.01)(draws, 40), list(walk - np.mean(walk))) > 0.0

    assert alone < 75
    assert together >= 95
    assert contradicted <= 5


def test_nights_cut_off_a_segment_still_tell_what_nights_remember() -> None:
    """What is left of a segment may look as if nights did not remember each other: then 8 alarms."""
    raised = 0
    for series in range(1000, 1100):
        raised += battery.starts(red(battery.noise("AR(1) .5, 2 %", series, 560)))

    assert raised <= 5


def test_no_shift_below_one_per_cent_is_told() -> None:
    values = [*(1.0 + 1e-5 * (night % 3) for night in range(60)), *[1.009] * 6]

    assert shifts.shift(values) is None
    assert shifts.shift([*values[:60], *[1.011] * 6]) is not None


def test_a_step_on_two_clusters_is_told_as_one_away_from_both() -> None:
    """Above both of two clusters drawn at random: never taken for a visit to the slower one, which needs no look."""
    found = []
    for seed in range(20):
        draws = np.random.default_rng(seed)
        nights = np.where(draws.random(66) < 0.5, 1.08, 1.0) * (1.0 + 0.01 * draws.standard_normal(66))
        nights[60:] *= 1.1
        found.append(shifts.shift(list(nights)))

    told = [one for one in found if one is not None]
    assert len(told) >= 15
    assert all(one.apart for one in told)

"""Run times: silence where there is only noise, red where something changed."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from scipy import stats

from spook_tracker.tracker.document.middle import quartile
from spook_tracker.tracker.document.run_document import Timing
from spook_tracker.tracker.judge.run_times import judge_noisy, judged_and_segments
from spook_tracker.tracker.judge.timing_statistics import compare_times, rank_test


def noisy(count: int, seed: int, level: float = 1e-3, noise: float = 0.01) -> list[float]:
    source = random.Random(seed)
    return [level * (1.0 + source.gauss(0.0, noise)) for _ in range(count)]


def states(values, **options) -> list[str]:
    return [night.state for night in judge_noisy(values, **options)]


def test_fifty_series_of_a_thousand_noisy_nights_raise_no_alarm():
    alarms = sum(state != "green" for seed in range(50) for state in states(noisy(1000, seed)))

    assert alarms <= 1  # one unusual night may be suspected; 50 000 nights must not turn red
    assert not any("detected" in states(noisy(1000, seed)) for seed in range(50, 55))


def test_heavy_tails_are_suspected_at_most():
    draws = np.random.default_rng(1).standard_t(3, size=(10, 500))

    assert not any("detected" in states(list(1e-3 * (1.0 + 0.01 * series))) for series in draws)


@pytest.mark.parametrize("seed", range(20))
def test_ten_per_cent_more_at_one_per_cent_noise_is_red_within_two_nights(seed):
    told = judge_noisy([*noisy(60, seed), *noisy(3, 100 + seed, level=1.1e-3)])

    assert "detected" not in [night.state for night in told[:60]]
    assert told[61].state == "detected"
    assert (told[61].verdict.name, told[61].first_bad, told[61].last_good) == ("slower", 60, 59)
    assert told[62].state == "detected"


def test_one_slow_night_is_suspected_and_forgotten():
    told = states([*noisy(30, 1), 1.3e-3, *noisy(5, 2)])

    assert told[30] == "suspected"
    assert set(told[31:]) == {"green"}


def test_a_mended_slowdown_is_recovered():
    told = states([*noisy(30, 1), *noisy(3, 2, level=1.3e-3), *noisy(3, 3)])

    assert told[30:] == ["suspected", "detected", "detected", "detected", "recovered", "green"]


def test_a_speed_up_becomes_the_new_level():
    told = judge_noisy([*noisy(30, 1), *noisy(40, 2, level=0.8e-3), *noisy(2, 3)])

    assert "detected" not in [night.state for night in told[:70]]
    assert told[71].state == "detected"  # back to the old time is slower now


@pytest.mark.parametrize(("share", "nights"), [(0.8, 15), (0.5, 10)])
def test_a_speed_up_of_some_nights_hides_no_slow_down(share, nights):
    told = states([*noisy(40, 1), *noisy(nights, 2, level=share * 1e-3), *noisy(3, 3)])

    assert "detected" not in told[: 40 + nights]
    assert told[40 + nights + 1] == "detected"


@pytest.mark.parametrize("seed", range(10))
def test_three_per_cent_more_at_a_fifth_of_a_per_cent_noise_is_red_within_two_nights(seed):
    told = states([*noisy(60, seed, noise=0.002), *noisy(2, 100 + seed, level=1.03e-3, noise=0.002)])

    assert "detected" not in told[:60]
    assert told[61] == "detected"


def begins(told: list[str]) -> int:
    """How many red stretches begin after sixty nights of learning."""
    return sum(told[i] == "detected" != told[i - 1] for i in range(60, len(told)))


@pytest.mark.parametrize(("share", "factor", "most"), [(0.2, 1.5, 12), (0.2, 1.08, 12), (0.5, 1.08, 60)])
def test_spikes_and_clusters_are_learnt(share, factor, most):
    """Alarms in 10 000 night-values; medians alone raised 298, 327 and 896."""
    alarms = 0
    for seed in range(20):
        draws = np.random.default_rng(seed)
        values = (
            1e-3
            * (1.0 + 0.01 * draws.standard_normal(560))
            * np.where(draws.random(560) < share, factor, 1.0)
        )
        alarms += begins(states([float(value) for value in values]))

    assert alarms <= most


def test_slow_creep_is_drift_against_the_last_release():
    values = [value * 1.001**night for night, value in enumerate(noisy(200, 4))]
    told = judge_noisy(values, releases=[night == 0 for night in range(200)])
    red = [night for night in told if night.state == "detected"]

    assert red
    assert {night.verdict.name for night in red} <= {"drift", "slower"}
    assert red[0].verdict.name == "drift"


def test_a_time_that_is_not_finite_is_red_that_same_night():
    told = judge_noisy([*noisy(10, 1), math.inf])

    assert (told[-1].state, told[-1].verdict.name) == ("detected", "not finite")


def test_a_target_that_was_never_reached_is_not_worse_for_it():
    assert states([math.inf, math.inf]) == ["green", "green"]
    assert states([math.inf, 1.0, math.inf]) == ["green", "green", "detected"]


def test_an_accepted_level_is_the_new_usual():
    values = [*noisy(30, 1), *noisy(10, 2, level=1.3e-3)]
    told = states(values, accepted=[i >= 30 for i in range(40)])

    assert told[30] == "accepted"
    assert set(told[31:]) == {"green"}


def levels(values):
    return [(segment.first, segment.last) for segment in judged_and_segments(values)[1]]


def test_a_step_is_found_where_it_is_and_its_levels_are_told():
    before, after = judged_and_segments([*noisy(45, 1), *noisy(15, 2, level=1.05e-3)])[1]

    assert abs(after.first - 45) <= 1
    assert abs(after.level / before.level - 1.05) < 0.01
    assert after.boundary.probability > 0.9
    assert 45 in after.boundary.places
    assert sum(after.boundary.probabilities) == pytest.approx(1.0, abs=0.01)


def test_two_steps_are_three_segments():
    values = [*noisy(40, 1), *noisy(40, 2, level=1.2e-3), *noisy(40, 3)]

    assert levels(values) == [(0, 39), (40, 79), (80, 119)]


def test_a_change_of_eight_nights_in_the_middle_of_a_history_is_found():
    values = [*noisy(60, 1), *noisy(8, 2, level=1.1e-3), *noisy(60, 3)]
    told = states(values)

    assert told[61] == "detected"
    assert "recovered" in told[68:71]
    assert "detected" not in told[71:]


def test_the_boundary_of_a_thousand_nights_is_at_its_night():
    assert levels([*noisy(600, 5), *noisy(400, 6, level=1.1e-3)])[1] == (600, 999)


def test_noise_is_one_segment():
    assert all(len(levels(noisy(200, seed))) == 1 for seed in range(30))
    assert levels([1.0] * 50) == [(0, 49)]
    assert levels([1.0]) == [(0, 0)]
    assert levels([math.nan] * 20) == []


@pytest.mark.parametrize(("n", "m"), [(5, 5), (5, 7), (10, 10), (30, 30)])
def test_the_rank_test_agrees_with_scipy(n, m):
    draws = np.random.default_rng(n)
    low, high = list(draws.normal(size=n)), list(draws.normal(0.7, size=m))
    expected = stats.mannwhitneyu(
        high, low, alternative="greater", method="auto" if n > 20 else "exact"
    ).pvalue

    assert abs(rank_test(low, high) - expected) < 1e-12
    assert rank_test([1.0] * 5, [1.0] * 5) > 0.5


def timing(seed: int, level: float, noise: float = 0.01, instructions: int | None = None) -> Timing:
    source = random.Random(seed)
    seconds = tuple(level * (1.0 + abs(source.gauss(0.0, noise))) for _ in range(5))
    return Timing(seconds=seconds, runs_per_repeat=1, instructions=instructions)


def ladder(seed: int, factor: float = 1.0, **options) -> list[Timing]:
    return [timing(seed * 100 + i, factor * 1e-3 * 2**i, **options) for i in range(6)]


def test_doubled_run_times_are_slower_and_the_same_build_is_not():
    slower = compare_times(ladder(1), ladder(2, 2.0))

    assert slower.slower
    assert abs(slower.ratio - 2.0) < 0.05
    for seed in range(100):
        same = compare_times(ladder(seed), ladder(1000 + seed, noise=0.05))
        assert not same.slower
        assert not same.faster


def test_the_same_instructions_need_a_gross_change_to_be_believed():
    before = ladder(1, instructions=10**6)

    assert not compare_times(before, ladder(2, 1.3, instructions=10**6)).slower
    assert compare_times(before, ladder(2, 1.3, instructions=13 * 10**5)).slower
    assert compare_times([], []) is None


def test_a_time_of_0_is_none():
    none = Timing(seconds=(0.0, 0.0, 0.0), runs_per_repeat=1)

    assert compare_times([none], [timing(1, 1e-3)]) is None
    assert compare_times([timing(1, 1e-3)], [none]) is None
    assert compare_times([none, *ladder(1)], [none, *ladder(2, 2.0)]).rungs == 6


def test_one_slow_rung_is_not_a_slower_engine():
    after = ladder(2)
    after[3] = timing(7, 20.0)

    assert not compare_times(ladder(1), after).slower


def by_the_processor(
    seed: int, factor: float = 1.0, machine: float = 1.0, noise: float = 0.001, repeats: int = 5
):
    """A ladder whose clock says nothing (a busy machine), with processor time and kernel of little noise."""
    source = random.Random(seed)
    found = []
    for rung in range(6):
        cpu = tuple(
            machine * factor * 1e-3 * 2**rung * (1.0 + abs(source.gauss(0.0, noise))) for _ in range(repeats)
        )
        kernel = tuple(machine * 1e-3 * (1.0 + abs(source.gauss(0.0, noise))) for _ in range(repeats))
        clock = tuple(seconds * source.uniform(1.0, 3.0) for seconds in cpu)
        found.append(Timing(seconds=clock, runs_per_repeat=1, cpu_seconds=cpu, calibration=kernel))
    return found


def test_two_sessions_are_compared_by_processor_time_over_the_kernels() -> None:
    for seed in range(50):
        same = compare_times(by_the_processor(seed), by_the_processor(100 + seed, machine=1.4))
        assert not same.slower and not same.faster
        assert compare_times(by_the_processor(seed), by_the_processor(100 + seed, 1.04, machine=0.7)).slower
    assert same.floor < 0.04


def test_the_floor_of_two_sessions_follows_what_repeats_and_rungs_show() -> None:
    quiet = compare_times(by_the_processor(1, noise=1e-5), by_the_processor(2, 1.02, noise=1e-5))
    noisy = compare_times(by_the_processor(1, noise=0.03), by_the_processor(2, 1.08, noise=0.03))

    assert (quiet.floor, quiet.slower) == (0.01, True)
    assert noisy.floor > 0.08
    assert not noisy.slower
    loud = compare_times(by_the_processor(5, noise=0.08), by_the_processor(55, 1.2, noise=0.08))
    assert loud.floor < 0.15  # rungs and repeats may ask for less, never for more
    assert loud.slower
    assert compare_times(ladder(1), ladder(2, 1.08)).floor >= 0.1  # by the clock alone
    assert compare_times(by_the_processor(1)[:2], by_the_processor(2)[:2]).floor >= 0.1  # of few rungs


@pytest.mark.parametrize("repeats", [1, 2])
def test_a_time_taken_once_or_twice_a_side_is_measured_again_before_it_is_told(repeats) -> None:
    before, after = ([Timing(seconds=(level,) * repeats, runs_per_repeat=1)] for level in (1.0, 1.5))
    found = compare_times(before, after)

    assert not found.slower
    assert not found.repeated
    assert compare_times(
        [Timing(seconds=(1.0,) * 3, runs_per_repeat=1)], [Timing(seconds=(1.5,) * 3, runs_per_repeat=1)]
    ).slower


def test_a_series_tells_no_change_of_time_below_its_own_tolerance():
    values = [*noisy(60, 1), *noisy(20, 2, level=1.1e-3)]

    assert "detected" in states(values)
    assert "detected" not in states(values, tolerance=0.15)
    assert "detected" in states([*values, *noisy(3, 3, level=1.4e-3)], tolerance=0.15)
    assert compare_times(ladder(1), ladder(2, 1.4)).slower
    assert not compare_times(ladder(1), ladder(2, 1.4), tolerance=0.5).slower


@pytest.mark.parametrize("odd", [math.nan, math.inf, 0.0])
def test_a_rate_that_began_without_a_number_is_judged_as_any_other(odd: float) -> None:
    """What is not finite, and the time of a rate of zero, has no place in sums over the nights of a level."""
    level = [1.0 + 0.01 * math.sin(7.0 * n) for n in range(10)]
    faster, slower = [1.1 * v for v in level], [0.55 * v for v in level]
    found = states([odd, *level, *faster, *slower], larger_is_better=True)

    assert "detected" not in found[1:21]
    assert set(found[24:]) == {"detected"}


def test_whatever_nights_there_are_each_gets_a_verdict() -> None:
    chance = random.Random(2)
    for count in range(2, 60):
        level, values = 1.0, []
        for _ in range(count):
            level *= chance.choice([0.8, 1.1, 1.3, 2.0, 0.5]) if chance.random() < 0.05 else 1.0
            odd = chance.choice([math.nan, math.inf, 0.0])
            values.append(odd if chance.random() < 0.06 else level * (1.0 + chance.gauss(0.0, 0.01)))
        for larger in (False, True):
            assert len(states(values, larger_is_better=larger)) == count


def test_the_lower_quartile_is_numpys() -> None:
    chance = np.random.default_rng(4)
    for count in (*range(1, 20), 400):
        values = chance.lognormal(size=count)
        assert quartile(values.tolist()) == float(np.quantile(values, 0.25))

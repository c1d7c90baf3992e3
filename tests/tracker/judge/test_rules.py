"""The judge's rules as they are documented, on series in which a reader can count.

Each expectation is written from the rule and never read from a constant of the judge, so that a constant that
changes is noticed. `make mutation` changes them one by one and sees a test here, or beside it, fail.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from spook_tracker.tracker.document.run_document import MapData, Point
from spook_tracker.tracker.judge.compare import same_commit
from spook_tracker.tracker.judge.run_times import judge_noisy
from spook_tracker.tracker.judge.series_history import judge_history
from spook_tracker.tracker.judge.verdict import judge, judge_map
from spook_tracker.tracker.judge.vocabulary import with_recoveries
from tests.histories.documents import definition, engine, gate, run_of
from tests.tracker.judge.test_compare import side
from tests.tracker.judge.test_verdict import sample

LEVELS = [1e-6, 1.0, 1e6]  # s: what counts is relative, so the unit of time makes no difference


def around(level: float, spread: float, count: int) -> list[float]:
    """`count` nights, a multiple of three: a third at the level, a third below and a third above."""
    return [level * (1.0 + spread * place) for _ in range(count // 3) for place in (-1, 0, 1)]


def last_state(history: list[float], *more: float) -> str:
    return judge_noisy([*history, *more])[-1].state


@pytest.mark.parametrize("level", LEVELS)
def test_clear_of_the_noise_is_four_times_the_noise(level: float) -> None:
    """A spread of 2 % is a median absolute deviation of 2 %, so sigma is 2.97 %; 4 sigma 11.9 %, 3 sigma 8.9 %."""
    usual = around(level, 0.02, 30)

    assert last_state(usual, 1.11 * level, 1.11 * level) == "green"
    assert last_state(usual, 1.13 * level, 1.13 * level) == "detected"


@pytest.mark.parametrize("level", LEVELS)
def test_without_noise_five_per_cent_are_the_floor_and_one_after_twenty_nights(level: float) -> None:
    assert last_state([level] * 15, 1.04 * level, 1.04 * level) == "green"
    assert last_state([level] * 15, 1.06 * level, 1.06 * level) == "detected"
    assert last_state([level] * 30, 1.009 * level, 1.009 * level) == "green"
    assert last_state([level] * 30, 1.011 * level, 1.011 * level) == "detected"


def test_with_few_nights_only_half_as_much_again_counts() -> None:
    """Four nights cannot say what is noise; five can."""
    assert last_state([1.0] * 4, 1.45) == "green"
    assert last_state([1.0] * 4, 1.55) == "suspected"
    assert last_state([1.0] * 5, 1.06) == "suspected"


def test_the_last_thirty_nights_say_what_is_usual() -> None:
    """Eight calm nights after a noisy month do not make it calm; thirty do, whatever was before them."""
    noisy_month = [*around(1.0, 0.04, 30), *[0.96, 1.04] * 15]  # a deviation of 4 %: 4 sigma are 23.7 %

    assert last_state([*noisy_month, *[1.0] * 8], 1.15, 1.15) == "green"
    assert last_state([*noisy_month, *[1.0] * 30], 1.1, 1.1) == "detected"


def test_a_creep_is_told_by_five_nights_at_both_ends() -> None:
    """Six per cent, little by little: the median of five nights reaches five per cent only at the end."""
    slow = [1.0] * 5 + [1.0 + 0.001 * night for night in range(1, 61)]

    told = judge_noisy(slow)

    red = [night for night, found in enumerate(told) if found.state == "detected"]
    assert told[red[0]].verdict.name == "drift"
    assert {(night.last_good, night.first_bad, night.accused) for night in told[red[0] :]} == {
        (4, red[0], (4, red[0]))  # each commit between may have its share
    }
    assert set(range(red[0], len(slow))) == set(red)


WORSE = [("value", "unsettled"), ("unsettled", "out_of_limit"), ("out_of_limit", "not_finite"), ("not_finite", "diverged"),
         ("not_finite", "crashed"), ("not_finite", "timed_out"), ("diverged", "missing"), ("crashed", "missing"),
         ("timed_out", "missing")]  # fmt: skip


@pytest.mark.parametrize(("better", "worse"), WORSE)
def test_outcomes_have_the_documented_order(better: str, worse: str) -> None:
    """value < unsettled < out of limit < not finite < diverged, crashed, timed out < missing."""

    def one(outcome: str):
        return sample(1.0 if outcome in ("value", "unsettled", "out_of_limit") else math.nan, outcome)

    word = "missing" if worse == "missing" else "regressed"
    assert judge(gate(limit=1.0), one(better), one(worse)).word == word
    assert judge(gate(limit=1.0), one(worse), one(better)).word in ("fixed", "improved")


@pytest.mark.parametrize(
    "pair", [("diverged", "crashed"), ("crashed", "timed_out"), ("timed_out", "diverged")]
)
def test_ways_to_give_no_answer_are_equally_bad(pair: tuple[str, str]) -> None:
    assert not judge(gate(), sample(math.nan, pair[0]), sample(math.nan, pair[1])).red


CELLS = ("settled", "bounded", "growing", "diverged", "not_finite", "an unknown word")


@pytest.mark.parametrize(("better", "worse"), list(itertools.pairwise(CELLS)))
def test_cells_of_a_map_have_the_documented_order(better: str, worse: str) -> None:
    def map_of(cell: str) -> MapData:
        return MapData(
            test="t", name="m", title="", configuration="", x_label="", y_label="", definition="", note="", prediction=None,
            x=(1.0,), y=(1.0,), cells=((cell,),),
        )  # fmt: skip

    assert judge_map(map_of(better), map_of(worse)).word == "regressed"
    assert judge_map(map_of(worse), map_of(better)).word == "improved"


UNLIKE = [
    ({"git_hash": "b" * 40}, "another commit"),
    ({"git_hash": ""}, "an unknown commit"),
    ({"dirty": True}, "a changed tree"),
]


@pytest.mark.parametrize(("facts", "why"), [*UNLIKE, ({"engine": "other"}, "another engine")])
def test_one_commit_is_one_hash_of_one_engine_in_clean_trees(facts: dict, why: str) -> None:
    one, other = side("a"), side("a", **facts)

    assert same_commit(one, side("a", run="again"))
    assert not same_commit(one, other), why
    assert not same_commit(other, one), why


@pytest.mark.parametrize(("facts", "why"), [*UNLIKE, ({"name": "other"}, "another engine")])
def test_only_the_same_commit_can_contradict_itself(facts: dict, why: str) -> None:
    def told(first: dict, second: dict) -> str:
        runs = [
            run_of({"a": value}, id=str(value), engine=engine(**{"git_hash": "a" * 40, **changes}))
            for value, changes in ((1.0, first), (1.0 + 2**-40, second))
        ]
        history = [Point(run, run.samples[0], "1") for run in runs]
        return judge_history("a", definition("a"), history)[-1].verdict.word

    assert told({}, {}) == "non_deterministic"
    assert told({}, facts) != "non_deterministic", why
    assert told(facts, {}) != "non_deterministic", why


def test_where_larger_is_better_less_is_worse() -> None:
    assert judge_noisy([1.0] * 10 + [0.9, 0.9], larger_is_better=True)[-1].state == "detected"
    assert judge_noisy([1.0] * 10 + [1.1, 1.1], larger_is_better=True)[-1].state == "green"


def test_recovered_is_the_first_night_after_red_that_says_anything() -> None:
    states = (
        "recovered",
        "suspected",
        "detected",
        "unjudged",
        "green",
        "green",
        "detected",
        "suspected",
        "accepted",
    )

    assert list(with_recoveries(states)) == [
        "green", "suspected", "detected", "unjudged", "recovered", "green", "detected", "recovered", "accepted",
    ]  # fmt: skip


def test_more_nights_of_the_slower_cluster_in_a_row_than_chance_draws_are_a_level() -> None:
    """One night in five is 10 % slower: six of them in a row are drawn too often to be told, twelve once in 10⁷."""
    rng = np.random.default_rng(1)
    nights = 1.0 + 0.1 * (rng.permutation(60) < 12) + 0.005 * rng.standard_normal(60)
    slow = 1.1 + 0.005 * rng.standard_normal(24)
    said = judge_noisy([*nights, *slow])

    assert {night.state for night in said[60:66]} <= {"green", "suspected"}
    assert (said[72].state, said[-1].worse_at, said[-1].verdict.name) == ("detected", 60, "slower")


@pytest.mark.parametrize(("every", "slow", "step"), [(5, 1.5, 1.4), (4, 1.5, 1.3), (6, 2.0, 1.5)])
def test_a_step_is_told_whatever_nights_were_slow_in_turn_before(
    every: int, slow: float, step: float
) -> None:
    nights = 1.0 + 0.01 * np.random.default_rng(2).standard_normal(90)
    nights[:60:every] *= slow
    nights[60:] *= step
    told = judge_noisy(list(nights))[-1]

    assert (told.state, told.worse_at) == ("detected", 60)


def test_what_mended_a_part_of_a_red_is_not_accused() -> None:
    nights = 1.0 + 0.01 * np.random.default_rng(1).standard_normal(70)
    nights[40:] *= 1.5
    nights[55:] *= 0.8
    told = judge_noisy(list(nights))[-1]

    assert (told.state, told.worse_at, told.accused) == ("detected", 40, (39, 40))


def test_values_that_are_lost_on_a_red_series_keep_the_commit_that_lost_them() -> None:
    slow = [*around(1.0, 0.01, 30), *around(1.3, 0.01, 15)]
    told = judge_noisy([*slow, *[math.inf] * 3])[-3:]

    assert [(night.first_bad, night.worse_at, night.news) for night in told] == [
        (30, 45, True), (30, 45, False), (30, 45, False)
    ]  # fmt: skip

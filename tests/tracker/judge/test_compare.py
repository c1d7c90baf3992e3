"""Two runs side by side: the verdict over all, what is missing, and two versions on one ladder."""

from __future__ import annotations

import math
import random

import msgspec
import pytest

from spook_tracker.tracker.document.json_form import Number, decode, encode
from spook_tracker.tracker.document.run_document import Sample, Timing
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.compare import ComparedRun, Known, compare
from spook_tracker.tracker.judge.comparison_document import CompareDocument, Side
from tests.histories.documents import gate, stability_map

STEPS = (0.1, 0.05, 0.025, 0.0125, 0.00625)


def pair(key: str, value: float, timing: Timing | None = None, steps: int = 0, **facts):
    finite = math.isfinite(value)
    sample = Sample(
        series=key,
        value=Number(value),
        outcome="value" if finite else "not_finite",
        passed=finite,
        set_point_held=finite,
        counters={"steps": steps} if steps else {},
        timing=timing,
    )
    return key, (gate(key, **facts), sample)


def side(name: str, **facts) -> Side:
    common = {
        "run": f"run-{name}",
        "engine": "toy",
        "version": name,
        "git_hash": name * 40,
        "dirty": False,
        "started": "2026-11-21T03:00:00+00:00",
        "machine": "m",
        "float_environment": "f",
    }
    return Side(**{**common, **facts})


def run(name: str, *pairs, maps=(), **facts) -> ComparedRun:
    return ComparedRun(side=side(name, **facts), samples=dict(pairs), maps=maps)


def by_series(document: CompareDocument) -> dict[str, str]:
    return {change.series: change.word for change in document.changes}


def test_two_equal_runs_are_identical_with_exit_code_0():
    document = compare(run("a", pair("t/c/m", 0.1)), run("b", pair("t/c/m", 0.1)))

    assert (document.verdict, document.exit_code, document.counts) == ("identical", 0, {"identical": 1})


def test_one_regression_decides_and_stands_first():
    before = run("a", *(pair(f"t/c/m{i}", 0.1) for i in range(5)))
    after = run("b", *(pair(f"t/c/m{i}", 0.2 if i == 3 else 0.1) for i in range(5)))
    document = compare(before, after)

    assert (document.verdict, document.exit_code) == ("regressed", 1)
    assert (document.changes[0].series, document.changes[0].name) == ("t/c/m3", "worse")


def test_a_value_that_a_test_no_longer_gives_is_missing_and_red():
    before = run("a", pair("t/c/m", 0.1), pair("t/c/n", 0.1))
    document = compare(before, run("b", pair("t/c/m", 0.1)))

    assert by_series(document)["t/c/n"] == "missing"
    assert document.exit_code == 1


def test_a_test_or_sweep_that_was_not_asked_for_is_named_and_not_red():
    before = run("a", pair("t/c/m", 0.1), pair("u/c/m", 0.1), pair("t/c/ladder:e/h=1", 0.1, kind="ladder"))
    document = compare(before, run("b", pair("t/c/m", 0.1)))

    assert by_series(document)["u/c/m"] == "not_measured"
    assert by_series(document)["t/c/ladder:e/h=1"] == "not_measured"
    assert document.exit_code == 0
    assert document.notes == ("in part not measured in the later run: t, u",)


def test_a_new_value_is_new():
    document = compare(run("a", pair("t/c/m", 0.1)), run("b", pair("t/c/m", 0.1), pair("t/c/n", 9.0)))

    assert (by_series(document)["t/c/n"], document.exit_code) == ("new", 0)


@pytest.mark.parametrize(
    "later",
    [
        run("b", pair("t/c/m", 0.9, test_version="2")),
        run("b", pair("t/c/m", 0.9), float_environment="other"),
        run("b", pair("u/c/m", 0.9)),
    ],
)
def test_what_cannot_be_compared_ends_with_3_and_is_never_red(later):
    document = compare(run("a", pair("t/c/m", 0.1)), later)

    assert (document.verdict, document.exit_code) == ("not_comparable", 3)
    assert not any(change.red for change in document.changes)


def test_the_same_commit_with_two_values_is_non_deterministic():
    document = compare(run("a", pair("t/c/m", 0.1)), run("a", pair("t/c/m", 0.1000001), run="again"))

    assert (by_series(document)["t/c/m"], document.exit_code) == ("non_deterministic", 1)


def test_an_accepted_level_is_told_and_not_red():
    level = Accepted(series="t/*", low=0.0, high=0.3, who="Ada", why="known")
    document = compare(run("a", pair("t/c/m", 0.1)), run("b", pair("t/c/m", 0.2)), [level])

    assert (document.changes[0].word, document.changes[0].accepted) == ("accepted", "accepted by Ada: known")
    assert document.exit_code == 0


def test_the_first_bad_commit_is_told_where_it_is_known():
    known = Known(first_bad={"t/c/m": ("good", "bad")})
    document = compare(run("a", pair("t/c/m", 0.1)), run("b", pair("t/c/m", 0.2)), (), known)

    assert (document.changes[0].last_good, document.changes[0].first_bad) == ("good", "bad")


def test_a_map_cell_that_got_worse_is_a_regression():
    before = stability_map("n", test="t", configuration="c")
    after = msgspec.structs.replace(before, cells=(("diverged", "settled"),))
    document = compare(
        run("a", pair("t/c/m", 1.0), maps=[before]), run("b", pair("t/c/m", 1.0), maps=[after])
    )

    assert (document.changes[0].series, document.changes[0].red) == ("t/c/map:n", True)


def test_a_map_that_was_asked_for_and_is_not_there_is_missing_and_red():
    cells = stability_map("n", test="t", configuration="c")
    values = [pair("t/c/m", 1.0), pair("t/c/stability:s", 1.0, kind="break_point", better="larger")]
    document = compare(run("a", *values, maps=[cells]), run("b", *values))
    silent = compare(run("a", *values, maps=[cells]), run("b", values[0]))
    level = Accepted(series="t/c/map:*", low=math.inf, high=math.inf, who="Ada", why="w", removed=True)
    accepted = compare(run("a", *values, maps=[cells]), run("b", *values), [level])

    assert (by_series(document)["t/c/map:n"], document.exit_code) == ("missing", 1)
    assert (silent.exit_code, "t/c/map:n" in by_series(silent)) == (0, False)
    assert (by_series(accepted)["t/c/map:n"], accepted.exit_code) == ("accepted", 0)


def test_a_smaller_break_point_is_less_stable():
    def point(value: float):
        return pair("t/c/stability:s", value, kind="break_point", better="larger", relative_tolerance=0.01)

    worse = compare(run("a", point(2.0)), run("b", point(1.9)))

    assert (worse.changes[0].name, worse.exit_code) == ("less stable", 1)
    assert compare(run("a", point(2.0)), run("b", point(1.99))).exit_code == 0
    assert compare(run("a", point(2.0)), run("b", point(2.5))).counts == {"improved": 1}


def ladder(seed: int, accuracy: float = 1.0, cost: float = 1.0, noise: float = 0.01):
    """A second order method: error h², time 1/h."""
    source = random.Random(seed)

    def timing(level: float) -> Timing:
        seconds = tuple(level * (1.0 + abs(source.gauss(0.0, noise))) for _ in range(5))
        return Timing(seconds=seconds, runs_per_repeat=3)

    return [
        pair(
            f"t/c/ladder:e/h={h}",
            accuracy * h * h,
            timing(cost * 1e-4 / h),
            steps=round(1.0 / h),
            kind="ladder",
            role="reported",
            time_step=h,
        )
        for h in STEPS
    ]


def test_a_doubled_cost_is_slower_at_equal_error():
    document = compare(run("a", *ladder(1)), run("b", *ladder(2, cost=2.0)))
    (red,) = [change for change in document.changes if change.red]
    (frontier,) = document.frontiers

    assert (red.series, red.name) == ("t/c/ladder:e:run-time", "slower at equal error")
    assert abs(frontier.time_at_equal_error - 2.0) < 0.1
    assert abs(frontier.work_at_equal_error - 1.0) < 1e-9
    assert document.exit_code == 1


def test_a_coarser_method_is_less_accurate_at_equal_time():
    document = compare(run("a", *ladder(1)), run("b", *ladder(2, accuracy=4.0)))
    (frontier,) = document.frontiers

    assert {change.name for change in document.changes if change.red} == {"less accurate"}
    assert abs(frontier.error_at_equal_time - 4.0) < 0.3
    assert abs(frontier.work_at_equal_error - 2.0) < 1e-6


@pytest.mark.parametrize("seed", range(10))
def test_an_unchanged_build_is_identical_ten_times_out_of_ten(seed):
    document = compare(run("a", *ladder(seed)), run("b", *ladder(100 + seed, noise=0.05)))

    assert (document.verdict, document.exit_code) == ("identical", 0)


def test_a_time_of_one_session_is_judged_where_history_knows_its_noise():
    def seconds(value: float):
        return pair("t/c/time", value, kind="time", better="smaller", unit="s", role="reported")

    before, slower = run("a", seconds(1.0)), run("b", seconds(1.1))
    noise = Known(usual={"t/c/time": (1.0, 0.05)})

    assert compare(before, slower).counts == {"same": 1}
    assert compare(before, run("b", seconds(3.0))).counts == {"changed": 1}
    assert compare(before, slower, history=noise).changes[0].name == "slower"
    assert compare(before, run("b", seconds(1.04)), history=noise).exit_code == 0
    assert compare(before, run("b", seconds(0.9)), history=noise).counts == {"improved": 1}
    elsewhere = compare(before, run("b", seconds(9.0), machine="other"), history=noise)
    assert elsewhere.changes[0].word == "not_comparable"


def test_run_times_of_another_machine_are_not_compared():
    document = compare(run("a", *ladder(1)), run("b", *ladder(2, cost=9.0), machine="other"))

    assert document.exit_code == 0
    assert document.frontiers[0].time_at_equal_error is None
    assert any("different machines" in note for note in document.notes)


def test_a_comparison_survives_its_way_through_json():
    document = compare(
        run("a", *ladder(1), pair("t/c/m", math.nan)), run("b", *ladder(2), pair("t/c/m", 0.0))
    )

    assert decode(encode(document), CompareDocument) == document

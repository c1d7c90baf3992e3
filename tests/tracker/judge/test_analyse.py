"""The history of a series, night by night: what is red, since when, and what came back."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import msgspec
import pytest

from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import (
    EngineVersion,
    Machine,
    Point,
    Sample,
    SeriesDefinition,
    SeriesHistory,
    Timing,
)
from spook_tracker.tracker.judge import exact_values
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.lane import run_times
from spook_tracker.tracker.judge.series_history import judge_all, judge_history
from spook_tracker.tracker.judge.tonight import of_run
from tests.histories.documents import gate

SERIES = gate(limit=0.1)


@dataclass(frozen=True)
class Run:
    """As much of a run as judging needs."""

    id: str
    started: str
    engine: EngineVersion
    machine: Machine


def run(number: int, commit: str | None = None, version: str = "1.0.1.dev1", **machine: str) -> Run:
    return Run(
        id=f"run-{number}",
        started=f"20{26 + number // 336:02d}-{number // 28 % 12 + 1:02d}-{number % 28 + 1:02d}T03:00:00+00:00",
        engine=EngineVersion(
            name="toy",
            version=version,
            git_hash=commit if commit is not None else f"{number:040d}",
            dirty=False,
            commit_time="",
        ),
        machine=Machine(
            fingerprint=machine.get("fingerprint", "m"),
            processor="p",
            cores=2,
            operating_system="o",
            float_environment=machine.get("float_environment", "f"),
        ),
    )


def sample(value: float, limit: float = 0.1, **evidence) -> Sample:
    finite = math.isfinite(value)
    outcome = "not_finite" if not finite else "value" if abs(value) <= limit else "out_of_limit"
    passed = outcome == "value"
    return Sample(
        series="t/c/m",
        value=Number(value),
        outcome=outcome,
        passed=passed,
        set_point_held=passed,
        **evidence,
    )


def history(*values: float, version: str = "1", releases: tuple[int, ...] = (0,)) -> list[Point]:
    return [
        Point(run(i, version="1.0.0" if i in releases else "1.0.1.dev1"), sample(value), version)
        for i, value in enumerate(values)
    ]


def series(**facts) -> SeriesDefinition:
    return msgspec.structs.replace(SERIES, **facts)


def words(told) -> list[str]:
    return [judged.verdict.word for judged in told]


def states(told) -> list[str]:
    return [judged.state for judged in told]


def test_a_series_without_noise_is_judged_after_one_run():
    told = judge_history("t/c/m", SERIES, history(0.01, 0.01, 0.02))

    assert words(told) == ["new", "identical", "regressed"]
    assert (told[2].first_bad.run.id, told[2].last_good.run.id) == ("run-2", "run-1")


def test_a_red_level_stays_red_and_keeps_the_commit_where_it_began():
    told = judge_history("t/c/m", SERIES, history(0.01, 0.02, 0.02, 0.02))

    assert states(told) == ["green", "detected", "detected", "detected"]
    assert {judged.first_bad.run.id for judged in told[1:]} == {"run-1"}
    assert {judged.last_good.run.id for judged in told[1:]} == {"run-0"}


def test_one_bad_night_is_red_that_night_and_recovered_the_next():
    told = judge_history("t/c/m", SERIES, history(0.01, 0.01, 0.5, 0.01, 0.01))

    assert states(told) == ["green", "green", "detected", "recovered", "green"]


def test_not_a_number_is_red_that_same_night_and_as_long_as_it_lasts():
    told = judge_history("t/c/m", SERIES, history(0.01, math.nan, math.nan, math.inf))

    assert states(told) == ["green", "detected", "detected", "detected"]
    assert told[1].verdict.name == "not finite"


def test_an_improvement_is_the_new_level():
    told = judge_history("t/c/m", SERIES, history(0.02, 0.01, 0.015))

    assert words(told) == ["new", "improved", "regressed"]


def test_small_steps_inside_the_tolerance_are_drift_against_the_last_release():
    values = [0.01 * 1.001**night for night in range(200)]
    told = judge_history("t/c/m", series(relative_tolerance=0.02), history(*values))
    first = next(judged for judged in told if judged.red)

    assert first.verdict.name == "drift"
    assert first.against.run.engine.version == "1.0.0"
    assert "little by little since 1.0.0" in first.verdict.sentence
    assert told.index(first) == 20  # 1.001^20 is the first beyond two per cent
    assert all(judged.red for judged in told[20:])


def test_a_release_starts_the_count_again():
    values = [0.01 * 1.001**night for night in range(30)]
    told = judge_history("t/c/m", series(relative_tolerance=0.02), history(*values, releases=(0, 15)))

    assert not any(judged.red for judged in told)


def test_the_same_commit_with_two_values_is_non_deterministic():
    nights = [
        Point(run(i, commit="c" * 40), sample(value), "1") for i, value in enumerate((0.01, 0.010000001))
    ]
    told = judge_history("t/c/m", SERIES, nights)

    assert words(told) == ["new", "non_deterministic"]
    assert told[1].red


def test_a_new_definition_or_float_environment_is_not_comparable_and_starts_a_new_level():
    nights = [
        Point(run(0), sample(0.01), "1"),
        Point(run(1), sample(0.05), "2"),
        Point(run(2), sample(0.05), "2"),
        Point(run(3, float_environment="other"), sample(0.09), "2"),
    ]
    told = judge_history("t/c/m", SERIES, nights)

    assert words(told) == ["new", "not_comparable", "identical", "not_comparable"]
    assert not any(judged.red for judged in told)


def test_a_value_outside_its_limit_is_red_from_the_first_night_until_it_holds():
    told = judge_history("t/c/m", SERIES, history(0.5, 0.5, 0.05))

    assert states(told) == ["detected", "detected", "recovered"]
    assert (told[1].first_bad.run.id, told[1].last_good) == ("run-0", None)
    assert told[2].verdict.word == "fixed"


def test_an_accepted_level_is_not_red_and_the_next_step_is():
    level = Accepted(series="t/*", low=0.0, high=0.03, who="me", why="known")
    told = judge_history("t/c/m", SERIES, history(0.01, 0.02, 0.02, 0.05), [level])

    assert states(told) == ["green", "accepted", "green", "detected"]
    assert "accepted by me: known" in told[1].accepted


def test_run_times_of_another_machine_are_a_history_of_their_own():
    definition = series(kind="time", better="smaller", limit=None)
    nights = [
        Point(run(i, fingerprint="ab"[i % 2]), sample(1.0 + 4.0 * (i % 2), limit=9.0), "1") for i in range(20)
    ]
    told = judge_history("t/c/m", definition, nights)

    assert set(states(told)) == {"green"}
    assert words(told)[:2] == ["new", "new"]


def test_tonight_is_judged_against_the_nights_before_it_only():
    nights = history(0.01, 0.02, 0.01)
    before = {"t/c/m": SeriesHistory(SERIES, tuple(nights[:2]))}
    (found,) = of_run(judge_all(before), nights[1].run.id)

    assert found.red
    assert (found.first_bad, found.last_good) == (f"{1:040d}"[:12], f"{0:040d}"[:12])


def test_a_ladder_that_takes_longer_is_found_by_its_run_time():
    source = random.Random(1)
    ladder = series(kind="ladder", metric="ladder:e", limit=None, role="reported")

    def rung(scale: float) -> list[Point]:
        nights = []
        for i in range(12):
            level = scale * (1.2 if i >= 10 else 1.0) * (1.0 + source.gauss(0.0, 0.01))
            timing = Timing(seconds=(level, 1.1 * level), runs_per_repeat=1)
            nights.append(Point(run(i), sample(1e-3, timing=timing), "1"))
        return nights

    histories = {
        name: SeriesHistory(ladder, tuple(rung(scale))) for name, scale in (("a", 1e-3), ("b", 4e-3))
    }
    derived = run_times(histories)
    (found,) = of_run(judge_all(derived), "run-11")

    assert list(derived) == ["t/c/ladder:e:run-time"]
    assert (found.red, found.verdict.name) == (True, "slower")
    assert found.first_bad == f"{10:040d}"[:12]


def test_the_run_time_of_a_ladder_is_held_to_what_its_definition_tolerates():
    source = random.Random(3)

    def red(definition, key="t/c/ladder:e:run-time") -> bool:
        levels = [1e-3 * (1.3 if i >= 12 else 1.0) * (1.0 + source.gauss(0.0, 0.01)) for i in range(15)]
        timings = [Timing(seconds=(level, 1.1 * level), runs_per_repeat=1) for level in levels]
        nights = tuple(Point(run(i), sample(1e-3, timing=t), "1") for i, t in enumerate(timings))
        told = judge_all(run_times({"a": SeriesHistory(definition, nights)}))
        return any(judged.red for judged in told[key].nights)

    ladder = series(kind="ladder", metric="ladder:e", limit=None, role="reported", tolerance=9.0)
    assert red(ladder)
    assert not red(msgspec.structs.replace(ladder, time_tolerance=0.5))


def test_a_series_of_times_is_held_to_its_own_tolerance():
    source = random.Random(4)
    values = [(1.3 if i >= 12 else 1.0) * (1.0 + source.gauss(0.0, 0.01)) for i in range(15)]
    time = {"kind": "time", "better": "smaller", "limit": None, "role": "reported"}

    for told, tolerances in ((True, {}), (False, {"relative_tolerance": 0.5}), (False, {"tolerance": 0.5})):
        judged = judge_history("t/c/m", series(**time, **tolerances), history(*values))
        assert any(night.red for night in judged) is told


@pytest.mark.parametrize(
    "definition",
    [lambda i: "1", lambda i: "12"[i > 30], lambda i: "12"[i % 3 == 0], lambda i: "12"[20 < i < 40]],
    ids=["one definition", "two in turn", "two mixed", "one within another"],
)
def test_nights_between_equal_nights_are_judged_without_a_look_and_alike(monkeypatch, definition):
    values = [*([0.01] * 50), 0.02, *([0.01] * 50)]
    nights = [
        night._replace(test_version=definition(i))
        for i, night in enumerate(history(*values, releases=(0, 20)))
    ]
    short = judge_history("t/c/m", SERIES, nights)
    monkeypatch.setattr(exact_values, "_repeats", lambda before, after: False)

    assert list(judge_history("t/c/m", SERIES, nights)) == list(short)

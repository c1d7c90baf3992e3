"""What explains a run time is told beside it and is never red; what gates is."""

from __future__ import annotations

from dataclasses import replace as replaced
from typing import Any

import pytest
from msgspec.structs import replace

from spook_tracker.scalar_tests.case import Metric, ScalarTest
from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.json_form import decode, encode
from spook_tracker.tracker.document.run_document import RunDocument, Timing
from spook_tracker.tracker.judge.comparison_document import Change
from spook_tracker.tracker.judge.tonight import tonight
from spook_tracker.tracker.measure.question import metric_series
from spook_tracker.tracker.measure.short_form import whole
from spook_tracker.tracker.past import compare_documents
from tests.histories.documents import definition, engine, run, sample
from tests.histories.synthetic import DocumentHistory

COUNT, RUNG = "pendulum/plain/iterations", "pendulum/plain/ladder:error/h=0.01"
RUN_TIME = "pendulum/plain/ladder:error:run-time"


def answered(
    commit: str, iterations: float = 10.0, seconds: float = 1.0, sweeps: int = 100, instructions: int | None = None,
    role: str = "explaining", roles: dict[str, str] | None = None, outcome: str = "value",
) -> RunDocument:  # fmt: skip
    count = {
        "metric": "iterations",
        "role": role,
        "unit": "1",
        "limit": None,
        "set_point": None,
        "better": "smaller",
    }
    rung = {"kind": "ladder", "metric": "ladder:error", "role": "reported", "limit": None, "time_step": 0.01}
    roles = {"sweeps": "explaining"} if roles is None else roles
    timing = Timing(seconds=(seconds,) * 5, runs_per_repeat=1, instructions=instructions)
    series = definition(COUNT, **count, counter_roles=roles), definition(RUNG, **rung, counter_roles=roles)
    values = (
        sample(
            COUNT,
            iterations if outcome == "value" else float("nan"),
            timing=None,
            counters={},
            outcome=outcome,
        ),
        sample(RUNG, 1e-3, timing=timing, counters={"sweeps": sweeps}),
    )
    return run(engine=engine(commit, parents=()), series=series, samples=values, maps=())


def changes(before: RunDocument, after: RunDocument) -> dict[str, Change]:
    return {change.series: change for change in compare_documents(before, after).changes}


def test_one_more_iteration_with_a_better_run_time_is_no_regression() -> None:
    document = compare_documents(answered("a" * 40), answered("b" * 40, iterations=11.0, seconds=0.5))
    told = {change.series: change for change in document.changes}

    assert document.exit_code == 0
    assert (told[COUNT].word, told[COUNT].red) == ("changed", False)
    assert told[COUNT].sentence.endswith("does not decide")
    assert told[RUN_TIME].word == "improved"
    assert told[RUN_TIME].sentence.endswith("; iterations 10 → 11")


def test_the_same_count_that_gates_is_a_regression() -> None:
    assert (
        compare_documents(
            answered("a" * 40, role="reported"), answered("b" * 40, 11.0, role="reported")
        ).exit_code
        == 1
    )


def test_a_slower_run_time_says_what_explains_it() -> None:
    document = compare_documents(
        answered("a" * 40, instructions=10**6),
        answered("b" * 40, 12.0, 2.0, sweeps=120, instructions=1_200_000),
    )
    (red,) = [change for change in document.changes if change.red]

    assert red.series == RUN_TIME
    assert red.sentence.endswith("; instructions +20.0 %, iterations 10 → 12, sweeps 100 → 120")


def test_a_counter_gates_or_explains_as_its_test_says() -> None:
    key = "pendulum/plain/work:sweep:sweeps"
    usual, explains, unknown = (
        changes(answered("a" * 40, roles=roles), answered("b" * 40, sweeps=120, roles=roles))[key]
        for roles in ({}, {"sweeps": "explaining"}, {"sweeps": "gate"})
    )

    assert (usual.red, usual.role) == (True, "reported")
    assert (explains.red, explains.role) == (False, "explaining")
    assert unknown.red


def test_what_explains_and_fails_or_disappears_is_not_red() -> None:
    lost = answered("b" * 40, outcome="crashed")
    gone = answered("b" * 40)
    gone = replace(gone, series=gone.series[1:], samples=gone.samples[1:])

    assert not [change for change in changes(answered("a" * 40), lost).values() if change.red]
    assert not [change for change in changes(answered("a" * 40), gone).values() if change.red]


def test_a_night_is_not_red_for_what_explains() -> None:
    nights = [answered(f"{n:040x}", 10.0 if n < 6 else 20.0) for n in range(1, 9)]
    nights = [
        replace(
            night, started=f"2026-01-{n:02}T00:00:00+00:00",
            engine=replace(night.engine, commit_time=f"2026-01-{n:02}T00:00:00+00:00"),
        )
        for n, night in enumerate(nights, start=1)
    ]  # fmt: skip

    def red(found: list[RunDocument]) -> list[str]:
        return [finding.series for finding in tonight(DocumentHistory(found), found[-1]) if finding.red]

    def gating(night: RunDocument) -> RunDocument:
        return replace(night, series=(replace(night.series[0], role="reported"), night.series[1]))

    assert red(nights) == []
    assert red([gating(night) for night in nights]) == [COUNT]


def test_the_role_travels_from_the_test_to_the_document_and_an_old_document_has_none() -> None:
    from spook_tracker.scalar_tests.catalogue import CATALOGUE

    test: ScalarTest = replaced(CATALOGUE["falling_object"], counter_roles={"contacts": "explaining"})
    first = test.measurements[0]
    metric: Metric = replaced(first.metrics[0], role="explaining", limit=None, limit_source="")
    series = metric_series("falling_object", test, first, metric)
    told = answered("a" * 40)
    old = encode(told).replace(b',"counter_roles":{"sweeps":"explaining"}', b"")

    assert (series.role, series.counter_roles) == ("explaining", {"contacts": "explaining"})
    assert (
        series.test_version
        == metric_series("falling_object", CATALOGUE["falling_object"], first, metric).test_version
    )
    assert decode(encode(told), RunDocument) == told
    assert decode(old, RunDocument).series[0].counter_roles == {}


def test_the_short_form_may_explain_and_then_has_no_limit() -> None:
    said: Any = b'{"engine": "e", "version": "1", "results": [{"test": "t", "metric": "iterations", "value": 3, "explaining": true%s}]}'

    assert whole(said % b"", "f").series[0].role == "explaining"
    with pytest.raises(DocumentError, match="what only explains has no limit"):
        whole(said % b', "limit": 4', "f")

"""Exact work is judged tonight; what is only read off a ladder's times never is."""

from __future__ import annotations

import random
from typing import Any

from msgspec.structs import replace

from spook_tracker.tracker.judge.tonight import tonight
from tests.synthetic_history import DocumentHistory, sample, series
from tests.test_tracker_one_judge import night

SCALAR = series("t", "m", role="gate", limit=1.0)


def worked(number: int, value: float = 0.5, flags: str = "-O3", state: str = "s", **counters: int) -> Any:
    given = {"steps": 100, "block_operations": 200, "pivots": 40} | counters
    run = night(number, [(SCALAR, sample(SCALAR, value, counters=given, state_hash=state))])
    return replace(run, engine=replace(run.engine, flags=flags))


def words(*runs: Any) -> dict[str, tuple[str, str, bool]]:
    found = tonight(DocumentHistory(runs), runs[-1])
    told = {f.series: (f.verdict.word, f.verdict.name, f.red) for f in found}
    return {key.rpartition(":")[2]: said for key, said in told.items() if "/work:" in key}


def test_one_more_operation_for_the_same_answer_is_more_work() -> None:
    assert words(worked(0), worked(1, block_operations=201))["operations"] == ("regressed", "more work", True)
    assert words(worked(0), worked(1, block_operations=199))["operations"][0] == "improved"
    assert words(worked(0), worked(1))["operations"][0] == "identical"


def test_a_lost_warm_start_is_more_work_and_a_round_more_is_not() -> None:
    assert words(worked(0), worked(1, pivots=4000))["iterations"] == ("regressed", "more work", True)
    assert words(worked(0), worked(1, pivots=41))["iterations"][2] is False


def test_work_is_compared_for_equal_answers_and_equal_builds_only() -> None:
    other_answer = worked(1, value=0.4, state="other", block_operations=900)
    other_build = worked(1, flags="-O0", block_operations=900)

    assert words(worked(0), other_answer)["operations"][0] == "changed"
    assert words(worked(0), other_build)["operations"][0] == "not_comparable"


def test_a_time_read_off_a_ladder_that_jumps_by_a_rung_is_not_red() -> None:
    source = random.Random(1)
    definition = series(
        "t", "ladder:e:error-in-time", kind="time", better="smaller", unit="m", time_step=None
    )

    def of(number: int, level: float) -> Any:
        value = level * (1.0 + source.gauss(0.0, 0.01))
        return night(number, [(definition, sample(definition, value))])

    runs = [*(of(n, 1e-4) for n in range(10)), *(of(n, 5.5e-4) for n in range(10, 13))]
    found = {f.series: f for f in tonight(DocumentHistory(runs), runs[-1])}

    assert not found[definition.key].red
    assert found[definition.key].verdict.word == "changed"
    assert "run time decide" in found[definition.key].verdict.sentence

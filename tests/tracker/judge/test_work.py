"""Exact work is judged tonight; what is only read off a ladder's times never is."""

from __future__ import annotations

import random
from typing import Any

from msgspec.structs import replace

from spook_tracker.tracker.judge.tonight import tonight
from tests.histories.synthetic import DocumentHistory, sample, series
from tests.tracker.judge.test_one_judge import night

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
    assert words(worked(0), worked(1, block_operations=201))["block_operations"] == (
        "regressed",
        "more work",
        True,
    )
    assert words(worked(0), worked(1, block_operations=199))["block_operations"][0] == "improved"
    assert words(worked(0), worked(1))["block_operations"][0] == "identical"


def test_a_lost_warm_start_is_more_work_and_a_round_more_is_not() -> None:
    assert words(worked(0), worked(1, pivots=4000))["pivots"] == ("regressed", "more work", True)
    assert words(worked(0), worked(1, pivots=41))["pivots"][2] is False


def test_fewer_of_one_counter_hide_no_more_of_another() -> None:
    told = words(worked(0, factorisations=1000), worked(1, factorisations=500, block_operations=201))

    assert told["factorisations"][0] == "improved"
    assert told["block_operations"] == ("regressed", "more work", True)
    assert words(worked(0, sweeps=0), worked(1, sweeps=3))["sweeps"] == ("regressed", "more work", True)


def test_a_test_declares_how_many_more_rounds_it_bears() -> None:
    def patient(number: int, pivots: int, tolerance: float) -> Any:
        run = worked(number, pivots=pivots)
        return replace(run, series=tuple(replace(d, iteration_tolerance=tolerance) for d in run.series))

    assert words(patient(0, 40, 0.5), patient(1, 55, 0.5))["pivots"][2] is False
    assert words(patient(0, 40, 0.01), patient(1, 41, 0.01))["pivots"][2] is True


def test_what_the_scene_and_the_observer_count_is_no_work() -> None:
    assert (
        not {"contacts", "samples", "evaluations"}
        & words(worked(0, contacts=3, samples=9, evaluations=2)).keys()
    )


def test_work_is_compared_for_equal_answers_and_equal_builds_only() -> None:
    other_answer = worked(1, value=0.4, state="other", block_operations=900)
    other_build = worked(1, flags="-O0", block_operations=900)

    assert words(worked(0), other_answer)["block_operations"][0] == "changed"
    assert words(worked(0), other_build)["block_operations"][0] == "not_comparable"


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

"""What a step costs: with and without what it leaves out, against real time, at worst, in memory."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from msgspec import structs

from spook_tracker import engine
from spook_tracker.engine import Final, Position
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.step_limits import REAL_TIME, SAVES
from spook_tracker.tracker.document.coverage import saved
from spook_tracker.tracker.document.run_document import Sample, Saving
from spook_tracker.tracker.judge.series_history import judge_history
from spook_tracker.tracker.judge.standing import standing
from spook_tracker.tracker.measure import step_cost
from spook_tracker.tracker.measure.step_cost import (
    COMPARED,
    LeavingOut,
    held,
    leaving_out,
    metrics,
    step_costs,
)
from spook_tracker.tracker.website.data_files import NightTexts
from spook_tracker.tracker.website.data_files import test_json as data_of
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.page_overviews import covered
from tests.histories.synthetic import history

WAYS = {(): 1.0, ("collision",): 3.0, ("rotation",): 2.0, ("solve_block",): 4.0}  # s a run


class Clocked:
    """Our engine, with a processor that takes as long as it is told for each way to go, and some time before the first step."""

    def __init__(self, slow: float = 1.0, wrong: float = 0.0) -> None:
        self.slow, self.wrong, self.round = slow, wrong, 0

    def __call__(self, scene: Any, **options: Any) -> Any:
        options.pop("time_limit", None)
        result = engine.simulate(scene, **options)
        forced = options["method"].force_stages
        self.round += not forced and options["steps"] > 1
        seconds = WAYS.get(forced, 10.0) * (1.0 + 0.1 * (self.round % 2)) * (self.slow if not forced else 1.0)
        if forced and self.wrong and "x" in options["observe"]:
            result = replace(result, observables={**result.observables, "x": result["x"] + self.wrong})
        return replace(result, cpu_seconds=5.0 + seconds * options["steps"] / 100.0)


def test_the_whole_step_is_laid_beside_the_step_as_compiled() -> None:
    found = leaving_out(CATALOGUE["pendulum"], Clocked())

    assert found is not None
    assert found.stages == ("collision", "solve_block", "integrate_rotations")
    assert found.factor == pytest.approx(10.0, rel=1e-12), "a round that is slow is slow on both sides"
    assert [one * 100.0 for one in found.saved.values()] == pytest.approx([2.0, 3.0, 1.0], rel=0.11)


def test_a_scene_is_timed_while_it_lasts_and_as_often_as_the_clock_asks() -> None:
    """What has died away is in denormal numbers: a night was red by what these cost, at an engine as fast as ever."""
    test, asked = CATALOGUE["oscillator_filter"], []

    def swift(scene: Any, **options: Any) -> Any:
        asked.append((options["method"].force_stages, options["steps"]))
        return replace(engine.simulate(scene, **options), cpu_seconds=1e-7 * options["steps"])

    assert leaving_out(test, swift) is not None
    last = test.example().duration / test.example().time_step
    timed = [steps for forced, steps in asked if not forced]
    assert 0.5 * last < max(timed) <= last
    assert timed.count(max(timed)) >= step_cost.ROUNDS * step_cost.MOST_RUNS


def test_a_stage_that_runs_though_it_is_not_needed_breaks_the_limit() -> None:
    test = CATALOGUE["pendulum"]
    for slow, outcome in ((1.0, "value"), (8.0, "out_of_limit")):
        pairs, _ = step_costs("pendulum", test, Clocked(slow), None)
        (series, sample) = next(pair for pair in pairs if pair[0].metric == "leaving_out")
        assert series.kind == "time" and series.limit == SAVES["pendulum"]
        assert sample.outcome == outcome
        assert standing(series, sample) == ("pass" if outcome == "value" else "fail")


def test_other_values_are_told() -> None:
    test = CATALOGUE["falling_object"]
    same, other = leaving_out(test, Clocked()), leaving_out(test, Clocked(wrong=1e-9))

    assert same is not None and other is not None
    assert same.difference == 0.0 and "same to the bit" in saved(same.told())
    fallen = abs(float(engine.simulate(
        test.example().scene, time_step=test.example().time_step, steps=COMPARED,
        observe={"x": Final(quantity=Position())})["x"].min()))  # fmt: skip
    assert other.difference == pytest.approx(1e-9 / fallen, rel=1e-6)
    assert "to the bit" not in saved(other.told())


@pytest.mark.parametrize(
    "name", ["falling_object", "pendulum", "n_pendulum", "double_pendulum", "robot_arm", "wires"]
)
def test_our_engine_gives_the_same_values_both_ways(name: str) -> None:
    found = leaving_out(CATALOGUE[name], engine.simulate)

    assert found is not None and found.difference <= 1e-12
    low, high = found.told().spread or (math.nan, math.nan)
    assert low <= found.factor <= high


def test_what_needs_every_stage_says_so_and_what_is_not_measured_says_nothing() -> None:
    assert leaving_out(CATALOGUE["falling_chain"], engine.simulate) == LeavingOut()
    assert saved(LeavingOut().told()) == "nothing to leave out"
    assert saved(None) == ""
    told = Saving(stages=("collision",), factor=3.0, spread=(2.5, 3.5), difference=0.0)
    assert saved(told) == "3 times (2.5 to 3.5), same to the bit"


def test_every_scene_has_a_cell() -> None:
    """What one step tells: which stages are left out and could come in."""
    quick = Clocked()
    for name, test in CATALOGUE.items():
        assert step_cost._stages_of(test.example(), (), quick), name


class Slow:
    """A run that is held and takes so many seconds a step, the fifth one ten times as long."""

    def __init__(self, clock: list[float], seconds: float) -> None:
        self.clock, self.seconds, self.step_number = clock, seconds, 0

    def step(self) -> None:
        self.step_number += 1
        self.clock[0] += self.seconds * (10.0 if self.step_number == 5 else 1.0)


@pytest.mark.parametrize(("slower", "outcome"), [(0.1, "value"), (5.0, "out_of_limit")])
def test_a_ragdoll_that_is_five_times_slower_than_real_time_is_red(
    slower: float, outcome: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    test, clock = CATALOGUE["falling_chain"], [0.0]
    h = test.example().time_step
    monkeypatch.setattr(step_cost, "time", SimpleNamespace(perf_counter=lambda: clock[0]))

    def start(scene: Any, **options: Any) -> Any:
        return Slow(clock, slower * h)

    pairs, _ = step_costs("falling_chain", test, engine.simulate, start)
    by_name = {series.metric: (series, sample) for series, sample in pairs}
    series, sample = by_name["real_time_factor"]
    assert sample.value == pytest.approx(60 / 69 / slower, rel=1e-9)
    assert sample.outcome == outcome
    assert by_name["worst_step_time"][1].value == pytest.approx(10.0 * slower * h)
    told = judge_history(series.key, series, points(series, [20.0, 21.0, sample.value]))
    assert told[-1].stands == ("pass" if outcome == "value" else "fail"), "on the night it becomes so"


def points(series: Any, values: list[float]) -> list[Any]:
    """Nights of one series, by the machine and engine of a made-up history."""
    found = next(iter(history(len(values)).series().values())).points
    return [
        point._replace(
            test_version=series.test_version,
            sample=Sample(
                series=series.key,
                value=value,
                passed=value >= series.limit,
                outcome="value" if value >= series.limit else "out_of_limit",
                set_point_held=True,
            ),
        )
        for point, value in zip(found, values, strict=True)
    ]


def test_a_held_run_tells_its_clock_its_worst_step_and_its_memory() -> None:
    values = held(CATALOGUE["pile"].example(), engine.start)

    assert values["real_time_factor"] > 1.0
    assert 0.0 < values["worst_step_time"] < 1.0
    if "memory" in values:
        assert 0.05 < values["memory"] < 50.0, "bodies, contacts and the solver's rows, in MB"


def test_limits_are_of_scenes_there_are_and_every_scene_is_followed() -> None:
    assert set(SAVES) <= set(CATALOGUE) and set(REAL_TIME) <= set(CATALOGUE)
    assert {metric.name for metric in metrics("pendulum")} == {
        "leaving_out",
        "real_time_factor",
        "worst_step_time",
        "memory",
    }
    assert all(metric.noisy for metric in metrics("falling_chain"))
    assert min(REAL_TIME.values()) == 1.0 and min(SAVES.values()) > 1.0


def test_the_page_has_what_leaving_out_saves_and_its_data_files_do_not() -> None:
    """Another number every night is not to write every file anew."""
    told = book(history(1))
    test = told.tests[0]
    test.card = structs.replace(
        test.card, saving=Saving(stages=("collision",), factor=3.0, spread=(2.5, 3.57713), difference=0.0)
    )
    rows = {row.test: row for row, _ in covered(told).context["rows"]}

    assert rows[test.name].cells[2] == "3 times (2.5 to 3.58), same to the bit"
    assert b"3.57713" not in data_of(test, NightTexts(told.nights))

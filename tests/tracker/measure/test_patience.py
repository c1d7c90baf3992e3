"""What bounds a night of another engine: seconds for a simulation, seconds for a question, settings that are not asked."""

from __future__ import annotations

import pickle
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from spook_tracker.engine.protocol import Configuration
from spook_tracker.tracker.measure.question import NoAnswer
from spook_tracker.tracker.measure.questions import Questions

SOURCE: dict[str, Any] = {"catalogue": "tests.toys.toy_questions:CATALOGUE", "engine": "slow_engine"}


class Slow:
    """Two settings, and simulations that take as long as asked."""

    gating = False
    configurations = (Configuration(name="one", reason=""), Configuration(name="two", reason=""))

    def __init__(self) -> None:
        self.limits: list[float | None] = []

    def simulate(self, scene: Any, **options: Any) -> Any:
        self.limits.append(options.get("time_limit"))
        return SimpleNamespace(seconds=scene)


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> Slow:
    engine = Slow()
    monkeypatch.setitem(sys.modules, "slow_engine", engine)  # type: ignore[arg-type]
    return engine


def test_a_question_whose_seconds_are_over_begins_no_further_simulation(slow: Slow) -> None:
    simulate = Questions(**SOURCE, limit=0.5, patience=1.0).simulate()
    for _ in range(3):
        simulate(0.4)
    with pytest.raises(NoAnswer, match="not tried: the 1 s for this question are over") as ended:
        simulate(0.4)

    assert ended.value.outcome == "timed_out"
    assert slow.limits == [0.5] * 3
    assert Questions(**SOURCE, limit=0.5, patience=1.0).simulate()(0.4).seconds == 0.4, "the next has its own"


@pytest.mark.parametrize(
    "counted", ["process_time", "perf_counter"]
)  # in this process, and in one of its own
def test_a_simulation_that_raises_has_taken_its_time(
    slow: Slow, monkeypatch: pytest.MonkeyPatch, counted: str
) -> None:
    clock = [0.0]
    monkeypatch.setattr(f"time.{counted}", lambda: clock[0])

    def fails(scene: Any, **options: Any) -> Any:
        clock[0] += 0.4
        raise ValueError("came apart")

    monkeypatch.setattr(slow, "simulate", fails)
    simulate = Questions(**SOURCE, limit=0.5, patience=1.0).simulate()
    for _ in range(3):
        with pytest.raises(ValueError, match="came apart"):
            simulate(0.4)
    with pytest.raises(NoAnswer, match="not tried"):
        simulate(0.4)


def test_single_values_can_be_left_to_the_first_setting_and_ladders_cannot(slow: Slow) -> None:
    def asked(**more: Any) -> tuple[int, int]:
        tests = Questions(**SOURCE, **more).tests().values()
        return (
            sum(len(test.measurements) for test in tests),
            sum(len(ladder.configurations) for test in tests for ladder in test.ladders),
        )

    every, first = asked(), asked(every_setting=False)

    assert every[0] == 2 * first[0] > 0
    assert every[1] == first[1]


def test_what_was_found_is_found_once_and_not_sent_along() -> None:
    source = Questions(catalogue="tests.toys.toy_questions:CATALOGUE")

    assert source.tests() is source.tests()
    assert pickle.loads(pickle.dumps(source)) == source
    assert "_tests" not in source.__getstate__()


def test_what_a_busy_machine_adds_to_a_simulation_is_not_charged_to_its_question(
    slow: Slow, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the clock .8 s each, of the processor .1 s: eleven of them use up a second, and not two."""
    monkeypatch.setattr(
        slow, "simulate", lambda scene, **options: SimpleNamespace(seconds=0.8, cpu_seconds=0.1)
    )
    simulate = Questions(**SOURCE, limit=0.5, patience=1.0).simulate()
    for _ in range(10):
        simulate(0.0)
    with pytest.raises(NoAnswer, match="not tried"):
        for _ in range(2):
            simulate(0.0)

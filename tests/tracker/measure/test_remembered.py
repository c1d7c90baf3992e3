"""What a test has simulated is not simulated again, and what comes back is the same to the bit."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest

import spook_tracker.tracker.measure.remembered as remembered
from spook_tracker.engine import Final, Method, Particle, Position, Scene, Trace, simulate
from spook_tracker.engine.model_file import ModelFile, ModelRun
from spook_tracker.tracker.measure.remembered import Remembered, of_test

STEPS = {"time_step": 1e-3, "steps": 100}
TRACED = {"x": Trace(quantity=Position())}


def falling(height: float = 1.0) -> Scene:
    body = Particle(name="p", mass=1.0, position=(0.0, 0.0, height))
    return Scene(bodies=(body,), gravity=(0.0, 0.0, -9.81))


class Counted:
    """Our engine, that says how often it ran."""

    def __init__(self, **changed: Any) -> None:
        self.runs, self.changed = 0, changed

    def __call__(self, scene: Scene, **options: Any) -> Any:
        self.runs += 1
        return replace(simulate(scene, **options), **self.changed)


@pytest.fixture(autouse=True)
def _everything_is_worth_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remembered, "WORTH", 0.0)


def test_the_same_question_is_run_once_whatever_its_time_limit() -> None:
    engine = Counted()
    asked = Remembered(engine)
    first = asked(falling(), observe=TRACED, time_limit=60.0, **STEPS)
    again = asked(falling(), observe=TRACED, time_limit=300.0, **STEPS)

    assert engine.runs == 1
    assert (again["x"] == first["x"]).all() and again.state_hash == first.state_hash
    assert again.counters == first.counters and again.seconds == first.seconds


@pytest.mark.parametrize(
    "other",
    [
        {"scene": falling(np.nextafter(1.0, 2.0))},
        {"scene": falling(-0.0), "first": falling(0.0)},
        {"observe": {"x": Final(quantity=Position())}},
        {"method": Method(corrections=1)},
        {"steps": 101},
    ],
    ids=["last bit", "sign of zero", "observed", "method", "steps"],
)
def test_what_differs_in_a_bit_is_another_question(other: dict[str, Any]) -> None:
    engine = Counted()
    asked = Remembered(engine)
    other = dict(other)
    asked(other.pop("first", falling()), observe=TRACED, **STEPS)
    asked(other.pop("scene", falling()), **{"observe": TRACED, **STEPS, **other})

    assert engine.runs == 2


def test_who_writes_into_a_result_changes_no_other() -> None:
    asked = Remembered(Counted())
    for _ in range(3):
        found = asked(falling(), observe=TRACED, **STEPS)
        assert found["x"][0, 0, 2] == 1.0 and found.final_state["p"][2] < 1.0
        found["x"][:] = found.final_state["p"][:] = 7.0


def test_what_a_clock_ended_is_asked_again() -> None:
    engine = Counted(status="timed_out")
    asked = Remembered(engine)
    for _ in range(2):
        asked(falling(), **STEPS)

    assert engine.runs == 2


def test_no_more_is_kept_than_a_worker_can_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remembered, "MOST_KEPT", 3 * 101 * 3 * 8)  # three traces of a place
    engine = Counted()
    asked = Remembered(engine)
    for _ in range(2):
        for height in range(5):
            asked(falling(height), observe=TRACED, **STEPS)

    assert engine.runs == 5 + 2


@pytest.mark.parametrize(("scenes", "runs"), [(True, 6), (False, 7)])
def test_of_a_model_what_is_read_at_samples_is_remembered_in_any_engine(scenes: bool, runs: int) -> None:
    """And no more: whether a model repeats its bits, and how long it takes, are questions of their own. Scenes are in our engine
    alone."""
    engine = Counted()
    asked = Remembered(lambda run, **how: engine(falling(), **how), scenes)
    model = ModelFile(path="a.xml", format="MJCF", digest="1", time_step=0.002, watched=())
    read = ModelRun(model=model, samples=(0.1,))
    for run in (read, ModelRun(model=model), replace(read, timed=True), falling()):
        first, again = asked(run, **STEPS), asked(run, **STEPS)
        assert first.state_hash == again.state_hash

    assert engine.runs == runs


def test_a_run_that_another_process_is_making_is_waited_for(tmp_path: Path) -> None:
    """And read where it is done. A scene's run is made by each: it is shorter than the file would take."""
    begun, go_on = Event(), Event()
    engines = [Counted(), Counted()]

    def slow(run: object, **how: Any) -> Any:
        begun.set()
        assert go_on.wait(60.0)
        return engines[0](falling(), **how)

    first = Remembered(slow, shared=tmp_path)
    second = Remembered(lambda run, **how: engines[1](falling(), **how), shared=tmp_path)
    model = ModelFile(path="a.xml", format="MJCF", digest="1", time_step=0.002, watched=())
    asked = ModelRun(model=model, samples=(0.1,))
    with ThreadPoolExecutor(2) as pool:
        made = pool.submit(first, asked, **STEPS)
        assert begun.wait(60.0)
        read = pool.submit(second, asked, **STEPS)
        assert not wait([read], timeout=0.2).done
        go_on.set()
        assert made.result().state_hash == read.result().state_hash
    second(falling(), **STEPS)

    assert [engine.runs for engine in engines] == [1, 1]


def test_another_test_begins_with_nothing() -> None:
    engine = Counted()
    for name in ("one", "one", "two", "one"):
        of_test(name, engine, True)(falling(), **STEPS)

    assert engine.runs == 3

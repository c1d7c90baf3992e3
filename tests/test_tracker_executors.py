"""The same run whoever measures it: processes here, threads, a real Dask cluster of two workers; to the bit."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from spook_tracker.engine.errors import EngineError
from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.measure import executors
from spook_tracker.tracker.measure.executors import ExecutorError, Place
from spook_tracker.tracker.measure.run import Questions, Request, run
from spook_tracker.tracker.measure.workers import Lost

HERE = Path(__file__).parent
ASKED: dict[str, Any] = {"figures": True, "stability": True}
TESTS = ("falling_object", "oscillator_spring")


def threads() -> Executor:
    """What a team's own factory gives."""
    return ThreadPoolExecutor(2)


def nonsense() -> object:
    return object()


def answered(document: RunDocument) -> list[bytes]:
    """Everything a run says of the engine: not when it ran and who it was, nor what the clock said."""
    return [encode(part) for part in (document.series, document.samples, document.figures, document.maps)]


@pytest.fixture(scope="module")
def by_processes() -> RunDocument:
    return run(Questions(), Request(tests=TESTS, workers=1, **ASKED))


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A scheduler and two worker processes of Dask on this machine."""
    distributed = pytest.importorskip("distributed", reason="Dask is not installed here")
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(HERE), before]))
    try:
        with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as started:
            yield started
    finally:
        os.environ.pop("PYTHONPATH")
        if before is not None:
            os.environ["PYTHONPATH"] = before


def dask(cluster: Any) -> str:
    return str(cluster.scheduler_address).replace("tcp://", "dask://")


def test_an_executor_of_ones_own_gives_the_same_bits(by_processes: RunDocument) -> None:
    document = run(Questions(), Request(tests=TESTS, executor=f"{__name__}:threads", **ASKED))

    assert answered(document) == answered(by_processes)


@pytest.mark.filterwarnings("ignore")  # Dask's own, of its own parts
def test_two_workers_of_dask_give_the_same_bits(by_processes: RunDocument, cluster: Any) -> None:
    document = run(Questions(), Request(tests=TESTS, executor=dask(cluster), **ASKED))

    assert answered(document) == answered(by_processes)
    assert len(cluster.scheduler_info["workers"]) == 2


@pytest.mark.filterwarnings("ignore")
def test_a_worker_that_dies_costs_its_piece(cluster: Any) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.Client(cluster) as client:
        client.run_on_scheduler(lambda dask_scheduler: setattr(dask_scheduler, "allowed_failures", 2))

    found = dict(executors.answers(dask(cluster), dies_of_two, [1, 2, 3], here))

    assert (found[1], found[3]) == (10, 30)
    assert isinstance(found[2], Lost)
    assert found[2].outcome == "crashed"


def dies_of_two(piece: int) -> int:
    if piece == 2:
        os._exit(1)
    return 10 * piece


def here() -> Place:
    return Place("toy 1", "same")


def test_a_worker_that_rounds_otherwise_is_refused() -> None:
    places = iter([Place("toy 1", "same"), Place("toy 1", "another")])

    with pytest.raises(ExecutorError, match="not like this machine"):
        list(executors.answers(f"{__name__}:threads", str, [1], lambda: next(places)))


def test_a_worker_with_another_build_is_refused() -> None:
    places = iter([Place("toy 1", "same"), Place("toy 2", "same")])

    with pytest.raises(ExecutorError, match="toy 2"):
        list(executors.answers(f"{__name__}:threads", str, [1], lambda: next(places)))


def fails(piece: int) -> int:
    raise EngineError("the answer is refused")


def test_what_a_piece_raises_is_raised_here() -> None:
    with pytest.raises(EngineError, match="the answer is refused"):
        list(executors.answers(f"{__name__}:threads", fails, [1], here))


def test_what_is_not_asked_for_any_more_is_cancelled() -> None:
    made: list[Future[Any]] = []

    class Counting(ThreadPoolExecutor):
        def submit(self, *given: Any, **named: Any) -> Future[Any]:
            made.append(super().submit(*given, **named))
            return made[-1]

    globals()["counting"] = lambda: Counting(1)
    answers = executors.answers(f"{__name__}:counting", slow, list(range(50)), here)
    next(answers)
    answers.close()

    assert sum(future.cancelled() for future in made) > 40


def slow(piece: int) -> int:
    import time

    time.sleep(0.01)
    return piece


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nowhere:factory", "no executor 'nowhere:factory'"),
        (f"{__name__}:nonsense", "no submit"),
        (f"{__name__}:lacking", "no executor"),
        ("dask://127.0.0.1:1", "no Dask scheduler answers"),
        ("dask://", "no Dask scheduler answers"),
    ],
)
@pytest.mark.filterwarnings("ignore")
def test_an_executor_that_cannot_be_had_is_one_sentence(
    name: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(executors, "PATIENCE", 1)

    with pytest.raises(ExecutorError, match=said):
        list(executors.answers(name, str, [1], here))

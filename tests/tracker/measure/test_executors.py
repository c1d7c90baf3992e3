"""The same run whatever measures it: processes here, threads, a real Dask cluster of three workers; to the bit."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from spook_tracker.engine.errors import EngineError
from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.run_document import Machine, RunDocument
from spook_tracker.tracker.measure import executors
from spook_tracker.tracker.measure.executors import ExecutorError, Place
from spook_tracker.tracker.measure.machine import machine
from spook_tracker.tracker.measure.run import Questions, Request, run
from spook_tracker.tracker.measure.workers import Lost
from spook_tracker.tracker.store.border import decoded
from tests.places import TOYS
from tests.tracker.cli.test_command_line import tracker

ASKED: dict[str, Any] = {"figures": True, "stability": True}
# A few tests of the catalogue; all of them where SPOOK_WHOLE_CATALOGUE is set (make executors).
TESTS = () if "SPOOK_WHOLE_CATALOGUE" in os.environ else ("falling_object", "oscillator_spring")
PATIENCE = 7200 if not TESTS else 600  # s


def threads() -> Executor:
    """What a team's own factory gives."""
    return ThreadPoolExecutor(2)


def nonsense() -> object:
    return object()


def answered(document: RunDocument) -> list[bytes]:
    """Everything a run says of the engine: not when it ran and which it was, nor what the clock said."""
    return [encode(part) for part in (document.series, document.samples, document.figures, document.maps)]


@pytest.fixture(scope="module")
def by_processes() -> RunDocument:
    return run(Questions(), Request(tests=TESTS, workers=1, **ASKED))


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A scheduler and three worker processes of Dask on this machine: two may die, and no piece waits until Dask has started
    another, which on a busy machine may come to nothing."""
    distributed = pytest.importorskip("distributed", reason="Dask is not installed here")
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(TOYS), before]))
    sys.path.insert(0, str(TOYS))  # which its processes take over
    try:
        with distributed.LocalCluster(
            n_workers=3, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as started:
            yield started
    finally:
        sys.path.remove(str(TOYS))
        os.environ.pop("PYTHONPATH")
        if before is not None:
            os.environ["PYTHONPATH"] = before


def dask(cluster: Any) -> str:
    return str(cluster.scheduler_address).replace("tcp://", "dask://")


def without_clocks(document: RunDocument) -> list[bytes]:
    """The same of a night with run times: those are taken on this machine, alone, whatever measures the values."""
    by_clock = {series.key for series in document.series if series.kind == "time"}
    assert by_clock, "a sweep takes run times"
    kept = [replace(s, timing=None) for s in document.samples if s.series not in by_clock]
    return [encode(part) for part in (document.series, tuple(kept), document.figures, document.maps)]


@pytest.mark.filterwarnings("ignore")
def test_a_night_at_the_command_line_gives_the_same_bits_on_dask(
    cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(TOYS))
    nights = []
    for name in ("process", dask(cluster)):
        file = tmp_path / f"{len(nights)}.json"
        done = tracker(
            "nightly", "--executor", name, "--workers", "1", "--engine", "toy_engine", "--json", str(file),
            "--catalogue", "toy_questions:CATALOGUE", "--db", f"{file}.db", "--out", f"{file}.public",
        )  # fmt: skip
        assert done.exit_code == 0, done.output
        nights.append(decoded(file.read_bytes()))

    processes, on_dask = nights
    assert {"values", "sweep", "stability"} == set(processes.asked.families)
    assert without_clocks(on_dask) == without_clocks(processes)


def test_an_executor_of_ones_own_gives_the_same_bits(by_processes: RunDocument) -> None:
    document = run(Questions(), Request(tests=TESTS, executor=f"{__name__}:threads", **ASKED))

    assert answered(document) == answered(by_processes)


@pytest.mark.timeout(PATIENCE)
@pytest.mark.filterwarnings("ignore")  # Dask's own, of its own parts
def test_workers_of_dask_give_the_same_bits(by_processes: RunDocument, cluster: Any) -> None:
    document = run(Questions(), Request(tests=TESTS, executor=dask(cluster), **ASKED))

    assert answered(document) == answered(by_processes)
    assert [worker.fingerprint for worker in document.workers] == [machine().fingerprint]
    assert not by_processes.workers
    assert len(cluster.scheduler_info["workers"]) == 3


@pytest.mark.timeout(120)
@pytest.mark.filterwarnings("ignore")
def test_a_worker_that_dies_costs_its_piece(cluster: Any) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.Client(cluster) as client:
        client.run_on_scheduler(lambda dask_scheduler: setattr(dask_scheduler, "allowed_failures", 0))

    found = dict(executors.answers(dask(cluster), dies_of_two, [1, 2, 3], here))

    assert (found[1], found[3]) == (10, 30)
    assert isinstance(found[2], Lost)
    assert found[2].outcome == "crashed"


class KilledWorker(Exception):
    """As Dask calls what it gives up."""


class GivesUpTogether(Executor):
    """Piece 2 kills every time; 3 is given up with it once."""

    def submit(self, function: Any, *arguments: Any) -> Future[Any]:  # type: ignore[override]
        future: Future[Any] = Future()
        submitted.append(arguments[-1])
        if arguments[-1] == 2 or (arguments[-1] == 3 and submitted.count(3) == 1):
            future.set_exception(KilledWorker())
        else:
            future.set_result(function(*arguments))
        return future


submitted: list[int] = []


def test_a_piece_that_stood_behind_one_that_kills_is_asked_again_alone() -> None:
    submitted.clear()
    found = dict(executors.answers(f"{__name__}:GivesUpTogether", dies_of_two, [1, 2, 3], here))

    assert (found[1], found[3]) == (10, 30)
    assert found[2] == Lost("crashed", "the worker died while answering, more than once")
    assert submitted == [1, 2, 3, 2, 3] or submitted == [1, 2, 3, 3, 2]


def test_a_piece_that_kills_alone_is_not_asked_again() -> None:
    submitted.clear()
    found = dict(executors.answers(f"{__name__}:GivesUpTogether", dies_of_two, [1, 2], here))

    assert isinstance(found[2], Lost)
    assert submitted == [1, 2]


def dies_of_two(piece: int) -> int:
    if piece == 2:
        os._exit(1)
    return 10 * piece


def computer(floats: str, name: str = "one") -> Machine:
    return Machine(
        fingerprint=name, processor="toy", cores=1, operating_system="none", float_environment=floats
    )


def here() -> Place:
    return Place("toy 1", computer("same"))


def test_a_worker_that_rounds_otherwise_is_refused() -> None:
    places = iter([Place("toy 1", computer("same")), Place("toy 1", computer("another"))])

    with pytest.raises(ExecutorError, match="not like this machine"):
        list(executors.answers(f"{__name__}:threads", str, [1], lambda: next(places)))


def test_a_worker_with_another_build_is_refused() -> None:
    places = iter([Place("toy 1", computer("same")), Place("toy 2", computer("same"))])

    with pytest.raises(ExecutorError, match="toy 2"):
        list(executors.answers(f"{__name__}:threads", str, [1], lambda: next(places)))


def test_a_run_names_the_machines_that_measured_it(tmp_path: Path) -> None:
    places = iter([Place("toy 1", computer("same", name)) for name in ("here", "ash", "oak", "ash")])
    told: list[str] = []

    pieces = executors.answers(
        f"{__name__}:threads",
        str,
        [1, 2, 3],
        lambda: next(places),
        lambda found: told.append(found.fingerprint),
    )

    assert sorted(answer for _, answer in pieces) == ["1", "2", "3"]
    assert sorted(told) == ["ash", "ash", "oak"]


def test_the_machines_that_measured_are_stored_and_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(TOYS))
    asked = (
        "--engine", "toy_engine", "--catalogue", "toy_questions:CATALOGUE", "--executor", f"{__name__}:threads"
    )  # fmt: skip

    done = tracker("run", *asked, "--json", "run.json")

    assert done.exit_code == 0, done.output
    (worker,) = decoded(Path("run.json").read_bytes()).workers
    assert worker.fingerprint == machine().fingerprint and worker.pieces > 1
    assert f"{worker.pieces} pieces measured on {worker.processor}" in done.output
    assert tracker("export", "latest", "--out", "again").exit_code == 0
    (again,) = Path("again").glob("*.json")
    assert decoded(again.read_bytes()).workers == (worker,)


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

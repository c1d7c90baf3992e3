"""A run is whole or absent: processes killed, disks full, writers at the same time."""

from __future__ import annotations

import random
import subprocess
import sys
import time

import pytest
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DatabaseError
from spook_tracker.tracker.store import connection
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from tests.histories.documents import figure, run, run_of
from tests.tracker.store.database_work import SERIES, write, write_once_told
from tests.tracker.store.forked import begun, said


def stored_runs(url: str) -> set[str]:
    """Ids of the runs there; every one of them is whole, and nothing else is wrong."""
    engine = open_database(url)
    assert check(engine) == ()
    with Session(engine) as session:
        history = History(session)
        for info in history.runs():
            assert len(history.samples(info.id)) == SERIES
        found = {info.id for info in history.runs()}
    engine.dispose()
    return found


def test_a_process_killed_at_any_moment_leaves_whole_runs(url):
    """Everything it had announced as recorded is there; of the run it was at, all or nothing."""
    chance, announced = random.Random(7), set()
    for attempt in range(3):
        process, pipe = begun(write, url, f"w{attempt}", 10_000)
        announced.add(f"w{attempt}-{pipe.recv()}")  # it is at work now
        time.sleep(chance.uniform(0.0, 0.15))
        process.kill()
        announced |= {f"w{attempt}-{number}" for number in said(pipe)}
        process.join()

        stored = stored_runs(url)

        assert announced <= stored
        assert len(stored - announced) <= attempt + 1  # committed, but killed before it could say so


def ended(writers) -> list[int | None]:
    """How processes ended, once all have."""
    for process, pipe in writers:
        said(pipe)
        process.join()
    return [process.exitcode for process, _ in writers]


def test_writers_at_the_same_time_wait_for_each_other(url):
    """Both start on an empty database: the first makes the tables, and no run of either is lost."""
    writers = [begun(write, url, name, 10) for name in ("one", "two")]

    assert ended(writers) == [0, 0]
    assert stored_runs(url) == {f"{name}-{number}" for name in ("one", "two") for number in range(10)}


@pytest.mark.parametrize("attempt", range(2))
def test_nine_writers_that_meet_on_a_new_database_lose_nothing(url, attempt):
    """The first makes the tables; the others neither take them for something strange nor collide."""
    writers = [begun(write_once_told, url, name) for name in range(9)]
    for _, pipe in writers:
        assert pipe.recv() == "ready"
    for _, pipe in writers:
        pipe.send("go")

    assert ended(writers) == [0] * 9
    assert stored_runs(url) == {str(name) for name in range(9)}


def test_writers_of_the_same_run_store_it_once(url):
    writers = [begun(write, url, "same", 8) for _ in range(2)]

    assert ended(writers) == [0, 0]
    assert stored_runs(url) == {f"same-{number}" for number in range(8)}


FULL_DISK = """
import resource, signal, sys
from sqlalchemy.orm import Session
from tests.histories.documents import run
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.document.errors import DatabaseError
from spook_tracker.tracker.store.record import record
engine = open_database(sys.argv[1])
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
try:
    with Session(engine) as session:
        for number in range(10_000):
            record(session, run(id=str(number), idempotency_key=str(number), ci_address="x" * 60_000))
            print(number, flush=True)
except DatabaseError as error:
    print(error)
"""


def test_a_full_disk_is_one_sentence_and_costs_nothing_stored(sqlite_url, tmp_path):
    engine = open_database(sqlite_url)
    with Session(engine) as session:
        record(session, run(id="before"))
    engine.dispose()
    limit = (tmp_path / "tracker.db").stat().st_size + 500_000

    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, sqlite_url, str(limit)], capture_output=True, text=True, check=False
    )

    assert done.stderr == ""
    *numbers, sentence = done.stdout.splitlines()
    assert "cannot be written" in sentence
    engine = open_database(sqlite_url)
    assert check(engine) == ()
    with Session(engine) as session:
        assert {info.id for info in History(session).runs()} == {"before", *numbers}
        assert record(session, run(id="after"))  # space again: goes on as if nothing had been
    engine.dispose()


def test_a_writer_that_waits_too_long_says_so(sqlite_url, monkeypatch):
    monkeypatch.setattr(connection, "LOCK_TIMEOUT", 0.2)
    engine, other = open_database(sqlite_url), open_database(sqlite_url)
    with Session(engine) as holding, Session(other) as waiting:
        History(holding)  # a transaction of a writer, left open
        with pytest.raises(DatabaseError, match="in use by another writer; try again"):
            record(waiting, run())
    engine.dispose()
    other.dispose()


def test_a_failure_in_the_middle_leaves_nothing(session, monkeypatch):
    """Samples are written before figures: an error there takes everything back."""
    from spook_tracker.tracker.store import rows

    def broken(part):
        raise RuntimeError("the power went")

    with monkeypatch.context() as failing:
        failing.setattr(rows, "packed", broken)
        with pytest.raises(RuntimeError):
            record(session, run(figures=(figure(),)))

    assert check(session.get_bind().engine) == ()
    assert History(session).runs() == ()
    assert record(session, run())


def test_a_clock_that_goes_backwards_loses_no_run(session):
    for number, started in enumerate(
        ("2026-11-21T03:00:00Z", "2026-11-21T02:00:00Z", "1999-01-01T00:00:00Z")
    ):
        record(session, run_of({"a": float(number)}, id=str(number), started=started))

    assert len(History(session).series()["a"].points) == 3

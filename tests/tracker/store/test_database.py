"""Opening: one way for all, and one sentence with exit code 2 whenever it cannot be."""

from __future__ import annotations

import shutil
import sqlite3
import subprocess
import sys
import tempfile
from contextlib import closing, suppress
from pathlib import Path

import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DatabaseError, UnknownName
from spook_tracker.tracker.store.connection import file_system
from spook_tracker.tracker.store.database import open_database, shown
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from tests.histories.documents import run, run_of


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A SQLite file with one run."""
    path = tmp_path / "tracker.db"
    engine = open_database(str(path))
    with Session(engine) as session:
        record(session, run())
    engine.dispose()
    return path


def refused(url, *, readonly=True, words):
    with pytest.raises(DatabaseError, match=words) as caught:
        engine = open_database(str(url), readonly=readonly)
        with Session(engine) as session:
            History(session)
            engine.dispose()
    assert caught.value.exit_code == 2
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def runs_in(url):
    engine = open_database(str(url), readonly=True)
    with Session(engine) as session:
        found = History(session).runs()
    engine.dispose()
    return found


def names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def test_every_connection_is_told_what_sqlite_forgets(sqlite_url):
    engine = open_database(sqlite_url)
    with engine.connect() as connection:
        told = {
            name: connection.execute(text(f"PRAGMA {name}")).scalar_one()
            for name in ("journal_mode", "foreign_keys", "synchronous", "trusted_schema", "busy_timeout")
        }
    engine.dispose()

    assert told == {
        "journal_mode": "wal",
        "foreign_keys": 1,
        "synchronous": 2,  # full: the last night survives a power cut
        "trusted_schema": 0,
        "busy_timeout": 30_000,
    }


def test_a_network_drive_gets_a_journal_that_works_there(sqlite_url, monkeypatch):
    monkeypatch.setattr("spook_tracker.tracker.store.connection.file_system", lambda path: "nfs4")
    engine = open_database(sqlite_url)
    with engine.connect() as connection:
        assert connection.execute(text("PRAGMA journal_mode")).scalar_one() == "delete"
    with Session(engine) as session:
        assert record(session, run())
    engine.dispose()


@pytest.mark.skipif(not Path("/proc/self/mountinfo").exists(), reason="only Linux says what is mounted")
def test_the_file_system_is_known():
    assert file_system(Path("/proc/self/mountinfo")) == "proc"
    assert file_system(Path("/proc/not there")) == "proc"


def test_opening_twice_is_opening_once(url):
    open_database(url).dispose()
    open_database(url).dispose()
    assert runs_in(url) == ()


def test_a_database_in_memory_works():
    engine = open_database("sqlite://")
    with Session(engine) as session:
        assert record(session, run())
        assert len(History(session).runs()) == 1
    engine.dispose()


def test_reading_changes_no_byte_and_leaves_no_files(file):
    before, names = file.read_bytes(), names_in(file.parent)

    assert len(runs_in(file)) == 1

    assert file.read_bytes() == before
    assert names_in(file.parent) == names == ["tracker.db"]


def test_recording_needs_a_database_opened_for_writing(url):
    open_database(url).dispose()
    engine = open_database(url, readonly=True)
    with Session(engine) as session, pytest.raises(DatabaseError, match="read-only"):
        record(session, run())
    engine.dispose()


def test_reading_goes_on_while_another_process_writes(sqlite_url):
    writer = open_database(sqlite_url)
    with Session(writer) as writing:
        record(writing, run())
        writing.execute(text("UPDATE run SET ci_address = 'half done'"))  # holds the lock

        (seen,) = runs_in(sqlite_url)

        assert seen.ci_address != "half done"
        writing.rollback()
    writer.dispose()


def test_a_file_that_is_not_there(tmp_path):
    refused(tmp_path / "no.db", words="there is no database .*no.db; record a run first with: tracker run")
    refused(tmp_path / "no" / "no.db", readonly=False, words="the folder of .* does not exist")
    assert names_in(tmp_path) == []


def test_a_folder(tmp_path):
    refused(tmp_path, words="is a folder; name a file")


@pytest.mark.parametrize("content", [b"hello, I am not a database", b"SQLite format 3\0" + b"\xff" * 5000])
def test_a_file_that_is_something_else(tmp_path, content):
    (tmp_path / "x.db").write_bytes(content)

    for readonly in (True, False):
        refused(tmp_path / "x.db", readonly=readonly, words="damaged")
    assert (tmp_path / "x.db").read_bytes() == content


def test_a_database_of_another_program(tmp_path):
    connection = sqlite3.connect(tmp_path / "x.db")
    connection.execute("CREATE TABLE recipes (name TEXT)")
    connection.close()

    for readonly in (True, False):
        refused(tmp_path / "x.db", readonly=readonly, words=r"holds something else \(a table 'recipes'\)")


def test_a_trigger_from_elsewhere(file):
    connection = sqlite3.connect(file)
    connection.execute("CREATE TRIGGER mine AFTER INSERT ON run BEGIN DELETE FROM sample; END")
    connection.close()

    for readonly in (True, False):
        refused(file, readonly=readonly, words="holds a trigger 'mine'.*; drop it")
    with pytest.raises(DatabaseError, match="holds a trigger 'mine'"), History.open(str(file)):
        pass


def test_a_truncated_file(file):
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])

    refused(file, words="damaged")


def test_overwritten_pages_never_give_wrong_values_silently(file):
    """Whatever page is overwritten: reading fails with a sentence or gives what was stored; `check` finds it."""
    (info,) = runs_in(file)
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("VACUUM")  # a page that holds nothing can lose nothing
    content, page, given = file.read_bytes(), 4096, read_all(file, info.id)
    for number in range(1, len(content) // page):
        damaged = bytearray(content)
        damaged[number * page : (number + 1) * page] = b"\xa5" * page
        file.write_bytes(damaged)

        with suppress(DatabaseError, UnknownName):
            assert read_all(file, info.id) == given

        try:
            engine = open_database(str(file), readonly=True)
            faults = check(engine)
            engine.dispose()
        except DatabaseError as error:
            faults = (str(error),)
        assert faults, f"page {number}"
        assert "damaged" in faults[0]


def read_all(file, run_id):
    engine = open_database(str(file), readonly=True)
    try:
        with Session(engine) as session:
            history = History(session)
            return history.document(run_id), history.series(), history.samples(run_id)
    finally:
        engine.dispose()


AS_ANOTHER = """
import os, sys
from sqlalchemy.orm import Session
from tests.histories.documents import run
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.document.errors import DatabaseError
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.history import History

History(Session(open_database("sqlite://")))  # everything is imported while we may still read it
if os.geteuid() == 0:
    os.setuid(65534)
engine = open_database(sys.argv[1], readonly=True)
with Session(engine) as session:
    print(len(History(session, "/").runs()))
try:
    record(Session(open_database(sys.argv[1])), run())
except DatabaseError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="permissions are others there")
def test_a_read_only_file_in_a_read_only_folder_can_be_read_but_not_written(file):
    """As another user: to root everything is writable."""
    folder = Path(tempfile.mkdtemp())
    copy = Path(shutil.copy(file, folder))
    copy.chmod(0o444)
    folder.chmod(0o555)
    try:
        done = subprocess.run(
            [sys.executable, "-c", AS_ANOTHER, str(copy)], capture_output=True, text=True, check=False
        )
    finally:
        folder.chmod(0o755)
        shutil.rmtree(folder)

    assert done.stderr == ""
    count, sentence = done.stdout.splitlines()
    assert count == "1"
    assert "read-only" in sentence


def test_an_unreachable_server_is_one_sentence(tmp_path):
    refused(f"postgresql://user:secret@/x?host={tmp_path}", words="the database postgresql://.* failed: ")


def test_a_password_is_never_shown(tmp_path):
    for url in ("postgresql://user:secret@/x?host=", "postgresql://user@/x?password=secret&host="):
        with pytest.raises(DatabaseError) as caught:
            open_database(f"{url}{tmp_path}")

        assert "secret" not in str(caught.value)


def test_opening_at_head_does_not_import_alembic(file):
    """It takes longer than everything else `tracker compare` does."""
    program = (
        "import sys; from spook_tracker.tracker.store.database import open_database; "
        f"open_database({str(file)!r}, readonly=True).dispose(); print('alembic' in sys.modules)"
    )

    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)

    assert done.stdout.strip() == "False"


def test_what_is_shown_of_a_database(file):
    engine = open_database(str(file))
    assert shown(engine.url) == str(file)
    engine.dispose()


def test_a_path_with_every_kind_of_character(tmp_path):
    path = tmp_path / "a b?c=d&e#f%20'ü💥.db"
    engine = open_database(str(path))
    with Session(engine) as session:
        record(session, run_of({"x": 1.0}))
    engine.dispose()

    assert len(runs_in(path)) == 1
    assert names_in(tmp_path) == [path.name]

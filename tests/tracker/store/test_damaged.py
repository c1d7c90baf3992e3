"""Databases that took harm, disks that are full: every command says one sentence, and what was there before stays.

Some thirty damages here; `make hostile` plays more (SPOOK_HOSTILE_DOCUMENTS says how many).
"""

from __future__ import annotations

import os
import random
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.revisions import revert
from tests.histories.documents import definition, engine, run, sample
from tests.tracker.cli.test_command_line import tracker

COUNT = int(os.environ.get("SPOOK_HOSTILE_DOCUMENTS", "300")) // 10
COMMANDS = (
    ("db", "check"), ("db", "stats"), ("compare", "previous", "latest"), ("judge",), ("trend", "t/*"), ("export",),
    ("db", "upgrade"), ("publish", "--out", "public"), ("export", "--format", "months", "--out", "months"),
    ("db", "copy", "sqlite:///tracker.db", "sqlite:///copied.db"), ("import", "one.json"),
)  # fmt: skip


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A history of a few nights; never changed."""
    folder = tmp_path_factory.mktemp("whole")
    opened = open_database(f"sqlite:///{folder}/tracker.db")
    with Session(opened) as session:
        for number in range(4):
            series = tuple(definition(f"t/c/m{place}") for place in range(40))
            values = tuple(sample(s.key, 1.0 + number / 7) for s in series)
            commit = engine(f"{number + 1:x}" * 40, parents=(f"{number:x}" * 40,) if number else ())
            record(session, run(series=series, samples=values, engine=commit))
    opened.dispose()
    return folder / "tracker.db"


@pytest.fixture(autouse=True)
def _desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("TRACKER_DB", raising=False)
    shutil.copyfile(whole, "tracker.db")


def _bits(chance: random.Random, file: Path) -> None:
    content = bytearray(file.read_bytes())
    for _ in range(chance.choice((1, 8, 200))):
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    file.write_bytes(content)


def _header(chance: random.Random, file: Path) -> None:
    content = bytearray(file.read_bytes())
    for _ in range(chance.choice((1, 4))):
        content[chance.randrange(100)] = chance.randrange(256)
    file.write_bytes(content)


def _cut(chance: random.Random, file: Path) -> None:
    file.write_bytes(file.read_bytes()[: chance.randrange(file.stat().st_size)])


def _log(chance: random.Random, file: Path) -> None:
    """A write-ahead log as a crash leaves it, with harm in it: its last transaction may be lost, no other."""
    connection = sqlite3.connect(file)
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("UPDATE run SET ci_address = ci_address || 'x'")
    connection.commit()
    log = Path(f"{file}-wal").read_bytes()
    content = file.read_bytes()
    connection.close()
    file.write_bytes(content)
    Path(f"{file}-wal").write_bytes(log)
    (_bits if chance.random() < 0.5 else _cut)(chance, Path(f"{file}-wal"))


def _page(chance: random.Random, file: Path) -> None:
    content = bytearray(file.read_bytes())
    at = 4096 * chance.randrange(len(content) // 4096)
    content[at : at + 4096] = chance.randbytes(4096)
    file.write_bytes(content)


HARMS: tuple[Callable[[random.Random, Path], None], ...] = (_bits, _header, _cut, _log, _page)


def test_a_damaged_database_is_one_sentence_whatever_is_asked(whole: Path) -> None:
    Path("one.json").write_text(tracker("export", "latest").stdout)
    refused = 0
    for number in range(COUNT):
        chance = random.Random(number)
        for name in ("tracker.db", "tracker.db-wal", "tracker.db-shm", "copied.db"):
            Path(name).unlink(missing_ok=True)
        shutil.copyfile(whole, "tracker.db")
        harm = HARMS[number % len(HARMS)]
        harm(chance, Path("tracker.db"))
        for command in chance.sample(COMMANDS, 3):
            done = tracker(*command)

            where = f"{harm.__name__} {number}: {' '.join(command)}"
            assert done.exception is None or isinstance(done.exception, SystemExit), where
            assert done.exit_code in (0, 1, 2, 3), where
            assert "this is a defect" not in done.stderr, f"{where}: {done.stderr}"
            assert len(done.stderr) < 1500, where
            refused += done.exit_code == 2
    assert 0 < refused < 3 * COUNT


FULL = """
import resource, signal, sys
from spook_tracker.tracker.cli.main import main
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
main(sys.argv[2:])
"""


def with_files_of(size: int, *command: str) -> subprocess.CompletedProcess[str]:
    """A command on a disk on which no file grows beyond so many bytes."""
    return subprocess.run(
        [sys.executable, "-c", FULL, str(size), *command], capture_output=True, text=True, check=False
    )


FILLING = [
    (("publish", "--out", "public"), 2000, "public"),
    (("export", "--out", "runs"), 100, "runs"),
    (("export", "--format", "months", "--out", "months"), 100, "months"),
    (("export", "--format", "csv", "--out", "table.csv"), 100, "table.csv"),
    (("db", "copy", "sqlite:///tracker.db", "sqlite:///copied.db"), 40_000, "copied.db"),
    (("db", "upgrade"), 40_000, "tracker.db"),
]


@pytest.mark.parametrize(
    ("command", "size", "made"), FILLING, ids=lambda x: " ".join(x[:2]) if isinstance(x, tuple) else None
)
def test_on_a_full_disk_nothing_half_is_left(command: tuple[str, ...], size: int, made: str) -> None:
    opened = open_database("sqlite:///tracker.db")
    if command == ("db", "upgrade"):
        with opened.begin() as connection:
            revert(connection, "0008")
    else:
        tracker(*command)  # there is an older one, which has to stay
        if made == "copied.db":
            Path(made).unlink()
        with Session(opened) as session:
            record(session, run(ci_address="y"))
    opened.dispose()
    before = {path: path.read_bytes() for path in Path(made).rglob("*") if path.is_file()}

    done = with_files_of(size, *command)

    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stderr.count("\n") == 1, done.stderr
    assert "defect" not in done.stderr
    for path, content in before.items():
        assert path.read_bytes() == content, path
    if made not in ("tracker.db", "copied.db"):
        assert not [path for path in Path().rglob("*") if ".part" in path.name or ".new-" in path.name]
    opened = open_database("sqlite:///tracker.db")  # goes up where it could not before
    assert check(opened) == ()
    with Session(opened) as session:
        assert len(History(session).runs()) >= 4
    opened.dispose()
    assert tracker(*command).exit_code == 0


def test_a_word_where_a_moment_belongs_is_called_damage_by_every_reader() -> None:
    with sqlite3.connect("tracker.db") as connection:
        connection.execute("UPDATE run SET started = 'yesterday'")

    done = tracker("judge", "latest")

    assert done.exit_code == 2
    assert "is damaged" in done.stderr and "restore it from a copy" in done.stderr

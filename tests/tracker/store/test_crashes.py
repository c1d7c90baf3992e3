"""Commands killed at random moments: whatever they were doing, the history is whole and the next command works.

A round is a command that was still at work when it was killed; one that was faster is played again. Every second one
loses only its parent process: whatever it had started has to end by itself. A few rounds here; `make crashes` plays two
hundred on each database (SPOOK_CRASH_ROUNDS says how many).
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from msgspec.structs import replace
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.json_form import decode, encode
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.months import _lines
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.revisions import revert
from spook_tracker.tracker.store.transfer import export_runs
from spook_tracker.tracker.website.folder import MARKER
from tests.histories.documents import definition, run, sample
from tests.places import TOYS

COMMANDS = ("nightly", "publish", "copy", "run", "import", "upgrade", "months")
ROUNDS = int(os.environ.get("SPOOK_CRASH_ROUNDS", "3"))
SHORT = len(COMMANDS) > ROUNDS
TRIES = 40  # for one kill, of a command that keeps ending before it
LONG = ("nightly", "run")  # commands that start others: played to their end in the long form only
PATIENCE = 60.0  # s in which orphans have ended, on a machine however busy


class Desk:
    """Where the commands work: a database, and beside it the files of what they make."""

    def __init__(self, url: str, folder: Path) -> None:
        self.url, self.folder, self.out = url, folder, folder / "public"
        self.number = 0

    def prepared(self, command: str) -> list[str]:
        """Its words, when there is work for it to do."""
        self.number += 1
        if command == "upgrade":
            engine = open_database(self.url)
            with engine.begin() as connection:
                revert(connection, "0007")
            engine.dispose()
        if command == "import":  # the same runs under other names: new to the history
            for file in (self.folder / "in").iterdir():
                said = json.loads(file.read_text(encoding="utf-8"))
                said["id"] = said["idempotency_key"] = f"{said['id'].partition(' ')[0]} {self.number}"
                file.write_text(json.dumps(said), encoding="utf-8")
        if command == "publish" and self.number % 2:
            shutil.rmtree(
                self.out, ignore_errors=True
            )  # all its pages are made, not only those that have changed
        if command == "months":
            for file in (self.folder / "months").glob("*.xz"):
                file.unlink()
        return self.words(command)

    @property
    def copy(self) -> Path:
        return self.folder / f"copy-{self.number}.db"

    def words(self, command: str) -> list[str]:
        database = ["--db", self.url]
        return {
            "run": ["run", "--workers", "1", *database],
            "nightly": ["nightly", "--quick", "--workers", "1", "--out", str(self.out), *database],
            "import": ["import", str(self.folder / "in"), *database],
            "upgrade": ["db", "upgrade", *database],
            "publish": ["publish", "--out", str(self.out), *database],
            "months": ["export", "--format", "months", "--out", str(self.folder / "months"), *database],
            "copy": ["db", "copy", self.url, f"sqlite:///{self.copy}"],
        }[command]

    def start(self, words: list[str]) -> subprocess.Popen[bytes]:
        environment = {k: v for k, v in os.environ.items() if not k.startswith("TRACKER")} | {
            "TRACKER_ENGINE": "toy_engine",
            "TRACKER_CATALOGUE": "toy_questions:CATALOGUE",
            "PYTHONPATH": str(TOYS),
            "CRASHING_AT": str(self.folder),
        }
        return subprocess.Popen(
            [sys.executable, "-m", "spook_tracker", *words],
            cwd=self.folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
        )  # fmt: skip

    def killed(self, words: list[str], after: float, all_of_it: bool) -> float | None:
        """End a command without warning, with all it has started or alone; how long it took if it was faster."""
        process = self.start(words)
        begun = time.monotonic()
        with suppress(subprocess.TimeoutExpired):
            process.communicate(timeout=after)
        if process.returncode is not None:
            return time.monotonic() - begun
        with suppress(ProcessLookupError):
            (os.killpg if all_of_it else os.kill)(process.pid, signal.SIGKILL)
        process.communicate()
        end = time.monotonic() + PATIENCE
        while at_work(self.folder):
            assert time.monotonic() < end, f"{words[0]} left orphans: {at_work(self.folder)}"
            time.sleep(0.01)
        return None

    def played(self, command: str) -> None:
        """The command after the kill: to its end, and with what it is for."""
        process = self.start(self.words(command))
        _, told = process.communicate()
        done = command == "copy" and b"already holds runs" in told  # it was killed behind its last word
        assert process.returncode in (0, 1) or done, (command, told.decode())
        if command in ("publish", "nightly"):
            assert (self.out / "index.html").is_file()
        if command == "copy":
            assert stored(f"sqlite:///{self.copy}") == stored(self.url)
        if command == "months":
            assert self.in_months() == set(stored(self.url))
        if command == "import":
            assert sum(f" {self.number}" in name for name in stored(self.url)) == 3
        if command == "upgrade":
            engine = open_database(self.url, readonly=True)  # refuses an older schema
            engine.dispose()

    def in_months(self) -> set[str]:
        """Ids in the files of the months; each of them reads to its end."""
        return {
            json.loads(line)["id"] for file in (self.folder / "months").glob("*.xz") for line in _lines(file)
        }

    def is_whole(self, command: str, before: dict[str, bytes]) -> dict[str, bytes]:
        """Whatever the killed command has left is the old or the new; returns what is stored."""
        after = stored(self.url)
        if command == "nightly":  # it drops figures of older runs, and nothing else
            assert bare(before).items() <= bare(after).items(), command
        else:
            assert before.items() <= after.items(), command
        if self.out.exists():
            whole_site(self.out)
        if self.copy.exists() and self.copy.stat().st_size:
            copied = stored(f"sqlite:///{self.copy}")
            assert copied in ({}, after)
        if (self.folder / "months").exists():
            assert self.in_months() <= set(after)
        for kept in self.folder.glob("tracker.db.revision-*"):  # a copy before an upgrade, if it has its name
            if not kept.name.endswith(".part"):
                found = stored_before(kept)
                assert found, f"{kept.name} is a copy of nothing"
                assert found <= set(after)
                kept.unlink()
        return after


def at_work(folder: Path) -> list[int]:
    """Processes that were started for this folder, by any process, and have not ended; zombies have no environment."""
    mark = f"CRASHING_AT={folder}".encode()
    found = []
    for place in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            if mark in place.read_bytes().split(b"\0"):
                found.append(int(place.parent.name))
    return found


def stored(url: str) -> dict[str, bytes]:
    """Every run with its whole document; reading it proves that it is whole."""
    engine = open_database(url)
    try:
        assert check(engine) == ()
        with Session(engine) as session:
            history = History(session)
            return {found.id: encode(history.document(found.id)) for found in history.runs()}
    finally:
        engine.dispose()


def bare(documents: dict[str, bytes]) -> dict[str, bytes]:
    """The documents without their drawings."""
    return {
        name: encode(replace(decode(document, RunDocument), figures=(), maps=(), trajectories=()))
        for name, document in documents.items()
    }


def stored_before(file: Path) -> set[str]:
    """Ids in a file of an older revision."""
    import sqlite3

    connection = sqlite3.connect(file)
    try:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        return {name for (name,) in connection.execute("SELECT id FROM run")}
    finally:
        connection.close()


def whole_site(folder: Path) -> None:
    """Every file that the site says it has is there to its end."""
    said = json.loads((folder / MARKER).read_text(encoding="utf-8"))["files"]
    assert "index.html" in said
    for name in said:
        content = (folder / name).read_bytes()
        if name.endswith(".html"):
            assert content.rstrip().endswith(b"</html>"), name
        if name.endswith(".json"):
            json.loads(content)


def filled(url: str, folder: Path) -> None:
    """A history of some runs, and files of others to be imported."""
    engine = open_database(url)
    with Session(engine) as session:
        for number in range(6):
            series = tuple(definition(f"t/c/m{place}") for place in range(30))
            values = tuple(sample(s.key, number + place / 7) for place, s in enumerate(series))
            record(session, run(series=series, samples=values))
            if number == 2:
                export_runs(History(session), folder / "in")
    engine.dispose()


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.timeout(max(600, 60 * ROUNDS))
def test_whatever_is_killed_the_history_is_whole(url: str, tmp_path: Path) -> None:
    chance = random.Random(f"{url.partition(':')[0]} {ROUNDS}")
    filled(url, tmp_path)
    desk = Desk(url, tmp_path)
    before = stored(url)
    lasts = dict.fromkeys(COMMANDS, 3.0)  # s, as far as is known
    missed = 0

    for number in range(ROUNDS):
        command = COMMANDS[number % len(COMMANDS)]
        for _ in range(TRIES):
            words = desk.prepared(command)
            took = desk.killed(words, chance.uniform(0.3, 1.0) * lasts[command], all_of_it=number % 2 == 0)
            if took is None:
                lasts[command] *= 1.05  # or else only its beginning is ever met
                break
            lasts[command] = took
            missed += 1
            before = desk.is_whole(command, before)
        else:
            pytest.fail(f"{command} ended {TRIES} times before it was killed")

        before = desk.is_whole(command, before)
        if not (SHORT and command in LONG):
            desk.played(command)
            before = desk.is_whole(command, before)
    print(f"{ROUNDS} kills, {missed} commands that were faster, {len(before)} runs stored")

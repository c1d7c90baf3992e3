"""Commands killed at random moments: whatever they were doing, the history is whole and the next command works.

A few rounds here; `make crashes` plays two hundred on each database (SPOOK_CRASH_ROUNDS says how many).
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.revisions import revert
from spook_tracker.tracker.store.transfer import export_runs
from tests.run_documents import definition, run, sample

HERE = Path(__file__).parent
ROUNDS = int(os.environ.get("SPOOK_CRASH_ROUNDS", "3"))
LONGEST = 4.0  # s after which a command is killed, unless it has ended
COMMANDS = ("run", "nightly", "import", "upgrade", "publish", "months", "copy")


def arguments(command: str, url: str, folder: Path, number: int) -> list[str]:
    return {
        "run": ["run", "--workers", "1"],
        "nightly": ["nightly", "--quick", "--workers", "1", "--out", str(folder / "public")],
        "import": ["import", str(folder / "in")],
        "upgrade": ["db", "upgrade"],
        "publish": ["publish", "--out", str(folder / "public")],
        "months": ["export", "--format", "months", "--out", str(folder / "months")],
        "copy": ["db", "copy", url, f"sqlite:///{folder}/copy-{number}.db"],
    }[command]


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


def killed(command: list[str], folder: Path, after: float) -> bool:
    """Run a command and end it without warning, workers and all; whether it was still at work."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("TRACKER")} | {
        "TRACKER_ENGINE": "toy_engine",
        "TRACKER_CATALOGUE": "toy_questions:CATALOGUE",
        "PYTHONPATH": str(HERE),
    }
    process = subprocess.Popen(
        [sys.executable, "-m", "spook_tracker", *command],
        cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    end = time.monotonic() + after
    while process.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    alive = process.poll() is None
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return alive


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
    for file in (folder / "in").iterdir():  # the same runs under other names: new to the history
        text = file.read_text(encoding="utf-8")
        identity = text.partition('"id": "')[2].partition('"')[0]
        file.write_text(text.replace(identity, f"{identity}-again"), encoding="utf-8")


@pytest.mark.timeout(max(600, 20 * ROUNDS))
def test_whatever_is_killed_the_history_is_whole(url: str, tmp_path: Path) -> None:
    chance = random.Random(f"{url.partition(':')[0]} {ROUNDS}")
    filled(url, tmp_path)
    before = stored(url)
    hit = 0

    for number in range(ROUNDS):
        command = COMMANDS[number % len(COMMANDS)] if len(COMMANDS) < ROUNDS else chance.choice(COMMANDS)
        if command == "upgrade":
            engine = open_database(url)
            with engine.begin() as connection:
                revert(connection, "0007")
            engine.dispose()
        words = arguments(command, url, tmp_path, number)
        words += [] if command == "copy" else ["--db", url]
        hit += killed(words, tmp_path, chance.uniform(0.0, LONGEST))

        after = stored(url)
        assert before.items() <= after.items(), (number, command)
        before = after

    assert hit or ROUNDS < 20, "no command was still at work when it was killed"

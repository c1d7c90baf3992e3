"""What the processes of the durability and migration tests do with a database."""

from __future__ import annotations

import os
import signal
from multiprocessing.connection import Connection
from typing import Any

from sqlalchemy import Engine, event
from sqlalchemy.orm import Session

from spook_tracker.tracker.store import (
    connection,
    revisions,  # (imported by the first process that migrates: here, so that it takes no time any more)
    schema,
)
from spook_tracker.tracker.store.record import record
from tests.histories.documents import run_of

SERIES = 40  # samples in each run of a writer


def write(said: Connection, url: str, name: str, count: int) -> None:
    """Record runs, and say the number of each that is recorded."""
    engine = schema.open_database(url)
    with Session(engine) as session:
        for number in range(count):
            values = {f"series {n}": n + number / 7 for n in range(SERIES)}
            record(session, run_of(values, id=f"{name}-{number}", idempotency_key=f"{name}-{number}"))
            said.send(number)
    engine.dispose()


def write_once_told(said: Connection, url: str, name: int) -> None:
    """Record one run as soon as the other end says so; every second writer has its series in reverse."""
    numbers = range(SERIES) if name % 2 else range(SERIES - 1, -1, -1)
    run = run_of({f"series {n}": n / 7 for n in numbers}, id=f"{name}", idempotency_key=f"{name}")
    said.send("ready")
    said.recv()
    engine = schema.open_database(url)
    with Session(engine) as session:
        record(session, run)
    engine.dispose()


def migrate_and_die(_said: Connection, url: str, statement: int) -> None:
    """Open an older database, and be killed before the given statement that changes something."""
    real = connection.connected
    schema.connected = lambda *given: mortal(real(*given), statement)  # type: ignore[assignment]
    schema.open_database(url).dispose()


def go_down_and_die(_said: Connection, url: str, target: str, statement: int) -> None:
    """Go back to an older revision, and be killed before the given statement that changes something."""
    engine = mortal(connection.connected(connection.database_url(url), readonly=False), statement)
    with engine.begin() as going:
        revisions.revert(going, target)


def mortal(engine: Engine, statement: int) -> Engine:
    """The engine, whose process is killed before so many statements have changed something."""
    left = [statement]

    @event.listens_for(engine, "before_cursor_execute")
    def count(_connection: Any, _cursor: Any, words: str, *_rest: Any) -> None:
        if words.startswith(("UPDATE", "CREATE", "INSERT", "DROP", "ALTER")):
            left[0] -= 1
            if left[0] == 0:
                os.kill(os.getpid(), signal.SIGKILL)

    return engine

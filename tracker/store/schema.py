"""A database at the newest revision of its schema: one way for all to open one."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import cast

from sqlalchemy import URL, Connection, Engine, inspect, text
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DatabaseError, DatabaseUnusable

from .connection import (
    ONE_WRITER,
    connected,
    database_url,
    in_words,
    is_file,
    shown,
)
from .head import head, known_revisions


def open_database(url: str | URL | None = None, readonly: bool = False) -> Engine:
    """The database at `url`, upgraded to the newest revision; a SQLite file is copied before an upgrade.

    `readonly` changes nothing, takes no lock and needs the database to exist at the newest revision.
    DatabaseError, one sentence, if it cannot be opened, is damaged, too new, or not a tracker's.
    """
    url = url if isinstance(url, URL) else database_url(url)
    if is_file(url):
        _check_file(url, readonly)
    engine = connected(url, readonly)
    try:
        with in_words(engine):
            with _one_moment(engine) as connection:
                revision = _current(connection)
                _refuse_strange(connection, revision)
                _refuse_triggers(connection)
            if revision == head():
                return engine
            if readonly:
                raise DatabaseError(
                    f"{shown(url)} has an older schema than this tracker; run: tracker db upgrade"
                    if revision
                    else f"{shown(url)} holds no runs yet; record one with: tracker run"
                )
            upgrade(engine)
    except BaseException:
        engine.dispose()
        raise
    return engine


def upgrade(engine: Engine, target: str = "head", *, keep_copy: bool = True) -> None:
    """Bring the schema to `target` in one transaction. An older SQLite file is copied beside itself first."""
    from .revisions import (
        migrate,  # Alembic is imported only when there is something to do
    )

    with engine.connect() as connection:
        sqlite = engine.dialect.name == "sqlite"
        if sqlite:  # a table rebuild with foreign keys on would delete the rows that refer to it
            _pragma(connection, "foreign_keys = OFF")  # has an effect only outside a transaction
        try:
            with connection.begin():
                one_writer(connection)
                revision = _current(connection)
                _refuse_strange(connection, revision)  # another process may have been here meanwhile
                if sqlite and keep_copy and revision is not None and revision != target:
                    _keep_copy(engine.url, revision)
                migrate(connection, target)
        finally:
            if sqlite:
                _pragma(connection, "foreign_keys = ON")


def one_writer(on: Connection | Session) -> None:
    """Wait until this transaction is the only one that writes. SQLite does so at its beginning, by itself."""
    connection = on if isinstance(on, Connection) else on.connection()
    if connection.dialect.name == "postgresql":
        connection.execute(text(f"SELECT pg_advisory_xact_lock({ONE_WRITER})"))


def _pragma(connection: Connection, words: str) -> None:
    driver = cast("sqlite3.Connection", connection.connection.dbapi_connection)
    driver.execute(f"PRAGMA {words}")


def _keep_copy(url: URL, revision: str) -> None:
    if not is_file(url):
        return
    source = Path(str(url.database))
    copy = source.with_name(f"{source.name}.revision-{revision}")
    number = 1
    while copy.exists():
        number += 1
        copy = source.with_name(f"{source.name}.revision-{revision}-{number}")
    part = source.with_name(f"{source.name}.revision-{revision}.part")  # a name of its own until it is whole
    part.unlink(missing_ok=True)  # of a process that was killed; this one alone writes now
    with sqlite3.connect(source) as old, sqlite3.connect(part) as new:
        old.backup(new)
    old.close()
    new.close()
    part.rename(copy)


def _check_file(url: URL, readonly: bool) -> None:
    path = Path(str(url.database))
    if path.is_dir():
        raise DatabaseError(f"{path} is a folder; name a file")
    try:
        path.resolve()
    except (OSError, RuntimeError):
        raise DatabaseError(f"{path} is a link that leads back to itself; name a file") from None
    if path.exists() and not path.is_file():
        raise DatabaseError(f"{path} is a pipe or a device; name a file")  # reading it might wait for ever
    if not path.exists():
        if readonly:
            raise DatabaseError(f"there is no database {path}; record a run first with: tracker run")
        if not path.absolute().parent.is_dir():
            raise DatabaseError(f"the folder of {path} does not exist; make it first")
        return
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as error:
        raise DatabaseError(f"{path} cannot be read: {error.strerror}") from None
    if start and start != b"SQLite format 3\0":
        raise DatabaseUnusable(f"{path} is not a SQLite database, or it is damaged; restore it from a copy")


def _one_moment(engine: Engine) -> Connection:
    """A connection whose transaction sees one state: between two, another process could make the tables."""
    connection = engine.connect()
    if engine.dialect.name != "sqlite":  # SQLite knows nothing else
        connection.execution_options(isolation_level="REPEATABLE READ")
    return connection


def _current(connection: Connection) -> str | None:
    if not inspect(connection).has_table("alembic_version"):
        return None
    found = connection.execute(text("SELECT version_num FROM alembic_version")).scalars().all()
    return str(found[0]) if len(found) == 1 else "+".join(found) or None


def _refuse_strange(connection: Connection, revision: str | None) -> None:
    name = shown(connection.engine.url)
    if revision is not None and revision not in known_revisions():
        raise DatabaseUnusable(
            f"{name} has schema revision {revision[:40]}, this tracker knows up to {head()}; "
            "update the tracker"
        )
    tables = set(inspect(connection).get_table_names()) - {"alembic_version"}  # empty: all the way down
    if revision is None and (strange := sorted(tables)):
        raise DatabaseUnusable(
            f"{name} holds something else (a table {strange[0][:40]!r}); choose another database"
        )


def _refuse_triggers(connection: Connection) -> None:
    """A trigger in a file from elsewhere would run whenever a night is recorded."""
    if connection.dialect.name == "sqlite":
        query = text("SELECT name FROM sqlite_master WHERE type = 'trigger'")
        name = connection.execute(query).scalar()
        if name is not None:
            raise DatabaseUnusable(
                f"{shown(connection.engine.url)} holds a trigger {name[:40]!r}, "
                "which is not the tracker's; drop it"
            )

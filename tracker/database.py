"""Open the database: one way for all, always at the newest schema revision.

SQLite loses what it is not told to keep, so every connection is told: write-ahead log, foreign keys, write
transactions that lock at once (a lock taken late fails at once, whatever the timeout).
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sqlalchemy import URL, Engine, create_engine, event, exc, inspect, make_url, text
from sqlalchemy.orm import Session
from sqlalchemy.pool import NullPool

from tracker.errors import DatabaseError
from tracker.resources import resource

DEFAULT = "sqlite:///tracker.db"
LOCK_TIMEOUT = 30.0  # s to wait for another writer


def database_url(given: str | None = None) -> URL:
    """The URL meant: `given`, else TRACKER_DB, else tracker.db here. A plain path means a SQLite file."""
    chosen = given or os.environ.get("TRACKER_DB") or DEFAULT
    if "://" not in chosen:
        return URL.create("sqlite", database=chosen)
    try:
        url = make_url(chosen)
    except (exc.ArgumentError, ValueError):
        raise DatabaseError(
            "the database URL cannot be read; write sqlite:///FILE or postgresql://..."
        ) from None
    if url.get_backend_name() not in ("sqlite", "postgresql"):
        raise DatabaseError(f"{url.get_backend_name()} is not supported; use sqlite or postgresql")
    return url


def shown(url: URL) -> str:
    """The database as it may be printed: no password."""
    return url.database or "memory" if url.get_backend_name() == "sqlite" else url.render_as_string()


def open_database(url: str | URL | None = None, readonly: bool = False) -> Engine:
    """The database at `url`, upgraded to the newest revision; a SQLite file is copied before an upgrade.

    `readonly` changes nothing, takes no lock and needs the database to exist at the newest revision.
    DatabaseError, one sentence, if it cannot be opened, is damaged, too new, or not a tracker's.
    """
    url = url if isinstance(url, URL) else database_url(url)
    if _is_file(url):
        _check_file(url, readonly)
    engine = _engine(url, readonly)
    event.listen(engine, "handle_error", _said, retval=True)
    try:
        with in_words(engine):
            revision = _revision(engine)
            if revision == head():
                return engine
            _refuse_strange(engine, revision)
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


def head() -> str:
    """The newest revision, from the file names: reading them takes no time, importing Alembic does."""
    return _revisions()[-1]


def _revisions() -> list[str]:
    return sorted(
        path.name.partition("_")[0] for path in (resource("migrations") / "versions").glob("[0-9]*.py")
    )


def upgrade(engine: Engine, target: str = "head", *, keep_copy: bool = True) -> None:
    """Bring the schema to `target` in one transaction. An older SQLite file is copied beside itself first."""
    from tracker.revisions import migrate  # Alembic is imported only when there is something to do

    with engine.connect() as connection:
        sqlite = engine.dialect.name == "sqlite"
        if sqlite:  # a table rebuild with foreign keys on would delete the rows that refer to it
            _pragma(connection, "foreign_keys = OFF")  # has an effect only outside a transaction
        try:
            with connection.begin():
                if not sqlite:
                    connection.execute(text("SELECT pg_advisory_xact_lock(5755)"))
                revision = _current(connection)
                if sqlite and keep_copy and revision is not None and revision != target:
                    _keep_copy(engine.url, revision)
                migrate(connection, target)
        finally:
            if sqlite:
                _pragma(connection, "foreign_keys = ON")


def _pragma(connection: Any, words: str) -> None:
    connection.connection.dbapi_connection.execute(f"PRAGMA {words}")


def _keep_copy(url: URL, revision: str) -> None:
    if not _is_file(url):
        return
    source = Path(str(url.database))
    copy = source.with_name(f"{source.name}.revision-{revision}")
    number = 1
    while copy.exists():
        number += 1
        copy = source.with_name(f"{source.name}.revision-{revision}-{number}")
    with sqlite3.connect(source) as old, sqlite3.connect(copy) as new:
        old.backup(new)
    old.close()
    new.close()


def _engine(url: URL, readonly: bool) -> Engine:
    if url.get_backend_name() == "postgresql":
        return _postgresql(url, readonly)
    if not _is_file(url):
        engine = create_engine(url)
    else:
        address = _address(url, readonly)

        def connect() -> sqlite3.Connection:
            return sqlite3.connect(address, uri=True, timeout=LOCK_TIMEOUT, check_same_thread=False)

        # NullPool: a connection closed is a file closed, so that the write-ahead log is folded in at the end
        engine = create_engine(url, poolclass=NullPool, creator=connect)
    begin = "BEGIN" if readonly else "BEGIN IMMEDIATE"

    @event.listens_for(engine, "connect")
    def prepare(connection: Any, _record: Any) -> None:
        connection.isolation_level = (
            None  # the driver begins nothing by itself: schema changes roll back, too
        )
        pragmas = ["foreign_keys = ON", "trusted_schema = OFF", "cell_size_check = ON"]
        pragmas += ["query_only = ON"] if readonly else ["journal_mode = WAL", "synchronous = FULL"]
        for words in pragmas:
            connection.execute(f"PRAGMA {words}")

    @event.listens_for(engine, "begin")
    def take_lock(connection: Any) -> None:
        connection.exec_driver_sql(begin)

    return engine


def _postgresql(url: URL, readonly: bool) -> Engine:
    try:
        engine = create_engine(url, connect_args={"connect_timeout": 10})
    except ModuleNotFoundError:
        raise DatabaseError("PostgreSQL needs a driver; install spook-tracker[postgresql]") from None
    return engine.execution_options(postgresql_readonly=True) if readonly else engine


def _is_file(url: URL) -> bool:
    return url.get_backend_name() == "sqlite" and url.database not in (None, "", ":memory:")


def _address(url: URL, readonly: bool) -> str:
    """The file as SQLite's own URI, which alone can say that nothing may be written."""
    path = Path(str(url.database)).resolve()
    mode = "rwc"
    if readonly:
        # where writing is possible, the last reader must be able to tidy the log away
        mode = "rw" if os.access(path, os.W_OK) and os.access(path.parent, os.W_OK) else "ro"
    log = path.with_name(path.name + "-wal")
    if mode == "ro" and not os.access(path.parent, os.W_OK) and not (log.exists() and log.stat().st_size):
        mode += "&immutable=1"  # SQLite would want to write an index of the (empty) log beside the file
    return f"file:{quote(str(path))}?mode={mode}"


def _check_file(url: URL, readonly: bool) -> None:
    path = Path(str(url.database))
    if path.is_dir():
        raise DatabaseError(f"{path} is a folder; name a file")
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
        raise DatabaseError(f"{path} is not a SQLite database, or it is damaged; restore it from a copy")


def _revision(engine: Engine) -> str | None:
    with engine.connect() as connection:
        return _current(connection)


def _current(connection: Any) -> str | None:
    if not inspect(connection).has_table("alembic_version"):
        return None
    found = connection.execute(text("SELECT version_num FROM alembic_version")).scalars().all()
    return str(found[0]) if len(found) == 1 else "+".join(found) or None


def _refuse_strange(engine: Engine, revision: str | None) -> None:
    if revision is not None and revision not in _revisions():
        raise DatabaseError(
            f"{shown(engine.url)} has schema revision {revision[:40]}, this tracker knows up to {head()}; "
            "update the tracker"
        )
    if revision is None and (strange := inspect(engine).get_table_names()):
        raise DatabaseError(
            f"{shown(engine.url)} holds something else (a table {strange[0][:40]!r}); choose another database"
        )


def _said(context: Any) -> DatabaseError | None:
    """Whatever the driver raises, anywhere, as one sentence; what concurrent writers cause is for `record`."""
    if isinstance(context.sqlalchemy_exception, exc.IntegrityError):
        return None
    return DatabaseError(_sentence(shown(context.engine.url), context.original_exception))


@contextmanager
def in_words(where: Engine | Session) -> Iterator[None]:
    """Whatever goes wrong in the database, as one sentence (DatabaseError)."""
    try:
        yield
    except (exc.SQLAlchemyError, sqlite3.Error, OSError) as error:
        engine = where if isinstance(where, Engine) else where.get_bind().engine
        name = shown(engine.url)
        raise DatabaseError(_sentence(name, error)) from error


def _sentence(name: str, error: Exception) -> str:
    reason = str(getattr(error, "orig", None) or error).strip().partition("\n")[0]
    lower = reason.lower()
    for sign, sentence in (
        ("locked", "is in use by another writer; try again"),
        ("readonly", "cannot be written; it, or its folder, is read-only"),
        ("read-only", "cannot be written; it, or its folder, is read-only"),
        ("full", "cannot be written: no space left; nothing of this run was stored"),
        ("disk i/o", "cannot be written or read: the disk reports an error, or is full"),
        ("malformed", "is damaged; restore it from a copy (tracker db check says more)"),
        ("not a database", "is damaged or not a SQLite database; restore it from a copy"),
        ("unable to open", "cannot be opened; check the path and its permissions"),
    ):
        if sign in lower:
            return f"the database {name} {sentence}"
    return f"the database {name} failed: {reason[:300]}"

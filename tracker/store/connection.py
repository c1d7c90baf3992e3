"""A connection to SQLite or PostgreSQL as the history needs it, and what goes wrong on it in words.

SQLite loses what it is not told to keep, so every connection is told: write-ahead log, foreign keys, write
transactions that lock at once (a lock taken late fails at once, whatever the timeout).
"""

from __future__ import annotations

import os
import re
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from sqlalchemy import URL, Engine, create_engine, event, exc, make_url
from sqlalchemy.orm import Session
from sqlalchemy.pool import NullPool

from spook_tracker.tracker.document.errors import DatabaseError, DatabaseUnusable

from .reader import LOCK_TIMEOUT, SAFE, address, sentence

if TYPE_CHECKING:
    from sqlalchemy import Connection
    from sqlalchemy.engine import ExceptionContext

DEFAULT = "sqlite:///tracker.db"
ONE_WRITER = 5755  # number of the lock that a writer to PostgreSQL holds
DRIVERS = frozenset({"sqlite", "sqlite+pysqlite", "postgresql", "postgresql+psycopg", "postgresql+psycopg2"})
NETWORK = frozenset({"nfs", "nfs4", "cifs", "smb3", "smbfs", "afs", "9p", "ceph", "lustre", "fuse.sshfs"})


def database_url(given: str | None = None) -> URL:
    """The URL meant: `given`, else TRACKER_DB, else tracker.db here. A plain path means a SQLite file."""
    chosen = given or os.environ.get("TRACKER_DB") or DEFAULT
    if not chosen.isprintable() and any("\ud800" <= c <= "\udfff" for c in chosen):
        raise DatabaseError("the name of the database is not UTF-8; give it one that is")
    if "\0" in chosen:
        raise DatabaseError("the name of the database holds a character that no file can have")
    if "://" not in chosen:
        _refuse_secrets(chosen)
        return URL.create("sqlite", database=chosen)
    try:
        url = make_url(chosen)
    except (exc.ArgumentError, ValueError):
        raise DatabaseError(
            "the database URL cannot be read; write sqlite:///FILE or postgresql://..."
        ) from None
    if url.get_backend_name() == "postgres":
        raise DatabaseError("a PostgreSQL URL begins with postgresql://, not with postgres://")
    if url.get_backend_name() not in ("sqlite", "postgresql"):
        raise DatabaseError(f"{url.get_backend_name()} is not supported; use sqlite or postgresql")
    if url.drivername not in DRIVERS:
        raise DatabaseError(f"{url.drivername} is not supported; write {url.get_backend_name()}:// alone")
    if url.get_backend_name() == "sqlite":
        if url.host or url.username or url.password:
            raise DatabaseError("a SQLite URL names no host and no user: write sqlite:///FILE")
        _refuse_secrets(url.database or "")
    elif _misread(url):  # the end of a password, which is not repeated
        raise DatabaseError(
            "the database URL cannot be read: in a password @ is written %40, / %2F, ? %3F, # %23"
        )
    if url.get_backend_name() == "sqlite" and url.query:
        raise DatabaseError("a SQLite URL takes no options: what stands behind its ? would be ignored")
    return url


CONNECTS = re.compile(  # what the programs of PostgreSQL, ODBC and others take where we want a URL
    r"(?:^|[\s;,&?'\"{-])(?:host|hostaddr|port|dbname|user|user ?id|uid|pass\w*|pwd|service|server|ssl\w+|pg[a-z]+|secret|token)['\"]?\s*="
    r"|(?:^|[\s;,&?'\"{-])(?:pass\w*|pwd)['\"]?\s*[:\s]\s*\S"
    r"|^\W*postgres\w*[:+]|:[^/]*@|@[\w.-]+:\d|^[^:/\\]+:\d+:[^:]*:[^:]*:",
    re.IGNORECASE,
)


def _refuse_secrets(path: str) -> None:
    """DatabaseError, which does not repeat it, if what would be the name of a file is meant for a server."""
    if Path(path).exists():
        return
    if CONNECTS.search(path) or CONNECTS.search(unquote(path)):
        raise DatabaseError(
            "the database looks like a server's, with a password perhaps, and is no URL: write "
            "postgresql://USER:PASSWORD@HOST/NAME, or for a file of such a name make it first"
        )


def _misread(url: URL) -> bool:
    """Whether a part of a password has become part of something else."""
    parts = (url.username, url.host, url.database, *url.query)
    return any(sign in (part or "") for part in parts for sign in "@=") or any(
        "@" in value for value in url.query.values() if isinstance(value, str)
    )


def shown(url: URL) -> str:
    """The database as it may be printed: made of what may be, so that no form of a password is among it."""
    if url.get_backend_name() == "sqlite":
        return url.database or "memory"
    place = f"{url.host or ''}{f':{url.port}' if url.port else ''}"
    return f"postgresql://{place}/{url.database or ''}"


def connected(url: URL, readonly: bool) -> Engine:
    """An engine whose connections are prepared and whose errors are sentences. Nothing is opened yet."""
    engine = _sqlite(url, readonly) if url.get_backend_name() == "sqlite" else _postgresql(url, readonly)
    event.listen(engine, "handle_error", _said, retval=True)
    return engine


def _sqlite(url: URL, readonly: bool) -> Engine:
    if not is_file(url):
        engine = create_engine(url)
    else:
        place = address(Path(str(url.database)), readonly)

        def connect() -> sqlite3.Connection:
            return sqlite3.connect(place, uri=True, timeout=LOCK_TIMEOUT, check_same_thread=False)

        # NullPool: a connection closed is a file closed, so that the write-ahead log is folded in at the end
        engine = create_engine(url, poolclass=NullPool, creator=connect)
    # processes on several machines cannot share the memory that the write-ahead log needs
    journal = "DELETE" if is_file(url) and file_system(Path(str(url.database))) in NETWORK else "WAL"
    begin = "BEGIN" if readonly else "BEGIN IMMEDIATE"

    @event.listens_for(engine, "connect")
    def prepare(connection: sqlite3.Connection, _record: object) -> None:
        connection.isolation_level = None  # the driver begins nothing itself: schema changes roll back, too
        pragmas = ["foreign_keys = ON", *SAFE]
        pragmas += ["query_only = ON"] if readonly else ["synchronous = FULL"]
        for words in pragmas:
            connection.execute(f"PRAGMA {words}")
        if not readonly:
            _patiently(connection, f"PRAGMA journal_mode = {journal}")

    @event.listens_for(engine, "begin")
    def take_lock(connection: Connection) -> None:
        connection.exec_driver_sql(begin)

    return engine


def _patiently(connection: sqlite3.Connection, statement: str) -> None:
    """What SQLite refuses at once while another process does it, too, however long it may wait for locks.

    Two that open a new file at the same moment both want to change its journal.
    """
    end = time.monotonic() + LOCK_TIMEOUT
    while True:
        try:
            connection.execute(statement)
            return
        except sqlite3.OperationalError as error:
            if "locked" not in str(error) or time.monotonic() > end:
                raise
        time.sleep(0.005)


def _postgresql(url: URL, readonly: bool) -> Engine:
    try:
        engine = create_engine(url, connect_args={"connect_timeout": 10})
    except ModuleNotFoundError:
        raise DatabaseError("PostgreSQL needs a driver; install spook-tracker[postgresql]") from None
    return engine.execution_options(postgresql_readonly=True) if readonly else engine


def file_system(path: Path) -> str:
    """The type of the file system `path` lies on; empty where the system does not say."""
    device = (path if path.exists() else path.absolute().parent).stat().st_dev
    number = f"{os.major(device)}:{os.minor(device)}"
    try:
        mounts = Path("/proc/self/mountinfo").read_text(errors="replace").splitlines()
    except OSError:
        return ""
    types = [line.partition(" - ")[2].split(" ")[0] for line in mounts if line.split(" ")[2] == number]
    return types[-1] if types else ""


def is_file(url: URL) -> bool:
    """Whether the database is one file, not a server or memory."""
    return url.get_backend_name() == "sqlite" and url.database not in (None, "", ":memory:")


def _said(context: ExceptionContext) -> DatabaseError | None:
    """Whatever the driver raises, anywhere, as one sentence; what concurrent writers cause is for `record`."""
    if isinstance(context.sqlalchemy_exception, exc.IntegrityError):
        return None
    if context.engine is None or not isinstance(context.original_exception, Exception):
        return None
    return said_of(shown(context.engine.url), context.original_exception)


@contextmanager
def in_words(where: Engine | Session) -> Iterator[None]:
    """Whatever goes wrong in the database, as one sentence (DatabaseError)."""
    try:
        yield
    except (exc.SQLAlchemyError, sqlite3.Error, OSError) as error:
        engine = where if isinstance(where, Engine) else where.get_bind().engine
        name = shown(engine.url)
        raise said_of(name, error) from error


def said_of(name: str, error: Exception) -> DatabaseError:
    """What the driver raised as an error of ours."""
    said = sentence(name, error)
    return (DatabaseUnusable if " is damaged" in said else DatabaseError)(said)

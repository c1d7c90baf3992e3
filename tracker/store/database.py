"""The database as others hold it: opened at the newest schema, and asked what is wrong with it where an error says so."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import URL
from sqlalchemy.orm import Session as Session  # for those that hold one and know no SQLAlchemy

from .connection import database_url, in_words, is_file, shown
from .damage import told_of_damage
from .head import head
from .schema import one_writer, open_database, upgrade

__all__ = [
    "database_url",
    "head",
    "in_words",
    "one_writer",
    "open_database",
    "session_on",
    "shown",
    "upgrade",
]


def set_aside(url: str) -> Path | None:
    """Give the SQLite file of a database another name, which is returned; None if it is no such file."""
    place = database_url(url)
    file = Path(str(place.database))
    if not is_file(place) or not file.is_file():
        return None
    number = 1
    while (aside := file.with_name(f"{file.name}.set-aside-{number}")).exists():
        number += 1
    for end in ("", "-wal", "-shm"):
        if (part := file.with_name(file.name + end)).exists():
            part.rename(f"{aside}{end}")
    return aside


@contextmanager
def session_on(url: str | URL | None = None, readonly: bool = False) -> Iterator[Session]:
    """A session on the database at `url`, opened as `open_database` does, closed at the end."""
    with told_of_damage(url):
        engine = open_database(url, readonly)
        try:
            with Session(engine) as session:
                yield session
        finally:
            engine.dispose()

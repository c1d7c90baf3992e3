"""Whose fault an error is: what a damaged database makes of its contents is no defect of the program."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from spook_tracker.tracker.document.errors import DatabaseUnusable, TrackerError

from .reader import NONSENSE

if TYPE_CHECKING:
    from sqlalchemy import URL


@contextmanager
def told_of_damage(url: str | URL | None) -> Iterator[None]:
    """An error that nonsense could cause is asked about: DatabaseError, one sentence, if something is wrong there.

    Reading all of the database takes time, which is spent only where an error would end the command anyway.
    """
    try:
        yield
    except TrackerError:
        raise
    except NONSENSE as error:
        from .connection import database_url, shown

        place = database_url(url) if url is None or isinstance(url, str) else url
        fault = _fault(place)
        if fault is None:
            raise
        raise DatabaseUnusable(
            f"the database {shown(place)} is damaged: {fault:.300}; restore it from a copy (tracker db check says more)"
        ) from error


def _fault(url: URL) -> str | None:
    """The first thing that is wrong there, if anything is."""
    from .database_check import check
    from .schema import open_database

    try:
        engine = open_database(url, readonly=True)
        try:
            return next(iter(check(engine)), None)
        finally:
            engine.dispose()
    except TrackerError as error:
        return str(error)

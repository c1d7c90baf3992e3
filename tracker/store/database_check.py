"""Is everything as it should be? Pages, tables, references, and the sense of what they hold."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection, Engine, func, select, text
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import TrackerError

from . import models, rows
from .border import checked
from .connection import in_words
from .identity import identity
from .reader import NONSENSE
from .stored_runs import StoredRuns

SHOWN = 5  # of the faults of one kind


def check(engine: Engine) -> tuple[str, ...]:
    """What is wrong, a sentence each; empty if nothing is. Reads everything: takes time in proportion."""
    with in_words(engine):
        with engine.connect() as connection:
            damage = tuple(_damage(connection))
            if damage:
                return damage  # what a damaged file says about its contents means nothing
            faults = tuple(_told(_schema(connection), _references(connection), _identities(connection)))
        with Session(engine) as session:
            return (*faults, *_told(_documents(session)))


def _told(*kinds: Iterator[str]) -> Iterator[str]:
    """Their faults; what cannot even be looked at is one."""
    for faults in kinds:
        try:
            yield from faults
        except NONSENSE as error:
            yield f"something there cannot be read: {error!s:.200}"


def _damage(connection: Connection) -> Iterator[str]:
    if connection.dialect.name == "sqlite":
        for line in connection.execute(text("PRAGMA integrity_check")).scalars().fetchmany(SHOWN):
            if line != "ok":
                yield f"the file is damaged: {line}"


def _schema(connection: Connection) -> Iterator[str]:
    from .revisions import differences

    for difference in differences(connection)[:SHOWN]:
        yield f"the tables differ from the models: {difference!s:.200}"


def _references(connection: Connection) -> Iterator[str]:
    if connection.dialect.name == "sqlite":
        for row in connection.execute(text("PRAGMA foreign_key_check")).fetchmany(SHOWN):
            yield f"a row of {row[0]} refers to a row of {row[2]} that is not there"
    else:
        unproved = "SELECT conname FROM pg_constraint WHERE NOT convalidated"
        for name in connection.execute(text(unproved)).scalars():
            yield f"the constraint {name} has never been validated"
    listed = (
        select(models.SeriesList.id, models.SeriesList.length, func.count(models.SeriesListItem.position))
        .outerjoin(models.SeriesListItem, models.SeriesListItem.list_id == models.SeriesList.id)
        .group_by(models.SeriesList.id, models.SeriesList.length)
    )
    for list_id, length, count in connection.execute(listed):
        if length != count:
            yield f"the series list {list_id} has {count} of its {length} entries"


def _identities(connection: Connection) -> Iterator[str]:
    """An id is a hash of its content: content that was changed afterwards gives itself away."""
    contents = (
        ("series", select(models.Series.id, models.Series.key)),
        ("definition", select(models.Definition.id, models.Definition.body)),
        ("cards", select(models.TestCards.id, models.TestCards.body)),
        ("run", select(models.Run.key, models.Run.id)),
    )
    for kind, query in contents:
        for number, content in connection.execute(query):
            if number != identity(kind, content):
                yield f"the content of {kind} {number} was changed after it was stored"
    for row in connection.execute(select(models.EngineVersion.__table__)).mappings():
        if rows.engine_row(rows.engine_of(dict(row))) != dict(row):
            yield f"the engine version {row['version']!r} was changed after it was stored"
    for row in connection.execute(select(models.Machine.__table__)).mappings():
        if rows.machine_row(rows.machine_of(dict(row))) != dict(row):
            yield f"the machine {row['fingerprint']!r} was changed after it was stored"


def _documents(session: Session) -> Iterator[str]:
    history = StoredRuns(session)
    for run in history.runs():
        try:
            document = checked(history.document(run.id))
            if run.content not in ("", rows.content_of(document)):
                yield f"what was measured in the run {run.id!r} was changed after it was stored"
        except (TrackerError, OSError, *NONSENSE) as error:
            yield f"the run {run.id!r} cannot be read: {error!s:.200}"

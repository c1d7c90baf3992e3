"""How much is stored, and of what."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import Engine, func, select, text

from . import models
from .database import head, in_words, shown


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistics:
    """Contents of a database in numbers."""

    database: str  # without password
    revision: str  # of the schema
    size: int  # bytes on disk
    rows: dict[str, int]  # by table
    first: datetime | None  # start of the oldest run
    last: datetime | None  # start of the newest run
    engines: dict[str, int]  # runs by engine name


def statistics(engine: Engine) -> Statistics:
    """Count what is stored."""
    with in_words(engine), engine.connect() as connection:
        if engine.dialect.name == "sqlite":
            pages = connection.execute(text("PRAGMA page_count")).scalar_one()
            size = pages * connection.execute(text("PRAGMA page_size")).scalar_one()
        else:
            size = connection.execute(text("SELECT pg_database_size(current_database())")).scalar_one()
        tables = models.Base.metadata.sorted_tables
        rows = {
            table.name: connection.execute(select(func.count()).select_from(table)).scalar_one()
            for table in tables
        }
        first, last = connection.execute(
            select(func.min(models.Run.started_at), func.max(models.Run.started_at))
        ).one()
        by_engine = (
            select(models.EngineVersion.name, func.count())
            .join(models.Run, models.Run.engine_version_id == models.EngineVersion.id)
            .group_by(models.EngineVersion.name)
            .order_by(models.EngineVersion.name)
        )
        engines = {row[0]: row[1] for row in connection.execute(by_engine)}
    return Statistics(
        database=shown(engine.url),
        revision=head(),
        size=int(size),
        rows=rows,
        first=first,
        last=last,
        engines=engines,
    )

"""Revisions of the tables: Alembic without an .ini file, handed the connection it works on."""

from __future__ import annotations

from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection

from spook_tracker.tracker.resources import resource

from .models import Base
from .views import create_views, drop_views


def configuration(connection: Connection | None = None) -> Config:
    """What Alembic needs to know: where the revisions are, the models, the connection."""
    config = Config()
    config.set_main_option("script_location", str(resource("migrations")).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    config.attributes["connection"] = connection
    config.attributes["target_metadata"] = Base.metadata
    return config


def migrate(connection: Connection, target: str) -> None:
    """Upgrade to `target` inside the transaction of `connection`; at the newest revision the views are made.

    In an empty SQLite file the tables are made from the models at once, which is quicker; the tests hold both ways to
    the same tables. PostgreSQL goes by the revisions, which named a constraint otherwise than the models do.
    """
    empty = MigrationContext.configure(connection).get_current_revision() is None
    if empty and target == "head" and connection.dialect.name == "sqlite":
        Base.metadata.create_all(connection)
        command.stamp(configuration(connection), "head")
        create_views(connection)
        return
    drop_views(connection)
    command.upgrade(configuration(connection), target)
    reached = MigrationContext.configure(connection).get_current_revision()
    if reached == ScriptDirectory.from_config(configuration()).get_current_head():
        create_views(connection)


def revert(connection: Connection, target: str) -> None:
    """Downgrade to `target` ("base" or a revision) inside the transaction of `connection`."""
    drop_views(connection)
    command.downgrade(configuration(connection), target)


def differences(connection: Connection) -> list[object]:
    """Where the tables differ from the models; empty if they are the same."""
    context = MigrationContext.configure(connection, opts={"compare_type": True})
    return list(compare_metadata(context, Base.metadata))

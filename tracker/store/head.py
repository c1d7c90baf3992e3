"""The revisions of the schema, from the file names: reading them takes no time, importing Alembic does."""

from __future__ import annotations

from spook_tracker.tracker.resources import resource


def head() -> str:
    """The newest revision."""
    return known_revisions()[-1]


def known_revisions() -> list[str]:
    """All revisions, oldest first."""
    return sorted(
        path.name.partition("_")[0] for path in (resource("migrations") / "versions").glob("[0-9]*.py")
    )

"""Which engine a history is about, among those it has: the website tells of it first, and `latest` is its run."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from .wording import instant

if TYPE_CHECKING:
    from .run_document import Run


def about(runs: Sequence[Run]) -> str:
    """The engine of the newest run that has gates; imported runs, and engines only shown, stand back.

    `runs`, at least one, are as a history has them (tracker.store.versions.RunInfo).
    """
    own = [run for run in runs if run.trigger != "import"] or runs
    gating = [run for run in own if getattr(run, "gates", 1)] or own
    return max(gating, key=started).engine.name


def started(run: Run) -> datetime:
    """When a run began, for order; long ago where that cannot be read."""
    known: datetime | None = getattr(run, "started_at", None)
    return known or instant(run.started) or datetime.min.replace(tzinfo=UTC)

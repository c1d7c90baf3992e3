"""Take a run out of the history: one that was recorded in error, or that breaks what reads it."""

from __future__ import annotations

from sqlalchemy import delete
from sqlalchemy.orm import Session

from . import models
from .database import in_words, one_writer
from .versions import RunInfo

LARGE = (
    models.Sample, models.Evidence, models.Timing, models.Figure, models.StabilityMap, models.Trajectory,
)  # fmt: skip


def remove(session: Session, run: RunInfo) -> int:
    """Delete the run and everything measured in it, in one transaction. Returns the number of its samples.

    Definitions, cards, the engine's version and the machine stay: other runs may refer to them.
    """
    with in_words(session):
        one_writer(session)
        samples = 0
        for model in LARGE:
            here = delete(model).where(model.started_at == run.started_at, model.run_key == run.key)
            count: int = session.execute(here).rowcount  # type: ignore[attr-defined]
            samples += count if model is models.Sample else 0
        session.execute(delete(models.Run).where(models.Run.key == run.key))
        session.commit()
    return samples

"""The website from a real database: what is recorded is what is shown."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy.orm import Session

from spook_tracker.tracker.document.points import columns
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.website.nights import Records
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import DocumentHistory, document


def test_a_recorded_history_gives_the_same_pages_as_its_documents(tmp_path: Path) -> None:
    runs = [document(night, broken=4) for night in range(6)]
    engine = open_database(f"sqlite:///{tmp_path / 'nights.db'}")
    with Session(engine) as session:
        for run in runs:
            record(session, run)
    with Session(engine) as session:
        report = publish(History(session), tmp_path / "recorded")
    engine.dispose()
    publish(DocumentHistory(runs), tmp_path / "remembered")

    pages = sorted(
        path.relative_to(tmp_path / "recorded") for path in (tmp_path / "recorded").rglob("*.html")
    )
    assert report.written > 40
    for page in pages:
        assert (tmp_path / "recorded" / page).read_text() == (tmp_path / "remembered" / page).read_text(), (
            page
        )


def test_documents_are_read_in_as_few_stretches_and_lists_of_runs_as_a_database(tmp_path: Path) -> None:
    runs = [document(night, broken=4) for night in range(6)]
    engine = open_database(f"sqlite:///{tmp_path / 'nights.db'}")
    with Session(engine) as session:
        for run in runs:
            record(session, run)
        recorded = columns_of(History(session))
    engine.dispose()
    stretches, lists = columns_of(DocumentHistory(runs))

    assert (stretches, lists) == recorded
    assert min(stretches.values()) == 1 and max(stretches.values()) > 1 == lists


def columns_of(history: Records) -> tuple[dict[str, int], int]:
    """By series, in how many stretches its nights are told, and how many lists of runs all series have."""
    found = {key: columns(series.points) for key, series in history.series_of("spook").items()}
    return {key: len(points.said.each) for key, points in found.items()}, len(
        {p.runs for p in found.values()}
    )

"""The website from a real database: what is recorded is what is shown."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy.orm import Session

from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
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

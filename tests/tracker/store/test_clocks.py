"""Which run is tonight's is the run that was recorded, whatever some clock has said."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.library import record
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.transfer import import_files, write_document
from tests.histories.documents import definition, engine, run, sample

DATABASE = "sqlite:///tracker.db"


@pytest.fixture(autouse=True)
def _desk(monkeypatch: pytest.MonkeyPatch, toy_desk: None, in_process: None) -> None:
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", "summary.md")


def tracker(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments), prog_name="tracker")


def dated(ahead: timedelta, **more: object):
    """A night of another engine, begun so long after this moment."""
    return run(
        series=(definition("t/c/m"),),
        samples=(sample("t/c/m", 1.0),),
        started=(datetime.now(UTC) + ahead).isoformat(),
        finished=(datetime.now(UTC) + ahead).isoformat(),
        **more,
    )


@pytest.mark.parametrize("ahead", [timedelta(hours=20), timedelta(days=400)])
def test_a_night_tells_of_the_run_it_recorded(ahead: timedelta, monkeypatch: pytest.MonkeyPatch) -> None:
    record(dated(ahead, engine=engine(name="other")), DATABASE)
    monkeypatch.setenv("TOY_ERROR", "9.0")  # a red night

    done = tracker("ci", "night", "--quick", "--workers", "0")

    assert done.exit_code == 1, done.output
    assert "### toy 1.0.0" in Path("summary.md").read_text(), "the summary is of another run"
    page = Path("public/index.html").read_text()
    assert "toy 1.0.0" in page
    assert "failing" in Path("public/badge.svg").read_text() or "red" in Path("public/badge.json").read_text()


def test_what_is_dated_ahead_is_in_no_history_and_is_said() -> None:
    ahead, now = dated(timedelta(days=3)), dated(timedelta(hours=-1))
    for document in (ahead, now):
        record(document, DATABASE)

    with History.open(DATABASE) as history:
        assert [found.id for found in history.runs()] == [now.id]
        assert history.resolve("latest").id == now.id
        assert [point.run.id for point in history.series()["t/c/m"].points] == [now.id]
        assert history.document(ahead.id).samples == ahead.samples, "nothing is lost"
    shown = tracker("publish", "--out", "public")
    assert f"1 run is dated ahead of this clock and left out, such as {ahead.id}" in shown.stderr

    removed = tracker("db", "remove", ahead.id)

    assert removed.exit_code == 0
    assert "dated ahead" not in tracker("publish", "--out", "public").stderr


def test_a_clock_that_is_a_day_ahead_is_only_another_time_zone() -> None:
    document = dated(timedelta(hours=14))
    record(document, DATABASE)

    with History.open(DATABASE) as history:
        assert (history.resolve("latest").id, history.ahead) == (document.id, ())


def test_a_document_dated_ahead_is_refused_and_nothing_is_stored(tmp_path: Path) -> None:
    for number, document in enumerate((dated(timedelta(hours=-1)), dated(timedelta(days=2)))):
        write_document(document, tmp_path / f"{number}.json")

    with session_on(DATABASE) as session:
        with pytest.raises(DocumentError, match="more than a day ahead of this clock"):
            import_files(session, sorted(tmp_path.glob("*.json")))
        assert History(session).runs() == ()

"""What cannot be shown says so in its place, and everything else is published; a bad run can be taken out."""

import json
import sqlite3

import msgspec
import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.store.database import open_database, session_on
from spook_tracker.tracker.store.database_check import check
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.website import page_test
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import SEVEN, DocumentHistory, document


def test_a_page_that_fails_says_so_and_the_rest_is_published(tmp_path, monkeypatch):
    true = page_test.scenery

    def broken(scene):
        raise ValueError("a scene that <b>cannot</b> be drawn")

    publish(DocumentHistory([document(0)]), tmp_path / "sound")
    monkeypatch.setattr(page_test, "scenery", broken)
    report = publish(DocumentHistory([document(0)]), tmp_path / "public")
    page = (tmp_path / "public" / "tests" / "beam.html").read_text()

    assert [line.partition(":")[0] for line in report.failed] == [f"tests/{name}.html" for name in SEVEN]
    assert "ValueError: a scene that &lt;b&gt;cannot&lt;/b&gt; be drawn" in page
    assert "tracker db remove" in page
    names = {p.relative_to(tmp_path / "sound") for p in (tmp_path / "sound").rglob("*.html")}
    assert names == {p.relative_to(tmp_path / "public") for p in (tmp_path / "public").rglob("*.html")}
    monkeypatch.setattr(page_test, "scenery", true)
    assert publish(DocumentHistory([document(0)]), tmp_path / "public").failed == ()
    assert "could not be made" not in (tmp_path / "public" / "tests" / "beam.html").read_text()


IDS = ["a/b", "../../etc", "x,y", "0", " ", "#&=%", "run\n2", "é" * 90]


@pytest.fixture(scope="module")
def runs_of_any_name(tmp_path_factory):
    """The report and the folder of one website of runs with all these ids, between two with usual ones."""
    out = tmp_path_factory.mktemp("named") / "public"
    named = [msgspec.structs.replace(document(n), id=name) for n, name in enumerate(IDS, 1)]
    return publish(DocumentHistory([document(0), *named, document(len(IDS) + 1)]), out), out


@pytest.mark.parametrize("name", IDS)
def test_any_id_of_a_run_can_be_published(runs_of_any_name, name):
    report, out = runs_of_any_name

    assert report.failed == ()
    assert name in {night["run"] for night in json.loads((out / "data" / "nights.json").read_text())}
    assert {p.parent.name for p in out.rglob("*.html")} == {"public", "tests"}


WILD = [1e308, -1.7e308, 5e-324, 0.0, "inf", "nan"]


@pytest.mark.parametrize("values", [*([value] for value in WILD), WILD, WILD[::-1]])
def test_any_number_can_be_drawn(tmp_path, values):
    """Each alone everywhere, and all side by side: on neighbouring rungs of a ladder, too."""
    night, value = document(1), values[0]
    samples = [
        msgspec.structs.replace(s, value=Number(values[place % len(values)]))
        if "ladder" in s.series or "deviation" in s.series
        else s
        for place, s in enumerate(night.samples)
    ]
    figures = [
        msgspec.structs.replace(
            f,
            curves=tuple(
                msgspec.structs.replace(c, x=(1e-300, *c.x[1:]), y=(Number(value), *c.y[1:]))
                for c in f.curves
            ),
        )
        for f in night.figures
    ]
    wild = msgspec.structs.replace(night, samples=tuple(samples), figures=tuple(figures))

    assert publish(DocumentHistory([document(0), wild]), tmp_path / "public").failed == ()


def test_a_run_is_taken_out_with_everything_measured_in_it(tmp_path):
    url = f"sqlite:///{tmp_path}/t.db"
    with session_on(url) as session:
        for n in range(3):
            record(session, document(n))
    told = CliRunner().invoke(main, ["db", "remove", "run-spook-0001", "--db", url])

    assert told.exit_code == 0, told.output
    assert told.output.startswith("removed run run-spook-0001 of spook 0.1.1, 2025-10-02 03:17 UTC, with ")
    with session_on(url) as session:
        assert [run.id for run in History(session).runs()] == ["run-spook-0000", "run-spook-0002"]
    database = open_database(url, readonly=True)
    assert not check(database)
    database.dispose()
    with session_on(url) as session:
        assert record(session, document(1))  # and can come again
    assert CliRunner().invoke(main, ["db", "remove", "absent", "--db", url]).exit_code == 2


def test_the_database_is_offered_when_asked(tmp_path):
    url = f"sqlite:///{tmp_path}/t.db"
    with session_on(url) as session:
        record(session, document(0))
    out = tmp_path / "public"
    told = CliRunner().invoke(main, ["publish", "--with-database", "--out", str(out), "--db", url])

    assert told.exit_code == 0, told.output
    assert 'href="data/tracker.db"' in (out / "data.html").read_text()
    with History.open(f"sqlite:///{out}/data/tracker.db") as history:
        assert [run.id for run in history.runs()] == ["run-spook-0000"]
    opened = sqlite3.connect(out / "data" / "tracker.db")
    assert opened.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    opened.close()
    CliRunner().invoke(main, ["publish", "--out", str(out), "--db", url])
    assert not (out / "data" / "tracker.db").exists()
    assert "--with-database" in (out / "data.html").read_text()
    assert json.loads((out / "data" / "nights.json").read_text())[0]["run"] == "run-spook-0000"

"""Nights that overlap, and databases that are of no use: the history keeps every night, whole."""

from __future__ import annotations

import lzma
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.library import record
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.months import export_months
from tests.histories.documents import definition, run, sample
from tests.places import ROOT

yaml = pytest.importorskip("yaml", reason="PyYAML is not installed here")
from tests.team.workflow_service import Service  # noqa: E402 (needs yaml)

TRACK = ROOT / ".github" / "workflows" / "track.yml"
BRANCH = "tracker-history"


def night(day: int, value: float = 1.0, **more: object) -> RunDocument:
    return run(
        series=(definition("t/c/m"),), samples=(sample("t/c/m", value),),
        started=f"2026-10-{day:02}T03:00:00+00:00", **more,
    )  # fmt: skip


def months(folder: Path, *nights: RunDocument) -> Path:
    """The files of the months that a job with these runs hands over."""
    folder.mkdir(parents=True)
    database = f"sqlite:///{folder}.db"
    for document in nights:
        record(document, database)
    with History.open(database) as history:
        export_months(history, folder)
    return folder


class Kept:
    """The repository that the history's branch is in, and the job that writes there."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.origin = folder, folder / "origin.git"
        subprocess.run(["git", "init", "-q", "--bare", str(self.origin)], check=True)
        self.service = Service(self.origin, folder / "ci", folder)
        (folder / "ci").mkdir()
        said = yaml.safe_load(TRACK.read_text(encoding="utf-8"))
        self.job = said["jobs"]["keep"]
        self.alone = [name for name, job in said["jobs"].items() if "concurrency" in job]

    def keep(self, handed: Path) -> str:
        self.service.runs += 1
        self.service.artifacts["history"] = sorted(handed.glob("*.xz"))
        night = type("Ran", (), {"result": "success", "outputs": {}})()
        context = {
            "inputs": {"branch": BRANCH}, "github": {**self.service._github("schedule")}, "needs": {"night": night},
            "branch": "main",
        }  # fmt: skip
        ran = self.service._job("keep", self.job, context)
        assert ran.result == "success", ran.log
        return ran.log

    def lines(self) -> dict[str, list[bytes]]:
        names = subprocess.run(
            ["git", "ls-tree", "--name-only", BRANCH],
            cwd=self.origin,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        shown = {
            name: subprocess.run(
                ["git", "show", f"{BRANCH}:{name}"], cwd=self.origin, capture_output=True, check=True
            )
            for name in names
        }
        return {name: lzma.decompress(done.stdout).splitlines() for name, done in shown.items()}


@pytest.fixture
def kept(tmp_path: Path) -> Kept:
    return Kept(tmp_path)


def test_two_nights_that_overlap_keep_three_of_three(kept: Kept, tmp_path: Path) -> None:
    """Both began from the history with the first night alone; the second takes nothing away."""
    first, one, other = night(1), night(2), night(3)
    kept.keep(months(tmp_path / "first", first))

    kept.keep(months(tmp_path / "one", first, one))
    kept.keep(months(tmp_path / "other", first, other))

    (lines,) = kept.lines().values()
    assert [any(run.id.encode() in line for line in lines) for run in (first, one, other)] == [True] * 3
    assert len(lines) == 3
    assert lines == sorted(lines, key=lambda line: line[line.index(b'"started"') :]), "the oldest first"
    assert not kept.alone, "a night that waits for another is dropped for a third"


def test_a_push_that_comes_too_late_is_made_again(kept: Kept, tmp_path: Path) -> None:
    first, second = night(1), night(2)
    kept.keep(months(tmp_path / "first", first))
    hook = kept.origin / "hooks" / "pre-receive"
    hook.write_text(f"#!/bin/sh\n[ -e {tmp_path}/once ] || {{ touch {tmp_path}/once; exit 1; }}\n")
    hook.chmod(0o755)

    kept.keep(months(tmp_path / "second", first, second))

    assert (tmp_path / "once").exists()
    assert [len(lines) for lines in kept.lines().values()] == [2]


def test_what_a_night_hands_over_rewrites_nothing_that_is_kept(kept: Kept, tmp_path: Path) -> None:
    """A job that builds foreign code hands over months: they add runs, and change or remove none."""
    old, new = night(1, 1.0), night(2)
    kept.keep(months(tmp_path / "old", old))
    before = kept.lines()
    forged = night(1, 9.0, id=old.id, idempotency_key=old.idempotency_key)

    kept.keep(months(tmp_path / "forged", forged, new))
    kept.keep(months(tmp_path / "emptied", new))

    ((name, lines),) = kept.lines().items()
    assert lines[0] == before[name][0]
    assert len(lines) == 2


def test_a_file_that_is_no_month_is_not_kept(kept: Kept, tmp_path: Path) -> None:
    kept.keep(months(tmp_path / "first", night(1)))
    before = kept.lines()
    handed = months(tmp_path / "odd", night(2))
    (month,) = handed.glob("*.xz")
    month.rename(handed / "main.jsonl.xz")

    with pytest.raises(AssertionError, match=r"main\.jsonl\.xz is no month"):
        kept.keep(handed)
    assert kept.lines() == before


def test_a_history_that_gained_nothing_is_left_alone(kept: Kept, tmp_path: Path) -> None:
    handed = months(tmp_path / "first", night(1))
    kept.keep(handed)
    before = subprocess.run(
        ["git", "rev-parse", BRANCH], cwd=kept.origin, capture_output=True, check=True
    ).stdout

    kept.keep(handed)

    after = subprocess.run(
        ["git", "rev-parse", BRANCH], cwd=kept.origin, capture_output=True, check=True
    ).stdout
    assert after == before


def damaged(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[4096:] = b"\x5a" * (len(content) - 4096)
    file.write_bytes(content)


def no_database(file: Path) -> None:
    file.write_bytes(b"no database at all" * 100)


def of_a_later_tracker(file: Path) -> None:
    import sqlite3

    with sqlite3.connect(file) as connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")
    connection.close()


def of_another_program(file: Path) -> None:
    import sqlite3

    file.unlink()
    with sqlite3.connect(file) as connection:
        connection.execute("CREATE TABLE recipes (name)")
    connection.close()


def with_another_value(file: Path) -> None:
    import sqlite3

    with sqlite3.connect(file) as connection:
        connection.execute("UPDATE sample SET value = 7.0")
    connection.close()


USELESS = [damaged, no_database, of_a_later_tracker, of_another_program, with_another_value]


def ci(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Result:
    monkeypatch.chdir(folder)
    for name in ("TRACKER_DB", "GITHUB_STEP_SUMMARY", "GITHUB_ACTIONS"):
        monkeypatch.delenv(name, raising=False)
    toys = ["--engine", "toy_engine", "--catalogue", "toy_questions", "--workers", "0"]
    return CliRunner().invoke(main, ["ci", "night", "--quick", *toys], prog_name="tracker")


@pytest.mark.usefixtures("in_process", "toys")
@pytest.mark.parametrize("how", USELESS, ids=lambda how: how.__name__)
def test_a_database_of_no_use_stops_no_night_whose_history_is_whole(
    how: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    handed = months(tmp_path / "history", night(1), night(2))
    file = tmp_path / "tracker.db"
    (tmp_path / "history.db").rename(file)
    how(file)  # type: ignore[operator]
    before = file.read_bytes()

    done = ci(tmp_path, monkeypatch)

    assert done.exit_code == 0, done.output
    assert "it was moved to tracker.db.set-aside-1 and is built again from history" in done.stderr
    aside = (tmp_path / "tracker.db.set-aside-1").read_bytes()
    assert aside[100:] == before[100:], "nothing is lost"  # the header says how it was opened last
    with History.open("sqlite:///tracker.db") as history:
        assert len(history.runs()) == 3
        assert {point.sample.value for point in history.series()["t/c/m"].points} == {1.0}
    assert sum(len(lzma.decompress(file.read_bytes()).splitlines()) for file in handed.glob("*.xz")) == 3


def test_a_database_in_use_is_not_set_aside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sqlite3

    months(tmp_path / "history", night(1))
    (tmp_path / "history.db").rename(tmp_path / "tracker.db")
    monkeypatch.setattr("spook_tracker.tracker.store.connection.LOCK_TIMEOUT", 0.1)
    with sqlite3.connect(tmp_path / "tracker.db") as other:
        other.execute("BEGIN EXCLUSIVE")
        done = ci(tmp_path, monkeypatch)
        other.rollback()
    other.close()

    assert done.exit_code == 2
    assert "in use by another writer" in done.stderr
    assert not list(tmp_path.glob("*.set-aside*"))

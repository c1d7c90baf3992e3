"""Machines that are set otherwise: a clock that goes backwards, a decimal comma, a Turkish i, no UTF-8."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from spook_tracker.tracker import library
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record
from tests.histories.documents import engine, run_of
from tests.places import TOYS

COMMITS = [f"{number:x}" * 40 for number in range(1, 6)]
ASKED = """import locale
locale.setlocale(locale.LC_ALL, '')
from spook_tracker.tracker.cli.main import main
main(["run", "--workers", "0", "--json", "run.json"], standalone_mode=False)
main(["trend", "fall"])
"""


@pytest.mark.parametrize("last", [1.0, 5.0])
def test_a_clock_that_goes_backwards_changes_no_verdict(tmp_path: Path, last: float) -> None:
    """Nights of commits that build on each other, the newest with the oldest date: judged and published as ever."""
    told = []
    for name, days in (("forwards", (1, 2, 3, 4, 5)), ("backwards", (5, 4, 3, 2, 1))):
        url = f"sqlite:///{tmp_path}/{name}.db"
        opened = open_database(url)
        with Session(opened) as session:
            for place, (commit, day) in enumerate(zip(COMMITS, days, strict=True)):
                version = engine(
                    commit, parents=tuple(COMMITS[place - 1 : place]), commit_time=f"2026-01-0{day}T00:00:00Z"
                )
                value = last if commit == COMMITS[-1] else 1.0
                started, finished = (f"2026-01-0{day}T0{hour}:00:00Z" for hour in (2, 3))
                given = {"engine": version, "id": f"night {place}", "idempotency_key": f"{place}"}
                record(session, run_of({"a": value}, started=started, finished=finished, **given))
            history = History(session)
            findings = library.judge_run(history, "night 4")
            report = library.publish(history, tmp_path / name)
        opened.dispose()
        told.append(([(f.series, f.verdict, f.red) for f in findings], report.pages, report.failed))

    assert told[0] == told[1]
    assert any(red for _, _, red in told[0][0]) == (last == 5.0)


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Locales of this test's own, made by the C library's tools."""
    folder = tmp_path_factory.mktemp("locales")
    for name in ("de_DE", "tr_TR"):
        made = subprocess.run(
            ["localedef", "-i", name, "-f", "UTF-8", str(folder / f"{name}.UTF-8")],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert (folder / f"{name}.UTF-8").is_dir(), made.stderr
    return folder


def answered(folder: Path, **environment: str) -> str:
    """A run, its document and a comparison, where the machine speaks so."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    given = {k: v for k, v in os.environ.items() if not k.startswith(("TRACKER", "LC_", "LANG"))}
    given |= {
        "TRACKER_ENGINE": "toy_engine", "TRACKER_CATALOGUE": "toy_questions:CATALOGUE", "PYTHONPATH": str(TOYS),
        "COLUMNS": "120", **environment,
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", ASKED], cwd=folder, env=given, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr
    said = done.stdout.decode("utf-8", "replace")
    assert '"value": -5.04' in (folder / "run.json").read_text(encoding="utf-8")
    return "\n".join(line for line in said.splitlines() if "UTC" not in line and "202" not in line)


@pytest.mark.skipif(
    not Path("/usr/share/i18n/locales/tr_TR").exists(),
    reason="no sources of locales here; .ci/install-system installs them",
)
def test_numbers_and_names_are_the_same_in_every_language(places: Path, tmp_path: Path) -> None:
    plain = answered(tmp_path / "c", LC_ALL="C.UTF-8")

    assert "-0.05" in plain
    for name in ("de_DE", "tr_TR"):
        assert answered(tmp_path / name, LC_ALL=f"{name}.UTF-8", LOCPATH=str(places)) == plain


def test_without_utf_8_it_works_all_the_same(tmp_path: Path) -> None:
    said = answered(tmp_path / "posix", LC_ALL="POSIX", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0")

    assert "-0.05" in said

"""Engines and catalogues that an installed package announces as entry points: found by name, and whole or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from spook_tracker.engine.find import EngineMissing, find, known
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.json_form import decode
from spook_tracker.tracker.document.run_document import RunDocument
from tests.places import TOYS

POINTS = """[spook_tracker.engines]
ours = toy_engine
gone = of_a_team.gone:ENGINE
torn = of_a_team.torn:ENGINE

[spook_tracker.catalogues]
ours = toy_questions:CATALOGUE
torn = of_a_team.torn:CATALOGUE
"""


@pytest.fixture
def tracker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, in_process: None) -> Any:
    """The command where a package is installed that announces one good engine, one missing and one that is torn."""
    site = tmp_path / "site"
    (site / "of_a_team").mkdir(parents=True)
    (site / "of_a_team" / "__init__.py").touch()
    (site / "of_a_team" / "torn.py").write_text('raise RuntimeError("its library\\nis of another age")\n')
    about = site / "of_a_team-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: of_a_team\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(POINTS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(TOYS))
    monkeypatch.syspath_prepend(str(site))
    return lambda *arguments: CliRunner().invoke(main, list(arguments))


def test_an_engine_and_a_catalogue_that_are_announced_are_asked_by_name(tracker: Any, tmp_path: Path) -> None:
    done = tracker(
        "run",
        *("--engine", "ours", "--catalogue", "ours", "--workers", "0"),
        *("--json", "run.json", "--db", "sqlite:///tracker.db"),
    )

    assert done.exit_code in (0, 1), done.output
    assert decode((tmp_path / "run.json").read_bytes(), RunDocument).samples
    assert {"ours", "gone", "torn"} <= set(known())


def test_one_that_does_not_load_is_named_in_a_sentence(tracker: Any) -> None:
    with pytest.raises(EngineMissing, match=r"'torn' .*RuntimeError: its library is of another age"):
        find("torn")
    with pytest.raises(EngineMissing, match=r"'gone' .*of_a_team\.gone"):
        find("gone")
    done = tracker("run", "--engine", "ours", "--catalogue", "torn", "--no-record", "--workers", "0")
    assert done.exit_code == 2
    assert "'torn'" in done.stderr and "defect" not in done.stderr


def test_the_list_of_engines_goes_on_past_one_that_is_torn(tracker: Any) -> None:
    done = tracker("engines")

    assert done.exit_code == 0, done.output
    assert "torn" in done.output and "ours" in done.output


def test_a_run_of_several_leaves_it_out(tracker: Any, tmp_path: Path) -> None:
    done = tracker(
        "run",
        *("--engine", "torn,ours", "--catalogue", "ours", "--workers", "0"),
        *("--json", "run.json", "--db", "sqlite:///tracker.db"),
    )

    assert done.exit_code == 2, done.output
    assert "left out: " in done.stderr and "'torn'" in done.stderr
    assert decode((tmp_path / "run-ours.json").read_bytes(), RunDocument).samples

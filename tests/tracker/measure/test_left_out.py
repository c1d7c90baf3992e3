"""An engine that is not there costs no other the night."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.json_form import decode
from spook_tracker.tracker.document.run_document import RunDocument

TOY = ("--workers", "0", "--catalogue", "toy_questions:CATALOGUE")


@pytest.fixture
def tracker(desk: None, in_process: None) -> Any:
    return lambda *arguments: CliRunner().invoke(main, [*arguments, "--db", "sqlite:///tracker.db"])


@pytest.mark.parametrize("engines", ["toy_engine,no_such_engine", "no_such_engine,toy_engine"])
def test_a_run_of_several_goes_on_without_it_and_says_so(tracker: Any, tmp_path: Path, engines: str) -> None:
    """The file of the one that is asked for first is missing where that engine is."""
    done = tracker("run", "--engine", engines, "--json", "run.json", *TOY)

    assert done.exit_code == 2, done.output
    assert "left out: " in done.stderr and "no_such_engine" in done.stderr
    second = engines.endswith("toy_engine")
    written = tmp_path / ("run-toy_engine.json" if second else "run.json")
    assert decode(written.read_bytes(), RunDocument).samples


def test_a_night_goes_on_without_it_and_is_judged(tracker: Any, tmp_path: Path) -> None:
    done = tracker("nightly", "--quick", "--engine", "toy_engine,no_such_engine", "--out", "public", *TOY)

    assert done.exit_code == 0, done.output
    assert "left out: " in done.stderr and "no_such_engine" in done.stderr
    assert (tmp_path / "public" / "index.html").exists()


def test_alone_it_is_refused_as_ever(tracker: Any) -> None:
    done = tracker("run", "--engine", "no_such_engine", *TOY)

    assert done.exit_code == 2
    assert "left out" not in done.stderr and len(done.stderr.splitlines()) == 1

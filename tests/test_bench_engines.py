"""The page of all engines: counted gates, who is first, where ours is behind and why, from recorded runs."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest

import spook_tracker.tracker as tracker
from tests.synthetic_history import document, rival

THEIRS = msgspec.structs.replace(rival("3.1"), trigger="manual")
FILE = Path(__file__).parents[1] / "bench" / "engines.py"


@pytest.fixture(scope="module")
def engines() -> Any:
    spec = importlib.util.spec_from_file_location("engines_page", FILE)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["engines_page"] = module
    spec.loader.exec_module(module)
    return module


def test_the_page_says_who_is_first_and_why_we_are_behind(
    engines: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    for run in (document(0), THEIRS):
        tracker.record(run, database)
    causes = tmp_path / "causes.toml"
    monkeypatch.setattr(engines, "CAUSES", causes)

    assert "No cause found yet." in engines.page(database)

    causes.write_text(
        '[[behind]]\ntest = "pendulum"\nengines = ["rival"]\ncause = "order four"\ncure = "a composition"\n'
    )
    told = engines.page(database)
    assert "| spook | 7 | 0 | 0 | 0 |" in told
    assert "| rival | 5 | 1 | 0 | 1 |" in told, "a door too heavy, and friction is not supported"
    assert "Order four. A composition." in told
    assert "ours never" in told.partition("## Where another engine is first")[2]


def test_a_page_without_a_run_of_ours_is_refused(engines: Any, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    tracker.record(THEIRS, database)
    with pytest.raises(SystemExit, match="no run of ours"):
        engines.page(database)


def test_times_of_another_machine_are_not_set_against_ours(engines: Any, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    machine = msgspec.structs.replace(THEIRS.machine, fingerprint="another")
    for run in (document(0), msgspec.structs.replace(THEIRS, machine=machine)):
        tracker.record(run, database)
    told = engines.page(database)

    assert "not timed here: rival." in told
    assert "| rival | 5 | 1 | 0 | 1 |" in told, "its answers count wherever they were given"
    assert told.endswith("Nowhere.\n")


def test_the_published_page_and_the_causes_are_of_one_piece(engines: Any) -> None:
    """Wherever another engine leads there is a cause, and no cause is kept for what is no longer so."""
    told = engines.PAGE.read_text(encoding="utf-8").partition("## Where another engine is first")[2]
    lines = [line for line in told.splitlines() if line.startswith("- ")]

    assert lines
    assert not [line for line in lines if "No cause found yet" in line]
    for (test, engine), (cause, cure) in engines.causes().items():
        assert cause
        assert cure
        here = [line for line in lines if line.startswith(f"- **{test},") and f"**: {engine} in " in line]
        assert here, f"{test}: {engine} is first nowhere; take the cause out"


def test_rungs_that_were_out_of_time_are_counted_and_the_limit_told(engines: Any, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    slow = [
        sample.series for sample in THEIRS.samples if "/ladder:" in sample.series and "/h=" in sample.series
    ]
    why = {
        slow[0]: "the time limit of 0.5 s was reached before step 7",
        slow[1]: "not tried: at 0.1 s a step",
    }
    samples = tuple(
        msgspec.structs.replace(s, outcome="timed_out", failure=why[s.series]) if s.series in why else s
        for s in THEIRS.samples
    )
    for run in (document(0), msgspec.structs.replace(THEIRS, samples=samples)):
        tracker.record(run, database)
    (line,) = (
        line
        for line in engines.page(database).partition("## Rungs")[2].splitlines()
        if line.startswith("| rival |")
    )

    assert line.split(" | ")[2:4] == ["2", "0.5 s"]


def test_the_published_page_says_how_unequal_the_treatment_is_and_how_long_all_took(engines: Any) -> None:
    """Sums of the page's own rows."""
    text = engines.PAGE.read_text(encoding="utf-8")
    table = text.partition("## Rungs")[2].partition("\n## ")[0]
    rows = {
        cells[0]: cells[1:]
        for line in table.splitlines()
        if (cells := [cell.strip() for cell in line.strip("|").split("|")]) and line.endswith(" min |")
    }
    first = " ".join(text.partition("## Which engine")[0].split())

    late = sum(int(cells[1]) for name, cells in rows.items() if name != engines.OURS)
    assert f"Rungs that ran out of time: {late} of the others, {rows[engines.OURS][1]} of ours." in first
    assert f"a limit ({', '.join({c[2] for c in rows.values()} - {'-'})})," in first
    assert f"timed up to {engines.REPEATS.most} times, beyond 50 ms once. Ours has no limit" in first
    minutes = sum(float(cells[-1].removesuffix(" min")) for cells in rows.values())
    assert f"All nights together, the facts above not counted: {minutes:.1f} min." in table


def test_a_new_page_says_so_too(engines: Any, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    late = tuple(
        msgspec.structs.replace(s, outcome="timed_out", failure="the time limit of 0.5 s was reached")
        if "/ladder:" in s.series and "/h=" in s.series
        else s
        for s in THEIRS.samples
    )
    for run in (document(0), msgspec.structs.replace(THEIRS, samples=late)):
        tracker.record(run, database)
    told = " ".join(engines.page(database).split())

    assert "Of another engine a simulation has a limit (0.5 s), and so have those" in told
    count = sum(s.outcome == "timed_out" for s in late)
    assert count > 0
    assert f"Rungs that ran out of time: {count} of the others, 0 of ours." in told
    assert "All nights together, the facts above not counted: " in told

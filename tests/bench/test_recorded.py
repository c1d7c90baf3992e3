"""The recorded night of all engines: what the workflow measures, and how old what comes with the sources is."""

from __future__ import annotations

import lzma
import re
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bench import engines, recorded
from spook_tracker.tracker.measure.run import Interrupted
from spook_tracker.tracker.website.recorded import Files
from tests.histories.synthetic import document, rival
from tests.places import ROOT


def test_when_the_minutes_are_over_what_is_finished_is_recorded_and_who_is_left_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first engine's watch is what stops it; the second is not begun."""
    asked: list[str] = []
    kept: list[Any] = []

    def run(tests: Any, *, engine: str, watch: Any, **budget: Any) -> Any:
        asked.append(engine)
        try:
            watch(None)
        except KeyboardInterrupt:
            raise Interrupted(document(0), 3) from None
        raise AssertionError("the minutes are over, and its watch lets it go on")

    monkeypatch.setattr(engines.tracker, "run", run)
    monkeypatch.setattr(engines.tracker, "record", lambda run, database: kept.append(run))
    clock = iter([0.0, 1.0, 99.0, 99.0, 99.0, 99.0])
    monkeypatch.setattr(engines.time, "monotonic", lambda: next(clock))
    engines.measure(["spook", "rival"], "unused", "unused", 0.5, ["pendulum"], minutes=1.0)

    assert asked == ["spook"] and len(kept) == 1
    assert "not asked: rival" in capsys.readouterr().out


def test_definitions_are_found_without_measuring_and_one_that_changed_is_stale() -> None:
    """The catalogue's own are those of today; with another hash, or a test that is gone, they are not."""
    now = recorded.asked_now()
    ladders = [d for d in now if d.kind == "ladder"]
    night = msgspec.structs.replace(document(0), series=tuple(now))

    assert {d.test for d in now} == set(recorded.CATALOGUE) and len(ladders) > 500
    assert recorded.stale(Files((night,)), now) == ()
    changed = msgspec.structs.replace(ladders[0], test_version="before")
    gone = msgspec.structs.replace(ladders[1], key="gone/plain/x", test="gone")
    old = msgspec.structs.replace(night, series=(*now[1:], changed, gone))
    assert recorded.stale(Files((old, rival("3"))), now) == (ladders[0].test, "gone")


def test_the_recorded_night_asks_what_the_catalogue_asks() -> None:
    """A few changed tests are left out of the website by name; when they are too many, they have to be asked anew."""
    files = recorded.recorded.read_files(recorded.FOLDER)
    old = recorded.stale(files, recorded.asked_now())
    asked = {d.test for run in files.night if run.engine.name == recorded.OURS for d in run.series}

    assert len(old) <= recorded.MOST_STALE * len(asked), recorded.CURE.format(" ".join(old))
    assert len({run.engine.name for run in files.night}) > 1
    assert {one.engine for one in files.occasions} == {run.engine.name for run in files.night}
    assert all(not (run.figures or run.maps or run.trajectories) for run in (*files.night, *files.releases))
    assert sum(file.stat().st_size for file in recorded.FOLDER.iterdir()) <= 4_000_000


def test_no_recorded_file_names_a_place_of_the_machine() -> None:
    for file in sorted(recorded.FOLDER.iterdir()):
        content = lzma.decompress(file.read_bytes()) if file.suffix == ".xz" else file.read_bytes()
        assert re.findall(rb"(?<![\w./:~-])/\w[\w.-]*/[\w./-]+", content) == [], file.name


def test_the_workflow_measures_all_engines_beside_the_night_and_shows_the_newest_such_night() -> None:
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed here")
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "nightly.yml").read_text())["jobs"]
    steps = jobs["engines"]["steps"]
    shell = "\n".join(step.get("run", "") for step in steps)
    (saved,) = [step["with"] for step in steps if "cache/save" in step.get("uses", "")]
    (found,) = [step["with"] for step in jobs["nightly"]["steps"] if "cache/restore" in step.get("uses", "")]
    night = "\n".join(step.get("run", "") for step in jobs["nightly"]["steps"])

    assert "make engines BUDGET=40" in shell and "make engine-releases" in shell
    assert jobs["engines"]["timeout-minutes"] > 40 and jobs["engines"]["permissions"] == {"contents": "read"}
    assert not any("engines" in job.get("needs", ()) for job in jobs.values()), (
        "the night waits for none of them"
    )
    assert saved["path"] == found["path"] == "build/recorded"
    assert saved["key"] == found["key"] and found["key"].startswith(found["restore-keys"])
    assert '--recorded "$recorded"' in night and "recorded=bench/recorded" in night

"""Backfill: releases in order, what cannot be had is named, what changed is told with its release."""

from __future__ import annotations

from pathlib import Path
from subprocess import CompletedProcess

import pytest

import spook_tracker.tracker.cli.releases as command
import spook_tracker.tracker.measure.releases as releases
from spook_tracker.tracker.library import record
from tests.run_documents import engine, run_of

KEY = "falling_object/rk4/position_error/h=0.0166667"


def test_releases_come_oldest_first_and_unknown_ones_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def pip(*arguments: str) -> CompletedProcess[str]:
        assert arguments == ("index", "versions", "mujoco")
        return CompletedProcess([], 0, "mujoco (3.4.0)\nAvailable versions: 3.4.0, 3.3.7, 3.3.0\n", "")

    monkeypatch.setattr(releases, "_pip", pip)
    known = releases.released("mujoco")

    assert known == ("3.3.0", "3.3.7", "3.4.0")
    assert releases.choose(known, (), 2) == ("3.3.7", "3.4.0")
    assert releases.choose(known, ("3.4.0", "3.3.0"), None) == ("3.3.0", "3.4.0")
    with pytest.raises(releases.ReleaseError, match=r"no release '9\.9'.*newest is 3\.4\.0"):
        releases.choose(known, ("9.9",), None)
    with pytest.raises(releases.ReleaseError, match="not known"):
        releases.released("spook")


def test_a_release_that_cannot_be_installed_or_started_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(
        releases, "_pip", lambda *a: CompletedProcess([], 1, "", "x\nno wheel for this Python\n")
    )
    with pytest.raises(releases.ReleaseError, match=r"mujoco==1\.0 cannot be installed: no wheel"):
        releases.install("mujoco", "1.0", tmp_path)

    asked: list[tuple[str, ...]] = []

    def pip(*arguments: str) -> CompletedProcess[str]:
        asked.append(arguments)
        return CompletedProcess([], 0, "", "")

    monkeypatch.setattr(releases, "_pip", pip)
    monkeypatch.setattr(
        releases, "_python", lambda *a, **o: CompletedProcess([], 1, "", "ImportError: numpy\n")
    )
    with pytest.raises(releases.ReleaseError, match="does not start: ImportError: numpy"):
        releases.install("mujoco", "1.0", tmp_path)
    assert [arguments[-1] for arguments in asked] == ["mujoco==1.0", "numpy<2"]


def test_every_change_is_told_with_its_release(tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/history.db"
    for day, (version, value) in enumerate([("1.0", 0.5), ("1.1", 0.5 + 1e-9), ("1.2", 0.25)], start=1):
        built = engine("", name="other", version=version, commit_time="", parents=())
        started = f"2026-01-0{day}T00:00:00+00:00"
        record(run_of({KEY: value}, engine=built, started=started, finished=started), database)

    told = command.changes(database, "other", ["1.0", "1.1", "1.2"])

    assert told[0] == "other 1.1 after 1.0: no changes"
    assert told[1] == "other 1.2 after 1.1: 1 changes"
    assert KEY in told[2]
    assert "0.5 -> 0.25" in told[2]

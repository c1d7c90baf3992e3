"""`make past`: the planted commit is the same one every time, so that what is built of it serves again."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

import bench.past as bench_past


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository with the lines that the mutant changes, some commits and a merge after them."""
    folder = tmp_path / "root"
    git(tmp_path, "init", "-q", "-b", "main", str(folder))
    for file, old, _ in bench_past.MUTANT.changes:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(f"{old}\n")
    git(folder, "add", "-A")
    git(folder, "commit", "-qm", "Begin")
    for number in range(4):
        written(folder, f"{number}")
    git(folder, "checkout", "-qb", "side")
    written(folder, "side")
    git(folder, "checkout", "-q", "main")
    written(folder, "main")
    git(folder, "merge", "-q", "--no-ff", "-m", "Merge", "side")
    monkeypatch.setattr(bench_past, "ROOT", folder)
    return folder


def git(place: Path, *arguments: str) -> None:
    who = ("-c", "user.name=A", "-c", "user.email=a@example.org")
    subprocess.run(["git", *who, *arguments], cwd=place, check=True, capture_output=True)


def written(place: Path, name: str) -> None:
    (place / name).write_text(name)
    git(place, "add", "-A")
    git(place, "commit", "-qm", f"Write {name}")


@pytest.mark.parametrize("count", [2, 100])
def test_a_commit_is_planted_in_the_middle_and_is_the_same_every_time(
    root: Path, tmp_path: Path, count: int
) -> None:
    once = bench_past.planted(tmp_path, count)
    again = bench_past.planted(tmp_path, count)

    assert once == again
    place, good, wrong = once
    later = bench_past.said(place, "rev-list", "--first-parent", f"{good}..HEAD").split()
    assert wrong in later
    assert len(later) == min(count, 7)
    for file, _, new in bench_past.MUTANT.changes:
        assert new in bench_past.said(place, "show", f"HEAD:{file}")
        assert new not in bench_past.said(place, "show", f"{good}:{file}")
    assert bench_past.said(place, "ls-tree", "--name-only", "HEAD").split() == [
        *("0", "1", "2", "3"), "engine", "main", "side",
    ]  # fmt: skip

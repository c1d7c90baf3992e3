"""A build says what it was built from, and says so when it does not know."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from spook_tracker.engine.build_info import _version
from tests.places import ROOT

NATIVE = ROOT / "engine" / "native"
KNOWN = {
    "version": "",
    "git_hash": "0123456789abcdef",
    "dirty": "false",
    "describe": "",
    "shallow": "false",
    "count": "17",
}


def test_a_version_is_given_counted_or_unknown_but_never_guessed() -> None:
    assert _version(KNOWN | {"version": "1.2"}) == "1.2"
    assert _version(KNOWN) == "0.1.dev17+g012345678"
    assert _version(KNOWN | {"dirty": "true"}) == "0.1.dev17+g012345678.dirty"
    assert _version(KNOWN | {"describe": "v1.4-0-g012345678"}) == "1.4"
    assert _version(KNOWN | {"describe": "v1.4-3-g012345678"}) == "1.4.post3+g012345678"
    assert _version(KNOWN | {"shallow": "true", "count": "1"}) == "0+shallow.g012345678"
    assert _version(KNOWN | {"shallow": "", "count": ""}) == "0+archive.g012345678"
    assert _version(KNOWN | {"git_hash": "", "shallow": "", "count": ""}) == "0+unknown"


def git(folder: Path, *arguments: str) -> str:
    identity = (
        "-c",
        "user.name=Ada Example",
        "-c",
        "user.email=ada@example.org",
        "-c",
        "commit.gpgsign=false",
    )
    command = ["git", *identity, "-C", str(folder), *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def facts(folder: Path) -> dict[str, str]:
    """What the build script finds out about the sources in that folder."""
    output = folder.parent / f"{folder.name}.inc"
    subprocess.run(
        [
            str(shutil.which("cmake")),
            f"-DGIT={shutil.which('git')}",
            f"-DSOURCE={folder / 'engine' / 'native'}",
            f"-DOUTPUT={output}",
            "-P",
            str(NATIVE / "build_info.cmake"),
        ],
        check=True,
        capture_output=True,
    )
    lines = [line.split(" ", 2) for line in output.read_text().splitlines()]
    return {name.removeprefix("SPOOK_").lower(): text.strip('"') for _, name, text in lines}


@pytest.mark.skipif(not (shutil.which("cmake") and shutil.which("git")), reason="needs cmake and git")
def test_clones_and_archives_are_told_apart(tmp_path: Path) -> None:
    full = tmp_path / "full"
    (full / "engine" / "native").mkdir(parents=True)
    (full / "engine" / "native" / "CMakeLists.txt").write_text("1")
    (full / ".source-archive").write_text("node: $Format:%H$\n")
    git(tmp_path, "init", "-q", str(full))
    for content in ("1", "2"):
        (full / "engine" / "native" / "CMakeLists.txt").write_text(content)
        git(full, "add", ".")
        git(full, "commit", "-qm", content)
    head = git(full, "rev-parse", "HEAD")

    known = facts(full)
    assert (known["git_hash"], known["dirty"], known["count"], known["shallow"]) == (
        head,
        "false",
        "2",
        "false",
    )
    assert known["parents"] == git(full, "rev-parse", "HEAD~1")

    (full / "engine" / "native" / "CMakeLists.txt").write_text("3")
    assert facts(full)["dirty"] == "true"

    shallow = tmp_path / "shallow"
    git(tmp_path, "clone", "-q", "--depth=1", full.as_uri(), str(shallow))
    assert (facts(shallow)["git_hash"], facts(shallow)["shallow"]) == (head, "true")

    archive = tmp_path / "archive"
    shutil.copytree(shallow, archive, ignore=shutil.ignore_patterns(".git"))
    unknown = facts(archive)
    assert unknown["git_hash"] == unknown["dirty"] == unknown["commit_time"] == ""

    (archive / ".source-archive").write_text(f"node: {head}\n")
    assert (facts(archive)["git_hash"], facts(archive)["dirty"]) == (head, "")

    # An archive made by the build backend holds engine/ one deeper, and says all that it knows.
    deeper = tmp_path / "deeper" / "spook_tracker"
    shutil.copytree(archive / "engine", deeper / "engine")
    told = f"node: {head}\ntime: 2026-11-21T03:17:00+00:00\nparents: {head} {head}\nchanged: true\n"
    (deeper.parent / ".source-archive").write_text(told)
    assert facts(deeper) | {
        "git_hash": head, "commit_time": "2026-11-21T03:17:00+00:00", "parents": f"{head} {head}", "dirty": "true",
    } == facts(deeper)  # fmt: skip

    # An unpacked archive inside another repository must not borrow that repository's commit.
    inside = full / "third_party"
    shutil.copytree(archive, inside)
    (inside / ".source-archive").unlink()
    assert facts(inside)["git_hash"] == ""

"""Commits by name, checked out into clones; and what today's engine of this project answers to an old commit's questions.

A clone shares the repository's objects; the repository itself is left alone. How commits are built and asked is said
in tracker.toml (tracker/measure/builds.py).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Mapping, Sequence
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import spook_tracker
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.json_form import decode
from spook_tracker.tracker.document.run_document import RunDocument

PACKAGE = "spook_tracker"
NATIVE = Path("engine/native")
OURS = ("engine", "scalar_tests", "tracker", "migrations", "site")


class CommitError(TrackerError):
    """A commit cannot be found, built or asked; one sentence that says which and why."""


def repository_at(folder: Path) -> Path:
    """The repository around a folder that holds this project's engine. Raises CommitError."""
    done = _run(["git", "-C", str(folder), "rev-parse", "--show-toplevel"])
    place = Path(done.stdout.strip()) if done.returncode == 0 else None
    if place is None or not (place / NATIVE / "CMakeLists.txt").exists():
        raise CommitError(f"{folder} is in no repository of the engine; call this inside a clone of it")
    return place


def full_hash(repository: Path, name: str) -> str:
    """The commit a name stands for. Raises CommitError."""
    done = _run(
        [
            "git",
            "-C",
            str(repository),
            "rev-parse",
            "--verify",
            "-q",
            "--end-of-options",
            f"{name}^{{commit}}",
        ]
    )
    if done.returncode:
        raise CommitError(f"git knows no commit {name!r}; name a hash, a tag or a branch")
    return done.stdout.strip()


def commits_named(repository: Path, names: Sequence[str]) -> list[str]:
    """The commits that names and ranges (A..B) stand for, ancestors first. Raises CommitError."""
    found: set[str] = set()
    for name in names:
        start, dots, end = name.partition("..")
        if not dots:
            found.add(full_hash(repository, name))
            continue
        ends = [full_hash(repository, end or "HEAD"), "^" + full_hash(repository, start)]
        found.update(_run(["git", "-C", str(repository), "rev-list", *ends]).stdout.split())
    listed = (
        _run(["git", "-C", str(repository), "rev-list", "--topo-order", "--reverse", *sorted(found)])
        if found
        else None
    )
    return [commit for commit in (listed.stdout.split() if listed else ()) if commit in found]


def subject(repository: Path, commit: str) -> str:
    """The first line of a commit's message, and who wrote it."""
    return _run(["git", "-C", str(repository), "show", "-s", "--format=%s (%an)", commit]).stdout.strip()


def checked_out(repository: Path, commit: str, folder: Path) -> Path:
    """The folder with that commit, not built; what is there already is used again. Raises CommitError."""
    place = folder / commit[:12]
    if not (place / "scalar_tests").is_dir():
        check_out(repository, commit, place)
    return place


def check_out(repository: Path, commit: str, place: Path) -> None:
    """Make the folder `place` a clone with that commit, whatever was there. Raises CommitError."""
    shutil.rmtree(place, ignore_errors=True)
    place.parent.mkdir(parents=True, exist_ok=True)
    clone = ["git", "clone", "-q", "--shared", "--no-checkout", str(repository), str(place)]
    for command in (clone, ["git", "-C", str(place), "checkout", "-q", "--detach", commit]):
        _must(command, f"commit {commit[:12]} cannot be checked out")


def ask_today(place: Path, tests: Sequence[str], *options: str) -> RunDocument:
    """What today's engine answers to the questions of a checkout, which need not be built. Raises CommitError.

    Today's tracker asks where the old catalogue still fits it, else that of then. `options` are those of
    `tracker run`.
    """
    reasons = []
    for whose, tracker in (("today's tracker", None), ("the tracker of then", place)):
        file = place / "old.json"
        file.unlink(missing_ok=True)
        search = _with_old_questions(place, tracker)
        done = call(search, "run", *tests, "--no-record", "--json", str(file), *options)
        if done.returncode in (0, 1) and file.exists():
            return decode(file.read_bytes(), RunDocument)
        reasons.append(f"by {whose}: {last_words(done.stderr)}")
    raise CommitError(
        f"today's engine does not answer the questions of {place.name}, asked " + "; ".join(reasons)
    )


def call(search: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The tracker of a folder with that folder's engine, in a process of its own."""
    # -S leaves out the finder of an editable install, here and in the worker processes it starts.
    path = os.pathsep.join([str(search), sysconfig.get_path("purelib")])
    environment = {**os.environ, "PYTHONPATH": path}
    module = (
        PACKAGE if (search / PACKAGE).exists() else "tracker"
    )  # before the package its rooms lay at the top
    return _run([sys.executable, "-S", "-m", module, *arguments], cwd=search, env=environment)


def _with_old_questions(place: Path, tracker: Path | None) -> Path:
    """A folder in which the package is today's, but for the questions, and the tracker if another is given."""
    older = {} if tracker is None else {name: tracker / name for name in ("tracker", "migrations", "site")}
    mixed = _mixed(place / "old", {"scalar_tests": place / "scalar_tests", **older})
    engine = mixed / PACKAGE / "engine"
    beside = (
        Path(sysconfig.get_path("purelib")) / PACKAGE / "engine"
    )  # an editable install keeps what it built there
    compiled = [file for suffix in EXTENSION_SUFFIXES for file in beside.glob(f"*{suffix}")]
    if compiled and beside.resolve() != engine.resolve():
        files = list(engine.resolve().iterdir())
        engine.unlink()
        engine.mkdir()
        for file in (*files, *compiled):
            if not (engine / file.name).exists():
                (engine / file.name).symlink_to(file)
    return mixed


def _mixed(folder: Path, others: Mapping[str, Path]) -> Path:
    """A folder in which the package is today's, but for the rooms that are given."""
    today = Path(spook_tracker.__file__).parent
    package = folder / PACKAGE
    shutil.rmtree(folder, ignore_errors=True)
    package.mkdir(parents=True)
    for file in today.glob("*.py"):
        shutil.copy(file, package)
    for name in OURS:
        (package / name).symlink_to(others.get(name, today / name).resolve())
    return folder


def _must(command: list[str], complaint: str) -> None:
    done = _run(command)
    if done.returncode:
        raise CommitError(f"{complaint}: {last_words(done.stderr or done.stdout)}")


def _run(command: list[str], **where: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, errors="replace", check=False, **where)  # type: ignore[call-overload,no-any-return]


def last_words(text: str) -> str:
    """The line in which a program says what is wrong: the last with the word error, else the last."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    telling = [line for line in lines if "error" in line.lower()] or lines
    return telling[-1][:200] if telling else "it said nothing"

"""What the git repository at hand knows: names of commits and their order. Nothing, if there is none."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Iterable
from pathlib import Path

HASH = re.compile(r"[0-9a-f]{40}|[0-9a-f]{64}")


def _git(repository: Path, *arguments: str, lines: Iterable[str] = ()) -> str | None:
    """Output of git, by argument list and never through a shell; None if it fails or is not there."""
    try:
        done = subprocess.run(
            ["git", "-C", str(repository), *arguments],
            input="\n".join(lines),
            capture_output=True,
            text=True,
            errors="replace",
            timeout=20,
            check=False,
        )
    except (OSError, ValueError, subprocess.TimeoutExpired):  # ValueError: NUL in a name
        return None
    return done.stdout if done.returncode == 0 else None


def commit(repository: Path, name: str) -> str | None:
    """The full hash that a tag (before a branch, before anything else git understands) stands for."""
    for reference in (f"refs/tags/{name}", name):
        found = _git(
            repository, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{reference}^{{commit}}"
        )
        if found and HASH.fullmatch(found.strip()):
            return found.strip()
    return None


def tags(repository: Path) -> dict[str, str]:
    """Tag name to the full hash of its commit."""
    listed = _git(
        repository, "for-each-ref", "--format=%(objectname) %(*objectname) %(refname:strip=2)", "refs/tags"
    )
    found = {}
    for line in (listed or "").splitlines():
        direct, peeled, name = line.split(" ", 2)
        found[name] = peeled or direct
    return found


def merge_base(repository: Path, commit: str) -> str:
    """The commit at which a commit leaves the main line; empty where git cannot tell.

    The main line is the branch that a pull request is for, as the CI service says, else main or master.
    """
    told = os.environ.get("CI_MERGE_REQUEST_DIFF_BASE_SHA", "")
    asked = os.environ.get("GITHUB_BASE_REF") or os.environ.get("CI_MERGE_REQUEST_TARGET_BRANCH_NAME")
    names = [f"origin/{asked}", asked] if asked else ["origin/main", "main", "origin/master", "master"]
    names = [told, *names] if HASH.fullmatch(told) else names
    for name in names if HASH.fullmatch(commit) else ():
        base = _git(repository, "merge-base", "--end-of-options", name, commit)
        if base and HASH.fullmatch(base.strip()):
            return base.strip()
    return ""


def fork_point(repository: Path, commit: str) -> set[str]:
    """The commits of the main line that a commit builds on; empty where git cannot tell."""
    base = merge_base(repository, commit)
    return set((_git(repository, "rev-list", base) or "").split()) if base else set()


def order(repository: Path, hashes: Iterable[str]) -> list[str]:
    """Those of `hashes` that git knows, ancestors first."""
    wanted = {text for text in hashes if HASH.fullmatch(text)}
    listed = _git(
        repository,
        "rev-list",
        "--topo-order",
        "--reverse",
        "--ignore-missing",
        "--stdin",
        lines=sorted(wanted),
    )
    return [text for text in (listed or "").splitlines() if text in wanted]

"""What the repository at hand says of a commit: its subject, its author, and whether the files are still its own."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

HASH = re.compile(r"[0-9a-f]{40}|[0-9a-f]{64}")
MOST = 500  # characters of a subject or a name


def subject_and_author(git_hash: str, folders: Sequence[Path]) -> tuple[str, str]:
    """Both from the first of these folders whose repository knows the commit; empty if none does."""
    if not HASH.fullmatch(git_hash):
        return "", ""
    for folder in folders:
        try:
            told = subprocess.run(
                ["git", "-C", str(folder), "show", "--no-patch", "--format=%s%x00%an", git_hash, "--"],
                capture_output=True, text=True, encoding="utf-8", errors="replace", timeout=20, check=False,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired):
            continue
        if told.returncode == 0:
            subject, _, author = told.stdout.strip("\n").partition("\0")
            return subject[:MOST], author[:MOST]
    return "", ""


def changed_since(git_hash: str, folders: Sequence[Path]) -> bool:
    """Whether tracked files in one of these folders differ from that commit.

    Python runs from the working tree while the commit was written down when the core was built: between the two,
    answers must not be recorded as that commit's. False where no repository knows the commit (an installed wheel).
    """
    if not HASH.fullmatch(git_hash):
        return False
    return any(
        _git(folder, "cat-file", "-e", f"{git_hash}^{{commit}}") == 0
        and _git(folder, "diff", "--quiet", git_hash, "--", ".") == 1
        for folder in folders
    )


def _git(folder: Path, *arguments: str) -> int | None:
    try:
        return subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, timeout=20, check=False
        ).returncode
    except (OSError, subprocess.TimeoutExpired):
        return None

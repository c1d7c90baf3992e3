"""What the repository at hand says of a commit: the first line of its message, and who wrote it."""

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

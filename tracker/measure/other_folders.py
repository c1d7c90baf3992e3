"""What lies around a file of another tool: asv's folders as asv leaves them, and the repository one stands in."""

from __future__ import annotations

import json
import re
import subprocess
from functools import lru_cache
from pathlib import Path
from typing import Any

from spook_tracker.tracker.document.errors import DocumentError

from .other_tools import Beside

ABOUT = ("benchmarks.json", "machine.json", "asv.conf.json")
SETTING = r'^\s*"{}"\s*:\s*"([^"]*)"'  # asv.conf.json has comments, so that json cannot read it


def files_in(folder: Path) -> tuple[Path, ...]:
    """The result files of an asv repository, of its results or of one machine's; else every JSON file in a folder.

    Where it has none, those of the folders in it: asv and pytest-benchmark keep one for each machine. DocumentError if
    there are none either.
    """
    root = folder / (_setting(folder / "asv.conf.json", "results_dir") or "results")
    inside = root if (folder / "asv.conf.json").is_file() and root.is_dir() else folder
    deep = "**/*.json" if inside is root or (inside / "benchmarks.json").is_file() else "*.json"
    for pattern in (deep, "*/*.json"):
        if found := sorted(file for file in inside.glob(pattern) if file.name not in ABOUT):
            break
    else:
        raise DocumentError(f"{folder} holds no JSON files of runs; name the folder they are in")
    return tuple(found)


def beside(file: Path, engine: str, machine: str, branch: str) -> Beside:
    """What the files of asv around a result file say, and what the caller says."""
    results = file.parent.parent
    return Beside(
        engine=engine,
        machine=machine,
        branch=branch,
        commits=_commits(branch, Path.cwd()) if branch else {},
        project=_setting(results.parent / "asv.conf.json", "project"),
        benchmarks=_benchmarks(results / "benchmarks.json"),
    )


@lru_cache(maxsize=8)
def _commits(branch: str, here: Path) -> dict[str, bool]:
    """The commits that the repository around `here` knows, and whether each lies on the branch; none without a repository."""

    def those(*words: str) -> list[str]:
        done = subprocess.run(
            ["git", "-C", str(here), "rev-list", *words, "--"], capture_output=True, text=True, check=False
        )
        return done.stdout.split() if done.returncode == 0 else []

    on_it = those(branch) or those(f"origin/{branch}")
    return dict.fromkeys(those("--all"), False) | dict.fromkeys(on_it, True) if on_it else {}


@lru_cache(maxsize=8)
def _benchmarks(file: Path) -> dict[str, Any]:
    try:
        said = json.loads(file.read_bytes())
    except (OSError, ValueError):
        return {}
    return (
        {name: one for name, one in said.items() if isinstance(one, dict)} if isinstance(said, dict) else {}
    )


@lru_cache(maxsize=8)
def _setting(file: Path, name: str) -> str:
    try:
        found = re.search(SETTING.format(name), file.read_text(), re.MULTILINE)
    except (OSError, ValueError):
        return ""
    return found[1] if found else ""

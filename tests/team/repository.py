"""A team's repository made of examples/pebble: as many commits as wanted, some wrong, some that do not build."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.places import ROOT

EXAMPLE = ROOT / "examples" / "pebble"
AUTHOR = ("-c", "user.name=Ada Example", "-c", "user.email=ada@example.org")
GRAVITY = "velocities[p] += time_step * gravity[p % 3];"
BUILD = "mkdir -p build && c++ -O1 -shared -fPIC -o build/libpebble.so src/pebble.cpp"
needs_compiler = pytest.mark.skipif(shutil.which("c++") is None, reason="no C++ compiler here")
SETTINGS = f"""engine = "tracking.adapter"
catalogue = "tracking.questions"
database = "sqlite:///history.db"

[build]
command = "{BUILD}"
"""


def git(folder: Path, *words: str) -> str:
    """What git prints, asked in `folder`; a commit has an author, whatever the machine is set up for."""
    done = subprocess.run(["git", *AUTHOR, *words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


class Pebble:
    """The repository, and its commits in order."""

    def __init__(self, folder: Path, settings: str = SETTINGS) -> None:
        self.folder = folder
        shutil.copytree(
            EXAMPLE, folder, ignore=shutil.ignore_patterns("build", "public", "__pycache__", "*.db*")
        )
        (folder / ".gitignore").write_text("build/\n__pycache__/\n*.db*\n.tracker-commits/\n")
        self.source = folder / "src" / "pebble.cpp"
        self.right = self.source.read_text()
        assert GRAVITY in self.right
        (folder / "tracker.toml").write_text(settings)
        git(folder, "init", "-q", "-b", "main")
        self.commits: list[str] = []

    def commit(self, subject: str, gravity: str = GRAVITY, files: Mapping[str, str] | None = None) -> str:
        """One more, in which the velocity is updated so; `files` are written as well."""
        text = self.right.replace(GRAVITY, gravity)
        self.source.write_text(f"{text}// {subject} {len(self.commits)}\n")
        for name, content in (files or {}).items():
            (self.folder / name).write_text(content)
        git(self.folder, "add", "-A")
        git(self.folder, "commit", "-q", "-m", subject)
        self.commits.append(git(self.folder, "rev-parse", "HEAD"))
        return self.commits[-1]

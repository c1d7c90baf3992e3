"""A checkout in which symbolic links became text files says so in one sentence, and what it says cures it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from tests.places import ROOT


def ask(folder: Path) -> subprocess.CompletedProcess[str]:
    """A name that lies behind a link, in a process that knows no installed package."""
    command = [sys.executable, "-S", "-c", "from spook_tracker.engine import NAME; print(NAME)"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_a_checkout_without_links_says_so_and_how_to_mend_it(tmp_path: Path) -> None:
    def git(*words: str) -> None:
        subprocess.run(
            ["git", "-c", "user.name=a", "-c", "user.email=a@b.c", *words], cwd=tmp_path, check=True
        )

    (tmp_path / "spook_tracker").mkdir()
    (tmp_path / "spook_tracker/__init__.py").write_bytes((ROOT / "spook_tracker/__init__.py").read_bytes())
    (tmp_path / "engine").mkdir()
    (tmp_path / "engine/__init__.py").write_text("NAME = 'here'\n")
    (tmp_path / "spook_tracker/engine").symlink_to("../engine")
    git("init", "-q")
    git("add", "-A")
    git("commit", "-qm", "as it is kept")
    assert ask(tmp_path).stdout == "here\n"
    git("config", "core.symlinks", "false")
    (tmp_path / "spook_tracker/engine").unlink()
    git("checkout-index", "-f", "-a")
    assert (tmp_path / "spook_tracker/engine").read_text() == "../engine"

    refused = ask(tmp_path)

    assert refused.returncode == 1
    assert refused.stderr.splitlines()[-1].startswith("ImportError: spook_tracker/engine is no folder")
    (cure,) = re.findall(r"`(git [^`]+)`", refused.stderr.splitlines()[-1])
    subprocess.run(cure, shell=True, cwd=tmp_path, check=True)
    assert ask(tmp_path).stdout == "here\n"

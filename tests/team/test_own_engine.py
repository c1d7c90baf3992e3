"""A team's own engine in C++, in a repository of its own: examples/pebble, from the empty folder to its table."""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.places import ROOT
from tests.team.repository import git

EXAMPLE = ROOT / "examples" / "pebble"
CMAKE = shutil.which("cmake", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")


def called(folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("TRACKER")}
    return subprocess.run(
        command, cwd=folder, env=environment | {"COLUMNS": "120"}, capture_output=True, text=True, check=False
    )


def tracker(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return called(folder, sys.executable, "-m", "spook_tracker", *words)


@pytest.fixture(scope="module")
def repository(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example as a repository with one commit and its engine built."""
    if CMAKE is None:
        pytest.skip("CMake is not installed here")
    folder = tmp_path_factory.mktemp("team") / "pebble"
    shutil.copytree(EXAMPLE, folder, ignore=shutil.ignore_patterns("build", "__pycache__", "history.db*"))
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-q", "-m", "Throw stones")
    for words in (("-S", ".", "-B", "build"), ("--build", "build")):
        done = called(folder, CMAKE, *words)
        assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def night(repository: Path) -> dict[str, object]:
    """A question of theirs, one of ours, one its engine cannot be asked, and one whose limits our method alone owes.

    Everything else is said by tracker.toml. It is a first night, and it is green.
    """
    asked = ("throw", "falling_object", "door", "hanging_chain")
    done = tracker(repository, "run", *asked, "--json", "run.json")
    assert done.returncode == 0, done.stderr
    assert "throw" in done.stdout
    assert "door: " not in done.stderr, "what it cannot do is not told as red"
    return json.loads((repository / "run.json").read_text())


def test_their_engine_answers_with_what_its_method_gives(night: dict) -> None:
    """The symplectic step comes ½ v h less high than v²/(2 g): 100 steps of 0.01 s, summed by hand."""
    values = {s["series"]: s["value"] for s in night["samples"]}
    top = 9.81 * 1.0 - 9.81 * 0.01**2 * (100 * 101 / 2)

    assert values["throw/default/height_error/h=0.01"] == pytest.approx(top - 9.81 / 2, abs=1e-12)


def test_a_limit_of_their_own_takes_the_place_of_the_printed_one(night: dict) -> None:
    series = {s["key"]: s for s in night["series"]}
    held = next(s for key, s in series.items() if key.startswith("falling_object/default/position_error/"))

    assert (held["limit"], held["limit_source"], held["role"]) == (2.0, "tracker.toml", "gate")


def test_the_run_knows_their_commit(repository: Path, night: dict) -> None:
    assert night["engine"]["name"] == "pebble"
    assert night["engine"]["git_hash"] == git(repository, "rev-parse", "HEAD")
    assert not night["engine"]["dirty"]
    assert night["engine"]["subject"] == "Throw stones"


def test_every_command_reads_the_settings_wherever_in_the_repository_one_stands(
    repository: Path, night: dict
) -> None:
    inside = repository / "src"

    told = tracker(inside, "trend", "throw")
    published = tracker(inside, "publish", "--out", str(repository / "public"))

    assert told.returncode == 0, told.stderr
    assert "height_error" in told.stdout
    assert (repository / "history.db").is_file()
    assert not (inside / "tracker.db").exists()
    assert published.returncode == 0, published.stderr
    page = (repository / "public" / "index.html").read_text(encoding="utf-8")
    assert "Pebble, every night" in page
    assert 'href="https://example.org/pebble"' in page
    assert "SPOOK tracker" not in page


def test_the_adapter_is_as_short_as_its_documents_say() -> None:
    """Lines with a statement on them, imports and docstring apart."""
    tree = ast.parse((EXAMPLE / "tracking" / "adapter.py").read_text(encoding="utf-8"))
    lines = {
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.stmt) and not isinstance(node, ast.Import | ast.ImportFrom)
    }
    settings = [line for line in (EXAMPLE / "tracker.toml").read_text().splitlines() if line.strip()]

    assert len(lines) <= 15
    assert len(settings) <= 9

"""What CONTRIBUTING says of the first hour in the core is so."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
NATIVE = ROOT / "engine/native"
SECTION = (ROOT / "CONTRIBUTING.md").read_text().split("## The first hour in the core")[1].split("\n## ")[0]


def test_every_file_it_names_is_there() -> None:
    named = re.findall(r"`(engine/[\w./]+)`", SECTION)

    assert len(named) > 8
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_a_new_solver_touches_the_files_that_are_said() -> None:
    """The hybrid one is found in those, and nowhere else in the engine."""
    solver = SECTION.split("look for `hybrid`")[1].split("\n- ")[0]
    sources = [*(ROOT / "engine").rglob("*.py"), *(NATIVE / "src").rglob("*.[ch]pp")]
    found = {
        path.relative_to(ROOT).as_posix()
        for path in sources
        if re.search(r"\bhybrid\b|\bsolve_hybrid\b", path.read_text())
    }

    assert set(re.findall(r"`(engine/[\w./]+)`", solver)) == found
    assert (
        f"named in {['no', 'one', 'two', 'three', 'four', 'five', 'six', 'seven'][len(found)]} files"
        in SECTION
    )


def test_clangd_finds_how_every_source_is_compiled() -> None:
    listed = ROOT / "build/compile_commands.json"
    if not listed.exists():
        pytest.skip("not built by make develop")
    compiled = {Path(entry["file"]).resolve() for entry in json.loads(listed.read_text())}

    assert compiled >= {path.resolve() for path in (NATIVE / "src").rglob("*.cpp")}

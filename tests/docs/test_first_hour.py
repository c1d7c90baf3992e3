"""What CONTRIBUTING says of the first hour in the core is so."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.places import ROOT

NATIVE = ROOT / "engine/native"
SECTION = (ROOT / "CONTRIBUTING.md").read_text().split("## The first hour in the core")[1].split("\n## ")[0]


def test_every_file_it_names_is_there() -> None:
    named = re.findall(r"`(engine/[\w./]+)`", SECTION)

    assert len(named) > 8
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_a_new_solver_touches_the_files_that_are_said() -> None:
    """The one by iterations is found in those, and nowhere else in what steps rigid bodies."""
    said = re.findall(
        r"`(engine/[\w./]+)`", SECTION.split("One that a scene can ask for")[1].split("\n- ")[0]
    )
    names_it = r"SolverKind::|Stage::solve_iterative|Solver::iterative|SPOOK_NAMED_ENUM\(Solver"
    sources = [
        path for room in ("contacts", "rigid", "run") for path in (NATIVE / "src" / room).rglob("*.?pp")
    ]
    found = {path.relative_to(ROOT).as_posix() for path in sources if re.search(names_it, path.read_text())}

    assert found | {"engine/method.py"} == set(said) and len(said) == len(set(said))


def test_clangd_finds_how_every_source_is_compiled() -> None:
    listed = ROOT / "build/compile_commands.json"
    if not listed.exists():
        pytest.skip("not built by make develop")
    compiled = {Path(entry["file"]).resolve() for entry in json.loads(listed.read_text())}

    assert compiled >= {path.resolve() for path in (NATIVE / "src").rglob("*.cpp")}

"""The rooms of the code keep to themselves: every import contract is shown to bite.

A contract that names a module wrongly is kept for ever. So an import that each of them forbids is planted in a
copy of the sources, and the check must name it.
"""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

import pytest

from tests.places import ROOT

SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())
CONTRACTS = {contract["name"]: contract for contract in SETTINGS["tool"]["importlinter"]["contracts"]}
PLANTED = {  # contract: where a forbidden import is planted, and what it imports
    "the tracker asks scalar tests, scalar tests ask the engine": [
        ("engine", "spook_tracker.scalar_tests.case"),
        ("engine", "spook_tracker.tracker.resources"),
        ("scalar_tests", "spook_tracker.tracker.document"),
    ],
    "the rooms of the tracker have one direction": [
        ("tracker/document", "spook_tracker.tracker.judge"),
        ("tracker/measure", "spook_tracker.tracker.store"),
        ("tracker/measure", "spook_tracker.tracker.judge"),
        ("tracker/judge", "spook_tracker.tracker.measure"),
        ("tracker/judge", "spook_tracker.tracker.store"),
        ("tracker/judge", "spook_tracker.tracker.website"),
        ("tracker/store", "spook_tracker.tracker.judge"),
        ("tracker/website", "spook_tracker.tracker.cli"),
    ],
    "the website shows what was measured and does not measure": [
        ("tracker/website", "spook_tracker.tracker.measure"),
    ],
    "only measuring and the command line know scalar tests and the engine": [
        ("tracker/document", "spook_tracker.engine"),
        ("tracker/store", "spook_tracker.scalar_tests"),
        ("tracker/judge", "spook_tracker.engine"),
        ("tracker/website", "spook_tracker.scalar_tests"),
    ],
    "only the store speaks to databases": [
        (room, module)
        for room in ("engine", "scalar_tests", "tracker/document", "tracker/measure", "tracker/judge")
        for module in ("sqlalchemy", "alembic")
    ] + [("tracker/website", "sqlalchemy"), ("tracker/cli", "sqlalchemy")]
    + [(f"tracker/{door}.py", "sqlalchemy") for door in ("library", "past", "resources")],
    "only the website draws": [
        (room, module)
        for room in ("engine", "scalar_tests", "tracker/document", "tracker/measure", "tracker/store")
        for module in ("jinja2", "plotly")
    ] + [("tracker/judge", "jinja2"), ("tracker/cli", "jinja2")]
    + [(f"tracker/{door}.py", "jinja2") for door in ("library", "past", "resources")],
    "what measures, keeps or judges knows no addresses": [
        (f"tracker/{room}", "spook_tracker.tracker.document.addresses") for room in ("judge", "measure", "store")
    ],
    "the engine needs NumPy at most": [("engine", "scipy"), ("engine", "msgspec")],
    "scalar tests need NumPy and SciPy at most": [("scalar_tests", "pandas"), ("scalar_tests", "rich")],
    "only the command line reads arguments and writes to terminals": [
        (f"tracker/{room}", module)
        for room in ("document", "measure", "store", "judge", "website")
        for module in ("click", "rich")
    ] + [(f"tracker/{door}.py", "click") for door in ("library", "past", "resources")],
}  # fmt: skip


def test_every_contract_has_an_import_that_breaks_it() -> None:
    assert set(CONTRACTS) == set(PLANTED)


def test_every_dependency_is_kept_out_of_the_engine_but_numpy() -> None:
    """A dependency added later is forbidden there as well, or this fails; so is what only an extra brings."""
    extras = SETTINGS["project"]["optional-dependencies"]
    named = [*SETTINGS["project"]["dependencies"], *extras["standard"], "pandas>", "plotly>"]
    wanted = {line.partition(">")[0].partition("[")[0] for line in named}
    wanted -= {"nanobind-backend"}  # what the binary itself is linked with

    assert set(CONTRACTS["the engine needs NumPy at most"]["forbidden_modules"]) == wanted - {"numpy"}
    assert set(CONTRACTS["scalar tests need NumPy and SciPy at most"]["forbidden_modules"]) == wanted - {
        "numpy",
        "scipy",
    }


def checked(folder: Path) -> str:
    """What the check says of the sources in `folder`; the installed ones must not come before them."""
    code = "import sys; sys.path[:0] = sys.argv[1:3]; from importlinter.cli import lint_imports; "
    code += "sys.exit(lint_imports(no_cache=True))"
    command = [sys.executable, "-S", "-c", code, str(folder), sysconfig.get_path("purelib")]
    wide = os.environ | {"COLUMNS": "400"}
    done = subprocess.run(command, cwd=folder, env=wide, capture_output=True, text=True, check=False)
    assert "broken." in done.stdout, done.stdout + done.stderr
    assert (done.returncode == 0) == (" 0 broken." in done.stdout)
    return done.stdout


def test_a_forbidden_import_breaks_its_contract(tmp_path: Path) -> None:
    only = shutil.ignore_patterns("native", "__pycache__", "site", "*.so")
    shutil.copytree(ROOT / "spook_tracker", tmp_path / "spook_tracker", ignore=only)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    number = 0
    names: dict[str, list[tuple[str, str]]] = {}
    for contract, plants in PLANTED.items():
        for room, module in plants:
            place = tmp_path / "spook_tracker" / room
            if place.suffix == ".py":  # into a door that stands open beside the rooms
                name = place.stem
                place.write_text(f"{place.read_text()}\nimport {module}\n")
            else:
                name = f"planted_{number}"
                (place / f"{name}.py").write_text(f"import {module}\n")
            names.setdefault(contract, []).append((name, module))
            number += 1

    told = checked(tmp_path)

    assert f"Contracts: 0 kept, {len(CONTRACTS)} broken." in told
    parts = re.split(r"\n(.+)\n-{3,}\n", told[told.index("Broken contracts") :])
    broken = dict(zip(parts[1::2], parts[2::2], strict=True))
    for contract, planted in names.items():
        for name, module in planted:
            assert re.search(rf"{name} -> {module}\b", broken[contract]), (contract, name, module)


def test_revisions_of_the_tables_import_nothing_of_ours() -> None:
    """They are frozen while the models move on."""
    allowed = {"__future__", "alembic", "collections", "contextlib", "hashlib", "json", "sqlalchemy"}
    for path in sorted((ROOT / "migrations").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                assert {alias.name.split(".")[0] for alias in node.names} <= allowed, path
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0 and (node.module or "").split(".")[0] in allowed, path


def test_every_door_of_the_tracker_is_in_the_contracts() -> None:
    """Modules beside the rooms: a contract over the rooms does not see them."""
    doors = {f"spook_tracker.tracker.{path.stem}" for path in (ROOT / "tracker").glob("*.py")} - {
        "spook_tracker.tracker.__init__"
    }

    for name in ("only the store speaks to databases", "only the website draws"):
        assert doors <= set(CONTRACTS[name]["source_modules"]), name
    assert doors <= set(
        CONTRACTS["only the command line reads arguments and writes to terminals"]["source_modules"]
    )


@pytest.mark.parametrize("room", ["judge", "store", "measure"])
def test_rooms_that_know_no_addresses_write_none(room: str) -> None:
    """The contract holds what asks for an address; none is made up in a text either."""
    files = (ROOT / "tracker" / room).glob("*.py")

    assert [path.name for path in files if ".html" in path.read_text()] == []

"""What builds the engine is what the list names, by hash: a planted constraint is obeyed, a planted archive refused.

pip gives the constraints of what is installed (PIP_CONSTRAINT) to no build, so builds have a list of their own.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from tests.places import ROOT

LIST = ROOT / ".ci" / "build-constraints.txt"
LINE = re.compile(r"([A-Za-z0-9-]+)==([\w.]+)((?: --hash=sha256:[0-9a-f]{64})+)")
BACKEND = """
import importlib.metadata, zipfile
def build_wheel(folder, settings=None, metadata=None):
    version = importlib.metadata.version("planted")
    name = f"built-{version}-py3-none-any.whl"
    with zipfile.ZipFile(f"{folder}/{name}", "w") as wheel:
        info = f"built-{version}.dist-info"
        wheel.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\\nName: built\\nVersion: {version}\\n")
        wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\\nGenerator: x\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n")
        wheel.writestr(f"{info}/RECORD", "")
    return name
"""
PROJECT = """
[build-system]
requires = ["planted>=1"]
build-backend = "backend"
backend-path = ["."]
[project]
name = "built"
dynamic = ["version"]
"""


def planted(folder: Path, version: str) -> str:
    """A package that can be asked for its version; returns the hash of its archive."""
    file = folder / f"planted-{version}-py3-none-any.whl"
    info = f"planted-{version}.dist-info"
    with zipfile.ZipFile(file, "w") as wheel:
        wheel.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: planted\nVersion: {version}\n")
        wheel.writestr(
            f"{info}/WHEEL", "Wheel-Version: 1.0\nGenerator: x\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        wheel.writestr(f"{info}/RECORD", "")
    return hashlib.sha256(file.read_bytes()).hexdigest()


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A project, and two versions of what builds it."""
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / "pyproject.toml").write_text(PROJECT)
    (tmp_path / "project" / "backend.py").write_text(BACKEND)
    (tmp_path / ".ci").mkdir()
    (tmp_path / ".ci" / "constraints.txt").write_text("planted==1.0\n")
    return tmp_path


def by_ci_run() -> str:
    """The line of .ci/run that says what pip obeys."""
    (line,) = re.findall(r"^export .*PIP_CONSTRAINT=.*$", (ROOT / ".ci" / "run").read_text(), re.MULTILINE)
    return str(line)


def by_make() -> str:
    """The same of the Makefile."""
    (line,) = re.findall(
        r"^export (PIP_BUILD_CONSTRAINT) \?= \$\(CURDIR\)(/.*)$", (ROOT / "Makefile").read_text(), re.M
    )
    return f'export {line[0]}="$PWD{line[1]}"'


def by_the_container_of_a_release() -> str:
    """The same of cibuildwheel's container, which has the project in a folder of its own and nothing of our environment."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["cibuildwheel"]
    assert settings["build-frontend"] == "pip"  # what others install for a build, pip does not take for one
    ((name, value),) = settings["linux"]["environment"].items()
    return f'export {name}="{value.replace("/project", "$PWD")}"'


def built(desk: Path, settings: str) -> subprocess.CompletedProcess[str]:
    pip = f'"{sys.executable}" -m pip wheel -q --no-index --find-links . --no-deps -w out ./project'
    own = {name: value for name, value in os.environ.items() if not name.startswith("PIP_")}
    return subprocess.run(
        ["sh", "-c", f"{settings}\n{pip}"], cwd=desk, env=own, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize(
    "settings", [by_ci_run, by_make, by_the_container_of_a_release], ids=lambda one: one.__name__
)
def test_each_way_to_build_names_the_list(settings, desk: Path) -> None:
    told = subprocess.run(
        ["sh", "-c", f'{settings()}\necho "$PIP_BUILD_CONSTRAINT"'],
        cwd=desk,
        env={},
        capture_output=True,
        text=True,
    )

    assert told.stdout == f"{desk}/.ci/{LIST.name}\n"


def test_a_planted_constraint_is_obeyed_and_a_planted_archive_refused(desk: Path) -> None:
    good, _ = planted(desk, "1.0"), planted(desk, "2.0")
    (desk / ".ci" / LIST.name).write_text(f"planted==1.0 --hash=sha256:{good}\n")

    done = built(desk, by_ci_run())

    assert done.returncode == 0, done.stderr
    assert [file.name for file in (desk / "out").iterdir()] == ["built-1.0-py3-none-any.whl"]
    (desk / ".ci" / LIST.name).write_text(f"planted==1.0 --hash=sha256:{'0' * 64}\n")
    refused = built(desk, by_ci_run())
    assert refused.returncode != 0
    assert "DO NOT MATCH THE HASHES" in refused.stderr


def test_constraints_of_what_is_installed_reach_no_build(desk: Path) -> None:
    """Why there is another list."""
    planted(desk, "1.0"), planted(desk, "2.0")

    done = built(desk, 'export PIP_CONSTRAINT="$PWD/.ci/constraints.txt"')

    assert done.returncode == 0, done.stderr
    assert [file.name for file in (desk / "out").iterdir()] == ["built-2.0-py3-none-any.whl"]


def test_everything_that_builds_is_listed_with_its_hash_and_as_it_is_installed() -> None:
    lines = [line for line in LIST.read_text().splitlines() if not line.startswith("#")]
    listed = {found[1]: found[2] for found in map(LINE.fullmatch, lines) if found}
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    installed = dict(line.split("==") for line in (ROOT / ".ci" / "constraints.txt").read_text().split())

    assert len(listed) == len(lines), "a line without a version or a hash"
    assert {re.split("[<>=]", one)[0] for one in wanted} | {"cmake", "ninja"} <= set(listed)
    same = {name.replace("_", "-"): version for name, version in installed.items()}
    assert {name: same.get(name, version) for name, version in listed.items()} == listed


@pytest.mark.parametrize("file", [*sorted((ROOT / ".github" / "workflows").glob("*.yml")), ROOT / "action.yml"],
                         ids=lambda file: file.name)  # fmt: skip
def test_whatever_says_what_is_installed_says_what_builds(file: Path) -> None:
    text = file.read_text(encoding="utf-8")

    assert len(re.findall(r"^ +PIP_CONSTRAINT:", text, re.M)) == len(
        re.findall(r"^ +PIP_BUILD_CONSTRAINT:", text, re.M)
    )

"""The house rules that a reader would otherwise have to trust."""

from __future__ import annotations

import ast
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import engine
import scalar_tests
from scalar_tests.catalogue import CATALOGUE

ROOT = Path(__file__).parent.parent
PYTHON_FILES = sorted(
    path for package in ("engine", "scalar_tests", "tracker") for path in (ROOT / package).rglob("*.py")
)


def test_site_holds_data_only() -> None:
    """A .py file under site/ could shadow the standard library's module of that name."""
    assert list((ROOT / "site").rglob("*.py")) == []


def test_only_the_engine_touches_its_binary() -> None:
    """import-linter cannot name a binary module, so this guards engine._core."""
    outside = [path for path in PYTHON_FILES if path.parent.name != "engine" and "_core" in path.read_text()]

    assert outside == []


def test_all_names_of_the_engine_exist_and_are_public() -> None:
    assert len(engine.__all__) == len(set(engine.__all__))
    for name in engine.__all__:
        assert hasattr(engine, name)
        assert not name.startswith("_")


def test_the_catalogue_lists_every_scalar_test() -> None:
    """A file whose module has a TEST is a scalar test, and must be in the table."""
    files = {
        module.name
        for module in pkgutil.iter_modules(scalar_tests.__path__)
        if re.search(r"^TEST\b", (ROOT / "scalar_tests" / f"{module.name}.py").read_text(), re.MULTILINE)
    }

    assert set(CATALOGUE) == files


def test_every_path_in_the_architecture_exists() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text()
    paths = re.findall(r"`([\w.-]+(?:/[\w.-]*)+)`", text)

    missing = [path for path in paths if not (ROOT / path).exists()]

    assert len(paths) > 20
    assert missing == []


def test_every_public_function_has_a_docstring() -> None:
    without = []
    for path in PYTHON_FILES:
        if not path.name.startswith("_") or path.name == "__init__.py":
            tree = ast.parse(path.read_text())
            nodes: list[ast.AST] = [tree, *tree.body]
            without += [
                f"{path.relative_to(ROOT)}:{getattr(node, 'name', 'module')}"
                for node in nodes
                if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef)
                and not getattr(node, "name", "module").startswith("_")
                and ast.get_docstring(node) is None
                and path.read_text().strip()
            ]

    trivial = [name for name in without if re.search(r"engine/(observe|bodies|shapes|joints|forces)\.py", name)]
    assert sorted(set(without) - set(trivial)) == []


def test_no_file_names_the_machine_it_was_written_on() -> None:
    names = subprocess.run(
        ["git", "ls-files", "*.py", "*.md", "*.cpp", "*.hpp", "*.toml", "*.yml", "Makefile"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    ).stdout.split()
    if not names:
        pytest.skip("not a git checkout")

    guilty = [n for n in names if re.search(r"(^|[^\w.])/(home|root|work)/\w", (ROOT / n).read_text())]

    assert guilty == []


def test_help_is_quick_because_it_imports_nothing_heavy() -> None:
    """`tracker --help` must not pay for pandas, SciPy, SQLAlchemy or Plotly."""
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "tracker", "--help"], capture_output=True, text=True, cwd=ROOT
    )

    assert done.returncode == 0
    for heavy in ("numpy", "pandas", "scipy", "sqlalchemy", "plotly", "rich", "jinja2", "engine"):
        assert not re.search(rf"\| +{heavy}\b", done.stderr), heavy

"""The documentation as a site: it builds, what it tells to type runs, and what is made from the code is complete."""

from __future__ import annotations

import importlib.util
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from sqlalchemy import text
from sqlalchemy.orm import Session

from spook_tracker.engine import joints, theory
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.store import models
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.views import ABOUT
from tests.histories.documents import run
from tests.places import ROOT
from tests.website.browser import look, wait_for

DOCS = ROOT / "docs"


def blocks(page: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)


def generated() -> Any:
    spec = importlib.util.spec_from_file_location("reference_pages", DOCS / "reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_tutorial_runs_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("TRACKER_DB", raising=False)
    page = (DOCS / "tutorial" / "first-night.md").read_text(encoding="utf-8")
    lines = re.findall(r"^ {4}(tracker .*)$", page, re.MULTILINE)
    said = []

    for line in lines:
        done = CliRunner().invoke(main, shlex.split(line)[1:], prog_name="tracker")
        assert done.exit_code == 0, (line, done.output)
        said.append(done.output)

    assert len(lines) == 4
    assert "1.635 m" in said[0], "the number the page names"
    assert re.search(r"≤ 4\.90\d* m", said[0])
    assert "identical" in said[2]
    assert (tmp_path / "public" / "index.html").is_file()


def test_the_scenes_from_the_classroom_follow_their_closed_forms(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page asserts each; with a wrong formula none of them passes."""
    monkeypatch.chdir(tmp_path)
    told = blocks("tutorial/scenes.md", "python")
    names: dict[str, Any] = {}
    wrong = {0: ("(3 * g / length)", "(2 * g / length)"), 1: ("2 * mu * g", "mu * g"), 2: ("-1 / 3, 2 / 3", "0.0, 0.0"),
             3: ("0.5 / 9", "0.5 / 3"), 4: ("run.restore(here)", ""), 5: ("** (2 *", "** (1 *")}  # fmt: skip

    for place, block in enumerate(told):
        if place in wrong:
            assert wrong[place][0] in block
            with pytest.raises(AssertionError):
                exec(block.replace(*wrong[place]), dict(names))
        exec(block, names)

    assert len(told) == 7
    assert (tmp_path / "bounce.html").is_file()


def test_the_queries_run_on_both_databases(session: Any) -> None:
    record(session, run())
    queries = blocks("how-to/sql.md", "sql")

    for query in queries:
        session.execute(text(query)).all()

    assert len(queries) >= 4
    told = session.execute(text(queries[-1])).all()
    assert any(column == "limit_low" for column, _ in told)


def test_the_python_beside_the_queries_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    engine = open_database(f"sqlite:///{tmp_path}/tracker.db")
    with Session(engine) as session:
        record(session, run())
    engine.dispose()
    monkeypatch.chdir(tmp_path)

    for block in blocks("how-to/sql.md", "python"):
        exec(block, {})


def test_the_method_by_hand_is_what_the_engine_does() -> None:
    """The page asserts it; a wrong sign in its step does not pass."""
    (block,) = blocks("explanation/method.md", "python")

    exec(block, {})

    with pytest.raises(AssertionError):
        exec(block.replace("-a * g + (1 - b)", "-a * g - (1 - b)"), {})


def test_the_numbers_of_the_method_are_those_of_the_code() -> None:
    """Each stands on the page, and is found again from the closed forms or in the engine's defaults."""
    page = (DOCS / "explanation" / "method.md").read_text(encoding="utf-8")

    def left(steps_a_period: float) -> float:
        """Of a vibration, ten steps of θ = 2 later: the larger eigenvalue of the undamped frequency's row."""
        squared = (2.0 * np.pi / steps_a_period) ** 2
        matrix = theory.one_row_matrix(1.0, 1.0 / squared, 2.0, 1.0)
        return float(np.abs(np.linalg.eigvals(matrix)).max() ** 10)

    assert f"{left(100):.3f}".lstrip("0") in page
    assert f"{left(2):.1e}".replace("e-05", "e-5") in page
    assert f"c = {joints.COMPLIANCE:.0e} m/N".replace("e-08", "e-8") in page
    for number in ("2.1 mm", "0.4 %"):  # tests/engine/rigid/test_compliance.py measures both
        assert number in (DOCS / "explanation" / "compliance.md").read_text(encoding="utf-8")
        assert number in page


def test_every_cell_of_the_notebook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    cells = json.loads((ROOT / "examples" / "first_night.ipynb").read_text(encoding="utf-8"))["cells"]
    names: dict[str, Any] = {}

    for cell in cells:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            exec("".join(cell["source"]), names)

    assert names["verdict"] == "identical"
    assert names["result"].steps == 100


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The documentation, built without a warning."""
    pytest.importorskip("mkdocs", reason="MkDocs is not installed here")
    folder = tmp_path_factory.mktemp("documentation") / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


def test_the_site_builds_without_a_warning(site: Path) -> None:
    pages = {str(page.relative_to(site)) for page in site.rglob("*.html")}
    assert {"index.html", "tutorial/first-night.html", "reference/schema.html"} <= pages
    for page in site.rglob("*.html"):
        assert not re.search(r'(src|href)="https?://[^"]*\.(js|css)', page.read_text(encoding="utf-8")), page


def test_the_documentation_is_searched_from_a_folder(site: Path, driver: Any) -> None:
    """Words in any order find the section, also in pages that are made from the code; the passage marks them."""
    look(driver)
    driver.get((site / "how-to" / "ci.html").as_uri())
    driver.find_element("css selector", "[data-bs-target='#mkdocs_search_modal']").click()
    wait_for(driver, "document.activeElement.id === 'mkdocs-search-query'")
    wait_for(driver, "typeof SECTIONS !== 'undefined'")
    box = driver.find_element("id", "mkdocs-search-query")
    box.send_keys("first_bad commit BISECT")
    nothing = driver.find_element("css selector", "#mkdocs-search-results p").text
    box.clear()
    box.send_keys("commit bisect BAD")
    results = driver.find_elements("css selector", "#mkdocs-search-results a")
    links = [link.get_attribute("href") for link in results]
    marks = {
        mark.text.lower() for mark in driver.find_elements("css selector", "#mkdocs-search-results mark")
    }
    broken = [entry["message"] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
    driver.get(links[0])
    there = driver.execute_script(
        "return !!document.getElementById(decodeURIComponent(location.hash.slice(1)))"
    )
    look(driver, width=600)
    driver.get((site / "detectors.html").as_uri())
    wide = driver.execute_script("return document.documentElement.scrollWidth")

    assert nothing == "0 sections"
    assert {"how-to/own-commits.html", "reference/commands.html"} <= {
        str(Path(link.partition("#")[0].removeprefix("file://")).relative_to(site)) for link in links
    }
    assert {"commit", "bisect", "bad"} <= marks
    assert broken == []
    assert there
    assert wide == 600, "a wide table is moved within its column"


def test_a_website_takes_the_documentation_along(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Linked from every page where it is, from none where it is not."""
    monkeypatch.chdir(tmp_path)
    engine = open_database(f"sqlite:///{tmp_path}/tracker.db")
    with Session(engine) as session:
        record(session, run())
    engine.dispose()
    pages = tmp_path / "built"
    (pages / "how-to").mkdir(parents=True)
    (pages / "index.html").write_text("<h1>ours</h1>")
    (pages / "how-to" / "ci.html").write_text("ci")

    def published(*words: str) -> set[str]:
        done = CliRunner().invoke(main, ["publish", "--out", "public", *words], prog_name="tracker")
        assert done.exit_code == 0, done.output
        shown = {path: path.read_text(encoding="utf-8") for path in (tmp_path / "public").glob("*.html")}
        return {path.name for path, html in shown.items() if 'href="docs/index.html"' in html}

    assert published() == set()
    refused = CliRunner().invoke(main, ["publish", "--out", "public", "--documents", "built/how-to"])
    assert refused.exit_code == 2
    assert "has no index.html" in refused.output
    assert {"index.html", "stability.html"} <= published("--documents", "built")
    assert (tmp_path / "public" / "docs" / "how-to" / "ci.html").read_text() == "ci"
    assert published() == set()
    assert not (tmp_path / "public" / "docs").exists()


def test_the_page_of_tables_is_complete() -> None:
    page = "\n".join(generated().schema())

    for table in models.Base.metadata.tables.values():
        assert f"## Table {table.name}" in page
        assert all(f"| `{column.name}` |" in page for column in table.columns)
    assert all(f"## View {view}" in page for view in ABOUT)


def test_the_page_of_commands_is_complete() -> None:
    page = "\n".join(generated().commands())

    def names(group: click.Group, before: str) -> list[str]:
        found = []
        for name, command in group.commands.items():
            found.append(f"{before} {name}")
            found += names(command, found[-1]) if isinstance(command, click.Group) else []
        return found

    assert [name for name in names(main, "tracker") if f"## {name}\n" not in page] == []


def test_the_page_of_the_library_is_complete() -> None:
    from spook_tracker import engine, tracker

    page = "\n".join(generated().library())

    assert [name for name in (*engine.__all__, *tracker.__all__) if f"### {name}\n" not in page] == []
    for thing, field in (("Hinge", "| `at` | m |"), ("Box", "| `size` | full edge lengths, m |")):
        assert field in page.partition(f"### {thing}\n")[2].partition("### ")[0]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_shell_can_complete(shell: str) -> None:
    variables = {"_TRACKER_COMPLETE": f"{shell}_source"}

    done = CliRunner(env=variables).invoke(main, [], prog_name="tracker", complete_var="_TRACKER_COMPLETE")

    assert "_TRACKER_COMPLETE" in done.output
    assert "tracker" in done.output


def test_each_line_of_the_threat_model_names_tests_that_are_there() -> None:
    rows = [line for line in (ROOT / "SECURITY.md").read_text().splitlines() if line.startswith("| ")][2:]

    assert len(rows) > 10
    for row in rows:
        named = re.findall(r"`(tests/[\w/]+\.py)`", row)
        assert named, row
        assert all((ROOT / name).is_file() for name in named), row

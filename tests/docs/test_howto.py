"""What the how-to pages tell to type is typed, in a team's folder with a question of the tutorial; what cannot be run
here names the test that runs it elsewhere. The recipes for other people's tools run, too.
"""

from __future__ import annotations

import importlib.util
import json
import re
import shlex
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from sqlalchemy import text
from sqlalchemy.orm import Session

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.record import record
from tests.docs.test_commands import typed
from tests.docs.test_site import DOCS, ROOT, blocks
from tests.histories.documents import run

ELSEWHERE = {  # what asks for another engine, a server, or minutes, and the test that does the same
    "tracker init NAME": "tests/tracker/test_init.py",
    "tracker run falling_object": "tests/tracker/test_init.py",
    "tracker ci change --history history --comment comment.md": "tests/team/test_workflow.py",
    "tracker run pendulum n_pendulum resting_stack --engine spook,mujoco --sweep": "tests/engine/peers/test_mujoco.py",
    "tracker backfill --engine mujoco --newest 3": "tests/tracker/measure/test_releases.py",
    "tracker run --model robot.xml --engine mujoco": "tests/docs/test_upgrade.py",
    "tracker backfill --engine mujoco 3.3.7 3.4.0 --model robot.xml": "tests/docs/test_upgrade.py",
    "tracker models gymnasium --engine mujoco": "tests/tracker/measure/test_model_packages.py",
    "tracker backfill --engine mujoco 3.3.7 3.4.0": "tests/docs/test_upgrade.py",
    "tracker releases mujoco": "tests/tracker/measure/test_releases.py",
    "tracker run --executor dask://scheduler:8786": "tests/tracker/measure/test_executors.py",
    "tracker db copy sqlite:///tracker.db postgresql://host/tracker": "tests/tracker/store/test_transfer.py",
    "tracker bisect pendulum": "tests/tracker/test_past.py",
    "tracker bisect throw": "tests/tracker/measure/test_builds.py",
    "tracker backfill v1.0..HEAD": "tests/tracker/measure/test_builds.py",
    "tracker import results.json": "tests/tracker/document/test_outside.py",
    "tracker import results": "tests/tracker/measure/test_other_tools.py",
    'tracker import nightly/*.jsonl --engine gravel --column run_time=s --column "step.*=us"': "tests/tracker/test_imports.py",
    "tracker db partition": "tests/tracker/store/test_partition.py",
}
CLUSTER = (
    "from concurrent.futures import ThreadPoolExecutor\n\ndef factory():\n    return ThreadPoolExecutor(1)\n"
)


def invoke(line: str) -> Any:
    return CliRunner().invoke(main, shlex.split(line)[1:], prog_name="tracker")


@pytest.fixture
def team(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the tutorial `own-test.md`, one stands in it."""
    (settings,), (questions,) = (blocks("tutorial/own-test.md", kind) for kind in ("toml", "python"))
    (tmp_path / "tracker.toml").write_text(settings)
    (tmp_path / "questions.py").write_text(questions)
    (tmp_path / "our_cluster.py").write_text(CLUSTER)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delenv("TRACKER_DB", raising=False)
    monkeypatch.delitem(sys.modules, "questions", raising=False)
    return tmp_path


def test_the_tutorial_of_an_own_test_goes_as_it_says(team: Path) -> None:
    ask, show, compare, publish = re.findall(
        r"^ {4}(tracker .*)$", (DOCS / "tutorial" / "own-test.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    questions = (team / "questions.py").read_text()

    green, shown = invoke(ask), invoke(show)
    sys.modules.pop("questions", None)
    (team / "questions.py").write_text(questions.replace("compliance=COMP", "compliance=1.01 * COMP"))
    shutil.rmtree(team / "__pycache__", ignore_errors=True)
    red, compared = invoke(ask), invoke(compare)
    sys.modules.pop("questions", None)
    (team / "questions.py").write_text(questions)
    published = invoke(publish)

    assert (green.exit_code, red.exit_code, compared.exit_code) == (0, 1, 3), green.output + red.output
    assert "How far does a weight sag" in shown.output
    assert re.search(r"0\.000196\d* m", red.output), "0.196 mm, as the page says"
    assert "not comparable" in compared.output
    assert published.exit_code == 0
    assert "Our questions" in (team / "public" / "index.html").read_text(encoding="utf-8")


def test_every_line_of_the_pages_runs_or_names_the_test_that_runs_it(team: Path) -> None:
    pages = [
        "ci.md",
        "red-night.md",
        "sql.md",
        "larger.md",
        "choose-an-engine.md",
        "own-engine.md",
        "own-commits.md",
        "other-tools.md",
        "upgrade.md",
    ]
    assert sorted(pages) == sorted(page.name for page in (DOCS / "how-to").glob("*.md"))
    lines = [line for page in pages for line in typed(f"docs/how-to/{page}") if line.startswith("tracker ")]
    seen = set()

    for line in lines:
        if line in ELSEWHERE:
            assert (ROOT / ELSEWHERE[line]).is_file()
            continue
        if "2026-11" in line:
            (month,) = (team / "history").iterdir()
            line = line.replace("2026-11.jsonl.xz", month.name)
        done = invoke(line)
        assert done.exit_code == 0, (line, done.output, done.exception)
        seen.add(line)

    assert set(ELSEWHERE) <= set(lines), "a line that no page tells any more"
    assert len(seen) >= 12
    assert (team / "values.parquet").is_file()


def test_every_query_of_the_dashboard_for_grafana_runs(session: Any) -> None:
    """On both databases; what Grafana fills in is filled in as Grafana does."""
    record(session, run())
    board = json.loads((ROOT / "examples" / "grafana" / "dashboard.json").read_text(encoding="utf-8"))
    (variable,) = board["templating"]["list"]
    (first, *_) = session.execute(text(variable["query"])).scalars()
    asked = 0

    for panel in board["panels"]:
        for target in panel["targets"]:
            query = re.sub(
                r"\$__timeFilter\((\w+)\)", r"\1 BETWEEN '1970-01-01' AND '2199-01-01'", target["rawSql"]
            ).replace(f"${variable['name']}", first)
            assert "$" not in query
            found = session.execute(text(query))
            names = set(found.keys())
            assert target["format"] in ("time_series", "table")
            assert target["format"] == "table" or {"time", "metric", "value"} <= names, query
            if "run_times" not in query and "'red'" not in query:
                assert found.all(), query
            asked += 1

    assert asked >= 4


def test_datasette_shows_the_views(tmp_path: Path) -> None:
    """The real program, on a port of this machine; ids come out as they are stored."""
    assert importlib.util.find_spec("datasette")
    engine = open_database(f"sqlite:///{tmp_path}/tracker.db")
    with Session(engine) as stored:
        record(stored, run())
        (key,) = stored.execute(text("SELECT key FROM run")).one()
    engine.dispose()
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "datasette", "tracker.db", "--host", "127.0.0.1", "--port", str(port)]
    server = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:

        def answer(path: str) -> Any:
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/tracker/{path}", timeout=10) as page:
                return json.loads(page.read())

        end = time.monotonic() + 60.0
        while True:
            try:
                rows = answer("gate_values.json?_shape=array")
                break
            except OSError:
                assert time.monotonic() < end
                assert server.poll() is None
                time.sleep(0.2)
        assert rows
        assert {"night", "series", "value"} <= set(rows[0])
        assert [row["key"] for row in answer("run.json?_shape=array")] == [key]
    finally:
        server.terminate()
        server.wait(timeout=30)

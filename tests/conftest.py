"""Fixtures of more than one file: an empty database of each kind, a browser."""

from __future__ import annotations

import gc
import os
import shutil
import signal
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from sqlalchemy import make_url
from sqlalchemy.orm import Session

from spook_tracker.tracker.cli.console import PIPE_WIDTH
from spook_tracker.tracker.measure.request import Request
from spook_tracker.tracker.store.database import open_database
from tests import warm
from tests.places import TOYS
from tests.skips import pytest_make_collect_report, pytest_runtest_makereport  # noqa: F401 (hooks)
from tests.tracker.store import postgresql
from tests.website.browser import MISSING, browser, new_tab, programs

# A shell starts what runs behind it deaf to the keyboard; what tests start is to hear it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# As wide as a pipe, wherever the tests run: pytest's workers say 80 of themselves.
os.environ["COLUMNS"] = str(PIPE_WIDTH)

# What is claimed of drawn values is no matter of how busy the machine is.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

# Minutes of work in few tests: they start first, so that all workers end at about the same time.
LONG = (
    "website/test_publish", "scalar_tests/test_limits", "scalar_tests/test_answers", "tracker/store/test_durability",
    "tracker/store/test_history_machine", "website/test_browser", "website/test_access", "test_release", "test_packaging",
    "website/test_publish_history", "tracker/judge/test_detection", "team/test_workflow", "tracker/measure/test_executors",
)  # fmt: skip
FIRST = [Path(__file__).parent / f"{name}.py" for name in LONG]


def pytest_configure() -> None:
    warm.begin()


def pytest_unconfigure() -> None:
    warm.close()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Ten thousand tests stay to the end: to look for garbage among them took half of the time in which they are collected."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: FIRST.index(item.path) if item.path in FIRST else len(FIRST))


@pytest.fixture(scope="session")
def postgresql_server() -> Iterator[postgresql.Server]:
    """A server for this session."""
    programs = postgresql.binaries()
    if programs is None:
        pytest.skip(postgresql.MISSING)
    with postgresql.running_server(programs) as server:
        yield server


@pytest.fixture
def sqlite_url(tmp_path: Path) -> str:
    """A SQLite file that does not exist yet."""
    return f"sqlite:///{tmp_path}/tracker.db"


@pytest.fixture
def postgresql_url(postgresql_server: postgresql.Server) -> Iterator[str]:
    """An empty PostgreSQL database."""
    with postgresql_server.new_database() as url:
        yield url


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest) -> str:
    """An empty database of either kind: what is claimed holds on both."""
    found: str = request.getfixturevalue(f"{request.param}_url")
    return found


@pytest.fixture(scope="session")
def sqlite_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A SQLite file at the newest revision, to be copied: migrating costs seven times as much."""
    path = tmp_path_factory.mktemp("template") / "tracker.db"
    open_database(f"sqlite:///{path}").dispose()
    return path


@pytest.fixture(scope="session")
def postgresql_template(postgresql_server: postgresql.Server) -> Iterator[str]:
    """The name of a PostgreSQL database at the newest revision, to be copied."""
    with postgresql_server.new_database() as url:
        open_database(url).dispose()
        yield str(make_url(url).database)


@pytest.fixture
def migrated_sqlite_url(sqlite_url: str, sqlite_template: Path) -> str:
    """A SQLite file at the newest revision, without runs."""
    shutil.copyfile(sqlite_template, sqlite_url.removeprefix("sqlite:///"))
    return sqlite_url


@pytest.fixture
def migrated_postgresql_url(postgresql_server: postgresql.Server, postgresql_template: str) -> Iterator[str]:
    """A PostgreSQL database at the newest revision, without runs."""
    with postgresql_server.new_database(copied=postgresql_template) as url:
        yield url


@pytest.fixture(params=["sqlite", "postgresql"])
def migrated_url(request: pytest.FixtureRequest) -> str:
    """A database of either kind at the newest revision, without runs."""
    found: str = request.getfixturevalue(f"migrated_{request.param}_url")
    return found


@pytest.fixture
def session(migrated_url: str) -> Iterator[Session]:
    """A session on a database of either kind, at the newest revision, without runs."""
    engine = open_database(migrated_url)
    with Session(engine) as session:
        yield session
    engine.dispose()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """The browser of this session: to start one takes longer than most of what is asked of it."""
    found = programs()
    if found is None:
        pytest.skip(MISSING)
    with browser(*found) as opened:
        opened.set_script_timeout(90)
        yield opened


@pytest.fixture(scope="module")
def driver(chromium: Any) -> Any:
    """The browser in a tab of this file's own, which knows nothing of other files'."""
    new_tab(chromium)
    return chromium


@pytest.fixture
def in_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs that are asked for nothing else are measured in this process: for tests of what comes of their documents. That
    no engine reaches the process that judges is asked in tests/tracker/measure/test_gates.py and beside it."""
    monkeypatch.setitem(Request.__init__.__kwdefaults__, "apart", False)
    monkeypatch.setitem(Request.__init__.__kwdefaults__, "workers", 0)


@pytest.fixture
def toys(monkeypatch: pytest.MonkeyPatch) -> None:
    """The toys can be imported as a team's own modules, by the processes that a test starts as well."""
    monkeypatch.syspath_prepend(str(TOYS))


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, toys: None) -> None:
    """An empty folder to stand in, the toys importable, and nothing of the environment that commands would listen to."""
    monkeypatch.chdir(tmp_path)
    for name in (
        "TRACKER_DB",
        "TRACKER_ENGINE",
        "TRACKER_CATALOGUE",
        "GITHUB_STEP_SUMMARY",
        "GITHUB_ACTIONS",
    ):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def toy_desk(desk: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same with the toy engine and its questions on the table."""
    monkeypatch.setenv("TRACKER_ENGINE", "toy_engine")
    monkeypatch.setenv("TRACKER_CATALOGUE", "toy_questions:CATALOGUE")

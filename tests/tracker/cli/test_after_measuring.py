"""What goes wrong after a night was measured takes nothing from it: its verdict is the exit code all the same."""

from __future__ import annotations

import errno
import shutil
from pathlib import Path

import pytest

from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from tests.tracker.cli.test_command_line import tracker

pytestmark = pytest.mark.usefixtures("toy_desk", "in_process")


def runs() -> int:
    with session_on("tracker.db", readonly=True) as session:
        return len(History(session).runs())


@pytest.fixture
def full(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that is full when the documents are written."""

    def no_space(*_: object, **__: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("spook_tracker.tracker.cli.measuring.Path.write_text", no_space)


@pytest.mark.usefixtures("full")
@pytest.mark.parametrize(("error", "code"), [("0", 2), ("5", 1)])
@pytest.mark.parametrize("option", ["--json", "--junit"])
def test_a_red_run_is_red_though_its_file_cannot_be_written(
    monkeypatch: pytest.MonkeyPatch, option: str, error: str, code: int
) -> None:
    monkeypatch.setenv("TOY_ERROR", error)

    done = tracker("run", "--workers", "0", option, "made")

    assert done.exit_code == code
    assert "made cannot be written: No space left on device; what was measured stands" in done.stderr
    assert runs() == 1


@pytest.mark.parametrize(("error", "code"), [("0", 2), ("5", 1)])
def test_a_red_night_is_red_though_its_website_cannot_be_written(
    monkeypatch: pytest.MonkeyPatch, error: str, code: int
) -> None:
    assert tracker("nightly", "--quick", "--workers", "0").exit_code == 0
    page = Path("public/index.html").read_bytes()
    monkeypatch.setenv("TOY_ERROR", error)
    monkeypatch.setenv("TOY_HASH", "b" * 40)
    monkeypatch.setenv("TOY_PARENT", "a" * 40)

    def no_space(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("spook_tracker.tracker.website.folder.Folder.add", no_space)
    done = tracker("nightly", "--quick", "--workers", "0", "--junit", "made.xml", "--json", "made.json")

    assert done.exit_code == code
    assert "the website cannot be written" in done.stderr
    assert "No space left on device" in done.stderr
    assert ("✓ green" in done.stdout) == (code == 2)
    assert runs() == 2
    assert Path("made.xml").read_text().startswith("<?xml")
    assert Path("made.json").is_file()
    assert Path("public/index.html").read_bytes() == page


@pytest.mark.usefixtures("full")
def test_a_night_without_its_document_is_judged_and_published() -> None:
    done = tracker("nightly", "--quick", "--workers", "0", "--json", "made.json")

    assert done.exit_code == 2
    assert "made.json cannot be written" in done.stderr


def test_the_memory_of_a_piece_is_bounded_by_an_option(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gigabyte is taken by every simulation: more than 256 MB and less than what is allowed by default."""
    monkeypatch.setenv("TOY_FAULT", "hog")
    monkeypatch.setenv("TOY_HOG", str(1 << 30))

    bounded = tracker("run", "stand", "--workers", "1", "--memory", "256")
    free = tracker("run", "stand", "--workers", "1")
    shutil.rmtree("public", ignore_errors=True)
    Path("tracker.toml").write_text("memory = 256\n")
    said = tracker("run", "stand", "--workers", "1")

    assert (bounded.exit_code, free.exit_code, said.exit_code) == (1, 0, 1)
    assert "ran out of memory" in bounded.stdout


@pytest.mark.parametrize(
    ("lost", "error", "code"),
    [("history", "0", 2), ("history", "5", 1), ("summary", "0", 0), ("summary", "5", 1)],
)
def test_a_red_night_in_ci_is_red_though_what_it_leaves_cannot_be_written(
    monkeypatch: pytest.MonkeyPatch, lost: str, error: str, code: int
) -> None:
    """The history's file, the job's summary: both are tried, and neither takes the verdict along."""
    assert tracker("ci", "night", "--quick", "--workers", "0").exit_code == 0
    for name, value in {"ERROR": error, "HASH": "b" * 40, "PARENT": "a" * 40}.items():
        monkeypatch.setenv(f"TOY_{name}", value)
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", "no/such.md" if lost == "summary" else "summary.md")

    def no_space(*_: object) -> None:
        raise DocumentError("history cannot be written: No space left on device")

    if lost == "history":
        monkeypatch.setattr("spook_tracker.tracker.store.months._write", no_space)
    done = tracker("ci", "night", "--quick", "--workers", "0")

    assert done.exit_code == code, done.stderr
    assert "cannot be written" in done.stderr
    assert runs() == 2
    assert Path("summary.md").exists() == (lost == "history")


def test_a_red_run_judged_again_is_red_though_its_junit_cannot_be_written(
    monkeypatch: pytest.MonkeyPatch, full: None
) -> None:
    monkeypatch.setenv("TOY_ERROR", "5")
    tracker("run", "--workers", "0")

    done = tracker("judge", "latest", "--junit", "made.xml")

    assert done.exit_code == 1
    assert "made.xml cannot be written: No space left on device" in done.stderr

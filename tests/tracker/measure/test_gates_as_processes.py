"""A gate as a process: what an engine does to the process that decides, and how that one is started, open no gate."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.places import TOYS
from tests.tracker.measure.test_gates import BAD, QUESTIONS, TOY, runs

TRACKER = Path(sys.executable).with_name("tracker")
RUN, NIGHT = ("run",), ("nightly", "--quick")


@pytest.fixture(autouse=True)
def _desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sqlite_template: Path) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copyfile(sqlite_template, "tracker.db")


def ended(
    engine: str, command: tuple[str, ...] = RUN, *, shell: str = "", **settings: str
) -> tuple[int, str]:
    """Exit code and words of a command about this engine; `shell` is what stands behind it on its line."""
    Path("their_engine.py").write_text(engine)
    Path("their_catalogue.py").write_text(QUESTIONS)
    words = [*command, "--engine", "their_engine", "--catalogue", "their_catalogue", "--workers", "1"]
    own = {name: value for name, value in os.environ.items() if not name.startswith(("TRACKER", "GITHUB"))}
    line = ["bash", "-c", f'"{TRACKER}" {" ".join(words)} {shell}'] if shell else [str(TRACKER), *words]
    done = subprocess.run(
        line,
        env={**own, "PYTHONPATH": str(TOYS), **settings}, capture_output=True, text=True, stdin=subprocess.DEVNULL,
        timeout=120, check=False,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def sends(signal: str, to: str) -> str:
    return f"import os, signal, time\nos.{to}, signal.{signal})\ntime.sleep(2)\n"


@pytest.mark.parametrize(
    "to", ["kill(os.getppid()", "killpg(0"], ids=["to the one that decides", "to its group"]
)
@pytest.mark.parametrize("signal", ["SIGTERM", "SIGINT", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGUSR1"])
def test_a_signal_that_an_engine_sends_is_no_green_unless_all_was_measured(signal: str, to: str) -> None:
    code, said = ended(sends(signal, to) + TOY)

    assert (code == 0) == (runs() == 1), said


@pytest.mark.parametrize("signal", ["SIGTERM", "SIGPIPE"])
def test_a_signal_makes_no_bad_value_good(signal: str) -> None:
    code, said = ended(sends(signal, "kill(os.getppid()") + BAD)

    assert code != 0, said


@pytest.mark.parametrize(
    "shell", ["| head -c 1 >/dev/null; exit ${PIPESTATUS[0]}", ">&-", ">&- 2>&-", ">/dev/full"]
)
def test_where_no_word_can_be_written_red_stays_red(shell: str) -> None:
    code, said = ended(BAD, shell=shell)

    assert code not in (0, 2) or shell == ">/dev/full", said
    assert code != 0, said


def test_a_python_that_leaves_assertions_out_judges_as_well() -> None:
    code, said = ended(BAD, PYTHONOPTIMIZE="2")

    assert (code, runs()) == (1, 1), said


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the first test that needs a green night leaves its database."""
    return tmp_path_factory.mktemp("kept") / "tracker.db"


@pytest.fixture
def green(kept: Path) -> None:
    if not kept.exists():
        assert ended(TOY, NIGHT)[0] == 0
        shutil.copyfile("tracker.db", kept)
    shutil.copyfile(kept, "tracker.db")


@pytest.mark.usefixtures("green")
def test_a_commit_that_was_green_may_be_red_when_asked_again() -> None:
    code, said = ended(BAD, NIGHT)

    assert (code, runs()) == (1, 2), said


@pytest.mark.usefixtures("green")
def test_a_history_that_an_engine_deletes_makes_no_first_night() -> None:
    code, said = ended("import glob, os\nfor f in glob.glob('tracker.db*'): os.remove(f)\n" + BAD, NIGHT)

    assert code != 0, said

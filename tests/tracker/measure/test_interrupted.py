"""A command that is interrupted ends at once, leaves no process behind, keeps what was finished and says so."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from spook_tracker.tracker.cli import options
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.measure import run as measuring
from spook_tracker.tracker.measure.run import Interrupted, Questions, Request, run
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from tests.places import TOYS
from tests.tracker.cli.test_command_line import tracker
from tests.tracker.measure.test_workers import SOON, alive, children, until

SOURCE = Questions(catalogue="toy_stuck:CATALOGUE", engine="toy_engine")


@pytest.fixture(autouse=True)
def _desk(monkeypatch: pytest.MonkeyPatch, toy_desk: None) -> None:
    monkeypatch.setenv("TRACKER_CATALOGUE", "toy_stuck:CATALOGUE")


def time_of_processor(pids: set[int]) -> float:
    """Seconds that these processes, and those of their children that have ended, have had."""
    ticks = 0
    for pid in pids:
        with contextlib.suppress(FileNotFoundError):  # it has just ended: its parent counts it
            told = Path(f"/proc/{pid}/stat").read_text()
            ticks += sum(int(n) for n in told.rpartition(")")[2].split()[11:15])
    return ticks / os.sysconf("SC_CLK_TCK")


def time_of_children() -> float:
    """Seconds that all processes have had for which this one, or one of them, has waited."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def stored() -> list[RunDocument]:
    with session_on("tracker.db", readonly=True) as session:
        history = History(session)
        return [history.document(info.id) for info in history.runs()]


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_ends_and_keeps_what_was_finished(how: signal.Signals) -> None:
    """Of three tests one is answered, one hangs in Python and one waits behind it."""
    environment = os.environ | {"PYTHONPATH": str(TOYS)}
    others = time_of_children()
    process = subprocess.Popen(
        [sys.executable, "-m", "spook_tracker", "run", "--workers", "1"],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert until(Path("stuck").exists), process.communicate(timeout=1)
    family = children(process.pid)

    before = time_of_processor({process.pid, *family})
    process.send_signal(how)
    begun = time.monotonic()
    _, told = process.communicate(timeout=SOON)

    assert time.monotonic() - begun < SOON / 2
    # One worker turns round and round: what the family takes from now on is how long it goes on, on any machine.
    assert time_of_children() - others - before < 1.0  # s
    assert process.returncode == 2
    assert "interrupted; 1 of 3 tests were finished and are recorded as partial run" in told
    assert until(lambda: not alive(family))
    (document,) = stored()
    assert document.partial
    assert [card.name for card in document.tests] == ["quick"]
    assert {sample.outcome for sample in document.samples} == {"value"}
    assert document.id in told


def test_a_run_that_hangs_ends_by_its_time_limit() -> None:
    done = tracker("run", "stuck", "quick", "--workers", "1", "--time-limit", "1.5")

    assert done.exit_code == 1
    (document,) = stored()
    assert not document.partial
    assert {s.series.split("/")[0]: s.outcome for s in document.samples} == {
        "quick": "value",
        "stuck": "timed_out",
    }


def test_interrupted_before_anything_was_finished_nothing_is_recorded() -> None:
    Path("interrupted_engine.py").write_text(
        "from toy_engine import build_info\ndef simulate(*asked, **more): raise KeyboardInterrupt\n"
    )

    done = tracker("run", "--workers", "0", "--engine", "interrupted_engine")

    assert (done.exit_code, stored()) == (2, [])
    assert "interrupted; nothing of this command was recorded" in done.stderr


def test_the_library_hands_over_what_was_finished(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def sometimes(source: Questions, task: measuring.Task, **more: Any) -> object:
        asked.append(task.test)
        if task.test != "quick":
            raise KeyboardInterrupt
        return answer(source, task, **more)

    answer = measuring.perform
    monkeypatch.setattr(measuring, "perform", sometimes)

    with pytest.raises(Interrupted) as ended:
        run(SOURCE, Request(workers=0))

    assert asked == ["quick", "stuck"]
    assert (ended.value.asked, ended.value.document.partial) == (3, True)
    assert [card.name for card in ended.value.document.tests] == ["quick"]


def test_an_interruption_after_recording_does_not_deny_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("spook_tracker.tracker.cli.measuring._print_run", interrupted)

    done = tracker("run", "quick", "--workers", "0")

    (document,) = stored()
    assert done.exit_code == options.UNUSABLE
    assert f"interrupted; run {document.id} is recorded" in done.stderr

"""Workers are watched: a hang, a death, greed for memory cost one piece; nothing outlives its supervisor."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import spook_tracker.tracker.measure.workers as crew
from tests.places import ROOT

SOON = 240.0  # s: what takes longer hangs, on a machine however busy


def work(piece: str) -> str | None:
    """What a worker does with a piece: its name says what happens."""
    if piece.startswith("hang"):
        while True:  # in Python, where no watchdog of the engine sees it
            pass
    if piece.startswith("die"):
        os.kill(os.getpid(), signal.SIGSEGV)
    if piece.startswith("hog"):
        return str(len(bytearray(64 << 30)))
    if piece.startswith("raise"):
        raise ValueError(piece)
    if piece.startswith("fork"):
        os.fork()
    if piece.startswith("print"):
        os.write(1, b"LOUD\n")
    return None if piece.startswith("none") else piece.upper()


def told(pieces: list[str], workers: int = 2, **limits: float) -> dict[str, object]:
    return dict(crew.answers(work, pieces, workers, crew.Limits(**limits)))


def test_every_piece_is_answered_once():
    pieces = [f"piece {n}" for n in range(20)]

    assert told(pieces) == {piece: piece.upper() for piece in pieces}
    assert told([]) == {}


def who_worked(piece: tuple[str, int]) -> int:
    time.sleep(0.02)
    return os.getpid()


def test_pieces_on_one_subject_go_to_one_process_while_there_are_others(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(crew, "WORTH", 0.0)  # the second process comes at once
    pieces = [(subject, number) for subject in "abcdef" for number in range(4)]
    who = dict(crew.answers(who_worked, pieces, 2, crew.Limits(), lambda piece: piece[0]))

    assert who.keys() == set(pieces)
    shared = {s for s in "abcdef" if len({who[s, number] for number in range(4)}) > 1}
    assert len(shared) <= 1, "the last one is shared, when nothing else is left"


def test_a_piece_that_comes_to_nothing_is_answered_by_none():
    """And not taken for one that is still worked at, which would be ended as hanging."""
    found = told(["none", "a", "none too", "b"], workers=1, seconds=30.0)

    assert found == {"none": None, "a": "A", "none too": None, "b": "B"}


def test_who_hangs_dies_or_is_greedy_costs_its_own_piece():
    found = told(["a", "hang", "b", "die", "c", "hog", "d"], seconds=1.0)

    assert {piece: answer for piece, answer in found.items() if isinstance(answer, str)} == {
        "a": "A", "b": "B", "c": "C", "d": "D"
    }  # fmt: skip
    assert found["hang"] == crew.Lost("timed_out", "no answer within 1 s, so its process was ended")
    assert found["die"] == crew.Lost("crashed", "the engine's process died while answering")
    assert found["hog"] == crew.Lost("crashed", "the piece of work ran out of memory")


def test_a_copy_that_a_piece_forks_answers_nothing():
    pieces = ["fork a", "b", "fork c", *(f"piece {n}" for n in range(5))]
    found = list(crew.answers(work, pieces, 1, crew.Limits()))

    assert found == [(piece, piece.upper()) for piece in pieces]


def test_what_a_piece_prints_is_a_complaint(capfd: pytest.CaptureFixture[str]) -> None:
    told(["print"])

    assert "LOUD" not in (captured := capfd.readouterr()).out
    assert "LOUD" in captured.err


def test_an_error_of_ours_is_raised_and_ends_everything():
    with pytest.raises(ValueError, match="raise it"):
        told(["raise it", "hang"])


def children(of: int) -> set[int]:
    """The processes below one, all the way down."""
    below: dict[int, set[int]] = {}
    for place in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            below.setdefault(int(place.read_text().rpartition(")")[2].split()[1]), set()).add(
                int(place.parent.name)
            )
    found, ahead = set(), [of]
    while ahead:
        new = below.get(ahead.pop(), set()) - found
        found |= new
        ahead += new
    return found


def alive(pids: set[int]) -> set[int]:
    """Those that run: a zombie has ended and waits to be counted."""
    states = {}
    for pid in pids:
        try:
            states[pid] = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            states[pid] = "gone"
    return {pid for pid, state in states.items() if state not in ("gone", "Z", "X")}


def until(condition, limit: float = SOON) -> bool:
    end = time.monotonic() + limit
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return False


def what_is_open(piece: str) -> tuple[set[tuple[int, int]], int]:
    """The files behind this process' descriptors, and its parent."""
    found = set()
    for place in Path("/dev/fd").iterdir():
        with contextlib.suppress(OSError):  # the one that lists them
            told = os.fstat(int(place.name))
            found.add((told.st_dev, told.st_ino))
    return found, os.getppid()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks ahead")
@pytest.mark.filterwarnings(
    "ignore:.*multi-threaded:DeprecationWarning"
)  # those of pytest's workers; a run has none
def test_a_worker_forked_ahead_works_as_a_new_one_and_has_nothing_of_ours_open(tmp_path: Path) -> None:
    with (tmp_path / "ours").open("w") as ours:
        told = os.fstat(ours.fileno())
        crew.fork_ahead()
        (spare,) = crew._ahead
        found = dict(crew.answers(what_is_open, ["a"], 1, crew.Limits()))
        again = dict(crew.answers(what_is_open, ["a"], 1, crew.Limits()))

    opened, parent = found["a"]
    assert (told.st_dev, told.st_ino) not in opened
    assert len(opened) <= len(again["a"][0]), "no more than a new program has"
    assert parent == os.getpid()
    assert not crew._ahead
    with pytest.raises(ValueError, match="closed"):
        spare.process.is_alive()  # it was used, and ended


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks ahead")
@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
@pytest.mark.parametrize(
    ("piece", "outcome"), [("hang", "timed_out"), ("die", "crashed"), ("hog", "crashed")]
)
def test_a_worker_forked_ahead_is_watched_as_any_other(piece: str, outcome: str) -> None:
    crew.fork_ahead()

    found = told([piece, "a"], workers=1, seconds=1.0)

    assert isinstance(lost := found[piece], crew.Lost)
    assert (lost.outcome, found["a"]) == (outcome, "A")


def test_leaving_early_ends_the_workers():
    told(["a"])
    before = children(os.getpid())  # the one that Python keeps to count what processes share
    asked = crew.answers(work, ["a", "hang", "hang on"], 2, crew.Limits())
    next(asked)
    working = alive(children(os.getpid()) - before)

    asked.close()

    assert working
    assert not alive(working)


HANGING = """
import sys
sys.path.insert(0, sys.argv[1])
import spook_tracker.tracker.measure.workers as crew
from tests.tracker.measure.test_workers import work
if __name__ == "__main__":
    for answer in crew.answers(work, ["a", "b", "hang", "hang on"], 2, crew.Limits()):
        print(answer, flush=True)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_worker_outlives_a_supervisor_that_is_killed(how: signal.Signals, tmp_path: Path):
    program = tmp_path / "hanging.py"
    program.write_text(HANGING)
    process = subprocess.Popen(
        [sys.executable, str(program), str(ROOT)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert process.stdout is not None
    with process.stdout:
        process.stdout.readline(), process.stdout.readline()  # both workers are at work, or about to
        assert until(lambda: len(children(process.pid)) >= 2)
        family = children(process.pid)

        process.send_signal(how)
        process.wait(timeout=SOON)

    assert until(lambda: not alive(family)), "workers are left behind"


def where(seconds: float) -> int:
    """The process that does it, after a while."""
    time.sleep(seconds)
    return os.getpid()


def test_a_question_of_milliseconds_starts_one_process():
    """Two would import everything twice; work that lasts is shared as soon as it has lasted a second."""
    short = {answer for _, answer in crew.answers(where, [0.001] * 6, 4, crew.Limits())}
    long = {answer for _, answer in crew.answers(where, [crew.WORTH] * 12, 2, crew.Limits())}

    assert len(short) == 1
    assert len(long) == 2

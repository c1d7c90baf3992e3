"""What an adapter starts ends with the worker it runs in, and holds no stream open that is still read."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.places import TOYS

STARTS = """
import os, subprocess, sys, time
from toy_engine import build_info
import toy_engine
MARK = [sys.executable, "-c", "import time; time.sleep(300)", "{mark}"]
def simulate(*asked, **more):
    subprocess.Popen(MARK)  # as the peers for Node do: it has the streams of its parent
    open("started", "w").close()
    {then}
    return toy_engine.simulate(*asked, **more)
"""
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


def left(mark: str) -> list[int]:
    """Processes that were started with this word."""
    found = []
    for place in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = place.read_bytes().split(b"\0")
        except OSError:
            continue
        if mark.encode() in words:
            found.append(int(place.parent.name))
    return found


def gone(mark: str) -> bool:
    end = time.monotonic() + 10
    while left(mark) and time.monotonic() < end:
        time.sleep(0.05)
    return not left(mark)


@pytest.fixture
def mark(tmp_path: Path):
    word = f"started-in-{tmp_path.name}-{os.getpid()}"
    yield word
    for pid in left(word):
        os.kill(pid, signal.SIGKILL)


def start(folder: Path, mark: str, then: str, *options: str) -> subprocess.Popen[str]:
    (folder / "starting.py").write_text(STARTS.format(mark=mark, then=then))
    return begun(folder, *options)


def begun(folder: Path, *options: str, tests: tuple[str, ...] = ("fall",)) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "spook_tracker", "run", *tests, "--engine", "starting"]
    command += ["--catalogue", "toy_questions", "--no-record", "--workers", "1", *options]
    return subprocess.Popen(
        command, cwd=folder, env={**os.environ, "PYTHONPATH": str(TOYS)}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip


ENDS = {
    "answers": ("pass", (), 0),
    "hangs": ("time.sleep(300)", ("--time-limit", "1"), 1),
    "dies": ("os._exit(0)", (), 1),
    "makes sessions": ("subprocess.Popen(MARK, start_new_session=True)", (), 0),
}


@pytest.mark.parametrize("how", ENDS)
def test_a_command_ends_with_all_that_an_engine_has_started(how: str, tmp_path: Path, mark: str) -> None:
    then, options, code = ENDS[how]
    process = start(tmp_path, mark, then, *options)

    told, _ = process.communicate(timeout=60)  # returns once no process holds the output open

    assert (tmp_path / "started").exists(), told
    assert process.returncode == code, told
    assert gone(mark)


HANGS_FIRST = """
    first = not os.path.exists("seen")
    with open("seen", "a") as seen:
        seen.write(f"{{alive()}}\\n")
    subprocess.Popen(MARK)
    if first: time.sleep(300)
"""
ALIVE = """
def alive():
    from pathlib import Path
    found = 0
    for place in Path("/proc").glob("[0-9]*/cmdline"):
        try: found += b"{mark}" in place.read_bytes().split(b"\\0")
        except OSError: pass
    return found
"""


def test_what_a_piece_has_started_ends_with_its_time_limit_while_the_others_go_on(
    tmp_path: Path, mark: str
) -> None:
    starts = STARTS.replace(
        "    subprocess.Popen(MARK)  # as the peers for Node do: it has the streams of its parent\n",
        "",
    )
    (tmp_path / "starting.py").write_text(
        ALIVE.format(mark=mark) + starts.format(mark=mark, then=HANGS_FIRST.format().strip())
    )

    told, _ = begun(tmp_path, "--time-limit", "1", tests=("fall", "stand")).communicate(timeout=60)

    seen = (tmp_path / "seen").read_text().split()
    assert len(seen) > 1, told
    assert seen[1] == "0", "the next piece saw what the ended one had started"


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_a_command_that_is_ended_leaves_no_process_behind(
    how: signal.Signals, tmp_path: Path, mark: str
) -> None:
    process = start(tmp_path, mark, "subprocess.Popen(MARK, start_new_session=True); time.sleep(300)")
    end = time.monotonic() + 60
    while len(left(mark)) < 2 and time.monotonic() < end:
        time.sleep(0.05)
    assert len(left(mark)) == 2

    process.send_signal(how)
    process.communicate(timeout=30)

    assert gone(mark)


def test_what_an_engine_prints_is_a_complaint_and_no_result(tmp_path: Path, mark: str) -> None:
    (tmp_path / "loud.py").write_text(
        "import os\nfrom toy_engine import build_info\nimport toy_engine\n"
        "def simulate(*a, **m):\n    os.write(1, b'LOUD\\n')\n    return toy_engine.simulate(*a, **m)\n"
    )
    command = [
        sys.executable,
        "-m",
        "spook_tracker",
        "run",
        "fall",
        "--engine",
        "loud",
        "--catalogue",
        "toy_questions",
    ]

    done = subprocess.run(
        [*command, "--no-record"], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(TOYS)},
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip

    assert "LOUD" not in done.stdout
    assert "LOUD" in done.stderr

"""The browser of a test ends with the test, however the test ends."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep

import pytest

from tests.places import ROOT
from tests.website.browser import MISSING, programs

HOLDING = """
import os, signal
from pathlib import Path
from tests.website.browser import browser, programs

def children(pid):
    return Path(f"/proc/{pid}/task/{pid}/children").read_text().split()

with browser(*programs()) as driver:
    served = driver.service.process.pid
    shown = [child for thread in Path(f"/proc/{served}/task").iterdir() for child in (thread / "children").read_text().split()]
    print(served, *shown, *(part for child in shown for part in children(child)), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def runs(pid: str) -> bool:
    """Whether a process is there that has not ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc; only Linux ends a process with its parent")
def test_a_browser_ends_with_a_test_that_is_killed() -> None:
    """The driver, the browser and what the browser started, though the killed test tells them nothing."""
    if programs() is None:
        pytest.skip(MISSING)
    done = subprocess.run(
        [sys.executable, "-c", HOLDING],
        stdout=subprocess.PIPE,
        text=True,
        timeout=120,
        cwd=ROOT,
    )
    assert done.returncode == -signal.SIGKILL
    started = done.stdout.split()
    assert len(started) > 2, "a driver, a browser and its parts"
    until = monotonic() + 30.0
    while any(map(runs, started)) and monotonic() < until:
        sleep(0.05)
    assert [pid for pid in started if runs(pid)] == []

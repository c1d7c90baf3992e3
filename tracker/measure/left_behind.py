"""Ending a process with all it has started, however it ended and whichever process is there to see to it.

The process is the first of a session of its own, in which what it starts stays, whatever process groups it makes. What
makes a session for itself, as servers do, is known by a word of its environment, which every process hands on. On Linux
both are looked up; elsewhere the first process group has to do.
"""

from __future__ import annotations

import os
import select
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

MARK = "TRACKER_SESSION"  # of the environment: which process it was that all this was started for
ROUNDS = 20  # in which one that starts others while it is looked for is found, too


def end(process: subprocess.Popen[bytes], mark: str = "") -> None:
    """End a process that was started in a session of its own and with this mark, and all of both; its pipes are closed."""
    if os.name != "posix":
        process.kill()
    else:
        with suppress(
            ChildProcessError
        ):  # seen to have ended, but not yet taken away: its number is still its own
            if os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None:
                process.kill()
                os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        end_session(process.pid, mark)
    process.wait()
    for pipe in (process.stdin, process.stdout):
        with suppress(OSError):
            if pipe is not None:
                pipe.close()


def end_session(session: int, mark: str = "") -> None:
    """Kill every process of a session, and all that have a mark, but this one."""
    end_group(session)
    for _ in range(ROUNDS):
        found = [pid for pid in {*_of_session(session), *_with_mark(mark)} if pid != os.getpid()]
        for pid in found:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        if not found:
            return


def end_group(group: int) -> None:
    """Kill every process of a group that has a process of ours, or had one that is not yet taken away."""
    if os.name == "posix" and group not in (0, os.getpgrp()):
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(group, signal.SIGKILL)


def _of_session(session: int) -> list[int]:
    found = []
    for place in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError, ValueError, IndexError):
            state, _, _, its = place.read_text().rpartition(")")[2].split()[:4]
            if int(its) == session and state not in "ZX":
                found.append(int(place.parent.name))
    return found


def _with_mark(mark: str) -> list[int]:
    found = []
    for place in Path("/proc").glob("[0-9]*/environ") if mark else ():
        with suppress(
            OSError
        ):  # another user's, or ended; what has ended and is not taken away has no environment
            if f"{MARK}={mark}".encode() in place.read_bytes().split(b"\0"):
                found.append(int(place.parent.name))
    return found


def how_ended(process: subprocess.Popen[bytes], seconds: float) -> str:
    """How a process ended that is about to, in words; it is not taken away yet."""
    until = time.monotonic() + seconds
    while os.name == "posix" and time.monotonic() < until:
        if (ended := os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG)) is not None:
            code = ended.si_status
            return (
                f"ended with exit code {code}"
                if ended.si_code == os.CLD_EXITED
                else f"was ended by signal {code} ({signal.Signals(code).name})"
            )
        time.sleep(0.005)
    return "stopped answering"


def end_with(lifeline: int) -> None:
    """End this process, the first of its session, and all of that session once the other end of a pipe is gone.

    A process beside it sees to that, in a session of its own: it is there however this one ends, whatever it is doing.
    """
    if os.name != "posix":
        return  # no sessions there: the workers' own lifelines have to do
    session, (ours, kept) = os.getpid(), os.pipe()
    if os.fork() == 0:
        os.close(kept)
        _watch(session, lifeline, ours)
    os.close(ours)  # the other end stays open until this process ends; what it starts does not inherit it


def _watch(session: int, *pipes: int) -> None:
    """Until the process that asked, or the one watched, is gone."""
    try:
        os.setsid()
        for number in map(int, os.listdir("/dev/fd")):  # noqa: PTH208 - numbers, not paths
            if number not in pipes:
                with suppress(OSError):
                    os.close(number)
        watched = select.poll()
        for pipe in pipes:
            watched.register(pipe, 0)  # its end alone, not what is written to it
        watched.poll()
        end_session(session, os.environ.get(MARK, ""))
    finally:
        os._exit(0)

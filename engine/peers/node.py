"""Engines written in JavaScript: found in a node_modules folder, run by Node, one process an engine.

The process gets a task as a line of JSON and answers with a line of JSON and the states as float64, so nothing is
rounded. It waits for the next task, because starting Node and compiling an engine takes longer than most simulations.
What does not answer in time is ended; what dies is a crash; either way the next task has a new process.
"""

from __future__ import annotations

import atexit
import json
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from itertools import chain
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from ..recording import Recording
from ..result import Array

GRACE = 20.0  # s beyond its time limit in which a process must start and answer
HEAP = 2048  # MB that JavaScript may take
FOLDER = "TRACKER_NODE_MODULES"  # names a node_modules folder elsewhere


class NodeError(RuntimeError):
    """The process died without an answer."""


def package(name: str) -> Path:
    """The folder of an npm package: in $TRACKER_NODE_MODULES, here, or above. Raises ImportError if missing."""
    if shutil.which("node") is None:
        raise ImportError("Node is not installed")
    here = Path.cwd()
    folders = [folder / "node_modules" for folder in (here, *here.parents)]
    if os.environ.get(FOLDER):
        folders.insert(0, Path(os.environ[FOLDER]))
    for folder in folders:
        if (folder / name / "package.json").is_file():
            return folder / name
    raise ImportError(f"no npm package {name} in a folder node_modules here or above, nor in ${FOLDER}")


def facts(folder: Path) -> dict[str, Any]:
    """The package's own description."""
    found: dict[str, Any] = json.loads((folder / "package.json").read_text(encoding="utf-8"))
    return found


def entry(folder: Path) -> str:
    """Address of the package's module, for `import`."""
    described = facts(folder)
    address = (folder / str(described.get("module", described.get("main", "index.js")))).resolve().as_uri()
    return str(address)


def run(script: Path, task: dict[str, Any], time_limit: float | None) -> Recording:
    """One simulation by `script`; a process that hangs is ended and timed out. Raises NodeError if it died."""
    place = (os.getpid(), script, HEAP)
    with _ONE_AT_A_TIME:
        if place in _SERVED and not _SERVED[place].alive():  # it died idle: no fault of this task
            _SERVED.pop(place).end()
        if place not in _SERVED:
            _SERVED[place] = Served(script)
        try:
            head, states = _SERVED[place].answer(task, None if time_limit is None else time_limit + GRACE)
        except TimeoutError:
            _SERVED.pop(place).end()
            return _nothing(task, f"no answer within {time_limit:g} s, so its process was ended")
        except EOFError:
            raise NodeError(_SERVED.pop(place).last_words()) from None
        except BaseException:  # an interrupted answer would be taken for the next one's
            _SERVED.pop(place).end()
            raise
    return _recording(task, head, np.frombuffer(states, dtype="<f8"))


class Served:
    """A process that answers one task after the other."""

    def __init__(self, script: Path) -> None:
        self._name = script.stem
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 (open as long as the process lives)
        self._process = subprocess.Popen(
            ["node", f"--max-old-space-size={HEAP}", str(script)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            bufsize=0,
            preexec_fn=_prepared if sys.platform == "linux" else None,
        )

    def answer(self, task: dict[str, Any], timeout: float | None) -> tuple[dict[str, Any], bytes]:
        """Head and states. Raises TimeoutError after `timeout` seconds, EOFError where the process died."""
        until = None if timeout is None else monotonic() + timeout
        self._errors.seek(0)  # what it said of earlier tasks
        self._errors.truncate()
        self._give(json.dumps(task).encode() + b"\n", until)
        got = bytearray()
        while (end := got.find(b"\n")) < 0:
            got += self._piece(until)
        head = json.loads(got[:end])
        while len(got) < end + 1 + head["bytes"]:
            got += self._piece(until)
        return head, bytes(got[end + 1 :])

    def alive(self) -> bool:
        """Whether it waits for a task."""
        return self._process.poll() is None

    def _give(self, task: bytes, until: float | None) -> None:
        """A pipe holds less than a large task, and a process that hangs reads none of it: writing may time out, too."""
        assert self._process.stdin is not None
        left = memoryview(task)
        try:
            while left:
                if not select.select([], [self._process.stdin], [], _rest(until))[1]:
                    raise TimeoutError
                left = left[os.write(self._process.stdin.fileno(), left[: select.PIPE_BUF]) :]
        except BrokenPipeError:
            raise EOFError from None

    def _piece(self, until: float | None) -> bytes:
        assert self._process.stdout is not None
        if not select.select([self._process.stdout], [], [], _rest(until))[0]:
            raise TimeoutError
        piece = os.read(self._process.stdout.fileno(), 1 << 20)
        if not piece:
            raise EOFError
        return piece

    def end(self) -> None:
        """Nothing is left of it afterwards."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._errors):
            assert pipe is not None
            pipe.close()

    def last_words(self) -> str:
        """Why it died, in a line; nothing is left of it afterwards."""
        with suppress(subprocess.TimeoutExpired):  # it may have closed its output and run on
            self._process.wait(GRACE)
        code = self._process.poll()
        self._errors.seek(0)
        text = self._errors.read().decode(errors="replace")
        self.end()
        words = [line.strip() for line in text.splitlines() if line.strip()]
        said = next((line for line in words if re.match(r"\w*Error: |FATAL", line)), "it said nothing")
        return f"the process of {self._name} ended with {code}: {said[:200]}"


def _rest(until: float | None) -> float | None:
    return None if until is None else max(0.0, until - monotonic())


_SERVED: dict[tuple[int, Path, int], Served] = {}
_ONE_AT_A_TIME = threading.Lock()


@atexit.register
def _end_all() -> None:
    for place in [place for place in _SERVED if place[0] == os.getpid()]:
        _SERVED.pop(place).end()


def _prepared() -> None:
    """In the new process: no limit of addresses, of which Node reserves many it never uses (HEAP says what it may
    take), and an end with the process that asked, in whatever loop it is.
    """
    import ctypes
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (hard, hard))
    if threading.current_thread() is threading.main_thread():  # the death of another thread would end it, too
        die_with_parent = 1  # PR_SET_PDEATHSIG
        ctypes.CDLL(None).prctl(die_with_parent, int(signal.SIGKILL))


def _recording(task: dict[str, Any], head: dict[str, Any], states: Array) -> Recording:
    """`forces_of` says how many numbers follow the bodies' for which constraint, `contacts_of` which pairs of bodies
    have three more each, and `depth` that one more is the deepest.
    """
    forces, pairs = task.get("forces_of", {}), task.get("contacts_of", ())
    widths = [13 * len(task["bodies"]), *forces.values(), 3 * len(pairs), int(task.get("depth", False))]
    rows = states.reshape(head["kept"], sum(widths))
    states, *forced, contacts, depth = np.split(rows, np.cumsum(widths)[:-1], axis=1)
    names = task.get("names", ())
    whole = states.reshape(head["kept"], -1, 13)
    samples = range(task["steps"] + 1) if task["every_step"] else (0, task["steps"])
    return Recording(
        samples=np.array(samples[: head["kept"]], dtype=np.int64),
        positions=whole[:, :, :3],
        orientations=whole[:, :, 3:7],
        velocities=whole[:, :, 7:10],
        angular_velocities=whole[:, :, 10:],
        steps=head["steps"],
        seconds=head["seconds"],
        cpu_seconds=head["cpu_seconds"],
        setup_seconds=head["setup_seconds"],
        constraint_forces={
            name: rows[:, 0] if forces[name] == 1 else rows for name, rows in zip(forces, forced, strict=True)
        },
        contact_forces={
            (names[i], names[j]): contacts[:, 3 * place : 3 * place + 3] for place, (i, j) in enumerate(pairs)
        },
        penetration=depth[:, 0] if depth.size else None,
        status=head["status"],
        failure=head["failure"],
    )


def _nothing(task: dict[str, Any], failure: str) -> Recording:
    bodies = [[*b["position"], *b["orientation"], *b["velocity"], *b["spin"]] for b in task["bodies"]]
    more = sum(task.get("forces_of", {}).values()) + 3 * len(task.get("contacts_of", ()))
    more += int(task.get("depth", False))
    start = np.array([*chain.from_iterable(bodies), *[0.0] * more])
    head = {
        "kept": 1,
        "steps": 0,
        "status": "timed_out",
        "failure": failure,
        "seconds": 0.0,
        "cpu_seconds": 0.0,
        "setup_seconds": 0.0,
    }
    return _recording(task, head, start)

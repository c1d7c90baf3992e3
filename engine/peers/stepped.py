"""What engines that are stepped from Python share: the loop with its clock, and arrays that fill up as it goes."""

from __future__ import annotations

import contextlib
import ctypes
import math
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..protocol import Task
from ..recorded_joints import coordinate
from ..recording import Recording
from ..result import Array

TURN = 2.0 * math.pi  # rad
BLOCK = 1000  # steps between two looks at the clock where nothing is recorded between, at most
LOOK = 0.05  # s after which it is looked at again, or sooner
UNSEEN = 16  # steps between two looks at hinges whose turns are counted, at most
MOST_HEARD = 100_000  # bytes of what an engine has written last


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """What an engine writes past Python, to standard output or error, goes nowhere; its outcome says it."""
    with Path(os.devnull).open("wb") as nowhere, _written_to(nowhere.fileno()):
        yield


@contextlib.contextmanager
def overheard() -> Iterator[Callable[[], str]]:
    """The same; it gives a function that tells what has been written so far."""
    with tempfile.TemporaryFile() as kept, _written_to(kept.fileno()):

        def heard() -> str:
            _flush()
            size = os.fstat(kept.fileno()).st_size
            first = max(0, size - MOST_HEARD)
            return os.pread(kept.fileno(), size - first, first).decode(errors="replace")

        yield heard


@contextlib.contextmanager
def _written_to(place: int) -> Iterator[None]:
    """Standard output and error, until the end, to that open file."""
    _flush()
    kept = [os.dup(1), os.dup(2)]
    try:
        os.dup2(place, 1)
        os.dup2(place, 2)
        yield
    finally:
        _flush()
        for number, whole in enumerate(kept, start=1):
            os.dup2(whole, number)
            os.close(whole)


def _flush() -> None:
    """What Python and C keep back of both."""
    sys.stdout.flush()
    sys.stderr.flush()
    with contextlib.suppress(OSError, TypeError, AttributeError):  # Windows has no such library
        ctypes.CDLL(None).fflush(None)


class Kept:
    """One row a sample."""

    def __init__(self, count: int, n: int) -> None:
        self.count, self.length = 0, count
        self.positions, self.velocities = np.empty((count, n, 3)), np.zeros((count, n, 3))
        self.spins, self.orientations = np.zeros((count, n, 3)), np.empty((count, n, 4))
        self.contacts, self.depths = np.zeros(count), np.zeros(count)
        self.forces: dict[str, list[Any]] = {}
        self.pairs: dict[tuple[str, str], Array] = {}

    def pair(self, pair: tuple[str, str]) -> Array:
        """Contact forces [N] on the first of two bodies, a row a sample."""
        if pair not in self.pairs:
            self.pairs[pair] = np.zeros((self.length, 3))
        return self.pairs[pair]


class _Turns:
    """Counts turns of hinges by looks that are close enough together for an eighth of a turn between them."""

    def __init__(self, task: Task, read: Callable[[Kept, int, int], None]) -> None:
        self.task, self.read = task, read
        self.joints = [task.scene.constraint(name) for name in task.counted]
        places = {body.name: k for k, body in enumerate(task.scene.bodies)}
        self.ends = [[places[end] for end in joint.between if end in places] for joint in self.joints]
        self.angles = np.zeros(len(self.joints))
        self.now = np.zeros((len(task.samples), len(self.joints)))  # rad, a row a sample
        self.steps = 1 if self.joints else BLOCK  # until the next look

    def look(self, kept: Kept, row: int) -> None:
        """At what has just been read."""
        fastest = 0.0
        for k, (joint, ends) in enumerate(zip(self.joints, self.ends, strict=True)):
            where, turns = kept.positions[row : row + 1], kept.orientations[row : row + 1]
            angle = float(coordinate(self.task.scene, joint, where, turns)[0])
            self.angles[k] = angle + TURN * round((self.angles[k] - angle) / TURN)
            fastest = max(fastest, sum(float(np.linalg.norm(kept.spins[row, end])) for end in ends))
        soonest = 0.125 * TURN / (self.task.time_step * fastest) if fastest else math.inf
        self.steps = max(1, int(min(soonest, 2 * self.steps, UNSEEN))) if math.isfinite(fastest) else 1

    def glance(self, sample: int) -> None:
        """Between samples; nothing is kept but the turns."""
        if self.joints:
            seen = Kept(1, len(self.task.scene.bodies))
            self.read(seen, 0, sample)
            if np.isfinite(seen.orientations).all():
                self.look(seen, 0)

    def keep(self, kept: Kept, row: int) -> None:
        """At a sample."""
        if self.joints:
            if np.isfinite(kept.orientations[row]).all():
                self.look(kept, row)
            self.now[row] = self.angles


def stepped(
    task: Task,
    step: Callable[[int], None],
    read: Callable[[Kept, int, int], None],
    setup: float,
    health: Callable[[], str] = lambda: "",
) -> Recording:
    """Take all steps of a task: `step(n)` takes n, `read(kept, row, sample)` keeps the state of now.

    `health` says in words what went wrong in the engine, or nothing. Only the steps are timed; the time limit is one of
    the processor's time, so that a busy machine changes no outcome.
    """
    samples = [int(sample) for sample in task.samples]
    kept = Kept(len(samples), len(task.scene.bodies))
    done, failure, status, spent, worked, block = 0, "", "completed", 0.0, 0.0, 1
    entered = time.process_time()
    turns = _Turns(task, read)
    read(kept, 0, 0)
    turns.keep(kept, 0)
    kept.count = 1
    for row, sample in enumerate(samples[1:], start=1):
        while done < sample and status == "completed":
            taken = min(block, sample - done, turns.steps)
            since, began = time.process_time(), time.perf_counter()
            try:
                step(taken)
            except RuntimeError as error:  # what the engine could not do is an outcome
                status, failure = "diverged", " ".join(str(error).split())[:200]
                break
            took = time.perf_counter() - began
            spent += took
            worked += time.process_time() - since
            done += taken
            block = min(2 * block, BLOCK) if took < LOOK else max(block // 2, 1)
            failure = health()
            if failure:
                status, failure = "diverged", f"{failure} by step {done}"
            elif task.time_limit is not None and time.process_time() - entered > task.time_limit:
                status = "timed_out"
                failure = f"the time limit of {task.time_limit:g} s was reached before step {done + 1}"
            elif done < sample:
                turns.glance(done)
        if status != "completed":
            break
        read(kept, row, sample)
        turns.keep(kept, row)
        kept.count = row + 1
        if not (np.isfinite(kept.positions[row]).all() and np.isfinite(kept.velocities[row]).all()):
            status, failure = "not_finite", f"a value is not finite by step {done}"
            break
    count = kept.count
    return Recording(
        samples=np.array(samples[:count], dtype=np.int64),
        positions=kept.positions[:count],
        orientations=kept.orientations[:count],
        velocities=kept.velocities[:count],
        angular_velocities=kept.spins[:count],
        steps=done,
        seconds=spent,
        cpu_seconds=worked,
        setup_seconds=setup,
        constraint_forces={name: np.array(values) for name, values in kept.forces.items()},
        contact_forces={pair: kept.pair(pair)[:count] for pair in kept.pairs},
        contact_count=kept.contacts[:count],
        penetration=kept.depths[:count],
        turned={name: turns.now[:count, k] for k, name in enumerate(task.counted)},
        status=status,  # type: ignore[arg-type]
        failure=failure,
    )

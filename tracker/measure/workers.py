"""Processes that do pieces of work, each watched: one that hangs, dies or takes too much memory costs its piece.

A worker has one piece at a time and a pipe of its own, so it is always known whose piece is lost. Nothing
outlives the supervisor: leaving `answers` by whatever way kills every worker at once, and a worker whose
supervisor is gone (killed, even) ends itself.
"""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import connection as waiting
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Generic, Literal, Protocol, TypeVar

from . import left_behind
from .bounds import MEMORY, START_LIMIT, TIME_LIMIT

WORTH = 1.0  # s of work after which further processes are worth what they take to start
DIED = "the engine's process died while answering"
NOWHERE = -1  # in a piece of work that has no places, or at none of them

Piece = TypeVar("Piece")
Answer = TypeVar("Answer")


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What one piece of work may take."""

    seconds: float = TIME_LIMIT  # of wall time
    memory: int = MEMORY << 20  # bytes more than the process has at its start; 0: no limit


@dataclass(frozen=True)
class Lost:
    """A piece without an answer: how it ended, and one sentence."""

    outcome: Literal["crashed", "timed_out"]
    failure: str
    at: int = NOWHERE  # the place in the piece of work where it ended, as `at` said it


def answers(
    perform: Callable[[Piece], Answer],
    pieces: Sequence[Piece],
    workers: int,
    limits: Limits,
    subject: Callable[[Piece], Hashable] = lambda piece: None,
) -> Iterator[tuple[Piece, Answer | Lost]]:
    """Every piece with what `perform` made of it, or Lost, as they come. What `perform` raises is raised.

    `perform` and the pieces are sent to processes, so both must be picklable; `workers` is at least 1. One begins,
    the others join when the work has lasted a while: a question of milliseconds does not pay for two imports.
    Pieces on one `subject` go to one process as long as there is other work: what it has found out serves the next.
    """
    left = deque(pieces)
    crew: list[_Worker[Piece, Answer]] = []

    def next_for(worker: _Worker[Piece, Answer] | None) -> Piece:
        own = () if worker is None else (subject(worker.piece),)
        taken = {subject(other.piece) for other in crew if other is not worker}
        found = next((piece for piece in left if subject(piece) in own), None)
        if found is None:
            found = next((piece for piece in left if subject(piece) not in taken), left[0])
        left.remove(found)
        return found

    since = math.inf  # when the first of them had read its program and began
    try:
        while left or crew:
            since = min([since, *(worker.begun for worker in crew)])
            wanted = workers if time.monotonic() >= since + WORTH else 1
            while left and len(crew) < wanted:
                piece = next_for(None)
                crew.append(_Worker(_ahead.pop() if _ahead else _Process(), perform, limits))
                crew[-1].give(piece)
            moments = [worker.deadline for worker in crew]
            soonest = (
                min([*moments, since + WORTH] if left and wanted < workers else moments) - time.monotonic()
            )
            waiting.wait([worker.pipe for worker in crew], timeout=max(0.0, soonest))
            for worker in list(crew):
                found = worker.look()
                if found is None:
                    continue
                (answer,) = found
                yield worker.piece, answer  # kept before the next is begun, whatever interrupts that
                if left and not isinstance(answer, Lost):
                    worker.give(next_for(worker))
                else:
                    crew.remove(worker)
                    worker.end()
    finally:
        for worker in crew:
            left_behind.end_group(worker.process.pid or 0)
            worker.process.kill()
        for worker in crew:
            worker.end()


class _Process:
    """A process and our ends of its pipes: it is told what to do, and then piece by piece."""

    def __init__(self, *, forked: bool = False) -> None:
        context = get_context("fork") if forked else get_context("spawn")
        self.pipe, theirs = context.Pipe()
        end, self.lifeline = context.Pipe(duplex=False)
        self.place = context.RawValue("i", NOWHERE)
        arguments = (theirs, end, os.getpid(), self.place)
        self.process = context.Process(target=_serve, args=arguments, daemon=True)
        self.process.start()
        theirs.close()
        end.close()


class _Worker(Generic[Piece, Answer]):
    """The supervisor's end of one process."""

    piece: Piece

    def __init__(self, begun: _Process, perform: Callable[[Piece], Answer], limits: Limits) -> None:
        self.process, self.pipe = begun.process, begun.pipe
        self.lifeline, self.place = begun.lifeline, begun.place
        self.limits = limits
        with suppress(OSError):  # it is dead already, which the first look will find
            self.pipe.send((perform, limits.memory))
        self.deadline = time.monotonic() + START_LIMIT
        self.begun = math.inf  # when it began its first piece

    def give(self, piece: Piece) -> None:
        self.piece = piece
        self.place.value = NOWHERE
        with suppress(OSError):  # it is dead already, which the next look will find
            self.pipe.send(piece)

    def look(self) -> tuple[Answer | Lost] | None:
        """The answer, which may be None, alone in a tuple; Lost if there will be none; None while it is at work."""
        try:
            while self.pipe.poll():
                kind, content = self.pipe.recv()
                if kind == "begun":
                    self.begun = min(self.begun, time.monotonic())
                    self.deadline = time.monotonic() + self.limits.seconds
                elif kind == "raised":
                    raise content
                else:
                    self.deadline = time.monotonic() + self.limits.seconds
                    answer: Answer = content
                    return (answer,)
        except (EOFError, OSError):
            return (Lost("crashed", DIED, self.place.value),)
        if time.monotonic() < self.deadline:
            return None
        why = f"no answer within {self.limits.seconds:g} s, so its process was ended"
        return (Lost("timed_out", why, self.place.value),)

    def end(self) -> None:
        left_behind.end_group(self.process.pid or 0)  # with whatever the piece has started
        self.process.kill()
        self.process.join()
        self.process.close()
        self.pipe.close()
        self.lifeline.close()


_ahead: list[_Process] = []  # forked before there was work for them


def fork_ahead() -> None:
    """Fork the first worker of this process' next `answers`, where that is safe: before anything of a team's own is
    imported. What is ours, and NumPy, it need not import once more; engines and questions it imports itself, as a spawned one does."""
    if sys.platform == "linux":
        _ahead.append(_Process(forked=True))


class Place(Protocol):
    """A number in memory that a worker and its supervisor share."""

    value: int


_place: Place | None = None  # of this process, if it is a worker: memory its supervisor sees


def at(place: int) -> None:
    """Say where in its piece of work a worker is; costs a store to memory and wakes no process, while time is taken."""
    if _place is not None:
        _place.value = place


def _serve(pipe: Connection, lifeline: Connection, parent: int, place: Place) -> None:
    """The life of a worker: what is to be done with pieces; then a piece, its answer, the next piece."""
    global _place
    _place = place
    _ahead.clear()
    _close_all_but({pipe.fileno(), lifeline.fileno()})
    _alone()
    _never_outlive(lifeline, parent)
    warnings.simplefilter("ignore")  # what a worker has to say, it says in samples
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the supervisor decides what an interruption means
    try:
        perform, memory = pipe.recv()
    except (EOFError, OSError):
        return  # there was no work
    _bound_memory(memory)
    own = os.getpid()
    while True:
        try:
            piece = pipe.recv()
        except (EOFError, OSError):
            return
        pipe.send(("begun", None))
        found = _answer(perform, piece, place)
        if os.getpid() != own:
            os._exit(1)  # a copy that an engine has forked and let come back: it would answer once more
        pipe.send(found)


def _answer(
    perform: Callable[[Piece], Answer], piece: Piece, place: Place
) -> tuple[str, Answer | Lost | Exception]:
    try:
        return "answer", perform(piece)
    except MemoryError:
        return "answer", Lost("crashed", "the piece of work ran out of memory", place.value)
    except Exception as error:
        return "raised", error


def _close_all_but(ours: set[int]) -> None:
    """What a new program would not have, no worker may keep: the channel that tells a run, others' lifelines."""
    for number in map(int, os.listdir("/dev/fd")) if os.name == "posix" else ():  # noqa: PTH208 - numbers, not paths
        with suppress(OSError):
            if number not in ours and not os.get_inheritable(number):
                os.close(number)


def _alone() -> None:
    """A process group of its own, and no stream of ours: what an adapter starts ends with it and delays no reader."""
    if os.name == "posix":
        os.setpgid(0, 0)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)


def _never_outlive(lifeline: Connection, parent: int) -> None:
    """End this process with its supervisor: the kernel sees to it on Linux, a thread elsewhere."""

    def watch() -> None:
        with suppress(EOFError, OSError):
            lifeline.recv_bytes()  # nothing is ever sent: it returns when the other end is gone
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    if sys.platform == "linux":  # the thread cannot run while native code keeps the interpreter
        import ctypes

        die_with_parent = 1  # PR_SET_PDEATHSIG
        ctypes.CDLL(None).prctl(die_with_parent, int(signal.SIGKILL))
        if os.getppid() != parent:
            os._exit(1)


def _bound_memory(more: int) -> None:
    """Let this process take `more` bytes than it has now; beyond that, asking for memory fails."""
    if not more or sys.platform != "linux":
        return
    import resource

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    wanted = pages * resource.getpagesize() + more
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    if hard == resource.RLIM_INFINITY or wanted < hard:
        resource.setrlimit(resource.RLIMIT_AS, (wanted, hard))

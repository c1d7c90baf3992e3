"""Where pieces of work are done: in watched processes here, or on any `concurrent.futures` executor.

    process                 processes of this machine, each watched (tracker.measure.workers); the default
    dask://HOST:PORT        the workers of a Dask cluster; the extra spook-tracker[dask]
    module:factory          `factory()` returns an executor, such as a pool of MPI or of a batch system

A value depends on the engine and on how this kind of processor rounds, not on what computes it: each piece comes
back with the version and the float environment it was computed in, and one that differs from this machine's is
refused. It also says on which machine: a run names its workers. Wall time and memory of a piece are bounded by "process" only; elsewhere they are the cluster's affair.
Run times are never taken there: they need a machine of which is known that it is quiet, which is this one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Protocol, TypeVar

from spook_tracker.engine.find import look_beside
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import Machine

from .bounds import PROCESS as PROCESS
from .machine import machine
from .workers import Lost

if TYPE_CHECKING:
    from concurrent.futures import Future

    from .questions import Engine

DASK = "dask://"
Piece = TypeVar("Piece")
Answer = TypeVar("Answer")
PATIENCE = 20  # s to find a scheduler
KILLED = Lost("crashed", "the worker died while answering, more than once")


class ExecutorError(TrackerError):
    """The executor cannot be had, or its workers are not like this machine; one sentence with the way out."""


@dataclass(frozen=True)
class Place:
    """In what a piece was computed: places that are alike give equal bits."""

    engine: str  # version and commit
    machine: Machine

    def like(self, other: Place) -> bool:
        return self._decisive() == other._decisive()

    def __str__(self) -> str:
        return " and floats ".join(self._decisive())

    def _decisive(self) -> tuple[str, str]:
        return self.engine, self.machine.float_environment


class Submits(Protocol):
    """What is asked of an executor while it works."""

    def submit(self, function: Callable[..., Answer], *arguments: object) -> Future[Answer]:
        """As concurrent.futures has it."""
        ...


def answers(
    name: str,
    perform: Callable[[Piece], Answer],
    pieces: Sequence[Piece],
    place: Callable[[], Place],
    told: Callable[[Machine], None] = lambda machine: None,
) -> Iterator[tuple[Piece, Answer | Lost]]:
    """Every piece with what `perform` made of it, or Lost, as they come; what is left is cancelled at the end. Dask gives up
    what waits at a worker that dies together with what killed it: where it gave up several, each is asked once more, alone.

    `place` is called beside every piece, `told` with the machine of every answer. ExecutorError if a worker's place is
    not like this one.
    """
    here = place()
    with _executor(name) as executor:
        waiting: dict[Future[tuple[Answer, Place]], Piece] = {
            executor.submit(_placed, perform, place, piece): piece for piece in pieces
        }

        def taken(future: Future[tuple[Answer, Place]]) -> Answer | Lost:
            came = _answer(future)
            answer, there = came
            if there is not None:
                if not there.like(here):
                    raise ExecutorError(
                        f"a worker of {name} is not like this machine ({there} there, {here} here): its values "
                        "could not be compared; install the same build there, or use machines of the same kind"
                    )
                told(there.machine)
            return answer

        try:
            killed: list[Piece] = []
            for future in _completed(waiting):
                if (answer := taken(future)) is KILLED:
                    killed.append(waiting[future])
                else:
                    yield waiting[future], answer
            for piece in killed:  # each dies for itself, or had only stood behind another that did
                if len(killed) > 1:
                    again = executor.submit(_placed, perform, place, piece)
                    waiting[again] = piece
                    yield piece, taken(again)
                else:
                    yield piece, KILLED
        finally:
            for future in waiting:
                future.cancel()


def _placed(
    perform: Callable[[Piece], Answer], place: Callable[[], Place], piece: Piece
) -> tuple[Answer, Place]:
    """A piece's answer and where it was found; runs in the worker."""
    return perform(piece), place()


def _answer(future: Future[tuple[Answer, Place]]) -> tuple[Answer | Lost, Place | None]:
    """What came of a piece. A worker that dies costs its piece; what `perform` raises is raised."""
    from concurrent.futures import CancelledError  # most runs need no executor
    from concurrent.futures.process import BrokenProcessPool

    try:
        answer, there = future.result()
        return answer, there
    except (BrokenProcessPool, CancelledError):
        return Lost("crashed", "the worker died while answering"), None
    except Exception as error:
        if type(error).__name__ == "KilledWorker":  # Dask's own word for the same
            return KILLED, None
        raise


def place_of(engine: Engine) -> Place:
    """Where this process computes, with this engine."""
    info = engine.build_info
    return Place(f"{info.name} {info.version} {info.git_hash[:10]}".strip(), machine())


@contextmanager
def _executor(name: str) -> Iterator[Submits]:
    if name.startswith(DASK):
        with _dask(name) as executor:
            yield executor
        return
    module, _, factory = name.partition(":")
    look_beside()
    try:
        made = getattr(import_module(module), factory or "executor")()
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        raise ExecutorError(
            f"there is no executor {name!r} ({error}); say process, dask://HOST:PORT, or module:factory"
        ) from None
    if not hasattr(made, "submit"):
        raise ExecutorError(f"{name} gives a {type(made).__name__}, which has no submit; it is no executor")
    try:
        yield made
    finally:
        made.shutdown(wait=False, cancel_futures=True)


@contextmanager
def _dask(address: str) -> Iterator[Submits]:
    try:
        distributed = import_module("distributed")
    except ImportError:
        raise ExecutorError("Dask needs a package; install spook-tracker[dask]") from None
    try:
        client = distributed.Client(f"tcp://{address.removeprefix(DASK)}", timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise ExecutorError(f"no Dask scheduler answers at {address}: {error!s:.200}") from None
    try:
        if not client.scheduler_info()["workers"]:
            raise ExecutorError(f"the Dask cluster at {address} has no workers; start some with: dask worker")
        yield _DaskExecutor(client)
    finally:
        client.close()


class DaskClient(Protocol):
    """What is asked of Dask's client."""

    def submit(self, function: Callable[..., Answer], *arguments: object, pure: bool) -> Future[Answer]:
        """A task; equal ones are the same unless it is not pure."""
        ...


class _DaskExecutor:
    """`submit` of a Dask client: pure functions of pieces that may be equal, each asked for by itself."""

    def __init__(self, client: DaskClient) -> None:
        self._client = client

    def submit(self, function: Callable[..., Answer], *arguments: object) -> Future[Answer]:
        return self._client.submit(function, *arguments, pure=False)


def _completed(
    waiting: Mapping[Future[tuple[Answer, Place]], Piece],
) -> Iterator[Future[tuple[Answer, Place]]]:
    """Futures as they are done; Dask has its own."""
    from concurrent.futures import Future, as_completed

    first = next(iter(waiting), None)
    if first is None or isinstance(first, Future):
        return as_completed(waiting)
    found: Iterator[Future[tuple[Answer, Place]]] = iter(
        import_module("distributed").as_completed(list(waiting))
    )
    return found

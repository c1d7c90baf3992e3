"""Where pieces of work are done: in watched processes here, or on any `concurrent.futures` executor.

    process                 processes of this machine, each watched (tracker.measure.workers); the default
    dask://HOST:PORT        the workers of a Dask cluster; the extra spook-tracker[dask]
    module:factory          `factory()` returns an executor, such as a pool of MPI or of a batch system

A value depends on the engine and on how this kind of processor rounds, not on who computes it: each piece comes
back with the version and the float environment it was computed in, and one that differs from this machine's is
refused. It also says on which machine: a run names its workers. Wall time and memory of a piece are bounded by "process" only; elsewhere they are the cluster's affair.
Run times are never taken there: they need a machine of which is known that it is quiet, which is this one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from spook_tracker.engine.find import look_beside
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import Machine
from spook_tracker.tracker.measure.machine import machine
from spook_tracker.tracker.measure.workers import Lost

PROCESS = "process"
DASK = "dask://"
PATIENCE = 20  # s to find a scheduler


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


def answers(
    name: str,
    perform: Callable[[Any], Any],
    pieces: Sequence[Any],
    place: Callable[[], Place],
    told: Callable[[Machine], None] = lambda machine: None,
) -> Iterator[tuple[Any, Any]]:
    """Every piece with what `perform` made of it, or Lost, as they come; what is left is cancelled at the end.

    `place` is called beside every piece, `told` with the machine of every answer. ExecutorError if a worker's place is
    not like this one.
    """
    here = place()
    with _executor(name) as executor:
        waiting: dict[Future[Any], Any] = {
            executor.submit(_placed, perform, place, piece): piece for piece in pieces
        }
        try:
            for future in _completed(waiting):
                answer, there = _answer(future)
                if there is not None:
                    if not there.like(here):
                        raise ExecutorError(
                            f"a worker of {name} is not like this machine ({there} there, {here} here): its values "
                            "could not be compared; install the same build there, or use machines of the same kind"
                        )
                    told(there.machine)
                yield waiting[future], answer
        finally:
            for future in waiting:
                future.cancel()


def _placed(perform: Callable[[Any], Any], place: Callable[[], Place], piece: Any) -> tuple[Any, Place]:
    """A piece's answer and where it was found; runs in the worker."""
    return perform(piece), place()


def _answer(future: Future[Any]) -> tuple[Any, Place | None]:
    """What came of a piece. A worker that dies costs its piece; what `perform` raises is raised."""
    try:
        answer, there = future.result()
        return answer, there
    except (BrokenProcessPool, CancelledError):
        return Lost("crashed", "the worker died while answering"), None
    except Exception as error:
        if type(error).__name__ == "KilledWorker":  # Dask's own word for the same
            return Lost("crashed", "the worker died while answering, more than once"), None
        raise


def place_of(engine: Any) -> Place:
    """Where this process computes, with this engine."""
    info = engine.build_info
    return Place(f"{info.name} {info.version} {info.git_hash[:10]}".strip(), machine())


@contextmanager
def _executor(name: str) -> Iterator[Executor]:
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
def _dask(address: str) -> Iterator[Any]:
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


class _DaskExecutor:
    """`submit` of a Dask client: pure functions of pieces that may be equal, each asked for by itself."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def submit(self, function: Any, *arguments: Any) -> Any:
        return self._client.submit(function, *arguments, pure=False)


def _completed(waiting: dict[Any, Any]) -> Iterator[Any]:
    """Futures as they are done; Dask has its own."""
    first = next(iter(waiting), None)
    if first is None or isinstance(first, Future):
        return as_completed(waiting)
    found: Iterator[Any] = iter(import_module("distributed").as_completed(list(waiting)))
    return found

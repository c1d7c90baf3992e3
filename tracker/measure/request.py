"""What is asked of a run, and what is told while it goes: known to a command that imports no engine itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from spook_tracker.tracker.document.run_document import RunDocument

from .bounds import MEMORY, PROCESS, TIME_LIMIT

if TYPE_CHECKING:
    from .timing import Repeats

Trigger = Literal["manual", "nightly", "import", "test"]


@dataclass(frozen=True, kw_only=True)
class Request:
    """What to run. No tests named means all of them."""

    tests: tuple[str, ...] = ()
    figures: bool = False
    sweep: bool = False
    stability: bool = False
    trigger: Trigger = "manual"
    workers: int = 2  # processes, each watched; 0: in this one, where nothing can be ended
    time_limit: float = TIME_LIMIT  # s for one piece of work
    look: float | None = None  # s of the processor that a process has for a test; what is left is left out
    memory_limit: int = MEMORY << 20  # bytes for one piece of work
    repeats: int | Repeats = 5  # of each timing
    apart: bool = (
        True  # in a process of its own (tracker.measure.apart): a gate that what is measured cannot open
    )
    executor: str = PROCESS  # where values are measured, as `executors.answers` knows it


@dataclass(frozen=True)
class Progress:
    """What a watcher is told after each piece of work."""

    done: int
    total: int
    test: str
    finished: bool  # every piece of this test is done
    failed: tuple[str, ...] = ()  # series of this piece outside their limits


Watch = Callable[[Progress], None]


class Interrupted(KeyboardInterrupt):
    """The run was interrupted. `document` holds the tests that were finished by then, as a partial run."""

    def __init__(self, document: RunDocument, asked: int) -> None:
        done = f"{len(document.tests)} of {asked} tests were finished"
        super().__init__(f"interrupted; {done} and are recorded as partial run {document.id}")
        self.document = document
        self.asked = asked  # number of tests
        self.recorded = False  # until a caller does

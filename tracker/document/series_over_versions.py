"""A series over versions: the one shape in which histories travel from the store to the judge and the pages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from spook_tracker.tracker.document.run_document import EngineVersion, Machine, Sample, SeriesDefinition


class Run(Protocol):
    """What is read of a run: a stored run, a run document, or any value with these."""

    @property
    def id(self) -> str: ...
    @property
    def started(self) -> str: ...
    @property
    def engine(self) -> EngineVersion: ...
    @property
    def machine(self) -> Machine: ...


class Point(NamedTuple):
    """One value of a series, and the definition hash it was measured under."""

    run: Any  # a Run
    sample: Sample
    test_version: str

    @property
    def value(self) -> float:
        """The value as a float; NaN and infinities are what they are."""
        return float(self.sample.value)


@dataclass(frozen=True, slots=True)
class SeriesHistory:
    """A series over versions, in commit order; `definition` as of the newest run that has it."""

    definition: SeriesDefinition
    points: tuple[Point, ...]

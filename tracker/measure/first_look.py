"""A first look at a model file: what can be known of it in a few seconds, and what was left out for that."""

from __future__ import annotations

import os
import time
import uuid
from collections.abc import Callable
from dataclasses import dataclass, field

from spook_tracker.engine.model_file import ModelRun
from spook_tracker.engine.result import Result
from spook_tracker.engine.scene import Scene
from spook_tracker.scalar_tests.case import OutOfTime
from spook_tracker.tracker.document.run_document import LEFT_OUT, RunDocument, TestCard

from .remembered import Option


@dataclass(frozen=True)
class Share:
    """The time that each process has for a test in one run: the workers of a cluster outlive it."""

    seconds: float  # of the processor
    run: str = field(default_factory=lambda: uuid.uuid4().hex)


@dataclass(frozen=True)
class LeftOut:
    """A measurement that a first look has left out, or broken off."""

    test: str
    configuration: str
    partly: bool
    why: str


@dataclass(eq=False)
class Look:
    """Simulates until this process has spent so many seconds of the processor on a test; then OutOfTime."""

    simulate: Callable[..., Result]
    share: Share
    begun: float
    why: str = ""  # something of this piece of work was left out

    def __call__(self, scene: Scene | ModelRun, time_limit: float | None = None, **options: Option) -> Result:
        if (left := self.left()) <= 0.0:
            self.over("")
        result = self.simulate(scene, time_limit=min(left, time_limit or left), **options)
        if result.status == "timed_out" and self.left() <= 0.0:
            self.over(result.failure)
        return result

    def left(self) -> float:
        """Seconds of the processor."""
        return self.share.seconds - (_spent() - self.begun)

    def over(self, why: str) -> None:
        self.why = self.why or why or "over"
        raise OutOfTime(why)


_looks: dict[str, Look] = {}


def look(test: str, simulate: Callable[..., Result], share: Share) -> Look:
    """The look of this process at a test, for its next piece of work."""
    if (found := _looks.get(test)) is None or found.share != share:
        found = _looks[test] = Look(simulate, share, _spent())
    found.simulate, found.why = simulate, ""
    return found


def _spent() -> float:
    """Seconds of the processor, of this process and of those that it has waited for."""
    return time.process_time() + sum(os.times()[2:4])


def told(card: TestCard, left: list[LeftOut]) -> dict[str, str]:
    """What a card says of what was left out of its test."""
    mine = [one for one in left if one.test == card.name]
    return {LEFT_OUT: ", ".join(map(_said, mine))} if mine else {}


def why_nothing(run: RunDocument) -> str:
    """Of a look in which nothing came to an end."""
    left = [f"{card.name} within a first look: {card.lacks[LEFT_OUT]}" for card in run.tests]
    return f"{run.engine.name} did not finish {'; '.join(left)}; --all gives it more"


def _said(one: LeftOut) -> str:
    if one.partly:
        return f"a part of {one.configuration}"
    return f"{one.configuration} ({one.why})" if one.why else one.configuration

"""Where the questions and the engine of a run are found: by name, so that every process can find them itself.

A command names them and has them asked elsewhere (tracker.measure.apart): engines are imported where they are found.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

from spook_tracker.tracker.document.errors import TrackerError

from .bounds import STANDARD

if TYPE_CHECKING:
    from spook_tracker.engine.build_info import BuildInfo
    from spook_tracker.engine.result import Result
    from spook_tracker.engine.scene import Scene
    from spook_tracker.scalar_tests.case import ScalarTest, Simulate

    from . import limits

PEER_TIME_LIMIT = 10.0  # s per simulation of an engine that is only shown


class Engine(Protocol):
    """What is asked of the module or object that an engine is; `explain` is ours alone."""

    @property
    def build_info(self) -> BuildInfo: ...
    @property
    def simulate(self) -> Simulate: ...
    @property
    def explain(self) -> Callable[..., Sequence[Stage]]: ...


class Stage(Protocol):
    """A stage, kept or left out."""

    @property
    def stage(self) -> str: ...
    @property
    def kept(self) -> bool: ...
    @property
    def reason(self) -> str: ...


class RunError(TrackerError):
    """The run cannot be started as asked; one sentence that names what to do."""


class EngineUnavailable(RunError):
    """The engine is not here; where others were asked, too, they can still answer."""


@dataclass(frozen=True, kw_only=True)
class Questions:
    """Where the questions and the engine are found, by name."""

    catalogue: str = STANDARD  # as `catalogues.find` knows it
    engine: str = "spook"  # as `engine.find` knows it
    limit: float | None = None  # s for one simulation; None leaves it to the test
    patience: float | None = None  # s after which a piece of work begins no further simulation
    every_setting: bool = True  # whether single values are asked in each setting of another engine
    limits: limits.Limits = ()  # a team's own, by series
    folder: str = ""  # where engine and catalogue are looked for beside the folder one stands in

    def tests(self) -> Mapping[str, ScalarTest]:
        """What is asked, by name; found once."""
        return self._tests

    @cached_property
    def _tests(self) -> Mapping[str, ScalarTest]:
        from spook_tracker.engine.find import look_beside

        from . import catalogues, limits, others

        look_beside(self.folder)
        found = catalogues.find(self.catalogue)
        engine = self.module()
        configurations = getattr(engine, "configurations", ())
        if configurations:
            found = others.asked_of(
                found, configurations, bool(getattr(engine, "gating", False)), self.every_setting
            )
        return limits.held_to(found, self.limits) if self.limits else found

    def __getstate__(self) -> dict[str, object]:
        """Without what was found: another process finds it itself."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def module(self) -> Engine:
        """The engine: simulate, build_info, and its configurations if it is not ours; found once."""
        return self._module

    @cached_property
    def _module(self) -> Engine:
        from spook_tracker.engine.find import EngineMissing, find, look_beside

        look_beside(self.folder)
        try:
            found: Engine = find(self.engine)
            return found
        except EngineMissing as error:
            raise EngineUnavailable(str(error)) from None

    def simulate(self) -> Simulate:
        module = self.module()
        try:
            simulate = module.simulate
        except AttributeError:
            raise RunError(f"engine {self.engine!r} has no function simulate; it is not an engine") from None
        limit = self.limit
        if limit is None and hasattr(module, "configurations"):
            limit = PEER_TIME_LIMIT
        if limit is None and self.patience is None:
            return simulate
        return _Limited(simulate, limit, self.patience)


class _Limited:
    """Simulates for so many seconds at a time, and begins nothing once so many are over in all."""

    def __init__(self, simulate: Simulate, limit: float | None, patience: float | None) -> None:
        self.simulate, self.limit, self.patience, self.spent = simulate, limit, patience, 0.0

    def __call__(self, scene: Scene, **options: Any) -> Result:
        from .question import NoAnswer

        if self.patience is not None and self.spent >= self.patience:
            raise NoAnswer("timed_out", f"not tried: the {self.patience:g} s for this question are over")
        if self.limit is not None:
            options["time_limit"] = min(self.limit, options.get("time_limit") or self.limit)
        began, begun = time.process_time(), time.perf_counter()
        theirs, setup = None, 0.0
        try:
            result = self.simulate(scene, **options)
            theirs, setup = (
                getattr(result, "cpu_seconds", 0.0)
                or result.seconds,  # what else the machine does is not its doing
                getattr(result, "stage_seconds", {}).get("setup", 0.0),
            )  # compiling is no running
        finally:
            # Whichever is known: an engine in a process of its own takes none of this one's time, and what raises tells
            # no seconds, so that the clock has to do.
            theirs = time.perf_counter() - begun if theirs is None else theirs
            self.spent += max(time.process_time() - began - setup, theirs)
        return result

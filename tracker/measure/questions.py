"""Where the questions and the engine of a run are found: by name, so that every process can find them itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import spook_tracker.tracker.measure.catalogues as catalogues
import spook_tracker.tracker.measure.limits as limits
import spook_tracker.tracker.measure.others as others
from spook_tracker.engine.find import EngineMissing, find
from spook_tracker.scalar_tests.case import ScalarTest, Simulate
from spook_tracker.tracker.document.errors import TrackerError

PEER_TIME_LIMIT = 10.0  # s of wall time per simulation of an engine that is only shown


class RunError(TrackerError):
    """The run cannot be started as asked; one sentence that names what to do."""


@dataclass(frozen=True, kw_only=True)
class Questions:
    """Where the questions and the engine are found, by name."""

    catalogue: str = catalogues.STANDARD  # as `catalogues.find` knows it
    engine: str = "spook"  # as `engine.find` knows it
    limit: float | None = None  # s of wall time for one simulation; None leaves it to the test
    limits: limits.Limits = ()  # a team's own, by series

    def tests(self) -> Mapping[str, ScalarTest]:
        found = catalogues.find(self.catalogue)
        engine = self.module()
        configurations = getattr(engine, "configurations", ())
        if configurations:
            found = others.asked_of(found, configurations, engine.gating)
        return limits.held_to(found, self.limits) if self.limits else found

    def module(self) -> Any:
        """The engine: simulate, build_info, and its configurations if it is not ours."""
        try:
            return find(self.engine)
        except EngineMissing as error:
            raise RunError(str(error)) from None

    def simulate(self) -> Simulate:
        module = self.module()
        try:
            simulate: Simulate = module.simulate
        except AttributeError:
            raise RunError(f"engine {self.engine!r} has no function simulate; it is not an engine") from None
        limit = self.limit
        if limit is None and hasattr(module, "configurations"):
            limit = PEER_TIME_LIMIT
        return simulate if limit is None else partial(_limited, simulate, limit)


def _limited(simulate: Simulate, limit: float, scene: Any, **options: Any) -> Any:
    """Simulate for at most `limit` seconds of wall time."""
    options["time_limit"] = min(limit, options.get("time_limit") or limit)
    return simulate(scene, **options)

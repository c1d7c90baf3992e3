"""What can go wrong, and what a caller would do about it.

EngineError
├── SceneError (ValueError)       the scene cannot be simulated as written; the message names the culprit
├── MethodError (ValueError)      the time step, a method option or an observable makes no sense
└── SimulationFailed              an observable of an incomplete run was read; the run is in `.result`

A simulation that diverges is not an exception: `simulate` returns a Result whose status says so.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from spook_tracker.engine.result import Result


class EngineError(Exception):
    """Base of every error the engine raises on purpose."""


class SceneError(EngineError, ValueError):
    """The scene cannot be compiled; the message names the body, constraint or force, and the way out."""


class MethodError(EngineError, ValueError):
    """A time step, method option or observable is out of range; the message names it."""


class SimulationFailed(EngineError):
    """An observable of an incomplete run was read; `result` holds the run with its partial data."""

    def __init__(self, result: Result) -> None:
        super().__init__(result.failure)
        self.result = result

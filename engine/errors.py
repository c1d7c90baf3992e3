"""What can go wrong, and what a caller would do about it.

EngineError
├── SceneError (ValueError)       the scene cannot be simulated as written; the message names the culprit
├── MethodError (ValueError)      the time step, a method option or an observable makes no sense
└── SimulationFailed (result.py)  an observable of an incomplete run was read; the run is in `.result`

A simulation that diverges is not an exception: `simulate` returns a Result whose status says so.
"""

from __future__ import annotations

LONGEST = 800  # characters of a message


class EngineError(Exception):
    """Base of every error the engine raises on purpose: one sentence on one line, also where it shows a matrix, and of
    what it shows no more than begins to tell what was given: a hull prints as all its corners."""

    def __init__(self, message: str = "") -> None:
        sentence = " ".join(message.split()) if "\n" in message else message
        if len(sentence) > LONGEST:
            sentence = f"{sentence[: LONGEST - 203]} … {sentence[-200:]}"
        super().__init__(sentence)


class SceneError(EngineError, ValueError):
    """The scene cannot be compiled; the message names the body, constraint or force, and the way out."""


class MethodError(EngineError, ValueError):
    """A time step, method option or observable is out of range; the message names it."""

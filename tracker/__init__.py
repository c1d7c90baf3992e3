"""What changed, and since which commit? Runs scalar tests, records them, judges them, publishes them.

Everything the command line does can be done from here; each name is imported when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .library import (
        History,
        NightlyReport,
        RunOptions,
        SiteOptions,
        compare,
        judge_run,
        nightly,
        publish,
        record,
        run,
    )

__all__ = [
    "History",
    "NightlyReport",
    "RunOptions",
    "SiteOptions",
    "compare",
    "judge_run",
    "nightly",
    "publish",
    "record",
    "run",
]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from . import library

    found: object = getattr(library, name)
    return found


def __dir__() -> list[str]:
    return __all__

"""The order of releases. An engine that comes without commits has its version numbers: 3.9 before 3.10.

So a release measured later than its successors still takes its own place in the history.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import TypeVar

from packaging.version import InvalidVersion, Version

from spook_tracker.tracker.document.run_document import Run

AnyRun = TypeVar("AnyRun", bound=Run)


def in_release_order(runs: Sequence[AnyRun]) -> list[AnyRun]:
    """The runs with those of each engine without commits by version, then as they stood.

    Every engine keeps the places it had among the others. One whose versions are no version numbers keeps all.
    """
    places: dict[str, list[int]] = defaultdict(list)
    for place, run in enumerate(runs):
        places[run.engine.name].append(place)
    found = list(runs)
    for taken in places.values():
        mine = [runs[place] for place in taken]
        if any(run.engine.git_hash for run in mine):
            continue
        try:
            mine.sort(key=lambda run: Version(run.engine.version))
        except InvalidVersion:
            continue
        for place, run in zip(taken, mine, strict=True):
            found[place] = run
    return found

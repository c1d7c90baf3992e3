"""Levels that people have accepted: text in git, not a click.

accepted.toml holds tables like

    [[accepted]]
    series = "pendulum/plain/max_length_deviation/*"   # a key, * matches anything
    range = [0.0, 0.0042]                              # values that are accepted
    who = "a name"
    why = "one sentence"
    until = 2027-01-31                                 # optional: after this day it is red again

and, for a gate or a stability map that is not asked for any more or a value that the engine no longer supports,
`removed = true` in place of the range. A value inside the range is not red until that day and is the new level. What
is not finite is never accepted.

A table [[expected]] without a range (series, who, why, until) names what is known to fail: whatever it gives is not
red until that day, the level from before stays the one to come back to, and once it holds the entry is reported.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from fnmatch import fnmatchcase
from pathlib import Path

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.toml_file import Toml, read_toml

KINDS = ("accepted", "expected")
KNOWN = {"series", "range", "removed", "who", "why", "until"}


class AcceptedError(TrackerError):
    """accepted.toml cannot be used; the message names the entry."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Accepted:
    """One accepted level."""

    series: str
    low: float
    high: float
    who: str
    why: str
    until: date | None = None
    removed: bool = False  # that there are no values any more, instead of a range
    expected: bool = False  # that it fails, whatever its value

    def names(self, key: str) -> bool:
        """Whether the entry is about that series."""
        return fnmatchcase(key, self.series)

    def over(self, night: date) -> bool:
        """Whether its day has passed."""
        return self.until is not None and night > self.until

    def takes(self, key: str, value: float, night: date) -> bool:
        """Whether that value of that series is accepted on that night."""
        if self.over(night) or not self.names(key) or self.removed:
            return False
        return self.expected or (math.isfinite(value) and self.low <= value <= self.high)

    def __str__(self) -> str:
        until = f", until {self.until}" if self.until else ""
        return f"{'expected' if self.expected else 'accepted'} by {self.who}: {self.why}{until}"


def read_accepted(file: Path) -> tuple[Accepted, ...]:
    """The entries of a file, none if there is no such file; AcceptedError names what is wrong in it."""
    if not file.exists():
        return ()
    try:
        content = read_toml(file)
    except OSError as error:
        raise AcceptedError(f"{file} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise AcceptedError(f"{file} is not valid TOML: {error!s:.300}") from None
    kinds = [entries for kind in KINDS if isinstance(entries := content.get(kind, []), list)]
    if set(content) - set(KINDS) or len(kinds) < len(KINDS):
        raise AcceptedError(f"{file} may hold [[accepted]] tables only, and [[expected]] ones")
    return tuple(
        _entry(f"{file}, {'entry' if kind == 'accepted' else 'expected entry'} {number}", entry, kind)
        for kind, entries in zip(KINDS, kinds, strict=True)
        for number, entry in enumerate(entries, 1)
    )


def _entry(place: str, entry: Toml, kind: str) -> Accepted:
    if not isinstance(entry, dict):
        raise AcceptedError(f"{place}: write it as a [[{kind}]] table")
    known = KNOWN if kind == "accepted" else KNOWN - {"range", "removed"}
    for name in sorted(set(entry) - known):
        raise AcceptedError(f"{place}: {name!r} is not known; the names are {', '.join(sorted(known))}")
    texts = {}
    for name in ("series", "who", "why"):
        text = entry.get(name)
        if not isinstance(text, str) or not text.strip():
            raise AcceptedError(f"{place}: {name} must be a text; say {name}")
        texts[name] = text
    removed = entry.get("removed", False)
    if not isinstance(removed, bool) or (removed and "range" in entry):
        raise AcceptedError(f"{place}: removed must be true, without a range")
    expected = kind == "expected"
    said = entry.get("range", [math.inf, math.inf] if removed or expected else [])
    parts = said if isinstance(said, list) else []
    band = [float(end) for end in parts if isinstance(end, int | float) and not isinstance(end, bool)]
    if len(band) != 2 or len(parts) != 2 or not band[0] <= band[1]:
        raise AcceptedError(f"{place}: range must be [low, high]")
    until = entry.get("until")
    if isinstance(until, datetime):
        until = until.date()
    if until is not None and not isinstance(until, date):
        raise AcceptedError(f"{place}: until must be a date like 2027-01-31, without quotes")
    low, high = band
    return Accepted(
        series=texts["series"],
        low=low,
        high=high,
        who=texts["who"],
        why=texts["why"],
        until=until,
        removed=removed,
        expected=expected,
    )


def acceptance(
    levels: Sequence[Accepted], key: str, value: float, night: date, removed: bool = False
) -> Accepted | None:
    """The entry that takes this value, or that the series is gone, if one does."""
    if removed:
        gone = (x for x in levels if (x.removed or x.expected) and x.names(key) and not x.over(night))
        return next(gone, None)
    return next((level for level in levels if level.takes(key, value, night)), None)


def unused(
    levels: Sequence[Accepted], keys: Iterable[str], night: date, held: Iterable[str] = ()
) -> list[str]:
    """A sentence for each entry that does nothing.

    Its day has passed, no series has such a name, or what was expected to fail is among those that held.
    """
    names, well = list(keys), set(held)
    said = []
    for level in levels:
        named = [key for key in names if level.names(key)]
        kind = "expected to fail" if level.expected else "accepted"
        if level.over(night):
            said.append(f"{kind} until {level.until} and over: {level.series}; remove the entry")
        elif not named:
            said.append(f"{kind}, but there is no such series: {level.series}; correct or remove the entry")
        elif level.expected and well and well.issuperset(named):
            said.append(f"expected to fail, and it holds: {level.series}; remove the entry")
    return said

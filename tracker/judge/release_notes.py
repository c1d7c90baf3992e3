"""What each release of an engine changed, beside what its changelog says.

An entry of a changelog names the series that could show it. It is *found* if one of them changed with that
release, *missed* if none did; a change no entry speaks of is *not in the changelog*. Where a run blows up, rounding
decides its values: a change there is shown and is evidence of nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.toml_file import read_toml

from .comparison_document import Change
from .model_words import Moved, severity, words
from .release_order import Scene

SEEN = 1e-6  # relative: below it a value that changed is rounding to a reader of releases
NOTHING = 1e-12  # of any unit: below it a value is zero to a reader of releases


@dataclass(frozen=True, kw_only=True)
class Step:
    """From one measured release to the next."""

    release: str
    before: str
    changes: tuple[Change, ...]  # that a reader can see: direct questions first, of each the worst
    asked: int  # series measured in both
    alike: Mapping[str, tuple[int, int]] = field(default_factory=dict)  # model: same bits; rounding
    scenes: Mapping[str, Scene] = field(default_factory=dict)  # by test


@dataclass(frozen=True, kw_only=True)
class Entry:
    """What a changelog says of one release, in our words."""

    release: str
    item: int  # its number in the changelog
    says: str
    shows: tuple[str, ...]  # patterns of series that could show it


@dataclass(frozen=True, kw_only=True)
class Changelog:
    """Entries about behaviour that a scene could show. `last`: the newest release it speaks of."""

    source: str
    last: str
    releases: tuple[str, ...]  # it speaks of
    entries: tuple[Entry, ...]
    blown_up: tuple[str, ...] = ()  # patterns of series of runs that blow up


@dataclass(frozen=True, kw_only=True)
class Checked:
    """Both sides of the comparison."""

    found: tuple[tuple[Entry, tuple[Change, ...]], ...]
    missed: tuple[Entry, ...]
    unsaid: tuple[tuple[str, tuple[Change, ...]], ...]  # release and changes no entry speaks of
    unread: tuple[str, ...] = ()  # releases with changes that the changelog does not reach
    blown_up: tuple[str, ...] = ()  # releases with changes in runs that blow up


def visible(change: Change) -> bool:
    """A change of class, or of value beyond rounding; what a busy machine does says nothing here."""
    if change.kind in ("time", "run_time", "work") or change.before is None or change.after is None:
        return False
    outcomes = (str(change.before_outcome), str(change.after_outcome))
    if change.rounding is not None and outcomes[0] == outcomes[1]:
        return change.word in ("changed", "regressed") and change.before != change.after
    return moved(change.before, change.after, outcomes)


def moved(before: float, after: float, outcomes: tuple[str, str]) -> bool:
    """Whether a value is another one to a reader of releases: another outcome, or more than rounding."""
    if "timed_out" in outcomes:
        return False
    if outcomes[0] != outcomes[1]:
        return True
    if before == after or (before != before and after != after):
        return False
    return not abs(after - before) <= max(SEEN * max(abs(before), abs(after)), NOTHING)


def read_changelog(file: Path) -> Changelog:
    """From TOML: source, releases (oldest first) and a table [[entry]] each. DocumentError names what is wrong."""
    try:
        given: dict[str, Any] = read_toml(file)
        entries = tuple(
            Entry(release=one["release"], item=one["item"], says=one["says"], shows=tuple(one["shows"]))
            for one in given["entry"]
        )
        releases = tuple(given["releases"])
        source, blown_up = given["source"], tuple(given.get("blown_up", ()))
    except (OSError, ValueError, KeyError) as error:
        raise DocumentError(
            f"{file} is no changelog: {error}; it has source, releases and [[entry]] with release, item, "
            "says and shows"
        ) from None
    stray = [entry.release for entry in entries if entry.release not in releases]
    if stray:
        raise DocumentError(f"{file}: an entry speaks of {stray[0]!r}, which is not among its releases")
    return Changelog(source=source, last=releases[-1], releases=releases, entries=entries, blown_up=blown_up)


def check(steps: Sequence[Step], changelog: Changelog) -> Checked:
    """Found, missed, and not in the changelog; releases that were not measured are left out.

    An entry of a release that was passed over belongs to the next one that was measured.
    """
    found, missed, unsaid, unread, blown_up = [], [], [], [], []
    for step in steps:
        telling = tuple(change for change in step.changes if not matches(change.series, changelog.blown_up))
        if len(telling) < len(step.changes):
            blown_up.append(step.release)
        if step.release not in changelog.releases:
            if telling:
                unread.append(step.release)
            continue
        since = _between(changelog.releases, step.before, step.release)
        told: set[str] = set()
        for entry in (entry for entry in changelog.entries if entry.release in since):
            shown = tuple(change for change in telling if matches(change.series, entry.shows))
            told.update(change.series for change in shown)
            if shown:
                found.append((entry, shown))
            else:
                missed.append(entry)
        rest = tuple(change for change in telling if change.series not in told)
        if rest:
            unsaid.append((step.release, rest))
    return Checked(
        found=tuple(found),
        missed=tuple(missed),
        unsaid=tuple(unsaid),
        unread=tuple(unread),
        blown_up=tuple(blown_up),
    )


def matches(series: str, patterns: Iterable[str]) -> bool:
    """Whether one of the patterns, as a shell has them, fits the key of a series."""
    return any(fnmatchcase(series, pattern) for pattern in patterns)


def by_test(changes: Iterable[Change]) -> Mapping[str, list[Change]]:
    """In the order of the first of each."""
    found: dict[str, list[Change]] = {}
    for change in changes:
        found.setdefault(change.test, []).append(change)
    return found


def told(changes: Iterable[Change]) -> list[str]:
    """Changes of one model in words, worst first."""
    return words(
        Moved(
            metric=change.metric,
            unit=change.unit,
            before=float("nan") if change.before is None else change.before,
            after=float("nan") if change.after is None else change.after,
            severity=severity(change.sentence),
            became="" if change.before_outcome == change.after_outcome else change.sentence,
        )
        for change in changes
    )


def alike(changes: Iterable[Change]) -> dict[str, tuple[int, int]]:
    """Of each model that both were asked about, how many values have the same bits and how many differ by rounding."""
    found: dict[str, tuple[int, int]] = {}
    for change in changes:
        asked = change.before is not None and change.after is not None
        if asked and change.rounding is not None and change.word != "not_comparable":
            same, rounded = found.get(change.test, (0, 0))
            here = change.before == change.after
            found[change.test] = same + here, rounded + (not here and not visible(change))
    return found


def _between(releases: Sequence[str], before: str, last: str) -> tuple[str, ...]:
    """After `before` up to and with `last`; an unknown `before` leaves `last` alone."""
    end = releases.index(last)
    start = releases.index(before) + 1 if before in releases else end
    return tuple(releases[start : end + 1])

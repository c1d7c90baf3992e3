"""Charts over nights that are as the last publication drew them: most series stand still from one night to the next."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence

import msgspec

from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.kept import Kept

from .diagrams import View, first_drawn, trend_chart, view
from .events import Event
from .nights import Night, Trend

NAME = "charts"


class _Drawn(msgspec.Struct, frozen=True, array_like=True):
    """A chart without its data."""

    made_from: bytes
    words: tuple[str, str, str, str, str]  # name, title, thesis, note, description
    tall: bool
    key: str
    file: str
    mark: str  # of the file: what it was made from


class KnownCharts:
    """The charts of a publication by series; `there` tells whether the last website has a file, made from what is named."""

    def __init__(
        self, kept: Kept, nights: Sequence[Night], events: Sequence[Event], there: Callable[[str, str], bool]
    ) -> None:
        self._known: Mapping[str, _Drawn] = kept.get(NAME, dict[str, _Drawn]) or {}
        self._new: dict[str, tuple[bytes, View]] = {}
        self._nights, self._there = nights, there
        self._events: dict[str, list[Event]] = {}
        for event in events:
            self._events.setdefault(event.definition.key, []).append(event)
        self._of_nights: dict[int, bytes] = {}
        self._of_said: dict[int, bytes] = {}

    def view(self, trend: Trend, title: str = "") -> View:
        """The chart of a series over nights; without its data where its file is there."""
        events = self._events.get(trend.definition.key, [])
        made_from, name = self._made_from(trend, events, title), f"{title}/{trend.definition.key}"
        known = self._known.get(name)
        if known is not None and known.made_from == made_from and self._there(known.file, known.mark):
            made = View(*known.words, None, known.tall, key=known.key, file=known.file, mark=known.mark)
        else:
            made = view(trend_chart(trend, self._nights, events, title))
        self._new[name] = made_from, made
        return made

    def keep(self, kept: Kept) -> None:
        """For the next time."""
        drawn = {
            name: _Drawn(
                made_from,
                (made.name, made.title, made.thesis, made.note, made.description),
                made.tall,
                made.key,
                made.file,
                made.mark,
            )
            for name, (made_from, made) in self._new.items()
            if made.file
        }
        kept.put(NAME, drawn)

    def _made_from(self, trend: Trend, events: Sequence[Event], title: str) -> bytes:
        """All that the chart says: nothing of tonight unless the value changed tonight."""
        said, nights = trend.said, trend.nights
        goes_on, count = nights[-1] == self._nights[-1].index, len(nights)
        last = count - (said.ends[-2] if len(said.ends) > 1 else 0)  # how many nights it has stood still
        first = first_drawn(count)
        whole = trend.definition, title, goes_on, last == 1, first, nights[0], list(map(repr, events))
        of_night = self._of_night
        parts = [encode(whole), of_night(nights[first])]
        known = self._of_said
        for one in {id(one): one for one in said.each if id(one) not in known}.values():
            told = one[0]
            known[id(one)] = _short(f"{told.value!r} {told.outcome}".encode("utf-8", "replace"))
        parts += [known[id(one)] for one in said.each]
        parts += [of_night(nights[end - 1]) for end in said.ends[: -1 if goes_on else None]]
        parts += [of_night(nights[end]) for end in (0, *said.ends[:-1])]
        return hashlib.blake2b(b"".join(parts), digest_size=16).digest()

    def _of_night(self, place: int) -> bytes:
        """What a chart says of a night: most nights are in none."""
        if place not in self._of_nights:
            night = self._nights[place]
            self._of_nights[place] = _short(f"{night.index} {night.label}".encode("utf-8", "replace"))
        return self._of_nights[place]


def _short(told: bytes) -> bytes:
    return hashlib.blake2b(told, digest_size=8).digest()

"""What other programs read of the website: the Atom feed of regressions and recoveries, and the badges."""

from __future__ import annotations

import hashlib
import json
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

from spook_tracker.tracker.document.wording import (
    clean,
    conditions,
    instant,
    limit,
    named,
    quantity,
    short_hash,
    version,
)
from spook_tracker.tracker.judge.standing import Count
from spook_tracker.tracker.judge.vocabulary import Class, spaced
from spook_tracker.tracker.website.events import Event
from spook_tracker.tracker.website.nights import Book, Night

ATOM = "http://www.w3.org/2005/Atom"
MOST_ENTRIES = 100
COLOURS = {"pass": ("#00694d", "brightgreen"), "watch": ("#8a6100", "yellow"), "fail": ("#a93f00", "red")}


def atom(book: Book, events: Sequence[Event], addresses: dict[str, str]) -> bytes:
    """One entry for every regression and one for every recovery, newest first."""
    ElementTree.register_namespace("", ATOM)
    feed = ElementTree.Element(f"{{{ATOM}}}feed")
    _put(feed, "title", f"Regressions of {clean(book.tonight.engine.name)}")
    _put(feed, "id", f"tag:spook-tracker,2026:{_code(book.tonight.engine.name)}")
    _put(feed, "updated", _moment(book.tonight))
    ElementTree.SubElement(feed, f"{{{ATOM}}}link", {"href": "index.html"})
    author = ElementTree.SubElement(feed, f"{{{ATOM}}}author")
    _put(author, "name", "SPOOK tracker")
    news: list[tuple[Night, Event, str]] = [(e.first, e, spaced(e.word)) for e in events]
    news += [(e.worse_at, e, "regressed again") for e in events if e.worse_at is not e.first]
    news += [(e.end, e, e.standing) for e in events if e.end is not None]
    news.sort(key=lambda item: (-item[0].index, item[1].definition.key, item[2]))
    for night, event, word in news[:MOST_ENTRIES]:
        _entry(feed, night, event, word, addresses.get(event.definition.test, "index.html"))
    told: bytes = ElementTree.tostring(feed, encoding="utf-8", xml_declaration=True)
    return told


def _entry(feed: ElementTree.Element, night: Night, event: Event, word: str, address: str) -> None:
    d = event.definition
    entry = ElementTree.SubElement(feed, f"{{{ATOM}}}entry")
    _put(entry, "title", f"{clean(d.test)}: {clean(d.metric)} {word} at {version(night.engine)}")
    _put(entry, "id", f"tag:spook-tracker,2026:{_code(d.key, night.id, word)}")
    _put(entry, "updated", _moment(night))
    ElementTree.SubElement(entry, f"{{{ATOM}}}link", {"href": address})
    told = f"{clean(named(d)[0])} ({clean(conditions(d))}): "
    told += f"{quantity(event.before, d.unit, 6)} before, {quantity(event.value, d.unit, 6)} after; limit {limit(d)}. "
    told = f"{event.name}: {told}"
    _put(entry, "summary", told + f"Commit {short_hash(night.engine) or 'unknown'}.")


def _put(parent: ElementTree.Element, name: str, text: str) -> None:
    ElementTree.SubElement(parent, f"{{{ATOM}}}{name}").text = text


def _moment(night: Night) -> str:
    found = instant(night.started)
    return found.isoformat() if found else "1970-01-01T00:00:00+00:00"


def _code(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode("utf-8", "replace")).hexdigest()[:20]


def badge_words(found: Count) -> str:
    """What the badge says."""
    return f"{found.kept} of {found.limits} limits kept"


def badge_json(state: Class, words: str) -> bytes:
    """The endpoint format that badge services read."""
    colour = COLOURS.get(state, COLOURS["watch"])[1]
    return json.dumps({"schemaVersion": 1, "label": "physics", "message": words, "color": colour}).encode()


def badge_svg(state: Class, words: str) -> bytes:
    """The badge as a picture; widths are estimated, the text is fitted into them."""
    colour = COLOURS.get(state, COLOURS["watch"])[0]
    left, right = 58, 14 + round(6.3 * len(words))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + right}" height="20" role="img" '
        f'aria-label="physics: {words}"><title>physics: {words}</title>'
        f'<clipPath id="r"><rect width="{left + right}" height="20" rx="3"/></clipPath><g clip-path="url(#r)">'
        f'<rect width="{left}" height="20" fill="#3c4650"/><rect x="{left}" width="{right}" height="20" fill="{colour}"/></g>'
        f'<g fill="#fff" font-family="Verdana,DejaVu Sans,sans-serif" font-size="11" text-anchor="middle">'
        f'<text x="{left / 2:g}" y="14" textLength="{left - 14}">physics</text>'
        f'<text x="{left + right / 2:g}" y="14" textLength="{right - 12}">{words}</text></g></svg>\n'
    ).encode()

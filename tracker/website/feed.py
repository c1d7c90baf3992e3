"""What other programs read of the website: the Atom feed of causes and what became of them, and the badges."""

from __future__ import annotations

import hashlib
import json
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

from spook_tracker.tracker.document.wording import clean, instant, limit, opening, quantity
from spook_tracker.tracker.judge.causes import Cause
from spook_tracker.tracker.judge.standing import Count
from spook_tracker.tracker.judge.vocabulary import Class

from .causes import anchor, line
from .nights import Book, Night, as_night

ATOM = "http://www.w3.org/2005/Atom"
MOST_ENTRIES = 100
COLOURS = {"pass": ("#00694d", "brightgreen"), "watch": ("#8a6100", "yellow"), "fail": ("#a93f00", "red")}


def atom(book: Book, causes: Sequence[Cause], publisher: str = "SPOOK tracker") -> bytes:
    """One entry for every cause, and one more when the last of its series came back or was accepted."""
    ElementTree.register_namespace("", ATOM)
    feed = ElementTree.Element(f"{{{ATOM}}}feed")
    _put(feed, "title", f"Regressions of {clean(book.tonight.engine.name)}")
    _put(feed, "id", f"tag:spook-tracker,2026:{_code(book.tonight.engine.name)}")
    _put(feed, "updated", _moment(book.tonight))
    ElementTree.SubElement(feed, f"{{{ATOM}}}link", {"href": "regressions.html"})
    author = ElementTree.SubElement(feed, f"{{{ATOM}}}author")
    _put(author, "name", publisher)
    news: list[tuple[Night, str, Cause]] = [(as_night(cause.bad), "red", cause) for cause in causes]
    for cause in causes:
        ends = [as_night(hit.end) for hit in cause.hits if hit.end is not None]
        if cause.standing != "detected" and ends:
            news.append((max(ends, key=lambda night: night.index), cause.standing, cause))
    news.sort(key=lambda item: (-item[0].index, item[1], as_night(item[2].bad).id))
    for night, word, cause in news[:MOST_ENTRIES]:
        _entry(feed, night, word, cause)
    told: bytes = ElementTree.tostring(feed, encoding="utf-8", xml_declaration=True)
    return told


def _entry(feed: ElementTree.Element, night: Night, word: str, cause: Cause) -> None:
    entry = ElementTree.SubElement(feed, f"{{{ATOM}}}entry")
    _put(entry, "title", f"{word}: {line(cause)}")
    _put(entry, "id", f"tag:spook-tracker,2026:{_code(as_night(cause.bad).id, night.id, word)}")
    _put(entry, "updated", _moment(night))
    ElementTree.SubElement(entry, f"{{{ATOM}}}link", {"href": f"regressions.html#{anchor(cause)}"})
    worst = cause.worst
    told = f"{clean(worst.name)}: {clean(worst.series)}"
    if worst.definition is not None:
        unit = worst.definition.unit
        told += f", {quantity(worst.before, unit, 6)} before" if math.isfinite(worst.before) else ""
        told += f", {quantity(worst.value, unit, 6)} after" if math.isfinite(worst.value) else ", no value"
        told += f", limit {limit(worst.definition)}" if worst.definition.limit is not None else ""
    author = as_night(cause.bad).engine.author
    written = f" by {clean(author)}" if author else ""
    tests = ", ".join(clean(test)[:60] for test in cause.tests[:20])
    _put(entry, "summary", f"Tests: {tests}. The worst: {told}. {opening(clean(cause.blame))}{written}.")


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

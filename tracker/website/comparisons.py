"""Comparisons for the page: every ordered pair of the newest versions, judged by the command's own code.

A comparison of two runs changes only with what the history knows of them, or with the words of today's tests: else
that of the last publication is taken over. Texts are kept once in
a list and named by their place: a few hundred comparisons fit into one page.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypedDict

from spook_tracker.tracker.document.addresses import page_of
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.wording import (
    clean,
    conditions,
    named,
    number,
    quantity,
    short_hash,
)
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.compare import ComparedRun, compare, side_of
from spook_tracker.tracker.judge.comparison_document import Change, CompareDocument
from spook_tracker.tracker.judge.judged import Judged, is_release
from spook_tracker.tracker.judge.known import judged_in, known_of
from spook_tracker.tracker.judge.lane import asked_for, asked_whole
from spook_tracker.tracker.judge.maps import may_be_dropped
from spook_tracker.tracker.judge.vocabulary import CLASS_RANK, QUIET, WORD_RANK, Overall, spaced
from spook_tracker.tracker.judge.work import with_work

from .folder import digest
from .judged_nights import accepted_fields, described, gates_of_engines
from .nights import Book, Night, Records
from .scripts import as_json, call

NEWEST = 10  # versions to choose from
RELEASES = 6  # and the newest releases before them
FILE = "data/comparisons.json"


class ToldPair(TypedDict):
    """What a reader sees of a comparison, as it is stored beside the website."""

    verdict: Overall
    code: int
    counts: dict[str, int]
    changes: list[list[str]]
    frontiers: list[list[str]]
    notes: list[str]


@dataclass
class Comparisons:
    """The versions to choose from, and what became of every ordered pair."""

    nights: list[Night]
    pairs: dict[str, ToldPair]  # by `pair_name` to what the page shows
    made_from: dict[str, str] = field(default_factory=dict)  # the same to what it depends on
    texts: list[str] = field(default_factory=list)

    def kept(self) -> dict[str, tuple[str, ToldPair]]:
        """Each with what it was made from, for the next publication."""
        return {name: (self.made_from[name], pair) for name, pair in self.pairs.items()}


def pair_name(before: Night, after: Night) -> str:
    """What a comparison is stored under; an id may hold any sign."""
    return json.dumps([before.id, after.id])


def chosen(book: Book) -> list[Night]:
    """The versions a reader can choose: the newest nights, the newest releases, the last green night."""
    newest = book.nights[-NEWEST:]
    releases = [night for night in book.nights if is_release(night)][-RELEASES:]
    wanted = {night.index for night in [*newest, *releases]}
    return [night for night in book.nights if night.index in wanted]


def comparisons(
    history: Records, book: Book, accepted: Sequence[Accepted], stored: dict[str, tuple[str, ToldPair]]
) -> Comparisons:
    """All ordered pairs; `stored` are those of the last publication."""
    nights = chosen(book)
    sides: dict[str, ComparedRun] = {}
    titles = {test.name: test.card.title for test in book.tests}
    descriptions = {
        t.definition.key: f"{named(t.definition)[0]} ({conditions(t.definition)})"
        for test in book.tests
        for t in test.trends
    }
    told = {t.definition.key: t.told for test in book.tests for t in test.trends}
    dropped = may_be_dropped(history, nights)

    def side(night: Night) -> ComparedRun:
        if night.id not in sides:
            samples = with_work(history.samples(night.id), night.engine)
            sides[night.id] = ComparedRun(
                side=side_of(night),
                samples=samples,
                maps=history.maps(night.id),
                whole=asked_whole(night),
                asked=asked_for(night, samples),
                dropped=dropped[night.id],
            )
        return sides[night.id]

    verdicts = judged_in(told, [night.id for night in nights])
    words = json.dumps([titles, descriptions])
    content = {night.id: night.content.encode() for night in nights}
    facts = {run: digest(words.encode(), content[run], *_facts(found)) for run, found in verdicts.items()}
    pairs: dict[str, ToldPair] = {}
    made_from: dict[str, str] = {}
    for before in nights:
        for after in nights:
            if before is after:
                continue
            name = pair_name(before, after)
            history_knows = known_of(told, verdicts[before.id], verdicts[after.id])
            made_from[name] = digest(
                facts[before.id].encode(),
                facts[after.id].encode(),
                repr(history_knows).encode("utf-8", "replace"),
            )
            if name in stored and stored[name][0] == made_from[name]:
                pairs[name] = stored[name][1]
            else:
                document = compare(side(before), side(after), accepted, history_knows)
                pairs[name] = _told(document, titles, descriptions)
    return Comparisons(nights, pairs, made_from)


def _facts(night: Mapping[str, Judged]) -> list[bytes]:
    """The values of a run, as far as histories hold them."""
    return [
        f"{key} {found.night.value!r} {found.night.sample.outcome} {found.night.test_version}".encode(
            "utf-8", "replace"
        )
        for key, found in night.items()
    ]


def read_known(old: Path, made_from: str) -> dict[str, tuple[str, ToldPair]]:
    """The comparisons of the last publication, each with what it was made from, if they were made by the same code."""
    try:
        stored = json.loads((old / FILE).read_text(encoding="utf-8"))
        if stored["made_from"] == made_from and isinstance(stored["pairs"], dict):
            return dict(stored["pairs"])
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return {}


def stored(told: Comparisons, made_from: str) -> bytes:
    """The comparisons as a file of the website."""
    whole = {"made_from": made_from, "pairs": told.kept()}
    return json.dumps(whole, ensure_ascii=True, separators=(",", ":"), allow_nan=False).encode()


def page_files(told: Comparisons, book: Book, accepted: Sequence[Accepted]) -> bytes:
    """The script that hands the newest pairs to the page: texts once, and pairs that name texts by place."""
    texts: dict[str, int] = {}

    def place(text: str) -> int:
        return texts.setdefault(text, len(texts))

    pairs = {}
    index = {night.id: night.index for night in told.nights}
    for name, pair in told.pairs.items():
        before, after = json.loads(name)
        pairs[f"{index[before]},{index[after]}"] = {
            **pair,
            "changes": [[place(text) for text in change] for change in pair["changes"]],
            "frontiers": [[place(text) for text in line] for line in pair["frontiers"]],
        }
    series = described(book)
    levels = accepted_fields(accepted, [key for _, _, words in series.values() for key in words])
    gates = gates_of_engines(book)
    whole = {"pairs": pairs, "texts": list(texts), "series": series, "accepted": levels, "gates": gates}
    return call("compared", "newest", as_json(whole))


def choice(night: Night) -> dict[str, str]:
    """How a version is called in the list and in the address."""
    subject, author = clean(night.engine.subject), clean(night.engine.author)
    told = [shortened(subject, 60), f"({shortened(author, 30)})" if author else ""] if subject else []
    label = " · ".join(filter(None, [night.label, " ".join(told).strip()]))
    return {"id": night.id, "label": label, "hash": short_hash(night.engine)}


def shortened(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1].rstrip()}…"


def worst_first(changes: Sequence[Change]) -> list[Change]:
    """By class, then by what happened, gates before the rest, then by decades, to a millionth (as judge.js does)."""

    def rank(change: Change) -> tuple[bool, int, int, bool, float, str]:
        far = abs(change.decades) if change.decades is not None else math.inf if change.red else 0.0
        stands = CLASS_RANK[change.stands] if change.red else 0
        told = math.floor(far * 1e6 + 0.5) if math.isfinite(far) else far
        return not change.red, stands, WORD_RANK[change.word], change.role != "gate", -told, change.series

    return sorted(changes, key=rank)


def _told(document: CompareDocument, titles: dict[str, str], descriptions: dict[str, str]) -> ToldPair:
    """What a reader sees of a comparison."""
    shown = worst_first([change for change in document.changes if change.word not in QUIET])
    return {
        "verdict": document.verdict,
        "code": document.exit_code,
        "counts": dict(sorted(document.counts.items())),
        "changes": [_change(change, titles, descriptions) for change in shown],
        "frontiers": [
            [
                clean(titles.get(f.test, f.test)), clean(f.configuration), clean(f.ladder),
                _ratio(f.time_at_equal_error), _ratio(f.error_at_equal_time), _ratio(f.work_at_equal_error),
            ]
            for f in document.frontiers
        ],
        "notes": [clean(note) for note in document.notes],
    }  # fmt: skip


def _change(change: Change, titles: dict[str, str], descriptions: dict[str, str]) -> list[str]:
    said = change.name or spaced(change.word)
    since = f"first bad commit {change.first_bad}" if change.first_bad else change.accepted
    return [
        change.word,
        change.stands if change.red else "",
        page_of(change.test),
        clean(titles.get(change.test, change.test)),
        clean(descriptions.get(change.series, f"{change.metric} ({change.configuration})")),
        value_in_words(change.before, change.unit),
        value_in_words(change.after, change.unit),
        said,
        clean(change.sentence),
        clean(since),
    ]


def value_in_words(value: Number | None, unit: str) -> str:
    return "–" if value is None else quantity(value, unit, 7)


def _ratio(value: float | None) -> str:
    return "–" if value is None else f"{number(value, 3)}×"

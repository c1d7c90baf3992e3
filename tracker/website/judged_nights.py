"""What the page of comparisons needs to judge any two nights itself: site/static/judge.js has the rules.

Nights stand in blocks, a file each, so that a reader loads at most two. A series that stands still costs a
block one row. A night that is over never changes, so its block is made once.
"""

from __future__ import annotations

import json
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial

from spook_tracker.tracker.document.addresses import page_of
from spook_tracker.tracker.document.json_form import Writable, boxed
from spook_tracker.tracker.document.run_document import Sample, SeriesDefinition
from spook_tracker.tracker.document.wording import clean, conditions, limit, named, slug
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.judged import commit_of, night_of
from spook_tracker.tracker.judge.known import known_noise, of_two
from spook_tracker.tracker.judge.lane import asked_for, asked_whole
from spook_tracker.tracker.judge.rank import Question, question
from spook_tracker.tracker.judge.repeats import looked_at, states_of
from spook_tracker.tracker.judge.series_history import Told
from spook_tracker.tracker.judge.work import Samples, is_read_off, with_work

from .folder import digest
from .nights import Book, Chapter, Night, Records
from .scripts import as_json, call

BLOCK = 32  # nights in a file
OUTCOMES = (
    "value", "out_of_limit", "not_finite", "diverged", "crashed", "timed_out", "missing", "not_supported",
    "unsettled",
)  # fmt: skip
Row = list[
    Writable
]  # definition, value, outcome, passed + 2 held, state hash, failure, usual, suspected, blame


def definition_fields(definition: SeriesDefinition) -> dict[str, Writable]:
    """What the judge asks of a definition."""
    said = {what: str(getattr(definition, what)) for what in ("unit", "better", "reference", "limit")}
    return {
        "test": definition.test, "role": definition.role, "kind": definition.kind, "unit": definition.unit,
        "better": definition.better, "limit": definition.limit, "set_point": definition.set_point,
        "reference": definition.reference, "tolerance": definition.tolerance,
        "relative_tolerance": definition.relative_tolerance, "version": definition.test_version,
        "read_off": is_read_off(definition), "said": said,
    }  # fmt: skip


class Texts:
    """Texts and definitions, once each, named by their place."""

    def __init__(self) -> None:
        self.texts: dict[str, int] = {"": 0}
        self.definitions: dict[str, int] = {}
        self.known: dict[tuple[Writable, ...], int] = {}  # what a definition says, before it is written out

    def place(self, text: str) -> int:
        return self.texts.setdefault(text, len(self.texts))

    def definition(self, definition: SeriesDefinition) -> int:
        d = definition
        said = (
            d.test, d.role, d.kind, d.unit, d.better, d.limit, d.set_point, d.reference, d.tolerance,
            d.relative_tolerance, d.test_version, d.configuration, d.metric,
        )  # fmt: skip
        place = self.known.get(said)
        if place is None:
            told = json.dumps(definition_fields(definition), allow_nan=False)
            place = self.known[said] = self.definitions.setdefault(told, len(self.definitions))
        return place

    def row(
        self,
        definition: SeriesDefinition,
        sample: Sample,
        usual: tuple[float, float] | None = None,
        suspected: bool = False,
        blame: str = "",
    ) -> Row:
        """One sample, without what is empty at its end."""
        row: Row = [
            self.definition(definition),
            boxed(sample.value),
            OUTCOMES.index(sample.outcome),
            int(sample.passed) + 2 * int(sample.set_point_held),
            self.place(sample.state_hash),
            self.place(sample.failure),
            0 if usual is None else [boxed(end) for end in usual],
            int(suspected),
            self.place(blame),
        ]
        while row[-1] == 0:
            row.pop()
        return row


def side_fields(night: Night, samples: Samples) -> dict[str, Writable]:
    """What the judge asks of a run."""
    asked = asked_for(night, samples)
    return {
        "engine": night.engine.name, "commit": night.engine.git_hash, "dirty": night.engine.dirty,
        "machine": night.machine.fingerprint, "floats": night.machine.float_environment,
        "day": datetime.fromisoformat(night.started).astimezone(UTC).date().isoformat(),
        "whole": asked_whole(night), "asked": {family: sorted(tests) for family, tests in sorted(asked.items())},
    }  # fmt: skip


def accepted_fields(accepted: Sequence[Accepted], keys: Sequence[str]) -> list[dict[str, Writable]]:
    """The accepted levels with the series they are about."""
    return [
        {
            "keys": [key for key in keys if level.names(key)],
            "low": boxed(level.low), "high": boxed(level.high),
            "until": level.until.isoformat() if level.until else "", "said": clean(str(level)),
            "removed": level.removed, "expected": level.expected,
        }
        for level in accepted
    ]  # fmt: skip


NO_MARK: tuple[tuple[float, float] | None, bool, str] = (None, False, "")
Marks = dict[str, tuple[tuple[float, float] | None, bool, str]]  # by key: usual, suspected, blame


def all_marks(told: Mapping[str, Told]) -> dict[str, Marks]:
    """What the history knows of every run, by its id, as tracker/judge/known.py tells it of two."""
    found: dict[str, Marks] = {}
    for key, series in told.items():
        timed = series.definition.kind == "time" and not is_read_off(series.definition)
        noise = known_noise(series) if timed else {}
        for judged in (
            series.nights
            if timed
            else [night for night in looked_at(series.nights) if night.state == "detected"]
            if "detected" in states_of(series.nights)
            else ()
        ):
            known = noise.get(judged.night.run.id)
            usual = None if known is None else of_two(judged.night.value, known)
            suspected = timed and judged.state == "suspected"
            blame = ""
            if judged.red and judged.worse_at is not None:
                run = judged.worse_at.run
                blame = f"first bad commit {commit_of(run)}, of {night_of(run)}"
            if usual is None and not blame and not suspected:
                continue
            found.setdefault(judged.night.run.id, {})[key] = (usual, suspected, blame)
    return found


def file_stem(chapter: Chapter, book: Book) -> str:
    """What the files of an engine's nights are called, before their number."""
    return "nights" if chapter is book else f"{slug(chapter.name)}-nights"


def _values(chapter: Chapter) -> list[array[float]]:
    """Every value of each night of which nothing else is known to say what was measured."""
    found = [array("d") for _ in chapter.nights]
    if all(night.content for night in chapter.nights):
        return found
    for test in chapter.tests:
        for trend in test.trends:
            for place, value in zip(trend.nights, trend.values, strict=True):
                found[place].append(value)
    return found


def files(history: Records, book: Book) -> Iterator[tuple[str, bytes, Callable[[], bytes]]]:
    """The files of the page: path, what each is made from, and how."""
    for chapter in book.engines:
        told = {t.definition.key: t.told for test in chapter.tests for t in test.trends}
        marks = all_marks(told)
        values = _values(chapter)
        for number in range(0, len(chapter.nights), BLOCK):
            nights = chapter.nights[number : number + BLOCK]
            facts = [
                (
                    night.id,  # a run may be taken out, and come back under its name with other values
                    night.started,
                    night.trigger,
                    night.asked,
                    night.engine,
                    night.machine,
                    marks.get(night.id),
                    night.content or values[night.index].tobytes(),
                )
                for night in nights
            ]
            name = f"{file_stem(chapter, book)}-{number // BLOCK}"
            yield (
                f"compare/{name}.js",
                digest(repr(facts).encode("utf-8", "replace")).encode(),
                partial(_block, history, name, nights, marks),
            )


def _block(history: Records, name: str, nights: Sequence[Night], marks: Mapping[str, Marks]) -> bytes:
    texts = Texts()
    rows: dict[str, list[Row]] = {}
    last: dict[str, Row] = {}
    facts: dict[
        str, tuple[Writable, ...]
    ] = {}  # what each last row was made from: most stand still from night to night
    sides = []
    for place, night in enumerate(nights):
        samples = with_work(history.samples(night.id), night.engine)
        sides.append(side_fields(night, samples))
        here = marks.get(night.id, {})
        for key in last.keys() - samples.keys():
            rows[key].append([place])
            del last[key], facts[key]
        for key, (definition, sample) in samples.items():
            mark = here.get(key, NO_MARK)
            made_from = (
                definition, sample.value, sample.outcome, sample.passed, sample.set_point_held, sample.state_hash,
                sample.failure, mark,
            )  # fmt: skip
            if facts.get(key) == made_from:
                continue
            facts[key] = made_from
            row = texts.row(definition, sample, *mark)
            if last.get(key) != row:
                rows.setdefault(key, []).append([place, *row])
                last[key] = row
    definitions = [json.loads(text) for text in texts.definitions]
    fields = list(definitions[0]) if definitions else []
    whole: Writable = {
        "texts": list(texts.texts), "fields": fields, "definitions": [list(d.values()) for d in definitions],
        "nights": sides, "rows": rows,
    }  # fmt: skip
    return call("compared", name, as_json(whole))


def described(book: Book) -> dict[str, tuple[str, str, dict[str, str]]]:
    """Title and page of every test, and the words of each of its series by key; another engine's under the title and
    page of our test."""
    ours = {test.name: test for test in book.tests}
    found: dict[str, tuple[str, str, dict[str, str]]] = {}
    for chapter in reversed(book.engines):
        for test in chapter.tests:
            title = clean(ours.get(test.name, test).card.title)
            page = page_of(test.name) if test.name in ours else "engines.html"
            words = found[test.name][2] if test.name in found else {}
            words |= {
                t.definition.key: clean(f"{named(t.definition)[0]} ({conditions(t.definition)})")
                for t in test.trends
            }
            found[test.name] = (title, page, words)
    return found


def gates_of_engines(book: Book) -> list[list[Writable]]:
    """Every gate of ours where there are other engines: title, words, page, limit, and the series that each engine
    answers it with (the configuration that it names first), engine by engine as the nights stand; "" for none."""
    if len(book.engines) < 2:
        return []
    first: list[dict[Question, str]] = []
    for chapter in book.engines:
        asked: dict[Question, str] = {}
        for trend in sorted((t for test in chapter.tests for t in test.trends), key=lambda t: t.order):
            asked.setdefault(question(trend.definition), trend.definition.key)
        first.append(asked)
    return [
        [
            clean(test.card.title), clean(named(gate.definition)[0]), page_of(test.name), limit(gate.definition),
            [gate.definition.key, *(asked.get(question(gate.definition), "") for asked in first[1:])],
        ]
        for test in book.tests
        for gate in test.gates()
    ]  # fmt: skip

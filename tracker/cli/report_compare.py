"""A comparison for a terminal, for a pull request, and the lines about what is red."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import click

from spook_tracker.tracker.document.addresses import page_of
from spook_tracker.tracker.document.json_form import Number, readable
from spook_tracker.tracker.judge.causes import causes_tonight
from spook_tracker.tracker.judge.choice import worst_change
from spook_tracker.tracker.judge.comparison_document import Change, CompareDocument, Frontier, Side
from spook_tracker.tracker.judge.explaining import TIMES
from spook_tracker.tracker.judge.judged import BY_TIME, Judged
from spook_tracker.tracker.judge.tonight import Finding, not_compared
from spook_tracker.tracker.judge.verdict import Verdict
from spook_tracker.tracker.judge.vocabulary import OVERALL, QUIET, WORDS, besides, spaced

from .console import NARROW, Column, clean, table, width

if TYPE_CHECKING:
    from spook_tracker.tracker.document.json_form import Writable
    from spook_tracker.tracker.past import OldAnswers

COLOUR = {"✗": "red", "?": "yellow", "!": "yellow", "✓": "green"}
APART = {  # of series that are not red and hold no level
    "new": "are measured for the first time: nothing to compare with yet",
    "not_comparable": "cannot be compared",
    "accepted": "are worse and accepted",
    "expected": "fail as expected",
}
MOST_ROWS = 40  # of a Markdown table: a comment on a pull request has its limits


def value(number: Number | None, unit: str = "") -> str:
    """A value for a table; enough digits to see a change."""
    if number is None:
        return "-"
    if math.isnan(number):
        return "no value"
    return f"{number:.9g} {unit if unit != '1' else ''}".rstrip()


def both(change: Change) -> tuple[str, str]:
    """Values before and after with as many digits as it takes to tell them apart, the later with its unit."""
    if change.before is None or change.after is None:
        return value(change.before), value(change.after, change.unit)
    old, new = change.before, change.after
    digits = 6
    while digits < 17 and old != new and f"{old:.{digits}g}" == f"{new:.{digits}g}":
        digits += 1
    unit = "" if change.unit in ("", "1") else f" {change.unit}"
    return f"{old:.{digits}g}", f"{new:.{digits}g}{unit}"


def name_of(side: Side) -> str:
    """Version and commit of a side."""
    commit = f" ({side.git_hash[:10]})" if side.git_hash else ""
    return clean(f"{side.engine} {side.version}{commit}" + (" with local changes" if side.dirty else ""))


def _limit(limit: float | tuple[float, float] | None) -> str:
    if limit is None:
        return "no limit"
    return f"limit {limit[0]:g} … {limit[1]:g}" if isinstance(limit, tuple) else f"limit {limit:g}"


def red_lines(changes: Sequence[Change]) -> list[str]:
    """A line for each red series; of a ladder its worst rung speaks for the others."""
    lines: list[str] = []
    rungs: dict[tuple[str, ...], list[Change]] = {}
    for change in changes:
        if change.red and change.kind == "ladder":
            place = change.test, change.metric, change.configuration, change.machine
            rungs.setdefault(place, []).append(change)
        elif change.red:
            lines.append(red_line(change))
    for group in rungs.values():
        worst = max(group, key=lambda change: change.decades or 0.0)
        more = f"; and {len(group) - 1} more of its time steps" if len(group) > 1 else ""
        lines.append(red_line(worst) + more)
    return lines


def where(change: Change) -> str:
    """The series, and the machine where there are several."""
    return f"{change.series} on {change.machine}" if change.machine else change.series


def blamed(change: Change) -> str:
    """The commit, or the range of them, that a red change came with; empty where no history knows it."""
    if change.blame or not change.first_bad:
        return change.blame
    return f"first bad commit {change.first_bad}, last good {change.last_good or 'unknown'}"


def red_line(change: Change) -> str:
    """All a reader needs to act: test, metric, both values, limit, first bad commit, page to open."""
    asked = change.series.removeprefix(f"{change.test}/{change.configuration}/{change.metric}").strip("/")
    place = ", ".join([change.configuration, *filter(None, asked.split("/"))])
    parts = [
        f"✗ {change.test} {change.metric} [{place}]: {change.name or change.word}",
        " → ".join(both(change)),
        _limit(change.limit),
        change.sentence,
    ]
    parts.append(blamed(change))
    if change.machine:
        parts.append(f"on {change.machine}")
    parts.append(f"see {page_of(change.test)}")
    return clean("; ".join(part for part in parts if part))


def compare_table(document: CompareDocument, everything: bool = False, room: int | None = None) -> str:
    """The comparison for a terminal: what is red in full, the rest in a table, the verdict last."""
    shown = [change for change in document.changes if everything or change.word not in QUIET]
    heading = click.style(f"{name_of(document.before)} → {name_of(document.after)}", bold=True)
    lines = [*_worst(document), heading, ""]
    if shown:
        rows = [
            (
                _what(change),
                where(change),
                *both(change),
                _how(change),
            )
            for change in shown
        ]
        columns: tuple[Column, ...] = (
            Column("what"),
            Column("series", flexible=True, least=30),
            Column("before", "right"),
            Column("after", "right"),
            Column("how", flexible=True, least=12),
        )
        told: list[tuple[str, ...]] = [*rows]
        if (room or width()) < NARROW:  # the series stands above what became of it
            columns = (columns[0], *columns[2:])
            told = [part for row in rows for part in (row[1:2], (row[0], *row[2:]))]
        lines += [*table(columns, told, room or width(), {0: _paint}), ""]
    reds = [click.style(line, fg="red") for line in red_lines(document.changes)]
    lines += [*reds, ""] if reds else []
    lines += _frontier_lines(_moved(document), room or width())
    lines += [f"note: {clean(note)}" for note in document.notes]
    lines.append(_verdict(document))
    return "\n".join(lines)


def _worst(document: CompareDocument) -> list[str]:
    """The sentence over all: how many are worse, and which is the worst; none where nothing is."""
    worst = worst_change(document)
    if worst is None:
        return []
    reds = sum(change.red for change in document.changes)
    words = f"✗ {reds} worse; the worst: {clean(where(worst))}, {clean(worst.name or worst.word)}"
    return [click.style(words, fg="red", bold=True)]


def _how(change: Change) -> str:
    """The size of the change in few letters: decades, or per cent; else the sentence."""
    if change.kind in TIMES or not change.decades:
        return change.sentence
    if abs(change.decades) >= 0.05:
        return f"{change.decades:+.1f} decades"
    return f"{100.0 * (10.0**change.decades - 1.0):+.2g} %"


def _what(change: Change) -> str:
    """Mark and word; of a regression its name."""
    word = change.name if change.red and change.name else spaced(change.word)
    return f"{WORDS[change.word].mark} {word}"


def _paint(_row: int, text: str) -> str:
    return click.style(text, fg=COLOUR.get(text[:1]))


def _moved(document: CompareDocument) -> list[Frontier]:
    """Ladders on which an error or the run time changed; what is inside the noise is not told."""
    moved = {
        (change.test, change.metric.split(":")[1], change.configuration, change.machine)
        for change in document.changes
        if change.metric.startswith("ladder:")
        and change.kind in ("ladder", "run_time")
        and change.word not in QUIET
    }
    return [f for f in document.frontiers if (f.test, f.ladder, f.configuration, f.machine) in moved]


def _frontier_lines(told: Sequence[Frontier], room: int) -> list[str]:
    if not told:
        return []
    rows = [
        (f"{f.test} {f.ladder}", _of_ladder(f), *(f"{r:.3g}" if r else "-" for r in _ratios(f))) for f in told
    ]
    columns = (
        Column("error against run time", flexible=True),
        Column("configuration"),
        Column("time at equal error", "right"),
        Column("error at equal time", "right"),
        Column("steps at equal error", "right"),
    )
    return [*table(columns, rows, room), "(later / earlier; above 1 is worse)", ""]


def _ratios(frontier: Frontier) -> tuple[float | None, float | None, float | None]:
    return frontier.time_at_equal_error, frontier.error_at_equal_time, frontier.work_at_equal_error


def _of_ladder(frontier: Frontier) -> str:
    return f"{frontier.configuration} on {frontier.machine}" if frontier.machine else frontier.configuration


def counted(document: CompareDocument) -> str:
    """Counts by word, the worst first."""
    return ", ".join(f"{count} {spaced(word)}" for word, count in document.counts.items())


def _verdict(document: CompareDocument) -> str:
    mark = OVERALL[document.verdict].mark
    words = f"{mark} {spaced(document.verdict)}: {counted(document) or 'nothing measured'}"
    return click.style(words, fg=COLOUR.get(mark), bold=True)


def compare_markdown(document: CompareDocument) -> str:
    """The comparison as Markdown; names and sentences from outside are data, never markup."""
    lines = [
        f"### {escape(name_of(document.before))} → {escape(name_of(document.after))}",
        "",
        f"**{spaced(document.verdict)}**: {counted(document)}",
        "",
    ]
    shown = [change for change in document.changes if change.word not in QUIET]
    if shown:
        lines += ["| | series | before | after | limit | how |", "|---|---|---:|---:|---|---|"]
    for change in shown[:MOST_ROWS]:
        cells = (
            _what(change),
            where(change),
            *both(change),
            _limit(change.limit),
            "; ".join(filter(None, (change.sentence, blamed(change)))),
        )
        lines.append("| " + " | ".join(escape(cell) for cell in cells) + " |")
    if len(shown) > MOST_ROWS:
        lines.append(f"\nand {len(shown) - MOST_ROWS} more")
    moved = _moved(document)
    if moved:
        lines += ["", "| later / earlier, above 1 is worse | time at equal error | error at equal time |"]
        lines += ["|---|---:|---:|"]
    for f in moved[:MOST_ROWS]:
        ratios = [f"{ratio:.3g}" if ratio else "-" for ratio in _ratios(f)[:2]]
        lines.append(f"| {escape(f'{f.test} {f.ladder} {_of_ladder(f)}')} | {' | '.join(ratios)} |")
    lines += ["", *(f"- {escape(note)}" for note in document.notes)]
    return "\n".join(lines).rstrip() + "\n"


def escape(text: str) -> str:
    """Markdown and HTML signs made harmless."""
    text = clean(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return "".join("\\" + c if c in "\\`*_{}[]#|~!" else c for c in text).replace(
        "@", "@\N{ZERO WIDTH SPACE}"
    )


def finding_lines(findings: Sequence[Finding], site: str = "") -> list[str]:
    """What tonight came to: one sentence over all, a line for each cause of several, each red and recovered series."""
    red = [finding for finding in findings if finding.red]
    causes = causes_tonight(findings)
    shared = [f"  {clean(cause.sentence)}" for cause in causes] if len(causes) < len(red) else []
    lines = [
        summary(findings),
        *shared,
        *(click.style(_finding_line(finding, site), fg="red") for finding in red),
        *(click.style(_finding_line(f, site), fg="green") for f in findings if f.recovered),
        *(click.style(_finding_line(f, site), fg="yellow") for f in findings if f.suspected),
        *(
            click.style(_finding_line(f, site), fg="yellow")
            for f in findings
            if f.flaky or f.worse_than_expected
        ),
        *(f"note: {clean(note)}" for note in not_compared(_verdicts(findings))),
    ]
    if not any(BY_TIME in line for line in lines):
        return lines
    return [*(line.replace(f"; {BY_TIME}", "") for line in lines), f"note: runs are {BY_TIME}"]


def old_answer_lines(old: OldAnswers) -> list[str]:
    """What became of tests by their old definition (tracker.past.OldAnswers), and what could not be told."""
    tests = ", ".join(map(clean, old.tests))
    asked = f"{tests} by the definition at {old.commit[:12] or 'no commit'}"
    if old.why_not:
        return [f"? {asked}: cannot be compared; {clean(old.why_not)}"]
    red, told = [change for change in old.changes if change.red], old.told
    why: dict[str, list[Change]] = {}
    for change in old.untold:
        why.setdefault(change.sentence, []).append(change)
    left = [
        f"? of these, {len(changes)} cannot be compared, {kinds_of(changes)}: {clean(sentence)}"
        for sentence, changes in why.items()
    ]
    if not told:
        return [f"? {asked}: none of {len(old.changes)} series can be compared", *left]
    if not red:
        return [f"{'?' if old.open else '✓'} {asked}: {len(told)} series, none worse", *left]
    return [
        click.style(f"✗ {asked}: {len(red)} of {len(told)} series worse", fg="red"),
        *red_lines(red),
        *left,
    ]


def kinds_of(changes: Sequence[Change]) -> str:
    """How many there are of each kind, in words."""
    return ", ".join(f"{count} {spaced(kind)}" for kind, count in Counter(c.kind for c in changes).items())


def _verdicts(findings: Sequence[Finding]) -> Iterator[tuple[str, Verdict]]:
    """Of what was measured: a sum of work says nothing that its parts do not say."""
    for finding in findings:
        if finding.definition is None or finding.definition.kind != "work":
            yield finding.test, finding.verdict


def summary(findings: Sequence[Finding]) -> str:
    """One sentence: how many are red, how many of them since tonight, which is the worst, how many recovered."""
    red = [finding for finding in findings if finding.red]
    also = besides([finding.state for finding in findings])
    if strays := sum(finding.flaky for finding in findings):
        also += f"; {strays} flaky"
    words = Counter(_held(finding) for finding in findings if not finding.red)
    if red:
        new = sum(finding.news for finding in red)
        news = f"{new} new tonight" if new else "none of them new tonight"
        worst = clean(f"the worst: {red[0].series}, {red[0].name}")
        told = f"✗ {len(red)} worse than the history, {news}; {worst}{also}"
        return click.style(told, fg="red", bold=True)
    if not findings:
        return click.style("? nothing was measured that could be judged", fg="yellow", bold=True)
    left = words.total() - sum(words[word] for word in APART) - sum(f.suspected for f in findings)
    parts = [f"{left} series hold their level"] if left or also or not words else []
    parts += [f"{words[word]} {said}" for word, said in APART.items() if words[word]]
    machines = len({finding.machine for finding in findings})
    on = f"; judged on {machines} machines" if machines > 1 else ""
    return click.style("✓ " + "; ".join(parts) + also + on, fg="green")


def _held(finding: Finding) -> str:
    """What a series that is not red is counted as: its word, or that it was accepted tonight."""
    accepted = finding.state == "accepted" and finding.verdict.word != "expected"
    return "accepted" if accepted else finding.verdict.word


def _finding_line(finding: Finding, site: str) -> str:
    judged, definition = finding.judged, finding.definition
    mark, what = ("✓", "recovered") if finding.recovered else ("✗" if finding.red else "!", finding.name)
    parts = [f"? {finding.series}: suspected" if finding.suspected else f"{mark} {finding.series}: {what}"]
    if judged is not None and definition is not None:
        before, now = judged.pair
        parts.append(f"{value(before)} → {value(now, definition.unit)}")
        parts.append(_limit(definition.limit))
    parts.append(finding.verdict.sentence)
    if finding.blame:
        parts.append(("" if finding.news else "still red: ") + finding.blame)
    if finding.machine:
        parts.append(f"on {finding.machine}")
    parts.append(f"see {site}{page_of(finding.test)}")
    return clean("; ".join(parts))


def accused(judged: Judged | None) -> dict[str, Writable]:
    """The commits that a red run time may have become worse with, and how probable its first bad commit is."""
    if judged is None or judged.accused is None:
        return {}
    good, bad = (night.run.engine.git_hash or night.run.engine.version for night in judged.accused)
    return {"accused": {"after": good, "up_to": bad, "probability": judged.probability}}


def findings_json(findings: Sequence[Finding], then: Sequence[OldAnswers] = ()) -> str:
    """What tonight came to, the worst first, as JSON: a list with an object for each series.

    After them, of `then` (tracker.past.OldAnswers), one for each series by its old question; `asked_at` is whose.
    """

    told: list[dict[str, Writable]] = [
        {
            "series": finding.series,
            "test": finding.test,
            "word": finding.verdict.word,
            "name": finding.name if finding.red or finding.flaky or finding.worse_than_expected else "",
            "red": finding.red,
            "news": finding.red and finding.news,
            "state": finding.state,
            "sentence": finding.verdict.sentence,
            "value": finding.judged.night.sample.value if finding.judged else None,
            "levels": finding.judged.levels if finding.judged else None,
            "first_bad": finding.first_bad,
            "last_good": finding.last_good,
            **accused(finding.judged),
            **({"machine": finding.machine} if finding.machine else {}),
        }
        for finding in findings
    ]
    told += [
        {
            "series": change.series,
            "test": change.test,
            "asked_at": old.commit,
            "word": change.word,
            "name": change.name,
            "red": change.red,
            "news": change.red,
            "state": "detected" if change.red else "green",
            "sentence": change.sentence,
            "value": change.after,
            "first_bad": "",
            "last_good": "",
        }
        for old in then
        for change in old.changes
    ]
    return readable(told)

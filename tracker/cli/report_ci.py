"""What a CI service shows of a night: a summary in Markdown, and annotations beside the commit."""

from __future__ import annotations

from collections.abc import Sequence

import click

import spook_tracker.tracker.document.outside as outside
from spook_tracker.tracker.cli.report_compare import escaped, red_line, summary, value
from spook_tracker.tracker.document.wording import clock, page_of, version
from spook_tracker.tracker.judge.causes import causes_tonight
from spook_tracker.tracker.judge.comparison_document import Change
from spook_tracker.tracker.judge.tonight import Finding

MOST = 40  # rows of a summary
MOST_ANNOTATIONS = 10  # GitHub shows as many of a step


def night_markdown(run: object, findings: Sequence[Finding], site: str = "") -> str:
    """One sentence, what broke by cause, and a row for each red series; `site` is the address of the website."""
    engine, started = run.engine, run.started  # type: ignore[attr-defined]
    red = [finding for finding in findings if finding.red]
    lines = [f"### {escaped(engine.name)} {escaped(version(engine))}, {clock(started)} UTC", ""]
    lines += [escaped(click.unstyle(summary(findings))), ""]
    causes = causes_tonight(findings)
    if len(causes) < len(red):
        lines += [*(f"- {escaped(cause.sentence)}" for cause in causes), ""]
    if red:
        lines += ["| series | what | before | now | since |", "|---|---|---:|---:|---|"]
    for finding in red[:MOST]:
        cells = (_linked(finding, site), *map(escaped, (finding.name, *_values(finding), finding.blame)))
        lines.append("| " + " | ".join(cells) + " |")
    if len(red) > MOST:
        lines.append(f"\nand {len(red) - MOST} more")
    return "\n".join(lines).rstrip() + "\n"


def commands_of(findings: Sequence[Finding]) -> list[str]:
    """A workflow command of GitHub for each red series, the worst first; nothing in it can end it or begin another."""
    red = [finding for finding in findings if finding.red]
    return [
        f"::error title={_property(f'{f.test}: {f.name}')}::"
        + _data(f"{f.series}: {' → '.join(_values(f))}; {f.verdict.sentence}")
        for f in red[:MOST_ANNOTATIONS]
    ]


def change_annotations(changes: Sequence[Change]) -> list[str]:
    """The same for a comparison."""
    return [
        f"::error title={_property(f'{change.test}: {change.name or change.word}')}::{_data(red_line(change))}"
        for change in changes
        if change.red
    ][:MOST_ANNOTATIONS]


def _values(finding: Finding) -> tuple[str, str]:
    judged, definition = finding.judged, finding.definition
    if judged is None or definition is None:
        return "", ""
    before = judged.against.sample.value if judged.against else None
    return value(before), value(judged.night.sample.value, definition.unit)


def _linked(finding: Finding, site: str) -> str:
    name = escaped(finding.series)
    return f"[{name}]({site.rstrip('/')}/{page_of(finding.test)})" if site else name


def _data(text: str) -> str:
    """Text as GitHub's workflow commands take it."""
    text = outside.clean(text).replace("\t", " ")
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")

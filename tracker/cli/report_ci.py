"""What a CI service shows of a night: a summary in Markdown, and annotations beside the commit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from spook_tracker.tracker.document.addresses import page_of
from spook_tracker.tracker.document.wording import clock, version
from spook_tracker.tracker.judge.causes import causes_tonight
from spook_tracker.tracker.judge.tonight import Finding

from .report_comment import command_of
from .report_compare import escape, summary, value

if TYPE_CHECKING:
    from spook_tracker.tracker.store.versions import RunInfo

MOST = 40  # rows of a summary
MOST_ANNOTATIONS = 10  # GitHub shows as many of a step


def night_markdown(run: RunInfo, findings: Sequence[Finding], site: str = "") -> str:
    """One sentence, what broke by cause, a row for each series red, recovered or worse than expected; `site` is the website's address."""
    engine, started = run.engine, run.started
    red = [finding for finding in findings if finding.red]
    lines = [f"### {escape(engine.name)} {escape(version(engine))}, {clock(started)} UTC", ""]
    lines += [escape(click.unstyle(summary(findings))), ""]
    causes = causes_tonight(findings)
    if len(causes) < len(red):
        lines += [*(f"- {escape(cause.sentence)}" for cause in causes), ""]
    shown = [*red, *(f for f in findings if f.recovered), *(f for f in findings if f.worse_than_expected)]
    if shown:
        lines += ["| series | what | before | now | since |", "|---|---|---:|---:|---|"]
    for finding in shown[:MOST]:
        what = "recovered" if finding.recovered else finding.name
        cells = (_linked(finding, site), *map(escape, (what, *_values(finding), finding.blame)))
        lines.append("| " + " | ".join(cells) + " |")
    if len(shown) > MOST:
        lines.append(f"\nand {len(shown) - MOST} more")
    return "\n".join(lines).rstrip() + "\n"


def commands_of(findings: Sequence[Finding]) -> list[str]:
    """A workflow command of GitHub for each red series, the worst first; nothing in it can end it or begin another."""
    red = [finding for finding in findings if finding.red]
    return [
        command_of(f"{f.test}: {f.name}", f"{f.series}: {' → '.join(_values(f))}; {f.verdict.sentence}")
        for f in red[:MOST_ANNOTATIONS]
    ]


def _values(finding: Finding) -> tuple[str, str]:
    judged, definition = finding.judged, finding.definition
    if judged is None or definition is None:
        return "", ""
    before, now = judged.pair
    return value(before), value(now, definition.unit)


def _linked(finding: Finding, site: str) -> str:
    name = escape(finding.series)
    return f"[{name}]({site.rstrip('/')}/{page_of(finding.test)})" if site else name

"""A comparison for a pull request: a short comment, and annotations. Both are empty when nothing became worse."""

from __future__ import annotations

from spook_tracker.tracker.document.wording import clean
from spook_tracker.tracker.judge.choice import worst_change
from spook_tracker.tracker.judge.comparison_document import CompareDocument

from .report_compare import both, escape, name_of, red_lines, where

MOST = 10  # series in a comment: more are counted


def comment(document: CompareDocument) -> str:
    """Markdown of a few lines; empty when nothing is red."""
    worst = worst_change(document)
    if worst is None:
        return ""
    reds = [change for change in document.changes if change.red]
    tests = len({change.test for change in reds})
    count = (
        f"{len(reds)} series of {tests} tests" if tests > 1 else f"{len(reds)} series of {escape(worst.test)}"
    )
    lines = [
        f"**✗ {count} worse than at {escape(name_of(document.before))}**; the worst: "
        f"{escape(where(worst))}, {escape(worst.name or worst.word)}",
        "",
    ]
    for change in [worst, *(change for change in reds if change is not worst)][:MOST]:
        values = " → ".join(both(change))
        how = f"{change.name or change.word}: {values}, {change.sentence}"
        lines.append(f"- {escape(where(change))}: {escape(how)}")
    if len(reds) > MOST:
        lines.append(f"- and {len(reds) - MOST} more")
    return "\n".join([*lines, "", f"{escape(name_of(document.after))}; all of it: `tracker compare`"])


def workflow_commands(document: CompareDocument) -> str:
    """A workflow command of GitHub Actions for each red line; empty when nothing is red."""
    title = f"{document.after.engine} became worse"
    return "\n".join(command_of(title, line) for line in red_lines(document.changes))


def command_of(title: str, words: str) -> str:
    """The workflow command for an annotation; nothing in it can end it or begin another."""
    return f"::error title={_value(title)}::{_data(clean(words))}"


def _data(text: str) -> str:
    """The message of a workflow command: what would end or split it is escaped."""
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _value(text: str) -> str:
    return _data(clean(text)).replace(":", "%3A").replace(",", "%2C")

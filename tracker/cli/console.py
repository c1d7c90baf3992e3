"""The terminal: width, colour, aligned tables, and what to show while a run is under way.

Colour only underlines what words and symbols say already. A pipe gets plain text, one line per test as it
finishes; a terminal gets a progress bar.
"""

from __future__ import annotations

import os
import shutil
import sys
import unicodedata
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal, TextIO

import click

import spook_tracker.tracker.document.outside as outside

PIPE_WIDTH = 120  # columns, where no terminal says otherwise
NARROW = 100  # columns; below, tables are laid out for a terminal of eighty
PLAIN = str.maketrans(
    {
        "✓": "+",
        "✗": "x",
        "≤": "<",
        "≥": ">",
        "±": "~",
        "…": ".",
        "→": ">",
        "−": "-",
        "·": "|",
        "●": "*",
        "─": "-",
        "×": "x",
    }
)
BARS = "▁▂▃▄▅▆▇█"
MOST_LINES = 12  # of one cell: what comes from outside may have no end


@dataclass(frozen=True)
class Column:
    """A column of a table; flexible ones give way when the terminal is narrow, the last one first: their texts wrap."""

    title: str
    align: Literal["left", "right"] = "left"
    flexible: bool = False
    least: int = 8  # columns below which a flexible one does not go


Style = Callable[[int, str], str]  # row and padded text of a cell, to coloured text


def width() -> int:
    """Columns to fill: COLUMNS, the terminal's, or those of a pipe."""
    return max(60, shutil.get_terminal_size((PIPE_WIDTH, 24)).columns)


FEW = 20  # pieces of work; of more a log gets a line each tenth, and for each test that is red


def is_terminal(stream: TextIO | None) -> bool:
    """Whether a person is looking at the stream; one that was closed from the start is None."""
    return stream is not None and stream.isatty() and os.environ.get("TERM") != "dumb"


def say(text: str = "", err: bool = False) -> None:
    """Print, in plain letters where the stream's encoding has no others, without colour in a pipe."""
    stream = sys.stderr if err else sys.stdout
    if stream is None:  # closed before we began, as some do to be rid of what is printed
        return
    text = outside.inert(text)
    try:
        text.encode(stream.encoding or "utf-8")
    except (UnicodeEncodeError, LookupError):
        text = text.translate(PLAIN).encode("ascii", "replace").decode()
    click.echo(text, err=err, color=False if "NO_COLOR" in os.environ else None)


def cells(text: str) -> int:
    """Columns a text takes: wide letters two, combining marks none."""
    if text.isascii():
        return len(text)
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text
    )


def clean(text: str) -> str:
    """Text from outside on one line, its control characters made visible."""
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() else " " if c.isspace() else "\N{REPLACEMENT CHARACTER}" for c in text
    )


def fit(text: str, room: int, align: str = "left") -> str:
    """A text cut or padded to exactly that many columns."""
    if cells(text) > room:
        while text and cells(text) > room - 1:
            text = text[:-1]
        text += "…"
    padding = " " * (room - cells(text))
    return padding + text if align == "right" else text + padding


def wrapped(text: str, room: int) -> list[str]:
    """A text in lines of at most that many columns: parted after spaces, else after the signs that part names, else
    anywhere. Lines after a mark or an indent of two columns begin below what follows it."""
    indent = "  " if text[:2] in ("● ", "  ") and room > 10 else ""
    lines: list[str] = []
    while cells(text) > room:
        end, taken = 0, 0
        while taken + cells(text[end]) <= room or end == 0:
            taken += cells(text[end])
            end += 1
        spaces = text[: end + 1].rfind(" ")
        joints = max(text[:end].rfind(sign) for sign in "/_-,:·") + 1
        if spaces > len(indent):
            end = spaces
        elif joints > len(indent) + room // 3:
            end = joints
        if len(lines) == MOST_LINES - 1:
            return [*lines, fit(text, room)]
        lines.append(text[:end].rstrip())
        text = indent + text[end:].lstrip()
    return [*lines, text]


def table(
    columns: Sequence[Column],
    rows: Sequence[Sequence[str]],
    room: int | None = None,
    colour: dict[int, Style] | None = None,
) -> list[str]:
    """Aligned lines with a heading and a rule; flexible columns shrink until the table fits, and what they hold goes on
    in the next line. A row of one cell alone reaches across all columns."""
    room = room or width()
    rows = [[clean(cell) for cell in row] for row in rows]
    aligned = [row for row in rows if len(row) > 1 or len(columns) == 1]
    widths = [
        max([cells(column.title), *(cells(row[i]) for row in aligned)]) for i, column in enumerate(columns)
    ]
    excess = sum(widths) + 2 * (len(columns) - 1) - room
    for i in reversed(range(len(columns))):
        if excess > 0 and columns[i].flexible:
            cut = min(excess, widths[i] - columns[i].least)
            if cut > 0:
                widths[i] -= cut
                excess -= cut
    titles = [wrapped(c.title, w) for c, w in zip(columns, widths, strict=True)]
    lines = [click.style(line, bold=True) for line in _beside(titles, columns, widths, {}, 0)]
    lines.append("─" * min(room, sum(widths) + 2 * (len(widths) - 1)))
    for number, row in enumerate(rows):
        if len(row) == 1 < len(columns):
            lines += wrapped(row[0], room)
            continue
        parts = [
            wrapped(cell, w) if c.flexible else [cell]
            for cell, w, c in zip(row, widths, columns, strict=True)
        ]
        lines += _beside(parts, columns, widths, colour or {}, number)
    return lines


def _beside(
    parts: Sequence[Sequence[str]],
    columns: Sequence[Column],
    widths: Sequence[int],
    colour: dict[int, Style],
    number: int,
) -> Iterator[str]:
    """The lines of one row: its cells beside each other, each in its column."""
    for k in range(max(map(len, parts))):
        padded = [
            fit(part[k] if k < len(part) else "", w, c.align)
            for part, w, c in zip(parts, widths, columns, strict=True)
        ]
        for place, style in colour.items():
            padded[place] = style(number, padded[place])
        yield "  ".join(padded).rstrip()


def sparkline(values: Sequence[float], room: int = 60) -> str:
    """Values as bars, the newest at the right; what is not finite is a cross."""
    import math

    shown = list(values)[-room:]
    finite = [value for value in shown if math.isfinite(value)]
    low, high = min(finite, default=0.0), max(finite, default=0.0)
    spread = high - low
    bars = []
    for value in shown:
        if not math.isfinite(value):
            bars.append("×")
        else:
            level = (value - low) / spread if spread > 0.0 and math.isfinite(spread) else 0.5
            bars.append(BARS[min(len(BARS) - 1, int(level * len(BARS)))])
    return "".join(bars)


@contextmanager
def watching(title: str) -> Iterator[Callable[[int, int, str, bool, tuple[str, ...]], None]]:
    """A function to call after each piece of work: (done, total, test, test finished, failed series)."""
    if not is_terminal(sys.stderr):
        failures: dict[str, list[str]] = {}
        tenths = -1

        def line(done: int, total: int, test: str, finished: bool, failed: tuple[str, ...]) -> None:
            nonlocal tenths
            failures.setdefault(test, []).extend(failed)
            bad = failures[test]
            if finished and (bad or total <= FEW or 10 * done // total > tenths):
                tenths = 10 * done // total
                say(
                    f"[{done:>{len(str(total))}}/{total}] {test}" + (f": {len(bad)} red" if bad else ""),
                    err=True,
                )

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    shown = Progress(
        TextColumn(title),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[test]}", markup=False),
        console=Console(stderr=True),
        transient=True,
    )
    with shown:
        bar = shown.add_task(title, total=None, test="")

        def step(done: int, total: int, test: str, finished: bool, failed: tuple[str, ...]) -> None:
            shown.update(bar, completed=done, total=total, test=test)
            for key in failed:
                shown.console.print(f"✗ {outside.clean(key)}", style="red", markup=False, highlight=False)

        yield step

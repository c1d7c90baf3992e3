"""Pictures of charts without JavaScript: geometry here, markup in the template `chart.svg`.

Colours are classes of the style sheet, so a picture follows light and dark like the page around it. The
picture has a title and a description and is drawn in fixed units that scale with the page. Plotly makes such pictures
only by a browser that it starts, and with colours of one theme in them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypedDict

from spook_tracker.tracker.document.wording import clean, number

from .charts import (
    Chart,
    Grid,
    Line,
    Scale,
    drawable,
    flattened,
    names_on_lines,
    thinned,
    ticks,
)

WIDTH, HEIGHT = 640.0, 360.0
LEFT, RIGHT, TOP, BOTTOM = 74.0, 14.0, 14.0, 50.0
LETTER = 6.4  # width of a letter of the legend
MOST_POINTS = 600  # of one line; more cannot be seen at this size
MOST_MARKERS = 80  # of a line that is drawn itself
WHOLE = re.compile(r"\.0(?![0-9])")  # what `_n` leaves out
CELL_WORDS = ("settled", "bounded", "growing", "diverged", "not_finite")


@dataclass
class Mark:
    """A line of the picture: its path and the places of its markers."""

    name: str
    classes: str
    path: str = ""
    markers: list[tuple[str, str]] = field(default_factory=list)  # shape, transform
    label: str = ""  # shown in the legend if not empty


@dataclass
class Picture:
    """Everything the template needs, in the picture's own units."""

    name: str
    title: str
    description: str
    width: float
    height: float
    box: tuple[float, float, float, float]  # left, top, right, bottom
    x_label: str
    y_label: str
    x_ticks: list[tuple[str, str]] = field(default_factory=list)
    y_ticks: list[tuple[str, str]] = field(default_factory=list)
    bands: list[tuple[str, str, str]] = field(default_factory=list)  # top, height, name
    marks: list[Mark] = field(default_factory=list)
    rings: list[str] = field(default_factory=list)
    centre: tuple[str, str] = ("0", "0")
    legend: list[tuple[str, str, str, str]] = field(default_factory=list)  # x, y, classes, name
    cells: list[tuple[str, str, str, str, str, str]] = field(default_factory=list)
    names: list[tuple[str, str]] = field(default_factory=list)  # height and name of a line


def picture(chart: Chart, shown: Chart | None = None) -> Picture:
    """The chart as a picture; `shown` is what can be drawn of it, where that is known."""
    chart = flattened(shown or drawable(chart))
    (x_low, x_high), (y_low, y_high) = chart.ends()
    legend, rows = ([], 0) if chart.direct else _legend(chart.lines)
    top = TOP + 18.0 * rows
    box = (LEFT, top, WIDTH - RIGHT, HEIGHT - BOTTOM + 18.0 * rows)
    height = HEIGHT + 18.0 * rows
    if chart.polar:
        reach = chart.reach
        span_y, span_x = box[3] - box[1], box[2] - box[0]
        y_low, y_high = -reach, reach
        x_low, x_high = -reach * span_x / span_y, reach * span_x / span_y

    def place(value: float, ends: tuple[float, float], scale: Scale, edges: tuple[float, float]) -> float:
        at = math.log10(value) if scale == "log" else value
        return edges[0] + (at - ends[0]) / (ends[1] - ends[0]) * (edges[1] - edges[0])

    def x_of(x: float) -> float:
        return place(x, (x_low, x_high), chart.x_scale, (box[0], box[2]))

    def y_of(y: float) -> float:
        return place(y, (y_low, y_high), chart.y_scale, (box[3], box[1]))

    out = Picture(
        name=chart.name,
        title=clean(chart.title),
        description=describe(chart),
        width=WIDTH,
        height=height,
        box=box,
        x_label="" if chart.polar else clean(chart.x_label),
        y_label="" if chart.polar else clean(chart.y_label),
        legend=legend,
    )
    if chart.polar:
        out.centre = (_n(x_of(0.0)), _n(y_of(0.0)))
        out.rings = [_n(y_of(0.0) - y_of(r)) for r in chart.rings]
        out.y_ticks = []
    else:
        out.x_ticks = _tick_marks(chart.x_ticks, x_low, x_high, chart.x_scale, x_of)
        out.y_ticks = _tick_marks((), y_low, y_high, chart.y_scale, y_of)
    for band in chart.bands:
        low = y_of(band.low) if chart.y_scale == "linear" or band.low > 0.0 else box[3]
        high = max(y_of(band.high), box[1])
        out.bands.append((_n(high), _n(max(low - high, 1.5)), clean(band.name)))
    out.names = [
        (_n(y_of(one.y) + (12.0 if one.below else -5.0)), clean(one.name)) for one in names_on_lines(chart)
    ]
    out.marks = [_mark(line, x_of, y_of) for line in chart.lines if not line.waits]
    return out


def grid_picture(grid: Grid) -> Picture:
    """A map of cells as a picture; every class has its own hatching letter as well as its colour."""
    columns, rows = max(1, len(grid.x)), max(1, len(grid.y))
    box = (LEFT + 14.0, TOP, WIDTH - RIGHT, HEIGHT - BOTTOM)
    wide, tall = (box[2] - box[0]) / columns, (box[3] - box[1]) / rows
    out = Picture(
        name=grid.name,
        title=clean(grid.title),
        description=f"{grid.title}: {rows} by {columns} cells. {grid.note}".strip(),
        width=WIDTH,
        height=HEIGHT + 22.0,
        box=box,
        x_label=clean(grid.x_label),
        y_label=clean(grid.y_label),
    )
    for j, row in enumerate(grid.cells[:rows]):
        for i, word in enumerate(row[:columns]):
            x, y = box[0] + i * wide, box[3] - (j + 1) * tall
            letter = cell_letter(word)
            told = f"{grid.x_label} {number(grid.x[i])}, {grid.y_label} {number(grid.y[j])}: {clean(word)}"
            out.cells.append((_n(x), _n(y), _n(wide), _n(tall), cell_class(word), told))
            if letter and wide > 9.0 and tall > 9.0:
                out.legend.append((_n(x + wide / 2), _n(y + tall / 2 + 3.5), "letter", letter))
    out.x_ticks = [
        (_n(box[0] + (i + 0.5) * wide), number(grid.x[i], 3)) for i in thinned(columns, 8) if i < len(grid.x)
    ]
    out.y_ticks = [
        (_n(box[3] - (j + 0.5) * tall), number(grid.y[j], 3)) for j in thinned(rows, 8) if j < len(grid.y)
    ]
    return out


def cell_class(word: str) -> str:
    """The class of the style sheet for a cell's word."""
    return f"cell-{word.replace('_', '-')}" if word in CELL_WORDS else "cell-unknown"


def cell_letter(word: str) -> str:
    """A sign beside the colour, so that a map reads without colours too."""
    return {"growing": "↗", "diverged": "×", "not_finite": "∞"}.get(word, "")


def describe(chart: Chart) -> str:
    """One sentence for readers who cannot see the picture."""
    names = [line.name for line in chart.lines if not line.quiet]
    shown = "; ".join(clean(name) for name in names[:8]) + ("; …" if len(names) > 8 else "")
    return f"{clean(chart.y_label) or 'value'} against {clean(chart.x_label)}. Lines: {shown}."


class Spark(TypedDict):
    """A small line in a cell: its path, its last point, and where it failed, as coordinates."""

    path: str
    last: tuple[str, str] | None
    failed: list[tuple[str, str]]
    width: float
    height: float


def sparkline(
    values: Sequence[float], states: Sequence[str], width: float = 96.0, height: float = 24.0
) -> Spark:
    """A line of the newest values for a table cell: its path, its last point and where it failed."""
    finite = [v for v in values if math.isfinite(v)]
    if not finite:
        return {"path": "", "last": None, "failed": [], "width": width, "height": height}
    low, high = min(finite), max(finite)
    span = high - low
    flat = span <= 1e-12 * max(abs(low), abs(high))
    step = (width - 8.0) / max(1, len(values) - 1)

    def point(i: int, value: float) -> tuple[float, float]:
        share = 0.5 if flat else (value - low) / span
        return 4.0 + i * step, height - 4.0 - share * (height - 8.0)

    path: list[str] = []
    pen, level = "M", ""
    for i, value in enumerate(values):  # hundreds stand on a page: what stays level is one stroke
        if not math.isfinite(value):
            pen = "M"
            continue
        x, y = point(i, value)
        across, down = f"{x:.1f}", f"{y:.1f}"
        if pen == "L" and down == level:
            if path[-1].startswith("H"):
                path.pop()
            path.append(f"H{across}")
        else:
            path.append(f"{pen}{across} {down}")
        pen, level = "L", down
    failed = []
    for i, (value, state) in enumerate(zip(values, states, strict=True)):
        if state == "fail":
            x, y = point(i, value) if math.isfinite(value) else (4.0 + i * step, 4.0)
            failed.append((_n(x), _n(y)))
    last = len(values) - 1
    end = point(last, values[last]) if math.isfinite(values[last]) else None
    return {
        "path": _short("".join(path)),
        "last": (_n(end[0]), _n(end[1])) if end and states[last] != "fail" else None,
        "failed": failed[-12:],
        "width": width,
        "height": height,
    }


def _legend(lines: Sequence[Line]) -> tuple[list[tuple[str, str, str, str]], int]:
    """Names above the picture, in rows; at most twelve."""
    x, row, entries = LEFT, 0, []
    shown = [line for line in lines if not line.quiet]
    if len(shown) < 2 and all(line.style != "limit" for line in shown):
        return [], 0
    for line in shown[:12]:
        name = clean(line.name)
        name = name if len(name) <= 44 else name[:43] + "…"
        wide = 30.0 + LETTER * len(name)
        if x + wide > WIDTH - RIGHT and x > LEFT:
            x, row = LEFT, row + 1
        entries.append((_n(x), _n(TOP + 18.0 * row), f"{line.style} c{line.colour % 8}", name))
        x += wide
    return entries, row + 1


def _tick_marks(
    given: Sequence[tuple[float, str]], low: float, high: float, scale: Scale, place: Callable[[float], float]
) -> list[tuple[str, str]]:
    if given:
        return [(_n(place(value)), clean(label)) for value, label in given]
    if scale == "log":
        return [(_n(place(10.0**e)), number(10.0**e, 3)) for e in ticks(low, high, scale)]
    found = ticks(low, high, scale)
    return [(_n(place(value)), number(value, 6)) for value in found]


def _mark(line: Line, x_of: Callable[[float], float], y_of: Callable[[float], float]) -> Mark:
    mark = Mark(clean(line.name), f"{line.style} c{line.colour % 8}")
    pieces, pen, before = [], "M", 0.0
    places = thinned(len(line.x), MOST_POINTS)
    if line.style == "both" and len(places) > MOST_MARKERS and all(map(math.isfinite, line.y)):
        mark.path = _short("M" + "L".join([f"{x_of(line.x[i]):.1f} {y_of(line.y[i]):.1f}" for i in places]))
        return mark
    for i in places:
        if not math.isfinite(line.y[i]):
            pen = "M"
            continue
        x, y = x_of(line.x[i]), y_of(line.y[i])
        if line.style not in ("points", "failed", "broken"):
            if line.style == "steps" and pen == "L":
                pieces.append(f"L{x:.1f} {before:.1f}")
            pieces.append(f"{pen}{x:.1f} {y:.1f}")
            pen, before = "L", y
        if line.style in ("points", "both", "failed", "broken") and (
            len(places) <= MOST_MARKERS or line.style != "both"
        ):
            mark.markers.append(
                (
                    {"failed": "cross", "broken": "ring"}.get(line.style, f"m{line.colour % 4}"),
                    f"{_n(x)} {_n(y)}",
                )
            )
    for i in places if line.upto else ():
        if math.isfinite(line.y[i]) and line.upto[i] > line.x[i]:
            pieces.append(f"M{x_of(line.x[i]):.1f} {y_of(line.y[i]):.1f}H{x_of(line.upto[i]):.1f}")
    mark.path = _short("".join(pieces))
    return mark


def _n(value: float) -> str:
    """A coordinate with one decimal, so that the same chart is the same bytes."""
    return f"{value:.1f}".removesuffix(".0")


def _short(path: str) -> str:
    """The coordinates of a path as `_n` writes them, in one go."""
    return WHOLE.sub("", path)

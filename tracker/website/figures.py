"""Charts as data for Plotly, without importing Plotly: plain lists that the page's script gives to the library.

Names from outside reach the library as escaped text, never as a template: Plotly reads some tags in text and
every percent sign with braces in a hover template. Colours are slots; the script fills them in from the style
sheet, so that a chart follows light and dark.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, NotRequired, TypedDict

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
from .svg import CELL_WORDS

if TYPE_CHECKING:
    from spook_tracker.tracker.document.json_form import Writable


class Layout(TypedDict):
    """Of a chart, by Plotly's names; shapes and annotations are slots that a page fills in."""

    xaxis: dict[str, Writable]
    yaxis: dict[str, Writable]
    showlegend: bool
    shapes: NotRequired[list[dict[str, Writable]]]
    annotations: NotRequired[list[dict[str, Writable]]]


class FigureParts(TypedDict):
    """Traces and layout of a chart."""

    data: list[dict[str, Writable]]
    layout: Layout
    over: NotRequired[list[int | None]]  # x is nights: the first, and the last


Cut = Callable[[float], float | None]
DASHES = {"reference": "dash", "limit": "dot", "front": "longdash"}
SYMBOLS = (
    "circle",
    "square",
    "diamond",
    "triangle-up",
    "circle-open",
    "square-open",
    "diamond-open",
    "cross",
)


def plain(text: str) -> str:
    """Text that Plotly shows as it is."""
    return clean(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _all_plain(texts: Sequence[str]) -> list[str]:
    """Many texts as Plotly shows them, ends of lines kept: in one go, where nothing in them is the mark between."""
    between = "⁂|"
    found = plain(between.join(texts)).split(between)
    return found if len(found) == len(texts) else list(map(plain, texts))


def figure(chart: Chart, shown: Chart | None = None) -> FigureParts:
    """Traces and layout of a chart, colours as slots in `meta`; `shown` is what can be drawn of it, where known."""
    chart = flattened(shown or drawable(chart))
    x_ends, y_ends = chart.ends()
    layout: Layout = {
        "xaxis": {"title": {"text": plain(chart.x_label)}}
        if chart.over
        else _axis(chart.x_label, chart.x_scale, x_ends),
        "yaxis": _axis(chart.y_label, chart.y_scale, y_ends),
        "showlegend": not chart.direct and sum(not line.quiet for line in chart.lines) > 1,
        "shapes": [],
        "annotations": [],
    }
    if chart.x_ticks:
        layout["xaxis"] |= {
            "tickvals": [value for value, _ in chart.x_ticks],
            "ticktext": [plain(label) for _, label in chart.x_ticks],
            "tickangle": 0,
        }
    if chart.polar:
        _polar(layout, chart)
    for one in names_on_lines(chart):
        at = math.log10(one.y) if chart.y_scale == "log" else one.y
        side = {"yanchor": "top"} if one.below else {}
        layout["annotations"].append({"meta": "line", "y": at, "text": plain(one.name), **side})
    for band in chart.bands:
        low = band.low if chart.y_scale == "linear" or band.low > 0.0 else None
        layout["shapes"].append({"meta": "band", "low": low, "high": band.high, "name": plain(band.name)})
    for axis, ends in ((layout["xaxis"], x_ends), (layout["yaxis"], y_ends)):
        if "range" in axis and not chart.polar:
            axis["range"] = [_cut(end, ends, "linear") for end in ends]
    x_cut, y_cut = (
        partial(_cut, ends=x_ends, scale=chart.x_scale),
        partial(_cut, ends=y_ends, scale=chart.y_scale),
    )
    made: FigureParts = {"data": [_trace(line, x_cut, y_cut) for line in chart.lines], "layout": layout}
    if chart.over:
        made["over"] = [None if end is None else int(end) for end in chart.over]
    return made


def _cut(value: float, ends: tuple[float, float], scale: Scale) -> float | None:
    """A coordinate with the digits that can be seen: a hundred-thousandth of a linear axis, six digits of a
    logarithmic one. None where there is no number."""
    if not math.isfinite(value):
        return None
    if scale == "log":
        value = float(f"{value:.6g}")
    elif (span := ends[1] - ends[0]) > 0.0 and math.isfinite(span):
        value = round(value, min(300, 5 - math.floor(math.log10(span))))
    return int(value) if value.is_integer() and abs(value) < 1e15 else value


def grid_figure(grid: Grid) -> FigureParts:
    """A map as a heat map over places, with the prediction as a contour line at 1."""
    codes = {word: code for code, word in enumerate(CELL_WORDS)}
    z = [[codes.get(word, len(CELL_WORDS)) for word in row] for row in grid.cells]
    told = [
        [
            f"{plain(grid.x_label)}: {number(grid.x[i])}\n{plain(grid.y_label)}: {number(grid.y[j])}"
            f"\n{plain(word.replace('_', ' '))}{_predicted(grid, i, j)}"
            for i, word in enumerate(row)
        ]
        for j, row in enumerate(grid.cells)
    ]
    x, y = list(range(len(grid.x))), list(range(len(grid.y)))
    data: list[dict[str, Writable]] = [
        {
            "type": "heatmap",
            "x": x,
            "y": y,
            "z": z,
            "text": told,
            "hoverinfo": "text",
            "meta": {"role": "cells"},
        }
    ]
    if grid.prediction:
        logs = [
            [math.log10(v) if v > 0.0 and math.isfinite(v) else None for v in row] for row in grid.prediction
        ]
        data.append(
            {
                "type": "contour",
                "x": x,
                "y": y,
                "z": logs,
                "hoverinfo": "skip",
                "showscale": False,
                "contours": {"type": "constraint", "operation": "=", "value": 1e-9},
                "meta": {"role": "prediction"},
                "name": "predicted edge",
            }
        )
    return {
        "data": data,
        "layout": {
            "xaxis": _places(grid.x_label, grid.x),
            "yaxis": _places(grid.y_label, grid.y),
            "showlegend": False,
        },
    }


def _predicted(grid: Grid, i: int, j: int) -> str:
    if not grid.prediction or j >= len(grid.prediction) or i >= len(grid.prediction[j]):
        return ""
    return f"\npredicted growth per step: {number(grid.prediction[j][i], 6)}"


def _places(label: str, values: tuple[float, ...]) -> dict[str, Writable]:
    shown = thinned(len(values), 9)
    return {
        "title": {"text": plain(label)},
        "tickvals": shown,
        "ticktext": [number(values[i], 3) for i in shown],
        "showgrid": False,
        "zeroline": False,
    }


def _axis(label: str, scale: Scale, ends: tuple[float, float]) -> dict[str, Writable]:
    low, high = ends
    axis: dict[str, Writable] = {"title": {"text": plain(label)}, "type": scale, "range": [low, high]}
    if scale == "log":
        decades = ticks(low, high, scale)
        shown = decades if len(decades) > 2 else _within(low, high, (1, 2, 5))
        if len(shown) < 3:
            shown = _legible(
                [_within(low, high, steps) for steps in ((1,), (5, 2), (3, 7), (1.5, 4))], high - low
            )
        axis |= {
            "tickvals": [10.0**e for e in shown],
            "ticktext": [number(float(f"{10.0**e:.3g}"), 3) for e in shown],
            "minor": {"showgrid": False},
        }
    return axis


def _within(low: float, high: float, steps: Sequence[float]) -> list[float]:
    """Marks inside the decades, as decades."""
    marks = [e + math.log10(m) for e in range(math.floor(low), math.ceil(high)) for m in steps]
    return [e for e in marks if low <= e <= high]


def _legible(ranks: Sequence[Sequence[float]], room: float) -> list[float]:
    """Marks whose words do not touch, those of the first ranks before the rest."""
    kept: list[float] = []
    for mark in chain.from_iterable(ranks):
        if all(abs(mark - other) >= room / 7.0 for other in kept):
            kept.append(mark)
    return sorted(kept)


def _polar(layout: Layout, chart: Chart) -> None:
    """Rings and equal axes instead of a frame."""
    reach = chart.reach
    layout["xaxis"] = {"visible": False, "range": [-reach, reach], "scaleanchor": "y"}
    layout["yaxis"] = {"visible": False, "range": [-reach, reach]}
    for radius in chart.rings:
        layout["shapes"].append({"meta": "ring", "radius": radius})
        layout["annotations"].append({"meta": "ring", "x": 0.0, "y": radius, "text": number(radius, 6)})


def _trace(line: Line, x_cut: Cut, y_cut: Cut) -> dict[str, Writable]:
    drawn = {"points": "markers", "failed": "markers", "broken": "markers", "both": "lines+markers"}.get(
        line.style, "lines"
    )
    meta: dict[str, Writable] = {"colour": line.colour % 8, "style": line.style}
    trace: dict[str, Writable] = {
        "type": "scatter",
        "mode": drawn,
        "name": plain(line.name),
        "x": list(map(x_cut, line.x)),
        "y": list(map(y_cut, line.y)),
        "meta": meta,
        "showlegend": not line.quiet,
    }
    if line.night:
        meta["night"] = line.night
    if line.style in DASHES:
        trace["line"] = {"dash": DASHES[line.style]}
    if line.style == "steps":
        trace["line"] = {"shape": "hv"}
    if "markers" in drawn:
        own = {"failed": "x-thin", "broken": "circle-open"}.get(line.style)
        trace["marker"] = {"symbol": own or SYMBOLS[line.colour % 8]}
    if line.upto:
        far = [float(f"{end - x:.3g}") for x, end in zip(line.x, line.upto, strict=True)]
        trace["error_x"] = {"type": "data", "symmetric": False, "array": far, "arrayminus": [0] * len(far),
                            "thickness": 1, "width": 0}  # fmt: skip
    if line.notes:
        trace |= {"hovertext": _all_plain(line.notes), "hoverinfo": "text"}
    if line.labels:
        trace |= {"mode": "markers+text", "text": _all_plain(line.labels), "textposition": "top left",
                  "cliponaxis": False}  # fmt: skip
    return trace

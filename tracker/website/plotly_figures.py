"""The charts of the website as figures of Plotly's Python package, for notebooks.

Traces and layout are those of `figures.figure`; the colours that a page fills in from the style sheet are filled in from
the same style sheet here, those of its light theme.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.resources import resource

from .charts import Chart
from .figures import figure

CROWDED = 60  # points of a line, beyond which its marks are small
ALARMING = ("limit", "failed", "broken")


class Figure(Protocol):
    """A figure of Plotly's Python package, as far as we know of it: the package has no types."""

    @property
    def data(self) -> Sequence[object]:
        """Its traces."""
        ...

    def show(self) -> None:
        """Open it."""
        ...

    def write_html(self, file: str | Path) -> None:
        """Write it as a document."""
        ...


def plotly_figure(chart: Chart) -> Figure:
    """The chart as a figure. TrackerError without Plotly."""
    try:
        graph_objects = import_module("plotly.graph_objects")
    except ImportError:
        raise TrackerError(
            "a figure needs Plotly; install it with: pip install 'spook-tracker[standard]'"
        ) from None
    made = figure(chart)
    night = next((line.night for line in chart.lines if line.night), "")
    traces = [_trace(trace, night) for trace in made["data"]]
    found: Figure = graph_objects.Figure(data=traces, layout=_layout(made["layout"], chart.title))
    return found


@cache
def colours() -> Mapping[str, str]:
    """Name to value of the light theme's colours."""
    style = (resource("site") / "static" / "site.css").read_text(encoding="utf-8")
    return dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", style.partition("}")[0]))


def _trace(given: Mapping[str, Any], night: str) -> dict[str, Any]:
    """As site.js dresses it: one colour a line, small marks where there are many."""
    trace, meta = dict(given), given["meta"]
    style = meta["style"]
    for name in ("text", "hovertext"):
        if name in trace:
            trace[name] = [text.replace("\n", "<br>") for text in trace[name]]
    if "night" in meta:
        trace["visible"] = meta["night"] == night
    paint = colours()["fail-fill" if style in ALARMING else f"c{meta['colour']}"]
    trace["line"] = {"width": 1.5 if style == "front" else 2, **trace.get("line", {}), "color": paint}
    if style == "front":
        trace["opacity"] = 0.65
    if "marker" in trace:
        alarming = style in ("failed", "broken")
        crowded = len(trace["x"]) > CROWDED and style == "both"
        trace["marker"] |= {"color": paint, "size": 10 if alarming else 3 if crowded else 7}
        if alarming:
            trace["marker"]["line"] = {"width": 2.5, "color": paint}
    return trace


def _layout(given: Mapping[str, Any], title: str) -> dict[str, Any]:
    shapes, notes = [], []
    log = given["yaxis"].get("type") == "log"
    for shape in given["shapes"]:
        if shape["meta"] == "ring":
            r = shape["radius"]
            shapes.append({"type": "circle", "x0": -r, "x1": r, "y0": -r, "y1": r, "layer": "below",
                           "line": {"color": colours()["line"], "width": 1}})  # fmt: skip
            continue
        low = shape["low"] if shape["low"] is not None else 1e-300 if log else 0.0
        shapes.append({"type": "rect", "xref": "paper", "x0": 0, "x1": 1, "y0": low, "y1": shape["high"],
                       "layer": "below", "line": {"width": 0}, "fillcolor": colours()["c2"], "opacity": 0.16})  # fmt: skip
    for note in given["annotations"]:
        on_line = {"xref": "paper", "x": 1, "xanchor": "right"} if note["meta"] == "line" else {}
        rest = {name: value for name, value in note.items() if name != "meta"}
        notes.append({"showarrow": False, "font": {"size": 11}, "yanchor": "bottom", **on_line, **rest})
    return {
        **given,
        "shapes": shapes,
        "annotations": notes,
        "title": {"text": title},
        "template": "plotly_white",
    }

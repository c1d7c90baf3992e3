"""What a chart is, before it is drawn: lines, bands and axes.

`figures` turns a Chart into data for Plotly, `svg` into a picture for readers without JavaScript, for print and
for feeds. Both draw the same numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

Style = Literal["line", "points", "both", "reference", "limit", "front", "failed", "broken", "steps"]
Scale = Literal["linear", "log"]


@dataclass(frozen=True, kw_only=True)
class Line:
    """One line or cloud of points. A NaN in y is a gap; a failed point is a line of its own style."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    style: Style = "both"
    colour: int = 0  # slot of the palette
    notes: tuple[str, ...] = ()  # what a reader sees at each point, if anything
    labels: tuple[str, ...] = ()  # what stands beside each point
    quiet: bool = False  # left out of the legend
    upto: tuple[float, ...] = ()  # how far each point reaches along x: the slowest repeat
    night: str = ""  # the choice of an earlier night it belongs to
    waits: bool = False  # not drawn until a reader chooses its night


@dataclass(frozen=True, kw_only=True)
class Band:
    """A horizontal band: where the set point is."""

    low: float
    high: float
    name: str


@dataclass(frozen=True, kw_only=True)
class Chart:
    """One diagram. Polar charts have the angle in degrees in x and the radius in y."""

    name: str  # slug, unique on its page
    title: str
    x_label: str
    y_label: str
    lines: tuple[Line, ...]
    x_scale: Scale = "linear"
    y_scale: Scale = "linear"
    polar: bool = False
    bands: tuple[Band, ...] = ()
    x_ticks: tuple[tuple[float, str], ...] = ()  # where x is a place in a list
    note: str = ""
    thesis: str = ""
    direct: bool = False  # horizontal lines carry their names, so no legend is needed
    reach: float = 1.0  # of a polar chart drawn flat: how far its axes go from the centre
    rings: tuple[float, ...] = ()  # of a polar chart drawn flat: radii of its grid
    over: tuple[float, float | None] | None = (
        None  # x is nights: the first, and the last; None: it goes on tonight
    )

    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ends of both axes that show every line and band, in decades where logarithmic."""
        xs = [x for line in self.lines for x in line.x]
        ys = [y for line in self.lines for y in line.y]
        ys += [end for band in self.bands for end in (band.low, band.high)]
        return range_of(xs, self.x_scale, 0.03), range_of(ys, self.y_scale)


@dataclass(frozen=True, kw_only=True)
class Grid:
    """A map of cells with words for values; cells[row of y][column of x]."""

    name: str
    title: str
    x_label: str
    y_label: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    cells: tuple[tuple[str, ...], ...]
    prediction: tuple[tuple[float, ...], ...] | None = None
    note: str = ""
    thesis: str = field(default="")


HALF_NAME = 0.035  # half the height of a name on a line, as a share of a small chart's
LARGEST = 1e300  # what is larger cannot be drawn: the ends of its axis would overflow


def fits(value: float) -> bool:
    """Whether there is a place for a value on an axis."""
    return math.isfinite(value) and abs(value) <= LARGEST


def drawable(chart: Chart) -> Chart:
    """The chart with nothing in it that cannot be drawn.

    Non-finite values become failed points at the upper edge. On a logarithmic axis magnitudes are drawn and an
    exact zero sits at the lower edge, a decade under the smallest value.
    """
    finite = [abs(y) for line in chart.lines for y in line.y if fits(y)]
    positive = [y for y in finite if y > 0.0]
    zeros = chart.y_scale == "log" and len(positive) < len(finite)
    floor = 10.0 ** (math.floor(math.log10(min(positive))) - 1) if positive else 1e-16
    floor = floor or math.ulp(0.0)  # there is no double a decade under the smallest
    log_y = chart.y_scale == "log"
    if log_y:
        top = 10.0 ** min(308, math.ceil(math.log10(max(positive)) + 0.3)) if positive else 1.0
    else:
        signed = [y for line in chart.lines for y in line.y if fits(y)]
        low, high = (min(signed), max(signed)) if signed else (0.0, 1.0)
        top = high + 0.08 * (high - low or abs(high) or 1.0)
    lines: list[Line] = []
    for line in chart.lines:
        keep_x, keep_y, keep_notes, keep_upto = [], [], [], []
        failed_x, failed_notes = [], []
        notes = line.notes or ("",) * len(line.x)
        for x, y, note, upto in zip(line.x, line.y, notes, line.upto or line.x, strict=True):
            if not math.isfinite(x) or (chart.x_scale == "log" and x <= 0.0):
                continue
            if not fits(y):
                failed_x.append(x)
                failed_notes.append(note or "failed: no finite value")
                continue
            keep_x.append(x)
            keep_upto.append(upto)
            keep_y.append((abs(y) or floor) if log_y else y)
            keep_notes.append(note or ("exactly 0, drawn at the lower edge" if log_y and y == 0.0 else ""))
        told = tuple(keep_notes) if any(keep_notes) else ()
        reach = tuple(keep_upto) if line.upto else ()
        lines.append(replace(line, x=tuple(keep_x), y=tuple(keep_y), notes=told, upto=reach))
        if failed_x:
            lines.append(
                Line(
                    name=f"{line.name}: failed",
                    x=tuple(failed_x),
                    y=(top,) * len(failed_x),
                    style="failed",
                    colour=line.colour,
                    notes=tuple(failed_notes),
                    quiet=True,
                    night=line.night,
                    waits=line.waits,
                )
            )
    note = chart.note
    if zeros:
        note = f"{note} Values of exactly 0 are drawn at the lower edge.".strip()
    return replace(chart, lines=tuple(lines), note=note)


@dataclass(frozen=True)
class NameOnLine:
    """The name that a horizontal line carries."""

    y: float
    name: str
    below: bool  # of two lines close together the lower is named below itself


def names_on_lines(chart: Chart) -> list[NameOnLine]:
    """The names of horizontal lines that carry them; what would lie on another is left out, the legend aside."""
    if not chart.direct:
        return []
    (_, (low, high)) = chart.ends()
    log = chart.y_scale == "log"
    found: list[NameOnLine] = []
    places: list[float] = []  # of the text, as a share of the axis
    named = [line for line in chart.lines if line.style in ("limit", "reference") and line.y]
    for line in sorted(named, key=lambda line: -line.y[0]):
        y = line.y[0]
        share = ((math.log10(y) if log else y) - low) / (high - low or 1.0)
        for below, place in ((False, share + HALF_NAME), (True, share - HALF_NAME)):
            if all(abs(place - other) >= 2.0 * HALF_NAME for other in places):
                found.append(NameOnLine(y, line.name, below))
                places.append(place)
                break
    return found


def flattened(chart: Chart) -> Chart:
    """A polar chart as points of the plane, with the rings of its grid; another chart as it is.

    A band of radii is no band of heights, so none is left: its place would have nothing to do with its ends.
    """
    if not chart.polar:
        return chart
    radii = [abs(y) for line in chart.lines for y in line.y if math.isfinite(y)]
    _, top = range_of([0.0, *radii], "linear")
    lines = []
    for line in chart.lines:
        notes = line.notes or tuple(f"{x:g}°, {y:.6g}" for x, y in zip(line.x, line.y, strict=True))
        turned = [(math.radians(x), y) for x, y in zip(line.x, line.y, strict=True)]
        x = tuple(y * math.cos(angle) for angle, y in turned)
        y = tuple(y * math.sin(angle) for angle, y in turned)
        lines.append(replace(line, x=x, y=y, notes=notes))
    rings = tuple(r for r in ticks(0.0, top, "linear", 4) if r > 0.0)
    return replace(
        chart,
        lines=tuple(lines),
        rings=rings,
        reach=1.12 * max(radii, default=1.0) or 1.0,
        bands=(),
        x_scale="linear",
        y_scale="linear",
    )


def range_of(values: Sequence[float], scale: Scale, extra: float = 0.05) -> tuple[float, float]:
    """Ends of an axis that shows all values, in the axis' own terms (decades if logarithmic)."""
    if scale == "log":
        logs = [math.log10(v) for v in values if math.isfinite(v) and v > 0.0]
        low, high = (min(logs), max(logs)) if logs else (-1.0, 1.0)
        pad = max(extra * (high - low), 0.15)
    else:
        values = [v for v in values if math.isfinite(v)]
        low, high = (min(values), max(values)) if values else (0.0, 1.0)
        pad = extra * (high - low) or abs(high) * 0.1 or 1.0
    return low - pad, high + pad


def ticks(low: float, high: float, scale: Scale, about: int = 6) -> list[float]:
    """Round values between the ends (decades if logarithmic), about that many."""
    if not (math.isfinite(low) and math.isfinite(high)) or low >= high:
        return []
    if scale == "log":
        first, last = max(math.ceil(low), -307), min(math.floor(high), 308)  # what a double can name
        step = max(1, math.ceil((last - first + 1) / about))
        found = [float(e) for e in range(first, last + 1) if e % step == 0]
        return found or [float(first)] if first <= last else []
    rough = (high - low) / about
    power = 10.0 ** math.floor(math.log10(rough))
    width = next((m * power for m in (1.0, 2.0, 2.5, 5.0, 10.0) if m * power >= rough), 10.0 * power)
    start, end = math.ceil(low / width - 1e-9), math.floor(high / width + 1e-9)
    return [round(i * width, 12 - math.floor(math.log10(power))) for i in range(start, end + 1)]


def thinned(count: int, most: int) -> list[int]:
    """At most that many places of a list, evenly spread, first and last among them."""
    if count <= most:
        return list(range(count))
    return sorted({round(i * (count - 1) / (most - 1)) for i in range(most)})


def turning(values: Sequence[float]) -> list[int]:
    """The places where a line over equal steps changes: dropping all others loses nothing.

    A deterministic value stands still for months, so ten years of nights become a few dozen points.
    """
    last = len(values) - 1

    def same(a: float, b: float) -> bool:
        return a == b or (math.isnan(a) and math.isnan(b))

    return [
        i
        for i, value in enumerate(values)
        if i in (0, last) or not same(value, values[i - 1]) or not same(value, values[i + 1])
    ]

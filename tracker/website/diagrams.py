"""Which charts a page shows: values over versions, figures of a test, ladders and maps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from spook_tracker.tracker.document.run_document import FigureData, MapData, Sample
from spook_tracker.tracker.document.wording import (
    conditions,
    day,
    named,
    number,
    opening,
    quantity,
    seconds,
    short_hash,
    slug,
    version,
)
from spook_tracker.tracker.judge.events import in_full

from .charts import Band, Chart, Grid, Line, Scale, drawable, thinned, turning
from .earlier_nights import Earlier
from .events import Event
from .figures import FigureParts, figure, grid_figure
from .nights import Night, TestHistory, Trend, as_night
from .svg import describe

MOST_NIGHTS = 1500  # points of one trend; a value that stands still costs two, so this is many years
MOVES = 500  # nights by which the beginning of a chart of more than four times as many moves
MOST_TIMES = 400  # of a run time, which never stands still
FEWEST_NIGHTS = 3  # of a chart over nights
WORDS = {
    "value": "inside",
    "out_of_limit": "out of limit",
    "not_finite": "not finite",
    "timed_out": "timed out",
}
BROKEN = {  # values that do not pass, and what their points are called
    "out_of_limit": "outside the limit",
    "unsettled": "a solve left unsettled",
}


@dataclass
class View:
    """A chart as the template wants it: words for the page, data for the script, which makes the table, too."""

    name: str
    title: str
    thesis: str
    note: str
    description: str
    figure: FigureParts | None
    tall: bool = False  # many names in the legend
    nightly: str = ""  # slug of the test whose run times it shows: every night has others
    key: str = ""  # of its data, once that is known
    file: str = ""  # address of the script with its data, below the root
    mark: str = ""  # what the file was made from


def view(chart: Chart, nightly: str = "") -> View:
    """The chart with everything drawn from it; `nightly` names the test whose run times it shows."""
    shown = drawable(chart)
    data = figure(chart, shown)
    return View(
        chart.name, chart.title, chart.thesis, shown.note, describe(chart), data,
        data["layout"]["showlegend"] and sum(not line.quiet for line in chart.lines) > 5, nightly,
    )  # fmt: skip


def grid_view(grid: Grid) -> View:
    """A map with everything drawn from it."""
    said = f"{grid.y_label} against {grid.x_label}, a cell each."
    return View(grid.name, grid.title, grid.thesis, grid.note, said, grid_figure(grid))


def moving(trends: Iterable[Trend]) -> list[Trend]:
    """Those a chart over nights says something of: at least three nights, and not the same in all of them."""
    return [
        t
        for t in trends
        if len(t.nights) >= FEWEST_NIGHTS and any(_differ(t.said[0][0], sample) for sample in t.distinct)
    ]


def _differ(one: Sample, other: Sample) -> bool:
    """Whether they read differently: no two NaN do, and the zeros do."""
    if one is other or one.outcome != other.outcome:
        return one is not other
    apart = one.value != other.value or one.value == 0.0
    return apart and repr(one.value) != repr(other.value)


def first_drawn(count: int) -> int:
    """The place of the first night of a chart over so many: it moves by many at once, so that most nights leave it."""
    over = max(0, count - MOST_NIGHTS * 4)
    return -(-over // MOVES) * MOVES


def trend_chart(
    trend: Trend,
    nights: Sequence[Night],
    events: Sequence[Event] = (),
    title: str = "",
    each: Literal["night", "version"] = "night",
) -> Chart:
    """A series over versions, with its limit, set point, reference, and where it became worse.

    Over nights nothing in it names tonight unless the value changed tonight: site.js draws on to tonight what stands
    still, so that the file of a series stays as it is for as long as the series does.
    """
    definition = trend.definition
    first = first_drawn(len(trend.nights))
    values, at, outcomes = trend.values[first:], trend.nights[first:], trend.outcomes[first:]
    turned = {i for i, now in enumerate(outcomes) if i and now != outcomes[i - 1]}
    places = sorted({*turning(values), *turned})  # a class may change where the value stands still
    goes_on = each == "night" and at[-1] == nights[-1].index
    if goes_on and len(places) > 1 and len(values) - 1 not in turned and repr(values[-1]) == repr(values[-2]):
        places.pop()
    places = [
        places[i] for i in thinned(len(places), MOST_TIMES if definition.kind == "time" else MOST_NIGHTS)
    ]
    told = {pair: _told(*pair, definition.unit) for pair in {(values[i], outcomes[i]) for i in places}}
    notes: tuple[str, ...] = ()
    if definition.kind != "time":  # a run time is another every night: the script says day and value
        notes = tuple(f"{nights[at[i]].label}\n{told[values[i], outcomes[i]]}" for i in places)
    x = tuple(float(at[i]) for i in places)
    y = tuple(values[i] for i in places)
    lines = [Line(name="measured", x=x, y=y, style="both", notes=notes)]
    for outcome, name in BROKEN.items():
        broken = [i for i in places if outcomes[i] == outcome and math.isfinite(values[i])]
        if broken:
            lines.append(
                Line(
                    name=name, style="broken", colour=1, x=tuple(float(at[i]) for i in broken),
                    y=tuple(values[i] for i in broken),
                    notes=tuple(f"{nights[at[i]].label}\n{told[values[i], outcome]}" for i in broken),
                )
            )  # fmt: skip
    began = [e for e in events if e.definition.key == trend.definition.key and as_night(e.first).index in at]
    if began:
        lines.append(_beginnings(began, trend))
    scale, bounds, note = _axis_of(trend)
    ends = (float(at[0]), float(at[-1])) if len(at) > 1 else (at[0] - 0.5, at[0] + 0.5)
    if goes_on:
        ends = (float(at[0]), float(at[0]))  # to tonight, as the script knows
    for bound in bounds:
        lines.append(
            Line(
                name=f"limit {quantity(bound, definition.unit, 7)}", x=ends, y=(bound, bound), style="limit",
                colour=1,
            )
        )  # fmt: skip
    if definition.reference is not None and (scale == "linear" or definition.reference > 0.0):
        name = f"reference {quantity(definition.reference, definition.unit, 7)}"
        lines.append(Line(name=name, x=ends, y=(definition.reference,) * 2, style="reference", colour=7))
    low_high = definition.set_point
    bands: tuple[Band, ...] = ()
    if low_high is not None:
        low, high = low_high
        if scale == "log":
            low, high = (
                (0.0, max(abs(low), abs(high))) if low <= 0.0 <= high else sorted((abs(low), abs(high)))
            )
        bands = (Band(low=low, high=high, name="set point"),)
    kept = [at[i] for i in thinned(len(at), 4)]
    magnitude = "magnitude" if scale == "log" and any(v < 0.0 for v in values) else ""
    return Chart(
        name=f"v-{slug(definition.key)}",
        title=(f"{title}: " if title else "") + f"{named(definition)[0]} ({conditions(definition)})",
        x_label=each,
        y_label=", ".join(filter(None, (magnitude, definition.unit if definition.unit != "1" else ""))),
        lines=tuple(lines),
        y_scale=scale,
        bands=bands,
        direct=True,
        x_ticks=() if each == "night" else _night_ticks(nights, list(dict.fromkeys(kept))),
        over=(float(at[0]), None if goes_on else float(at[-1])) if each == "night" else None,
        note=note,
    )


def _beginnings(events: Sequence[Event], trend: Trend) -> Line:
    """A mark at each first bad commit."""
    places = [trend.nights.index(as_night(event.first).index) for event in events]
    notes = [
        f"{in_full(event.name, event.sentence)}\nfirst bad commit {short_hash(event.first.engine) or 'unknown'}, "
        f"{day(event.first.started)}\nnow {event.standing}"
        for event in events
    ]
    return Line(
        name="became worse",
        x=tuple(float(as_night(event.first).index) for event in events),
        y=tuple(trend.values[place] for place in places),
        style="points",
        colour=3,
        notes=tuple(notes),
        labels=tuple(short_hash(event.first.engine)[:7] for event in events),
    )


def _night_ticks(nights: Sequence[Night], shown: Sequence[int]) -> tuple[tuple[float, str], ...]:
    """Days under the axis; where several nights share a day, their commits."""
    dates = [day(nights[n].started) for n in shown]
    within = len({date[:4] for date in dates}) < 2  # a year; beyond it, the year is said
    days = [date[5:] if within else date for date in dates]
    if len(set(days)) < len(days):
        days = [short_hash(nights[n].engine)[:7] or version(nights[n].engine) for n in shown]
    return tuple(zip(map(float, shown), days, strict=True))


def _axis_of(trend: Trend) -> tuple[Scale, list[float], str]:
    """Scale, the limits worth drawing on it, and what to say about those that are not."""
    limit = trend.definition.limit
    values = [sample.value for sample in trend.distinct]
    sizes = [abs(v) for v in values if math.isfinite(v) and v != 0.0]
    if not sizes:
        return "linear", [], ""
    if isinstance(limit, tuple):
        band = limit[1] - limit[0]
        finite = [v for v in values if math.isfinite(v)]
        spread = max(finite) - min(finite)
        if band > 1e4 * max(spread, 1e-300) and spread > 0.0:
            return (
                "linear",
                [],
                f"The limits, {number(limit[0], 7)} and {number(limit[1], 7)}, are off the scale.",
            )
        return "linear", list(limit), ""
    one_sign = trend.definition.better == "smaller_magnitude" or min(values) > 0.0
    decades = math.log10(max(sizes) / min(sizes))
    theory = trend.definition.set_point or (0.0, 0.0)
    if one_sign and (
        decades > 1.5
        or 0.0 < 100.0 * theory[0] < theory[1]
        or (limit is not None and limit > 0.0 and not 0.2 < limit / max(sizes) < 5.0)
    ):
        return "log", [limit] if limit is not None and limit > 0.0 else [], ""
    if limit is None:
        return "linear", [], ""
    if trend.definition.better == "smaller_magnitude":
        return "linear", [-limit, limit], ""  # the limit is on the magnitude: both ends
    return "linear", [limit], ""


def _told(value: float, outcome: str, unit: str) -> str:
    """What a point of a trend says of its value."""
    shown = quantity(value, unit, 7) if math.isfinite(value) else ""
    word = WORDS.get(outcome, outcome)
    return f"{shown + ' · ' if shown else ''}{word}"


def figure_chart(data: FigureData, prefix: str = "") -> Chart:
    """A figure of the document as a chart."""
    lines = tuple(
        Line(
            name=curve.name,
            x=curve.x,
            y=curve.y,
            style=curve.style,
            colour=i,
        )
        for i, curve in enumerate(data.curves)
    )
    return Chart(
        name=f"{prefix}f-{slug(data.name)}",
        title=data.title,
        x_label=data.x_label,
        y_label=data.y_label,
        lines=lines,
        x_scale="log" if data.x_scale == "log" else "linear",
        y_scale=data.y_scale,
        polar=data.x_scale == "angle",
        note=data.note,
        thesis=data.thesis,
    )


def map_grid(data: MapData, prefix: str = "", title: str = "") -> Grid:
    """A stability map of the document as a grid."""
    prediction = data.prediction
    return Grid(
        name=f"{prefix}m-{slug(data.name + '/' + data.configuration)}",
        title=(f"{title}: " if title else "") + f"{data.title} ({data.configuration})",
        x_label=data.x_label,
        y_label=data.y_label,
        x=data.x,
        y=data.y,
        cells=data.cells,
        prediction=prediction,
        note=" ".join(filter(None, (data.note, data.definition))),
    )


@dataclass(frozen=True)
class Rung:
    """One point of an error-against-run-time ladder."""

    time_step: float
    error: float
    seconds: float  # NaN if it was not timed
    spread: float  # largest of the repeats over the smallest
    work: float  # sum of the exact counters
    instructions: int | None
    failure: str


def rungs(trends: Iterable[Trend], sample_of: Callable[[Trend], Sample | None]) -> list[Rung]:
    """The points of one configuration, coarse to fine."""
    found = []
    for trend in trends:
        sample = sample_of(trend)
        if sample is None or trend.definition.time_step is None:
            continue
        timing = sample.timing
        found.append(
            Rung(
                time_step=trend.definition.time_step,
                error=sample.value,
                seconds=min(timing.seconds) if timing and timing.seconds else math.nan,
                spread=max(timing.seconds) / min(timing.seconds)
                if timing and min(timing.seconds) > 0.0
                else math.nan,
                work=float(sum(sample.counters.values())),
                instructions=timing.instructions if timing else None,
                failure=sample.failure
                or ("" if sample.outcome == "value" else sample.outcome.replace("_", " ")),
            )
        )
    return sorted(found, key=lambda rung: -rung.time_step)


def ladders(test: TestHistory) -> dict[str, dict[str, list[Trend]]]:
    """Ladder name to configuration to its series."""
    found: dict[str, dict[str, list[Trend]]] = {}
    for trend in test.of_kind("ladder"):
        name = trend.definition.metric.removeprefix("ladder:")
        found.setdefault(name, {}).setdefault(trend.definition.configuration, []).append(trend)
    return found


Peers = Sequence[tuple[str, TestHistory]]  # other engines on the same machine: name, the same test


def ladder_charts(
    test: TestHistory, prefix: str = "", peers: Peers = (), earlier: Sequence[Earlier] = ()
) -> list[Chart]:
    """Error against seconds and against work for every ladder of a test; peers against seconds only.

    Of the earlier nights the first is drawn, the others wait until a reader asks for them.
    """
    charts = []
    orders = {
        (t.definition.metric.removeprefix("ladder:").rpartition(":")[0], t.definition.configuration): t.value
        for t in test.of_kind("order")
    }
    for name, configurations in ladders(test).items():
        definition = next(iter(configurations.values()))[0].definition
        points = {c: rungs(trends, lambda t: t.latest) for c, trends in configurations.items()}
        for axis, label, of in (
            ("seconds", "run time [s]", lambda r: r.seconds),
            ("work", "work [operations counted]", lambda r: r.work),
        ):
            lines: list[Line] = []
            for colour, (configuration, found) in enumerate(points.items()):
                order = orders.get((name, configuration))
                told = f" ({order:.2f})" if order is not None and math.isfinite(order) else ""
                lines.append(_ladder_line(f"{configuration}{told}", found, of, colour, definition.unit))
                if axis == "seconds":
                    trends = configurations[configuration]
                    lines += _earlier_lines(trends, configuration, earlier, colour, definition.unit)
            every_rung = [r for found in points.values() for r in found]
            if axis == "seconds":  # what one engine counts, another does not
                beside = _peer_rungs(peers, name)
                lines += _peer_lines(beside, definition.unit, len(points))
                every_rung += [r for _, found in beside for _, r in found]
            if not any(line.x for line in lines):
                continue
            lines.append(_front(every_rung, of))
            charts.append(
                Chart(
                    name=f"{prefix}l-{slug(name)}-{axis}",
                    title=f"{test.card.title}: {definition.description}"
                    if prefix
                    else opening(definition.description),
                    x_label=label,
                    y_label=f"error [{definition.unit}]",
                    x_scale="log",
                    y_scale="log",
                    lines=tuple(lines),
                )
            )
    return charts


def _peer_rungs(peers: Peers, ladder: str) -> list[tuple[str, list[tuple[str, Rung]]]]:
    """The ladders of other engines: engine, and its points with the configuration of each."""
    return [
        (
            engine,
            [
                (configuration, rung)
                for configuration, trends in ladders(test).get(ladder, {}).items()
                for rung in rungs(trends, lambda t: t.latest)
            ],
        )
        for engine, test in peers
    ]


def _peer_lines(
    beside: Sequence[tuple[str, Sequence[tuple[str, Rung]]]], unit: str, colour: int
) -> list[Line]:
    """One line for each other engine, after ours: the points that no other configuration of it beats."""
    lines = []
    for engine, found in beside:
        best, kept = math.inf, []
        timed = [(c, r) for c, r in found if math.isfinite(r.seconds) and math.isfinite(r.error)]
        for configuration, rung in sorted(timed, key=lambda one: one[1].seconds):
            if abs(rung.error) < best:
                best = abs(rung.error)
                kept.append((configuration, rung))
        if kept:
            line = _ladder_line(engine, [r for _, r in kept], lambda r: r.seconds, colour, unit)
            notes = tuple(
                note.replace(engine, f"{engine}: {configuration}", 1)
                for note, (configuration, _) in zip(line.notes, kept, strict=True)
            )
            lines.append(replace(line, notes=notes))
            colour += 1
    return lines


def _earlier_lines(
    trends: Sequence[Trend], configuration: str, earlier: Sequence[Earlier], colour: int, unit: str
) -> list[Line]:
    """The same configuration on earlier nights, in short dashes."""
    lines = []
    for place, one in enumerate(earlier):
        found = rungs(trends, _sample_of(one.index))
        if any(math.isfinite(r.seconds) for r in found):
            line = _ladder_line(f"{configuration}, {one.words}", found, lambda r: r.seconds, colour, unit)
            lines.append(
                replace(line, style="reference", quiet=True, upto=(), night=one.key, waits=place > 0)
            )
    return lines


def _sample_of(night: int) -> Callable[[Trend], Sample | None]:
    return lambda trend: trend.earlier.get(night)


def _ladder_line(
    name: str, found: Sequence[Rung], of: Callable[[Rung], float], colour: int, unit: str
) -> Line:
    """One configuration; a failed rung stands at the place its neighbours suggest, as a failure."""
    shown = [r for r in found if math.isfinite(of(r)) and of(r) > 0.0]
    notes = []
    for r in shown:
        spread = f" (slowest repeat {100 * (r.spread - 1):.0f} % more)" if math.isfinite(r.spread) else ""
        counted = f"{r.work:.0f} operations" + (f", {r.instructions} instructions" if r.instructions else "")
        timed = of(r) == r.seconds
        error = r.failure if r.failure else f"error {quantity(r.error, unit, 5)}"
        took = f"{seconds(r.seconds)}{spread}" if math.isfinite(r.seconds) else "not timed"
        cost = f"{took}\n{counted}" if timed else f"{r.work:.0f} operations"
        notes.append(f"{name}\nh = {number(r.time_step, 6)} s\n{error}\n{cost}")
    return Line(
        name=name, x=tuple(of(r) for r in shown), y=tuple(abs(r.error) for r in shown), colour=colour,
        notes=tuple(notes), style="both",
        upto=tuple(r.seconds * r.spread if math.isfinite(r.spread) and of(r) == r.seconds else of(r) for r in shown),
    )  # fmt: skip


def _front(found: Sequence[Rung], of: Callable[[Rung], float]) -> Line:
    """The points that no other beats in both error and cost."""
    points = sorted(
        (of(r), abs(r.error))
        for r in found
        if math.isfinite(of(r)) and math.isfinite(r.error) and of(r) > 0.0
    )
    best, front = math.inf, []
    for cost, error in points:
        if error < best:
            best = error
            front.append((cost, error))
    return Line(
        name="best of all",
        x=tuple(c for c, _ in front),
        y=tuple(e for _, e in front),
        style="front",
        colour=7,
    )

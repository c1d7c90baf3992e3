"""Charts lose nothing on the way to a picture: zeros, failures, logarithms, angles."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.website import charts
from spook_tracker.tracker.website.charts import Band, Chart, Grid, Line
from spook_tracker.tracker.website.diagrams import trend_chart
from spook_tracker.tracker.website.figures import figure, grid_figure
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.svg import grid_picture, picture, sparkline
from spook_tracker.tracker.website.templates import environment
from tests.histories.synthetic import DocumentHistory, document

NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


def chart(y: tuple[float, ...], **changes: Any) -> Chart:
    line = Line(name="a", x=tuple(float(i + 1) for i in range(len(y))), y=y)
    return Chart(**({"name": "c", "title": "t", "x_label": "x", "y_label": "y", "lines": (line,)} | changes))


def test_a_failed_point_stays_a_point() -> None:
    drawn = charts.drawable(chart((1.0, math.nan, 3.0, math.inf)))

    failed = next(line for line in drawn.lines if line.style == "failed")
    assert failed.x == (2.0, 4.0)
    assert min(failed.y) >= 3.0
    assert drawn.lines[0].y == (1.0, 3.0)


def test_an_exact_zero_on_a_logarithmic_axis_sits_under_every_other_value() -> None:
    drawn = charts.drawable(chart((1e-3, 0.0, -1e-5), y_scale="log"))

    assert drawn.lines[0].y == (1e-3, 1e-6, 1e-5)
    assert "exactly 0" in drawn.note


def test_a_polar_chart_is_drawn_in_the_plane() -> None:
    flat = charts.flattened(
        chart((2.0, 2.0), polar=True, lines=(Line(name="a", x=(0.0, 90.0), y=(2.0, 2.0)),))
    )

    assert flat.lines[0].x == pytest.approx((2.0, 0.0), abs=1e-15)
    assert flat.lines[0].y == pytest.approx((0.0, 2.0))
    assert flat.reach > 2.0
    assert 0.5 < max(flat.rings) <= flat.reach


def test_a_polar_chart_has_no_band_of_heights() -> None:
    made = chart((2.0, 2.0), polar=True, bands=(Band(low=1.0, high=3.0, name="b"),))

    assert picture(made).bands == []
    assert picture(chart((2.0, 2.0), bands=made.bands)).bands != []


@given(st.lists(NUMBERS, min_size=1, max_size=60))
def test_dropping_what_stands_still_loses_nothing(values: list[float]) -> None:
    kept = charts.turning(values)

    restored = []
    for i in range(len(values)):
        before = max(k for k in kept if k <= i)
        restored.append(values[before])
    assert all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in zip(values, restored, strict=True))
    assert charts.turning([1.0] * 3650) == [0, 3649]


@given(st.floats(-1e9, 1e9), st.floats(1e-6, 1e9))
def test_ticks_are_few_round_and_inside(low: float, width: float) -> None:
    found = charts.ticks(low, low + width, "linear")

    assert len(found) <= 9
    assert all(
        low - 1e-6 * width - 1e-9 * abs(low) <= t <= low + width * (1 + 1e-6) + 1e-9 * abs(low) for t in found
    )


@example(y=[2.225073858507203e-309], x_scale="linear", y_scale="linear", polar=True)  # a band far outside
@example(y=[0.0, 5e-324], x_scale="linear", y_scale="log", polar=False)
@example(y=[2e295, 1e-38], x_scale="linear", y_scale="log", polar=False)  # padding left the doubles here
@given(
    st.lists(NUMBERS, max_size=12),
    st.sampled_from(["linear", "log"]),
    st.sampled_from(["linear", "log"]),
    st.booleans(),
)
def test_any_numbers_make_a_picture_without_a_number_that_is_none(
    y: list[float], x_scale: Any, y_scale: Any, polar: bool
) -> None:
    """Whatever was measured, the geometry is finite and the figure is strict JSON."""
    bounded = tuple(v if not math.isfinite(v) else math.copysign(min(abs(v), 1e300), v) for v in y)
    made = chart(
        bounded, x_scale=x_scale, y_scale=y_scale, polar=polar, bands=(Band(low=-1.0, high=2.0, name="b"),)
    )

    drawn = picture(made)
    numbers = re.findall(
        r"nan|inf", " ".join(m.path for m in drawn.marks) + repr(drawn.bands) + repr(drawn.y_ticks)
    )
    assert numbers == []
    for trace in figure(made)["data"]:
        assert all(v is None or math.isfinite(v) for v in trace["y"])


def test_a_map_shows_its_cells_with_sign_and_colour() -> None:
    grid = Grid(
        name="m", title="t", x_label="x", y_label="y", x=(1.0, 2.0), y=(1.0, 10.0),
        cells=(("settled", "growing"), ("diverged", "not_finite")), prediction=((0.9, 1.1), (1.2, math.inf)),
    )  # fmt: skip

    drawn, told = grid_picture(grid), grid_figure(grid)

    assert [cell[4] for cell in drawn.cells] == [
        "cell-settled",
        "cell-growing",
        "cell-diverged",
        "cell-not-finite",
    ]
    assert [letter for *_, letter in drawn.legend] == ["↗", "×", "∞"]
    assert told["data"][0]["z"] == [[0, 2], [3, 4]]
    assert told["data"][1]["z"][1][1] is None


def test_a_picture_is_valid_svg_with_title_and_description() -> None:
    pieces = environment().get_template("pieces.html").module
    drawn = picture(
        chart((1.0, 2.0), title="<b>&", lines=(Line(name="<i>", x=(0.0, 1.0), y=(1.0, 2.0)),) * 2)
    )

    root = ElementTree.fromstring(str(pieces.picture(drawn)))  # type: ignore[attr-defined]
    space = {"s": "http://www.w3.org/2000/svg"}
    assert root.findtext("s:title", namespaces=space) == "<b>&"
    assert "<i>" in (root.findtext("s:desc", namespaces=space) or "")


def test_a_sparkline_marks_its_failures() -> None:
    drawn = sparkline([1.0, math.nan, 2.0], ["pass", "fail", "fail"])

    assert len(drawn["failed"]) == 2  # type: ignore[arg-type]
    assert drawn["last"] is None
    assert sparkline([math.nan], ["fail"])["path"] == ""


def test_the_hover_text_of_plotly_is_inert() -> None:
    hostile = "<a href='https://x'>%{y}</a>"
    made = figure(
        chart((1.0, 2.0), lines=(Line(name=hostile, x=(1.0, 2.0), y=(1.0, 2.0), notes=(hostile, "b")),))
    )

    trace = made["data"][0]
    assert "<" not in trace["name"]
    assert trace["hoverinfo"] == "text"
    assert "hovertemplate" not in trace
    assert "<a" not in trace["hovertext"][0]


@pytest.mark.parametrize(("low", "high"), [(2.7e-4, 1.2e-3), (1.5e-6, 8.8e-6), (3.1, 3.9), (2e-9, 9e3)])
def test_words_at_a_logarithmic_axis_leave_room_for_each_other(low: float, high: float) -> None:
    line = Line(name="a", x=(low, high), y=(1.0, 2.0))
    axis = figure(chart((1.0, 2.0), lines=(line,), x_scale="log"))["layout"]["xaxis"]
    marks = [math.log10(value) for value in axis["tickvals"]]
    room = axis["range"][1] - axis["range"][0]

    assert marks == sorted(marks)
    assert 1 <= len(marks) <= 8
    assert all(b - a >= room / 8.0 for a, b in pairwise(marks))


def test_the_days_under_a_trend_say_the_year_where_there_are_several_and_the_newest_is_one_of_them() -> None:
    runs = [
        msgspec.structs.replace(document(n), started=f"{2024 + n // 12}-{n % 12 + 1:02d}-05T03:00:00+00:00")
        for n in range(30)
    ]

    def days(nights: list[RunDocument]) -> list[str]:
        told = book(DocumentHistory(nights))
        trend = next(trend for test in told.tests for trend in test.gates())
        return [words for _, words in trend_chart(trend, told.nights, (), each="version").x_ticks]

    over_years, in_one = days(runs), days(runs[:12])
    assert over_years[-1] == "2026-06-05"
    assert {words[:4] for words in over_years} == {"2024", "2025", "2026"}
    assert in_one[-1] == "12-05"
    assert 2 < len(in_one) <= len(over_years) <= 12

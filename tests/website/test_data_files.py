"""Numbers as files: nothing lost, nothing that runs."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.website.data_files import inert, records, table
from spook_tracker.tracker.website.publish import publish
from spook_tracker.tracker.website.templates import css_text, embedded, environment
from tests.histories.synthetic import HOSTILE, DocumentHistory, document, of_test, sample, series


@pytest.mark.parametrize("formula", ["=cmd()", "+1", "-1+2", "@SUM(A1)", "\t=1", "\r=1"])
def test_a_spreadsheet_takes_no_text_for_a_formula(formula: str) -> None:
    assert inert(formula) == f"'{formula}"
    assert inert(-1.5) == "-1.5"
    assert inert("a=b") == "a=b"


@given(st.lists(st.floats(), min_size=1))
def test_numbers_in_a_csv_file_keep_every_bit(values: list[float]) -> None:
    (line,) = list(csv.reader(io.StringIO(table(["v"] * len(values), [values]).decode())))[1:]

    back = [float(cell) for cell in line]
    assert all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in zip(values, back, strict=True))
    assert [math.copysign(1.0, v) for v in values if v == 0.0] == [
        math.copysign(1.0, b) for b in back if b == 0.0
    ]


@given(st.lists(st.text(), min_size=1, max_size=4))
def test_any_text_survives_a_csv_file_but_for_its_apostrophe(texts: list[str]) -> None:
    whole = table([str(i) for i in range(len(texts))], [texts]).decode()
    (line,) = list(csv.reader(io.StringIO(whole, newline="")))[1:]

    assert [cell.removeprefix("'") for cell in line] == [
        t.replace("\x00", "�").encode("utf-8", "replace").decode().removeprefix("'") for t in texts
    ]


def test_a_table_as_json_says_what_is_not_finite_in_words() -> None:
    assert json.loads(records(["a", "b"], [[math.nan, "x"], [1.0, None]])) == [
        {"a": "nan", "b": "x"},
        {"a": 1.0, "b": None},
    ]


def test_data_in_a_page_cannot_end_its_element() -> None:
    text = str(embedded({"name": HOSTILE, "more": "</script><!--\u2028&"}))

    assert not set("<>&\u2028") & set(text)
    assert json.loads(text)["name"] == HOSTILE


def test_a_name_in_a_style_sheet_ends_nothing() -> None:
    text = str(css_text(f'a"}}</style>\\{HOSTILE}'))

    assert re.fullmatch(r'"[^"<>{}\n]*"', text)
    assert not re.search(r"\\[^0-9a-f]", text), "an escape is of a number"


def test_a_template_escapes_and_never_forgets_a_name() -> None:
    made = environment()

    assert made.from_string("{{ x }}").render(x="<b>&") == "&lt;b&gt;&amp;"
    with pytest.raises(Exception, match="undefined"):
        made.from_string("{{ missing }}").render()


def test_no_template_marks_anything_safe() -> None:
    from spook_tracker.tracker.resources import resource

    for template in (resource("site") / "templates").iterdir():
        text = template.read_text()
        assert "|safe" not in text.replace(" ", "")
        assert "autoescape" not in text
        assert "{% include" not in text


def worked(night: int, *metrics: tuple[str, float]) -> RunDocument:
    """A night that says itself what it counted, under whatever names."""
    run = of_test(document(night), "friction")
    bare = tuple(msgspec.structs.replace(s, counters={}) for s in run.samples)
    counts = [(series("friction", name, kind="work", time_step=None), value) for name, value in metrics]
    return msgspec.structs.replace(
        run,
        series=(*run.series, *(definition for definition, _ in counts)),
        samples=(*bare, *(sample(definition, value, counters={}) for definition, value in counts)),
    )


def test_work_that_comes_later_goes_or_has_a_name_of_its_own_is_told_and_nothing_else_is_lost(
    tmp_path: Path,
) -> None:
    nights = DocumentHistory(
        [
            worked(0, ("work:values:steps", 5.0)),
            worked(
                1, ("work:values:steps", 5.0), ("work:values:sweeps", 3.5), ("work:x", 1.0), ("plain", 2.0)
            ),
            worked(
                2, ("work:values:steps", 5.0), ("work:values:sweeps", 3.5), ("work:x", 1.0), ("a:b:c:d", 7.0)
            ),
            worked(3, ("work:values:steps", 5.0), ("work:x", 1.0)),
            worked(4, ("work:values:steps", 5.0), ("work:x", 1.0)),
            worked(5, ("work:x", 1.0)),
        ]
    )
    report = publish(nights, tmp_path / "public")
    told = list(csv.DictReader(io.StringIO((tmp_path / "public" / "data" / "work.csv").read_text())))

    assert report.failed == ()
    assert (tmp_path / "public" / "feed.xml").is_file(), "what follows work.csv is there"
    days = [run.started[:10] for run in nights.runs()]
    by_part = {
        part: [line for line in told if line["part"] == part] for part in ("values", "x", "plain", "a")
    }
    assert len(told) == sum(map(len, by_part.values()))
    assert [
        (days.index(line["since"][:10]), line["steps"], line["sweeps"]) for line in by_part["values"]
    ] == [
        (0, "5", ""),
        (1, "5", "3.5"),
        (3, "5", ""),
    ], "the night on which sweeps were not counted any more has a line"
    assert [(line["count"], line["steps"]) for line in by_part["x"]] == [("1", "")]
    assert [line["count"] for line in by_part["plain"]] == ["2"]
    assert [line["b:c:d"] for line in by_part["a"]] == ["7"]

"""Tables in a narrow terminal: they fit, and no number, unit or name is hidden."""

from __future__ import annotations

from pathlib import Path

import pytest
from click import unstyle
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from spook_tracker.tracker.cli.console import MOST_LINES, Column, cells, table, wrapped
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.record import record
from tests.histories.documents import definition, run, sample
from tests.tracker.cli.test_questions import nights
from tests.tracker.judge.test_rank import recorded, rungs

WIDE, NARROW = 200, (80, 60)
NAME = "a_question_whose_name_is_as_long_as_names_can_be"


def shown(columns: int, *command: str) -> str:
    done = CliRunner().invoke(main, list(command), env={"COLUMNS": str(columns), "NO_COLOR": "1"})
    assert done.exit_code in (0, 1), done.output
    return done.output


@given(
    st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z", "M"))).map(str.strip),
    st.integers(2, 40),
)
def test_a_text_that_wraps_is_whole_and_fits(text: str, room: int) -> None:
    lines = wrapped(text, room)

    assert all(cells(line) <= room for line in lines)
    if len(lines) < MOST_LINES:
        assert "".join(lines).replace(" ", "") == text.replace(" ", "")


def test_words_stay_whole_where_they_fit_and_long_names_part_at_their_joints() -> None:
    assert wrapped("  the rod keeps its length", 12) == ["  the rod", "  keeps its", "  length"]
    assert wrapped("pendulum/curved/length", 12) == ["pendulum/", "curved/", "length"]
    assert wrapped("x" * 30, 12) == ["x" * 12, "x" * 12, "x" * 6]
    assert len(wrapped("x" * 70_000, 8)) == MOST_LINES


def test_a_table_shows_all_of_its_cells_in_their_columns() -> None:
    columns = (Column("name", flexible=True), Column("value", "right"), Column("why", flexible=True))
    rows = [
        ("one name of many words", "1.25 m", "because it is so"),
        ("a line across all the columns there are",),
    ]
    lines = [unstyle(line) for line in table(columns, rows, 30)]

    assert max(map(cells, lines)) <= 30
    assert lines[2:] == [
        "one name of   1.25 m  because",
        "many words            it is so",
        "a line across all the columns",
        "there are",
    ]


@pytest.fixture(scope="module")
def history(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Five nights, the fourth worse than its limit."""
    url = f"sqlite:///{tmp_path_factory.mktemp('nights')}/t.db"
    with session_on(url) as session:
        for night in nights():
            record(session, night)
    return url


@pytest.mark.parametrize("columns", NARROW)
@pytest.mark.parametrize("command", ["trend", "compare"])
def test_a_red_night_is_told_as_wholly_as_in_a_wide_terminal(
    history: str, command: str, columns: int
) -> None:
    first, last = nights()[0].engine.version, nights()[4].engine.version
    asked = ("compare", first, last, "--all") if command == "compare" else ("trend", "t")
    wide, narrow = (shown(room, *asked, "--db", history) for room in (WIDE, columns))
    headings = {"night", "version", "commit", "value", "verdict", "what", "series", "before", "after", "how"}

    assert "…" not in narrow.replace(" … ", "")
    hidden = set(wide.split()) - set(narrow.split()) - headings
    assert not {word for word in hidden if "─" not in word}
    rows = narrow.splitlines()
    rule = next(k for k, line in enumerate(rows) if line.startswith("──"))
    assert max(map(cells, rows[rule - 1 : rule + 6])) <= columns


@pytest.mark.parametrize("columns", NARROW)
def test_a_ranking_names_scenes_engines_configurations_and_units(tmp_path: Path, columns: int) -> None:
    found = {}
    for configuration in ("many-iterations", "joints"):
        told = rungs(configuration, {1 / 60: (4.9e-6, 1e-4), 1 / 600: (1e-8, 1e-3)})
        found[configuration] = {
            key.replace("scene", NAME): (_renamed(definition), _of(sample, key.replace("scene", NAME)))
            for key, (definition, sample) in told.items()  # type: ignore[attr-defined]
        }
    database = recorded(
        tmp_path, {("spook", "1.0"): found["many-iterations"], ("mujoco", "3.4.0"): found["joints"]}
    )
    lines = shown(columns, "rank", "--db", database).splitlines()
    flat = "".join(line.strip() for line in lines)

    assert max(map(cells, lines)) <= columns
    assert f"{NAME} path [m]" in lines
    assert "ms" in flat and "(many-iterations)" in " ".join(lines) and "(joints)" in flat
    assert not any("…" in line for line in lines)


def _renamed(definition: object) -> object:
    from msgspec.structs import replace

    return replace(definition, test=NAME, key=definition.key.replace("scene", NAME))  # type: ignore[attr-defined, type-var]


def _of(sample: object, key: str) -> object:
    from msgspec.structs import replace

    return replace(sample, series=key)  # type: ignore[type-var]


def test_a_test_of_many_series_is_told_a_line_each_and_what_is_red_night_by_night(tmp_path: Path) -> None:
    """`tracker trend pendulum` printed 1459 lines for one night."""
    keys = [f"t/plain/m{number}" for number in range(9)] + ["t/plain/ladder:e/h=0.1"]
    kinds = ["scalar"] * 9 + ["ladder"]
    address = f"sqlite:///{tmp_path / 't.db'}"
    document = run(
        series=tuple(
            definition(key, test="t", metric=key.split("/")[2], limit=1.0, kind=kind)
            for key, kind in zip(keys, kinds, strict=True)
        ),
        samples=(
            *(sample(key, 0.5) for key in keys if key != keys[3]),
            sample(keys[3], 2.0, outcome="out_of_limit", passed=False),
        ),
    )
    with session_on(address) as session:
        record(session, document)

    shown = unstyle(CliRunner().invoke(main, ["trend", "t", "--db", address]).output)

    assert len(shown.splitlines()) < 25 and "1 of kind ladder" in shown
    assert "\nt/plain/m3" in shown and "\nt/plain/m4" not in shown, "night by night what is red alone"
    whole = CliRunner().invoke(main, ["trend", "t", "--all", "--db", address]).output
    assert all(key in whole for key in keys)

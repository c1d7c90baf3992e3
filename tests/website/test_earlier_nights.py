"""Which earlier nights a reader may lay beside tonight's ladders."""

from __future__ import annotations

import json
import re
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec

from spook_tracker.tracker.website.earlier_nights import earlier_nights
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import START, DocumentHistory, history


def night(index: int, day: float, version: str = "1.0.0+g12", started: str = "", dirty: bool = False) -> Any:
    engine = SimpleNamespace(version=version, dirty=dirty)
    return SimpleNamespace(
        index=index, engine=engine, started=started or (START + timedelta(days=day)).isoformat()
    )


def chosen(nights: list[Any], before: int) -> list[tuple[str, int]]:
    return [(one.key, one.index) for one in earlier_nights(nights[-1], nights[: before + 1])]


def test_a_week_and_a_month_are_the_newest_nights_at_least_that_old() -> None:
    days = [0, 9, 10, 11, 30, 33, 34, 38, 40]
    nights = [night(i, day) for i, day in enumerate(days)]
    assert chosen(nights, 7) == [("before", 7), ("week", 5), ("month", 2)]


def test_releases_are_offered_newest_first_and_at_most_four_of_them() -> None:
    names = ["1.0.0", "1.0.0+g1", "1.1.0", "1.2.0", "1.3.0", "1.3.0", "1.4.0", "1.4.0+g7", "1.4.0+g8"]
    nights = [night(i, i / 24.0, name) for i, name in enumerate(names)]
    assert chosen(nights, 7) == [
        ("before", 7), ("release-1.4.0", 6), ("release-1.3.0", 5), ("release-1.2.0", 3), ("release-1.1.0", 2),
    ]  # fmt: skip


def test_a_night_is_offered_once_and_a_changed_tree_is_no_release() -> None:
    nights = [night(0, 0, "1.0.0"), night(1, 1, "1.1.0", dirty=True), night(2, 9, "1.2.0")]
    assert chosen(nights, 0) == [("before", 0)]
    assert chosen(nights, 1) == [("before", 1), ("release-1.0.0", 0)]


def test_a_start_that_is_no_moment_offers_no_week() -> None:
    assert chosen([night(0, 0), night(1, 20, started="yesterday")], 0) == [("before", 0)]


def test_a_ladder_keeps_the_values_of_the_nights_that_are_offered() -> None:
    told = book(history(12))
    assert [(one.key, one.index) for one in told.earlier] == [("before", 10), ("week", 4)]
    ladder = next(t for test in told.tests for t in test.of_kind("ladder"))
    assert {i: sample.value for i, sample in ladder.earlier.items()} == {i: ladder.values[i] for i in (10, 4)}


def test_a_night_without_ladders_is_not_offered_and_does_not_hide_an_older_one_that_has_some() -> None:
    runs = list(history(12).documents.values())
    bare = msgspec.structs.replace(
        runs[4], samples=tuple(s for s in runs[4].samples if "/ladder:" not in s.series)
    )
    told = book(DocumentHistory([*runs[:4], bare, *runs[5:]]))
    assert [(one.key, one.index) for one in told.earlier] == [("before", 10), ("week", 3)]


def test_the_overview_offers_the_nights_that_are_there_and_speaks_of_no_other(tmp_path: Path) -> None:
    publish(history(1), tmp_path / "one")
    publish(history(24), tmp_path / "many")
    scripts = ((tmp_path / name / "tonight.js").read_text() for name in ("one", "many"))
    one, many = (json.loads(re.fullmatch(r"const TONIGHT = (.*);\n", text)[1])["earlier"] for text in scripts)

    assert one == []
    assert [key for key, _ in many][:2] == ["before", "week"]
    page = (tmp_path / "one" / "error-time.html").read_text()
    assert 'id="earlier" hidden' in page, "shown by the script where there is a night to choose"
    assert "short dashes" not in page.replace("Beside tonight, in short dashes of the same colour", "")

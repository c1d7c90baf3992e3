"""Histories that the continuous integration of other projects has published: red where something changed, once."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

from spook_tracker.tracker.judge.run_times import judge_noisy
from tests.histories import noise as battery
from tests.places import DATA, ROOT

FILES = sorted((DATA / "recorded").glob("*.json"))
LEARNING = 60
ROW = re.compile(r"\| (\w+): (\d+) series, (\d+) values \| (\d+) \| (\d+) \| (\d+) \|")


def recorded(file: Path) -> Any:
    return json.loads(file.read_text(encoding="utf-8"))


@cache
def alarms(file: Path) -> dict[str, list[int]]:
    """Nights after those of learning on which a red stretch begins, by series."""
    found = {}
    for name, values in recorded(file)["values"].items():
        red = [night.state == "detected" for night in judge_noisy(values)]
        found[name] = [n for n in range(LEARNING, len(red)) if red[n] and not red[n - 1]]
    return found


def test_each_file_names_its_source_and_holds_numbers_only() -> None:
    assert len(FILES) >= 2
    assert sum(file.stat().st_size for file in FILES) <= 200_000
    for file in FILES:
        told = recorded(file)
        assert told["source"].startswith("https://github.com/") and re.fullmatch(
            r"[0-9a-f]{40}", told["commit"]
        )
        assert all(name and min(values) > 0.0 for name, values in told["values"].items())


def test_there_are_no_more_alarms_than_asv_and_otava_see_steps_and_the_page_says_how_many() -> None:
    page = (ROOT / "docs" / "detectors.md").read_text(encoding="utf-8")
    rows = {row[1]: [int(number) for number in row.groups()[1:]] for row in ROW.finditer(page)}

    assert rows.keys() == {file.stem for file in FILES}
    for file in FILES:
        series, values, ours, *_ = rows[file.stem]
        told = recorded(file)["values"]
        assert (len(told), sum(map(len, told.values()))) == (series, values)
        assert sum(map(len, alarms(file).values())) == ours
    assert sum(row[2] for row in rows.values()) <= sum(row[3] + row[4] for row in rows.values())


def test_why_no_other_tool_splits_is_told_by_the_numbers_of_the_page() -> None:
    pages = [
        (ROOT / "docs" / name).read_text(encoding="utf-8")
        for name in ("detectors.md", "explanation/verdicts.md")
    ]
    rows = {cells[1].strip(): [cell.strip() for cell in cells[2:-1]] for line in pages[0].splitlines() if len(cells := line.split("|")) > 3}  # fmt: skip
    head = rows["alarms in 10 000 night-values"]
    alarms_of = {
        tool: {kind: float(rows[kind][place]) for kind in battery.STATIONARY}
        for place, tool in enumerate(head)
    }
    remember = {kind for kind in battery.STATIONARY if kind.startswith("AR(1)")}
    forget = max(value for kind, value in alarms_of["ruptures rbf"].items() if kind not in remember)
    low, high = (f"{alarms_of['ruptures rbf'][kind]:.0f}" for kind in sorted(remember))
    soon = rows["+10 % at 1 % noise, within 2 nights"]

    assert max(alarms_of["ours"].values()) == max(alarms_of["asv"].values()) == 1.0
    assert rows["+3 % at 1 % noise, within 4 nights"][head.index("asv")].startswith("0 %")
    assert (soon[head.index("ours")][:5], soon[head.index("ruptures rbf")][:4]) == ("100 %", "65 %")
    otava = alarms_of["Otava"].values()
    for said in (
        f"*Otava* raises {min(otava):.0f} to {max(otava):.0f} alarms",
        f"raise up to {max(alarms_of['ruptures l2'].values()):.0f} such alarms",
        f"raises {forget:.0f} at most where nights forget each other, but {low} and {high}",
        "finds 65 % of",
    ):
        assert said in " ".join(pages[1].split())


def test_every_alarm_is_near_anothers_step_or_explained() -> None:
    listed = json.loads((DATA / "recorded_alarms.json").read_text(encoding="utf-8"))
    page = (ROOT / "docs" / "detectors.md").read_text(encoding="utf-8")
    found = {(file.stem, name, n) for file in FILES for name, nights in alarms(file).items() for n in nights}

    assert {(alarm["file"], alarm["series"], alarm["night"]) for alarm in listed} == found
    assert all(alarm["why"] and re.fullmatch(r"[0-9a-f]{12}", alarm["commit"]) for alarm in listed)
    assert all(f"| {alarm['commit']} | {alarm['night']} |" in page for alarm in listed)
    assert sum(not alarm["near"] for alarm in listed) <= 5  # all of them drift


def test_a_drift_that_is_red_stays_red_until_half_of_it_is_gone() -> None:
    """A list's items took 60 % more time from one commit on, in noise of 15 %: one story, not seventeen."""
    file = next(file for file in FILES if file.stem == "pyo3")

    assert len(alarms(file)["list_get_item"]) <= 3
    ramp = [1.0 + 0.004 * max(0, night - 20) + 0.03 * (-1) ** night for night in range(80)]
    states = [night.state for night in judge_noisy([*ramp, *[1.1] * 10, *[1.0] * 40])]
    assert battery.starts([state == "detected" for state in states]) == 1
    assert "recovered" in states[80:]
    assert states[-1] == "green"

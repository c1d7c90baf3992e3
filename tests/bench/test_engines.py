"""The page of all engines: counted gates, which is first, where ours is behind and why, from recorded runs."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest

import bench.engine_kinds as engine_kinds
import bench.engine_settings as engine_settings
import spook_tracker.engine.find as find
import spook_tracker.tracker as tracker
from spook_tracker.tracker.document.run_document import Asked
from spook_tracker.tracker.judge.rank import Race
from tests.histories.synthetic import document, rival
from tests.places import ROOT


def physical(run: Any, only: str = "") -> Any:
    """The run with the limits of its gates made physical, of one test or of all."""
    series = tuple(
        msgspec.structs.replace(d, limit_kind="physical") if d.role == "gate" and only in d.test else d
        for d in run.series
    )
    return msgspec.structs.replace(run, series=series)


THEIRS = physical(msgspec.structs.replace(rival("3.1"), trigger="manual"))
FILE = ROOT / "bench" / "engines.py"


@pytest.fixture(scope="module")
def engines() -> Any:
    spec = importlib.util.spec_from_file_location("engines_page", FILE)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["engines_page"] = module
    spec.loader.exec_module(module)
    return module


def test_the_page_says_who_is_first_and_why_we_are_behind(
    engines: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    for run in (physical(document(0)), THEIRS):
        tracker.record(run, database)
    causes = tmp_path / "causes.toml"
    monkeypatch.setattr(engines, "CAUSES", causes)

    assert "No cause found yet." in engines.page(database)

    causes.write_text(
        '[[behind]]\ntest = "pendulum"\nengines = ["rival"]\ncause = "order four"\ncure = "a composition"\n'
    )
    told = engines.page(database)
    assert "| spook | 7 | 0 | 0 | 0 |" in told
    assert "| rival | 5 | 1 | 0 | 1 |" in told, "a door too heavy, and friction is not supported"
    assert "Order four. A composition." in told
    assert "ours never" in told.partition("## Where another engine is first")[2]


@pytest.mark.parametrize(
    ("theirs", "how", "told"),
    [
        ("value", "won", "rival 468 µs (1.1 × spook)"),
        ("diverged", "alone", "spook 500 µs (alone)"),
        ("not_supported", "unasked", "spook 500 µs (only one asked)"),
    ],
)
def test_a_place_is_won_reached_alone_or_not_for_others_to_win(
    engines: Any, theirs: str, how: str, told: str
) -> None:
    """Ours within an error in half a millisecond; the other a little sooner, not at all, or never asked."""
    races = (tracker_race((468e-6, "rival"), (500e-6, "spook")), tracker_race((500e-6, "spook")))
    place = engines.engine_places.Place(
        races[theirs != "value"], frozenset({"spook"} if theirs == "not_supported" else {"spook", "rival"})
    )

    assert place.how == how
    lines = engines.engine_places.first([place])
    assert any(told in line.replace("\u202f", " ") for line in lines), lines
    score = {"won": "first of several in 1: rival 1", "alone": "the only one so near in 1: spook 1",
             "unasked": "the only one asked in 1: spook 1"}[how]  # fmt: skip
    assert lines[-2] == f"Of 1 places (a scene at an error): {score}."
    ours = next(line for line in engines.engine_places.choice([place]) if line.startswith("| spook |"))
    assert ours.split(" | ")[1:5] == ["1", "0", str(int(how == "alone")), str(int(how == "unasked"))]


def tracker_race(*order: tuple[float, str]) -> Race:
    return Race(test="pendulum", ladder="length", unit="%", error=1e-4, order=order)


def test_a_first_place_names_the_setting_that_took_it(engines: Any) -> None:
    race = Race(
        test="pendulum", ladder="length", unit="%", error=1e-4,
        order=((1e-4, "rival"), (2e-4, "spook")), settings=("rk4", "plain"),
    )  # fmt: skip
    lines = engines.engine_places.first([engines.engine_places.Place(race, frozenset({"spook", "rival"}))])

    assert any("rival (rk4) 100 µs (2 × spook)" in line.replace("\u202f", " ") for line in lines), lines


def test_only_printed_limits_count_between_engines(engines: Any, tmp_path: Path) -> None:
    """Of seven gates two have a physical limit; what our method owes is named and not counted."""
    database = f"sqlite:///{tmp_path}/engines.db"
    run = physical(document(0), "pendulum")
    gates = [d for d in run.series if d.role == "gate"]
    printed = sum(d.limit_kind == "physical" for d in gates)
    tracker.record(run, database)
    told = engines.page(database).partition(f"## {printed} printed or physical limits")[2]

    assert 0 < printed < len(gates)
    assert f"The limits of {len(gates) - printed} more questions are what our own method owes" in told
    assert f"| spook | {printed} | 0 | 0 | 0 |" in told


def test_all_engines_have_one_budget(engines: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ours is asked with the same limits and repeats as another, by the same call; nothing is timed once."""
    asked: dict[str, dict[str, Any]] = {}

    def run(tests: Any, *, engine: str, **budget: Any) -> Any:
        asked[engine] = budget
        return document(0)

    monkeypatch.setattr(engines.tracker, "run", run)
    monkeypatch.setattr(engines.tracker, "record", lambda document, database: None)
    engines.measure(["spook", "rival"], "unused", "unused", 0.5, ["pendulum"])

    assert asked["spook"] == asked["rival"]
    assert asked["spook"]["limit"] == asked["spook"]["patience"] == 0.5
    assert asked["spook"]["repeats"].fewest == 2


def test_questions_asked_again_by_themselves_take_the_place_of_their_answers_alone(
    engines: Any, tmp_path: Path
) -> None:
    """A night of both, then one test of ours: that is new, all else stands; a whole night later and nothing older counts."""
    database = f"sqlite:///{tmp_path}/engines.db"
    whole = physical(document(0))
    gates = [d.key for d in whole.series if d.role == "gate" and d.test == "pendulum"]

    def again(night: int, asked: Asked, value: float) -> Any:
        run = physical(document(night))
        series = tuple(d for d in run.series if asked.whole or d.test == "pendulum")
        keys = {d.key for d in series}
        samples = tuple(
            msgspec.structs.replace(s, value=value, passed=not value) if s.series in gates else s
            for s in run.samples
            if s.series in keys
        )
        return msgspec.structs.replace(run, asked=asked, series=series, samples=samples)

    part = again(1, Asked(tests=("pendulum",), families=(), whole=False), 99.0)
    for run in (whole, THEIRS, part):
        tracker.record(run, database)
    told = engines.page(database)
    assert "(0.1.1 of ours): pendulum." in " ".join(told.split())
    assert "| spook | 6 | 1 | 0 | 0 |" in told, (
        "the pendulum misses its limit now, the other six are as they were"
    )

    tracker.record(again(2, Asked(tests=(), families=(), whole=True), 0.0), database)
    told = engines.page(database)
    assert "Asked by themselves" not in told
    assert "| spook | 7 | 0 | 0 | 0 |" in told


def test_the_page_names_the_questions_that_are_newer_than_it(engines: Any, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    tracker.record(document(0), database)
    told = " ".join(engines.page(database).partition("## Which engine")[0].split())
    words = told.partition("In the catalogue by now, and not asked here: ")[2].partition(".")[0].split(", ")

    assert set(words) == set(engines.CATALOGUE) - {d.test for d in document(0).series}


def test_an_engine_of_single_precision_is_said_to_end_where_it_ends(engines: Any) -> None:
    fine = Race(test="grasp", ladder="held", unit="m", error=1e-6, order=((1e-4, "spook"), (2e-4, "jolt")))
    coarse = Race(test="pendulum", ladder="angle", unit="rad", error=1e-6, order=((1e-4, "spook"),))
    both = [engines.engine_places.Place(race, frozenset({"spook", "jolt"})) for race in (fine, coarse)]

    assert "within 1e-06 comes jolt 1 of 2 scenes (grasp, held)." in " ".join(
        engines.engine_places.single(both)
    )
    assert engines.engine_places.single([engines.engine_places.Place(coarse, frozenset({"spook"}))]) == []


def test_a_page_without_a_run_of_ours_is_refused(engines: Any, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    tracker.record(THEIRS, database)
    with pytest.raises(SystemExit, match="no run of ours"):
        engines.page(database)


def test_times_of_another_machine_are_not_set_against_ours(engines: Any, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    machine = msgspec.structs.replace(THEIRS.machine, fingerprint="another")
    for run in (physical(document(0)), msgspec.structs.replace(THEIRS, machine=machine)):
        tracker.record(run, database)
    told = engines.page(database)

    assert "not timed here: rival." in told
    assert "| rival | 5 | 1 | 0 | 1 |" in told, "its answers count wherever they were given"
    assert told.endswith("Nowhere.\n")


def test_the_published_page_says_which_engines_are_not_asked_and_what_stops_do_to_newton(
    engines: Any,
) -> None:
    told = engines.PAGE.read_text(encoding="utf-8")
    assert (
        "\n".join(
            (
                *engine_settings.SETTINGS,
                *engine_kinds.ARM,
                *engine_kinds.TWINS,
                *engine_kinds.NEWCOMERS,
                *engine_kinds.NOT_ASKED,
            )
        )
        in told
    )
    assert {*find.EXTRAS, *find.NODE, *find.BUILT} == {*engine_settings.OBJECTIONS}
    assert not {*find.EXTRAS, *find.NODE, *find.BUILT} & {
        line.split(" | ")[0].strip("| ").lower() for line in engine_kinds.NOT_ASKED
    }


def test_the_published_page_and_the_causes_are_of_one_piece(engines: Any) -> None:
    """Wherever another engine leads there is a cause, and no cause is kept for what is no longer so."""
    told = engines.PAGE.read_text(encoding="utf-8").partition("## Where another engine is first")[2]
    lines = [line for line in told.splitlines() if line.startswith("- ")]

    assert lines
    assert not [line for line in lines if "No cause found yet" in line]
    for (test, engine), (cause, cure) in engines.causes().items():
        assert cause
        assert cure
        here = [line for line in lines if line.startswith(f"- **{test},") and f"**: {engine} in " in line]
        assert here, f"{test}: {engine} is first nowhere; take the cause out"


def test_rungs_that_were_out_of_time_are_counted_and_the_limit_told(engines: Any, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    slow = [
        sample.series for sample in THEIRS.samples if "/ladder:" in sample.series and "/h=" in sample.series
    ]
    why = {
        slow[0]: "the time limit of 0.5 s was reached before step 7",
        slow[1]: "not tried: at 0.1 s a step",
    }
    samples = tuple(
        msgspec.structs.replace(s, outcome="timed_out", failure=why[s.series]) if s.series in why else s
        for s in THEIRS.samples
    )
    for run in (document(0), msgspec.structs.replace(THEIRS, samples=samples)):
        tracker.record(run, database)
    (line,) = (
        line
        for line in engines.page(database).partition("## Rungs")[2].splitlines()
        if line.startswith("| rival |")
    )

    assert line.split(" | ")[2:4] == ["2", "0.5 s"]


def test_the_published_page_says_how_its_engines_were_treated_and_how_long_all_took(engines: Any) -> None:
    """Sums of the page's own rows; a page of nights with unequal budgets says so until it is made anew."""
    text = engines.PAGE.read_text(encoding="utf-8")
    table = text.partition("## Rungs")[2].partition("\n## ")[0]
    rows = {
        cells[0]: cells[1:]
        for line in table.splitlines()
        if (cells := [cell.strip() for cell in line.strip("|").split("|")]) and line.endswith(" min |")
    }
    first = " ".join(text.partition("## Which engine")[0].split())

    late = sum(int(cells[1]) for name, cells in rows.items() if name != engines.OURS)
    assert f"Rungs that ran out of time: {late} of the others, {rows[engines.OURS][1]} of ours." in first
    assert f"a limit ({', '.join({c[2] for c in rows.values()} - {'-'})})," in first
    assert ("One budget for all, ours included" in first) != ("Ours has no limit" in first)
    minutes = sum(float(cells[-1].removesuffix(" min")) for cells in rows.values())
    assert f"All nights together, the facts above not counted: {minutes:.1f} min." in table


def test_a_new_page_says_so_too(engines: Any, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/engines.db"
    late = tuple(
        msgspec.structs.replace(s, outcome="timed_out", failure="the time limit of 0.5 s was reached")
        if "/ladder:" in s.series and "/h=" in s.series
        else s
        for s in THEIRS.samples
    )
    for run in (document(0), msgspec.structs.replace(THEIRS, samples=late)):
        tracker.record(run, database)
    told = " ".join(engines.page(database).split())

    assert "One budget for all, ours included: a simulation has a limit (0.5 s), and so have those" in told
    count = sum(s.outcome == "timed_out" for s in late)
    assert count > 0
    assert f"Rungs that ran out of time: {count} of the others, 0 of ours." in told
    assert "All nights together, the facts above not counted: " in told


def test_a_package_called_tests_that_an_engine_brings_is_taken_out_and_nothing_else(tmp_path: Path) -> None:
    """DART's wheel has one: it would be found in place of ours."""
    about = tmp_path / "brings_tests-1.0.dist-info"
    for file in ("tests/test_theirs.py", "brings_tests/tests/kept.py", "brings_tests/engine.py"):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text("")
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: brings_tests\nVersion: 1.0\n")
    (about / "RECORD").write_text(
        "tests/test_theirs.py,,\nbrings_tests/tests/kept.py,,\nbrings_tests/engine.py,,\n"
    )
    script = FILE.parents[1] / ".ci" / "without_tests.py"
    for name in ("brings_tests", "no_such_package"):
        subprocess.run(
            [sys.executable, str(script), name], check=True, env={**os.environ, "PYTHONPATH": str(tmp_path)}
        )

    left = sorted(str(file.relative_to(tmp_path)) for file in tmp_path.rglob("*.py"))
    assert left == ["brings_tests/engine.py", "brings_tests/tests/kept.py"]

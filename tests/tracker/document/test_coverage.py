"""What is known of every scene is told: what is not known stands as an empty cell, or with a reason of the world's own."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast, get_args

import pytest
from click.testing import CliRunner

from spook_tracker import engine
from spook_tracker.scalar_tests.case import Part, Reason, StabilityMap
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.oscillators.oscillator.scene import (
    decay,
    growth,
    run_map,
    stiffness_of_period,
)
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.cli.report_catalogue import coverage_rows, coverage_table
from spook_tracker.tracker.document.coverage import HEADINGS, Rungs, rungs
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.page_overviews import covered
from tests.histories.synthetic import history, sample, series

MOST_REASONS = 8  # scenes that stand with a reason instead


def test_reasons_are_few_and_stand_only_where_something_is_lacking() -> None:
    excused = {name: test for name, test in CATALOGUE.items() if test.lacks}

    assert len(excused) <= MOST_REASONS
    for name, test in excused.items():
        assert set(test.lacks) <= set(get_args(Part)), name
        assert set(test.lacks.values()) <= set(get_args(Reason)), name
        assert not ("ladder" in test.lacks and test.ladders), name
        assert not ("stability" in test.lacks and test.stability), name


def test_every_scene_has_a_ladder_and_a_break_point_or_map_or_its_reason() -> None:
    rows = coverage_rows(CATALOGUE, None)

    assert [row.test for row in rows if not all(row.cells[:2])] == []
    assert (
        coverage_table(rows)
        .splitlines()[-1]
        .startswith(f"{len(CATALOGUE)} scenes: 0 without error against run time, 0 without stability, ")
    )


def test_every_scene_that_breaks_has_one_band_from_theory_at_least() -> None:
    """A map stands beside its prediction, or shows where break points with bands lie; a scene of "none: " alone has none."""
    without = [
        name
        for name, test in CATALOGUE.items()
        if test.stability
        and not any(study.expected is not None for study in test.stability)
        and not any(isinstance(study.study(engine.simulate), StabilityMap) for study in test.stability)
    ]
    assert without == []


def test_every_scene_is_asked_in_two_directions() -> None:
    """Its stiff and its extreme one; a map has both."""
    alone = [
        name
        for name, test in CATALOGUE.items()
        if len(test.stability) < 2
        and not any(isinstance(study.study(engine.simulate), StabilityMap) for study in test.stability)
    ]
    assert alone == []


def test_every_ladder_compares_two_configurations_at_least() -> None:
    alone = [
        f"{name}: {ladder.name}"
        for name, test in CATALOGUE.items()
        for ladder in test.ladders
        if len(ladder.configurations) < 2
    ]
    assert alone == []


def test_a_cell_is_what_there_is_or_the_reason_or_empty() -> None:
    test = CATALOGUE["pendulum"]
    bare = replace(test, ladders=(), stability=())
    excused = replace(bare, lacks={"ladder": "exact at every step"})

    rows = coverage_rows({"full": test, "bare": bare, "excused": excused}, None)

    assert [row.cells for row in rows] == [
        ("length: 3 configurations; angle: 6 configurations", "7 break points, 1 map", ""),
        ("", "", ""),
        ("exact at every step", "", ""),
    ]
    assert coverage_table(rows).splitlines()[-1] == (
        "3 scenes: 1 without error against run time, 2 without stability, 3 without leaving out; 1 with a reason"
    )


@pytest.mark.parametrize(
    ("errors", "told"),
    [
        (
            [1e-2, 5e-3],
            "rolled: 1 configuration, down to 0.005 m, not 1e-4: order 1 asks for steps of 0.001 s",
        ),
        (
            [3.2e-2, 8e-3, 2e-3],
            "rolled: 1 configuration, down to 0.002 m, not 1e-4: order 2 asks for steps of 0.0056 s",
        ),
        ([4e-3, 3.9e-3], "rolled: 1 configuration, down to 0.0039 m, not 1e-4: smaller steps do not help"),
        ([4e-3], "rolled: 1 configuration, down to 0.004 m, not 1e-4: no smaller step was asked"),
        ([1e-2, -5e-5], "rolled: 1 configuration, down to 5×10⁻⁵ m"),
        ([float("nan")], "rolled: 1 configuration"),
    ],
)
def test_the_least_error_is_read_off_the_rungs(errors: list[float], told: str) -> None:
    ladder = [
        series("log", "ladder:rolled", kind="ladder", unit="m", time_step=h)
        for h in (0.1 / 2**k for k in range(len(errors)))
    ]
    found = rungs((one, sample(one, error)) for one, error in zip(ladder, errors, strict=True))

    assert {name: str(one) for name, one in found["log"].items()} == {"rolled": told}
    assert isinstance(found["log"]["rolled"], Rungs)


def test_the_row_of_a_scene_tells_what_its_night_came_short_of() -> None:
    class Night:
        def runs(self) -> Any:
            return [SimpleNamespace(id=1)]

        def cards(self, run: int) -> Any:
            return []

        def samples(self, run: int) -> Any:
            found = {}
            for k, error in enumerate((1e-2, 5e-3)):
                one = series("motor", "ladder:angle", kind="ladder", unit="rad", time_step=0.1 / 2**k)
                found[k] = (one, sample(one, error))
            return found

    (row,) = coverage_rows({"motor": CATALOGUE["motor"]}, cast(Any, Night()))
    assert row.cells[0] == (
        "angle: 2 configurations, down to 0.005 rad, not 1e-4: order 1 asks for steps of 0.001 s"
    )


def test_list_prints_it_and_gives_it_as_json(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    answer = CliRunner().invoke(main, ["list", "--coverage", "--json"])

    rows = {row["test"]: row for row in json.loads(answer.output)}
    assert set(rows) == set(CATALOGUE)
    assert rows["falling_object"][HEADINGS[0]] == "position: 2 configurations"
    assert not list(tmp_path.iterdir()), "asking makes no database"


def test_the_page_has_a_row_for_every_test_of_the_night() -> None:
    told = book(history(2))
    context = covered(told).context

    assert [row.test for row, _ in context["rows"]] == [test.name for test in told.tests]
    assert all("down to" in row.cells[0] for row, _ in context["rows"] if row.test == "beam")
    assert context["summary"].startswith(f"{len(told.tests)} scenes: ")


@pytest.mark.parametrize("finer", [2, 3, 7])
@pytest.mark.parametrize(
    "name",
    [
        name
        for name, test in CATALOGUE.items()
        if test.lacks.get("ladder") == "exact at every step" and name != "oscillator_filter"
    ],
)
def test_what_is_called_exact_keeps_its_gates_at_every_step(name: str, finer: int) -> None:
    """Limits of rounding: an error that depends on the step would not keep them."""

    def simulate(scene: Any, *, time_step: float, steps: int | None = None, **rest: Any) -> Any:
        more = None if steps is None else steps * finer
        return engine.simulate(scene, time_step=time_step / finer, steps=more, **rest)

    for measurement in CATALOGUE[name].measurements:
        values = measurement.measure(simulate)
        for metric in measurement.metrics:
            assert metric.role != "gate" or metric.passes(values[metric.name]), (metric.name, values)


@pytest.mark.parametrize("time_step", [0.1, 1.0 / 60.0, 1e-3])
def test_the_filter_is_exact_at_every_step(time_step: float) -> None:
    """It is asked in steps, so that its damping and its period go with the step."""
    for period in (50, 7, 2):
        stiffness, damping = stiffness_of_period(period, time_step), 2.0 * time_step
        found = growth(run_map(engine.simulate, stiffness, damping, time_step, 10))

        assert found == pytest.approx(decay(stiffness, damping, time_step) ** 10, rel=1e-10)

"""A test, a metric or a configuration that is renamed in the catalogue goes on where it stood under its old name."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.cli.recorded import history_of
from spook_tracker.tracker.judge.work import with_work
from spook_tracker.tracker.library import record, run
from spook_tracker.tracker.measure.ladder import rung_series
from spook_tracker.tracker.measure.renames import with_aliases

OLD = CATALOGUE["falling_object"]
METRIC = OLD.measurements[0].metrics[0]
NEW = replace(
    OLD,
    formerly=("falling_object",),
    measurements=tuple(
        replace(
            m,
            metrics=tuple(
                replace(metric, name="renamed", formerly=(METRIC.name,))
                if metric.name == METRIC.name
                else metric
                for metric in m.metrics
            ),
            measure=lambda simulate, m=m: {
                "renamed" if name == METRIC.name else name: value
                for name, value in m.measure(simulate).items()
            },
        )
        for m in OLD.measurements
    ),
)


pytestmark = pytest.mark.usefixtures("in_process")
BEFORE, AFTER = {"falling_object": OLD}, {"dropped_object": NEW}
RENAMED = {"dropped_object": replace(OLD, formerly=("falling_object",))}


LADDERED = CATALOGUE["simple_pendulum"]
OTHERWISE = replace(
    LADDERED,
    ladders=tuple(
        replace(
            ladder,
            configurations=tuple(
                replace(way, name=f"{way.name}, renamed", formerly=(way.name,))
                for way in ladder.configurations
            ),
        )
        for ladder in LADDERED.ladders
    ),
)


def measured(catalogue: str) -> Any:
    return run(catalogue=f"{__name__}:{catalogue}")


def test_a_renamed_test_and_metric_name_their_earlier_keys() -> None:
    before = {found.key for found in measured("BEFORE").series}
    after = measured("AFTER").series

    assert all(before & set(found.aliases) for found in after)
    assert not any(found.test == "falling_object" for found in after)


def test_the_history_of_a_renamed_test_is_one(tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/t.db"
    record(measured("BEFORE"), database)
    record(measured("AFTER"), database)
    shown = CliRunner().invoke(main, ["trend", "dropped_object", "renamed", "--db", database]).output

    assert "(values: 2," in shown
    assert (
        CliRunner().invoke(main, ["compare", "previous", "latest", "--db", database]).exit_code == 3
    )  # its way of measuring is new, too


def test_a_test_that_only_has_another_name_is_compared(tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/t.db"
    record(measured("BEFORE"), database)
    record(measured("RENAMED"), database)
    shown = CliRunner().invoke(main, ["compare", "previous", "latest", "--db", database, "--format", "json"])

    assert shown.exit_code == 0
    assert set(json.loads(shown.stdout)["counts"]) == {"identical"}


def test_a_new_name_alone_is_not_another_definition() -> None:
    from spook_tracker.tracker.measure.question import metric_series

    first = OLD.measurements[0]
    renamed = replace(METRIC, name="renamed", formerly=(METRIC.name,))

    old, new = (metric_series("t", OLD, first, metric).test_version for metric in (METRIC, renamed))
    assert old == new
    assert metric_series("t", OLD, first, replace(METRIC, name="renamed")).test_version != old


def test_the_ladder_of_a_renamed_configuration_goes_on() -> None:
    old, new = (
        with_aliases(rung_series("simple_pendulum", test), {"simple_pendulum": test})
        for test in (LADDERED, OTHERWISE)
    )
    assert [found.key for found in old] == [found.aliases[0] for found in new]
    assert [found.test_version for found in old] == [found.test_version for found in new]
    assert not {found.key for found in old} & {found.key for found in new}


def test_exact_work_goes_on_under_the_new_name(tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/t.db"
    record(measured("BEFORE"), database)
    record(measured("RENAMED"), database)
    with history_of(database) as history:
        old, new = (
            {
                key: (definition.test_version, sample.value)
                for key, (definition, sample) in with_work(history.samples(told.id), told.engine).items()
                if definition.kind == "work"
            }
            for told in history.runs()
        )
    assert old == new != {}

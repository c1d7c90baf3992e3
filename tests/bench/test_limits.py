"""Every bench has a limit to miss; a missed one is the exit code of `make bench`, and stays in the history."""

from __future__ import annotations

import math
import os
import subprocess
from functools import partial
from pathlib import Path

import pytest
import yaml

from bench import bench_growth, bench_scenes, costs, floors
from bench.catalogue import CATALOGUE, QUICK
from spook_tracker.engine import simulate
from spook_tracker.tracker.measure.question import measure
from spook_tracker.tracker.measure.questions import Questions
from tests.places import ROOT

TRACKER = """#!/bin/sh
echo "$1" >> said
[ "$1" = publish ] || exit {code}
"""


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_bench_has_a_limit_to_miss(name: str) -> None:
    assert any(metric.limit is not None for _, metric in CATALOGUE[name].metrics())


@pytest.mark.parametrize(("value", "kept"), [(1.9, True), (2.1, False), (math.nan, False), (math.inf, False)])
def test_a_cost_above_its_limit_is_missed(value: float, kept: bool) -> None:
    asked = costs.asked("now", partial(dict, ratio=value), costs.cost("ratio", "beside another", 2.0))
    test = costs.bench("A bench", "What does it cost?", asked, beside="another")

    ((series, sample),) = measure("bench", test, asked, simulate)

    assert (series.kind, sample.passed) == ("time", kept)


@pytest.mark.parametrize("code", [0, 1])
def test_a_missed_limit_is_the_exit_code_and_is_published(tmp_path: Path, code: int) -> None:
    command = tmp_path / "tracker"
    command.write_text(TRACKER.format(code=code))
    command.chmod(0o755)
    makefile = ["make", "-f", ROOT / "Makefile", "-o", "develop", "bench", f"BIN={tmp_path}", "BENCHES=rigid"]

    done = subprocess.run(
        makefile, cwd=tmp_path, env={**os.environ, "MAKEFLAGS": ""}, capture_output=True, timeout=60
    )

    assert (tmp_path / "said").read_text().split() == ["run", "publish"]
    assert (done.returncode != 0) == bool(code)


def test_every_bench_runs_every_week() -> None:
    weekly = yaml.safe_load((ROOT / ".github" / "workflows" / "weekly.yml").read_text())
    targets = {*weekly["jobs"]["heavy"]["strategy"]["matrix"]["target"]}

    assert {"bench", "heaps", *(f"bench-{name}" for name in set(CATALOGUE) - set(QUICK))} <= targets


def test_a_unit_is_the_least_of_its_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    goes = iter((3.0, 2.0, 4.0))
    monkeypatch.setitem(floors.FLOORS, "operation", (lambda: next(goes), 8, 3))

    assert costs.in_units(1.0, "operation") == 1.0 / (2.0 / 8)


@pytest.mark.parametrize("power", [1.0, 1.6])
def test_what_grows_is_told_by_its_exponent(power: float) -> None:
    sizes = (10**5, 10**6, 10**7)
    exactly = [1.0 + (n / 1e9) ** power - (1e5 / 1e9) ** power for n in sizes]

    assert bench_growth.exponent(sizes, [1.0 + (n / 1e5) ** power for n in sizes]) == pytest.approx(
        power, abs=0.05
    )
    assert bench_growth.exponent(sizes, exactly) == 0.0, "it is noise"


def test_what_a_scene_costs_is_told_by_part() -> None:
    source = Questions()
    told = bench_scenes.spent(source, "falling_object")

    assert set(told) == set(bench_scenes.parts_of(source.tests()["falling_object"]))
    assert min(told.values()) > 0.0
    assert told["run times"] > told["replay"]

"""Ranking two engines: at equal error, each in the configuration that does it best, and nobody is red."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import msgspec
import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.run_document import Sample, SeriesDefinition, Timing
from spook_tracker.tracker.judge.rank import leads, standings
from spook_tracker.tracker.library import record
from tests.run_documents import definition as any_definition
from tests.run_documents import engine, machine, run


def rungs(
    configuration: str, points: dict[float, tuple[float, float]], outcome: str = "value"
) -> dict[str, object]:
    """A ladder of one scene: time step -> (error, seconds)."""
    found = {}
    for h, (error, seconds) in points.items():
        key = f"scene/{configuration}/ladder:path/h={h:.6g}"
        definition = msgspec.structs.replace(
            any_definition(),
            key=key,
            test="scene",
            metric="ladder:path",
            configuration=configuration,
            kind="ladder",
            time_step=h,
            unit="m",
        )
        sample = Sample(
            series=key,
            value=error,
            outcome=outcome,  # type: ignore[arg-type]
            passed=outcome == "value",
            set_point_held=True,
            timing=Timing(seconds=(2.0 * seconds, seconds), runs_per_repeat=1),
        )
        found[key] = (definition, sample)
    return found


def both() -> dict[str, dict[str, tuple[SeriesDefinition, Sample]]]:
    first_order = {1 / 60: (1e-1, 1e-4), 1 / 600: (1e-2, 1e-3), 1 / 6000: (1e-3, 1e-2)}
    fourth_order = {1 / 60: (1e-3, 5e-3), 1 / 600: (1e-7, 5e-2)}
    useless = {1 / 60: (5.0, 1e-5)}
    return {
        "plain 1": {**rungs("euler", first_order), **rungs("bad", useless)},
        "fine 2": rungs("rk4", fourth_order),
    }  # type: ignore[return-value]


def test_the_best_configuration_stands_for_an_engine() -> None:
    plain, fine = standings(both())

    assert (plain.error, plain.configuration) == (1e-1, "euler")
    assert (fine.error, fine.configuration) == (1e-3, "rk4")
    assert plain.seconds[0] == pytest.approx(1e-3)
    assert plain.seconds[1:] == (None, None)
    assert fine.seconds[1] == pytest.approx(5e-3 * 10 ** (1 / 4))


def test_who_is_ahead_depends_on_the_error_asked_for() -> None:
    found = leads(standings(both()), "plain 1", "fine 2")

    assert [(lead.error, lead.ahead) for lead in found] == [
        (1e-2, "plain 1"),
        (1e-4, "fine 2"),
        (1e-6, "fine 2"),
    ]
    assert found[0].factor == pytest.approx(5.0)
    assert math.isinf(found[1].factor)


def test_an_engine_that_diverged_or_was_not_asked_says_so() -> None:
    diverged = rungs("euler", {1 / 60: (1.0, 1.0)}, outcome="diverged")

    one, other = standings({"a": diverged, "b": {}})  # type: ignore[dict-item]

    assert (one.error, one.outcome) == (None, "diverged")
    assert (other.error, other.outcome) == (None, "not asked")
    assert leads([one, other], "a", "b") == []


def recorded(folder: Path, versions: dict[tuple[str, str], dict[str, Any]], **machines: Any) -> str:
    """A database with one run of each engine and version."""
    database = f"sqlite:///{folder}/history.db"
    for (name, version), found in versions.items():
        record(
            run(
                engine=engine("", name=name, version=version, commit_time="", parents=()),
                machine=machine(fingerprint=machines.get(name, "one")),
                series=tuple(definition for definition, _ in found.values()),
                samples=tuple(sample for _, sample in found.values()),
            ),
            database,
        )
    return database


def test_comparing_two_engines_ranks_them_scene_by_scene_and_nobody_has_regressed(tmp_path: Path) -> None:
    plain, fine = both().values()
    database = recorded(tmp_path, {("spook", "1.0"): plain, ("mujoco", "3.4.0"): fine})

    done = CliRunner().invoke(main, ["compare", "spook", "mujoco", "--db", database])

    assert done.exit_code == 0
    lines = [" ".join(line.split()) for line in done.output.splitlines()]
    assert "scene path [m] spook 0.1 (euler) 1 ms - -" in lines
    assert "mujoco 0.001 (rk4) 5 ms 8.9 ms 28 ms" in lines
    assert "scene path [m] spook 5.0 × mujoco alone mujoco alone" in lines
    assert lines[-1] == "ahead in 3 places (a scene at an error): spook 1, mujoco 2"


def test_two_versions_of_one_engine_are_told_apart(tmp_path: Path) -> None:
    plain, fine = both().values()
    database = recorded(tmp_path, {("mujoco", "3.3.7"): plain, ("mujoco", "3.4.0"): fine})

    done = CliRunner().invoke(main, ["rank", "mujoco@3.3.7", "mujoco@3.4.0", "--db", database])

    assert done.exit_code == 0
    assert "mujoco 3.4.0 alone" in done.output


def test_run_times_of_two_machines_are_not_set_against_each_other(tmp_path: Path) -> None:
    plain, fine = both().values()
    database = recorded(tmp_path, {("spook", "1.0"): plain, ("mujoco", "3.4.0"): fine}, mujoco="other")

    done = CliRunner().invoke(main, ["compare", "spook", "mujoco", "--db", database])

    assert done.exit_code == 0
    assert "not comparable" in done.output
    assert "ahead" not in done.output


def test_without_ladders_it_says_what_to_measure(tmp_path: Path) -> None:
    database = recorded(tmp_path, {("spook", "1.0"): {}, ("mujoco", "3.4.0"): {}})

    done = CliRunner().invoke(main, ["compare", "spook", "mujoco", "--db", database])

    assert done.exit_code == 0
    assert "tracker run --engine spook,mujoco --sweep" in done.output


def test_a_ladder_without_a_rung_there_is_not_an_engine_that_failed() -> None:
    (one,) = standings({"a": rungs("euler", {1 / 1000: (1e-3, 1.0)})})  # type: ignore[dict-item]

    assert (one.error, one.outcome) == (None, "no such step")

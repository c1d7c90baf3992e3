"""Ranking two engines: at equal error, each in the configuration that does it best, and none is red."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import msgspec
import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.run_document import Asked, Sample, SeriesDefinition, Timing
from spook_tracker.tracker.judge.rank import leads, standings
from spook_tracker.tracker.library import record
from tests.histories.documents import definition as any_definition
from tests.histories.documents import engine, machine, run


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


def test_comparing_two_engines_ranks_them_scene_by_scene_and_none_has_regressed(tmp_path: Path) -> None:
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

    assert (one.error, one.outcome) == (None, "not run at this time step")


def asked(tests: tuple[str, ...], *, whole: bool = False, families: Any = ("values", "sweep")) -> Asked:
    return Asked(tests=tests, families=families, whole=whole)


def of_test(name: str, found: dict[str, Any]) -> dict[str, Any]:
    """The same ladder as one of another test."""
    renamed = {}
    for key, (definition, sample) in found.items():
        key = key.replace("scene/", f"{name}/", 1)
        renamed[key] = (
            msgspec.structs.replace(definition, key=key, test=name),
            msgspec.structs.replace(sample, series=key),
        )
    return renamed


def night(found: dict[str, Any], day: int, of: Asked, version: str = "4.0", place: str = "one") -> Any:
    return run(
        engine=engine("", name="mujoco", version=version, commit_time="", parents=()),
        machine=machine(fingerprint=place),
        series=tuple(definition for definition, _ in found.values()),
        samples=tuple(sample for _, sample in found.values()),
        asked=of,
        started=f"2026-11-{day:02}T03:00:00Z",
        finished=f"2026-11-{day:02}T04:00:00Z",
    )


def test_of_tests_that_the_latest_run_was_not_asked_the_one_before_answers(tmp_path: Path) -> None:
    """Of the same version and machine, back to the first that was asked everything with ladders."""
    database = f"sqlite:///{tmp_path}/history.db"
    plain, fine = both().values()
    other, third = of_test("other", plain), of_test("third", plain)
    everything = ("scene", "other", "third")
    for one in (
        night(third, 1, asked(everything, whole=True)),  # before the whole one: forgotten
        night({**plain, **other}, 2, asked(everything, whole=True)),
        night(third, 3, asked(("third",)), version="3.9"),  # of another version
        night(third, 4, asked(("third",)), place="elsewhere"),  # on another machine
        night({}, 5, asked(everything, whole=True, families=("values",))),  # whole, but no ladders
        night(fine, 6, asked(("scene",))),
    ):
        record(one, database)

    done = CliRunner().invoke(main, ["rank", "mujoco", "--db", database])
    alone = CliRunner().invoke(main, ["rank", "mujoco@4.0", "--db", database])

    lines = [" ".join(line.split()) for line in done.output.splitlines()]
    assert done.exit_code == 0, done.output
    assert "scene path [m] mujoco 0.001 (rk4) 5 ms 8.9 ms 28 ms" in lines
    assert "other path [m] mujoco 0.1 (euler) 1 ms - -" in lines
    assert "third" not in done.output
    assert "other" not in alone.output and "scene" in alone.output


def test_two_engines_are_compared_on_the_tests_that_are_named(tmp_path: Path) -> None:
    plain, fine = both().values()
    both_tests = ({**found, **of_test("other", found)} for found in (plain, fine))
    keys = (("spook", "1.0"), ("mujoco", "3.4.0"))
    database = recorded(tmp_path, dict(zip(keys, both_tests, strict=True)))

    done = CliRunner().invoke(main, ["compare", "spook", "mujoco", "--test", "other", "--db", database])

    assert done.exit_code == 0
    assert "other path" in done.output and "scene path" not in done.output


def test_an_engine_that_is_not_recorded_is_said_to_be_that(tmp_path: Path) -> None:
    database = recorded(tmp_path, {("spook", "1.0"): both()["plain 1"]})

    ranked = CliRunner().invoke(main, ["rank", "drake", "--db", database])
    compared = CliRunner().invoke(main, ["compare", "drake", "spook", "--db", database])
    mixed = CliRunner().invoke(main, ["compare", "1.0", "spook", "--db", database])

    assert (ranked.exit_code, compared.exit_code, mixed.exit_code) == (2, 2, 2)
    assert "no run of an engine 'drake' is recorded, only of spook" in ranked.stderr
    assert compared.stderr == ranked.stderr
    assert "'spook' is an engine: compare it with another one that is recorded" in mixed.stderr


def test_the_processor_s_time_counts_where_it_is_known() -> None:
    """An engine that a busy machine held up twice as long is no slower for it; one that does not tell keeps its clock."""
    told = both()
    held_up = {
        key: (
            definition,
            msgspec.structs.replace(
                sample,
                timing=msgspec.structs.replace(
                    sample.timing, cpu_seconds=(0.5 * min(sample.timing.seconds),)
                ),
            ),
        )
        for key, (definition, sample) in told["plain 1"].items()
        if sample.timing is not None
    }
    (clock, other), (processor, same) = standings(told), standings({**told, "plain 1": held_up})

    assert processor.seconds[0] == pytest.approx(0.5 * clock.seconds[0])
    assert same.seconds == other.seconds

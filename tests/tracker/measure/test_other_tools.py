"""Files as other benchmark tools write them come in as run times, each in its own unit, and are not judged exactly."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.measure.other_tools import of_other_tools
from spook_tracker.tracker.past import compare_documents

COMMIT = "a" * 40
FAILED = "crashed"
PYTEST = {
    "machine_info": {"node": "desk", "cpu": {"brand_raw": "Example", "count": 4}},
    "commit_info": {"id": COMMIT, "time": "2026-11-01T10:00:00+00:00", "dirty": False, "project": "ours", "branch": "main"},
    "benchmarks": [
        {"name": "test_step", "fullname": "bench/test_step.py::test_step", "params": None, "stats":
            {"min": 0.5, "max": 0.7, "mean": 0.6, "median": 0.6, "stddev": 0.1, "rounds": 3, "data": [0.6, 0.5, 0.7]}},
        {"name": "test_few", "fullname": "bench/test_step.py::test_few", "params": None, "stats":
            {"min": 2.0, "max": 4.0, "mean": 3.0, "median": 3.0, "stddev": 1.0, "rounds": 9}},
    ],
    "datetime": "2026-11-01T11:00:00+00:00",
    "version": "5.1.0",
}  # fmt: skip
GOOGLE = {
    "context": {"date": "2026-11-01T11:00:00+00:00", "host_name": "desk", "executable": "./build/bench_solver", "num_cpus": 2},
    "benchmarks": [
        {"name": "BM_Solve/64", "run_name": "BM_Solve/64", "run_type": "iteration", "real_time": 250.0, "cpu_time": 240.0, "time_unit": "us"},
        {"name": "BM_Solve/64", "run_name": "BM_Solve/64", "run_type": "iteration", "real_time": 260.0, "cpu_time": 240.0, "time_unit": "us"},
        {"name": "BM_Solve/64_mean", "run_name": "BM_Solve/64", "run_type": "aggregate", "real_time": 9.0, "cpu_time": 9.0, "time_unit": "us"},
        {"name": "BM_Old", "real_time": 3.0, "cpu_time": 3.0},
    ],
}  # fmt: skip
ASV = {
    "commit_hash": COMMIT, "env_name": "py", "date": 1761990000000, "params": {"machine": "desk"}, "python": "3.12",
    "result_columns": ["result", "params", "version"], "version": 2,
    "results": {
        "bench.Suite.time_step": [[0.25], [], "v"],
        "bench.Suite.time_many": [[0.5, None, 1.5], [["1", "2", "3"]], "v"],
        "bench.Suite.track_drift": [[0.125], [], "v"],
        "bench.Suite.time_broken": [None, [], "v"],
        "bench.Suite.time_skipped": [[math.nan], [], "v"],
    },
}  # fmt: skip
ACTION = {
    "lastUpdate": 1761990000000,
    "repoUrl": "https://example.org/ours",
    "entries": {"Engine": [
        {"commit": {"id": COMMIT, "timestamp": "2026-11-01T10:00:00Z"}, "date": 1761990000000, "tool": "cargo",
         "benches": [{"name": "step", "value": 500.0, "unit": "ns/iter", "range": "± 3"}]},
        {"commit": {"id": "b" * 40, "timestamp": "2026-11-02T10:00:00Z"}, "date": 1762080000000, "tool": "customBiggerIsBetter",
         "benches": [{"name": "speed", "value": 9.0, "unit": "bodies"}]},
        {"commit": {"id": "c" * 40, "timestamp": "2026-11-03T10:00:00Z"}, "date": 1762170000000, "tool": "pytest",
         "benches": [{"name": "rate", "value": 7.0, "unit": "iter/sec"}]},
    ]},
}  # fmt: skip


def read(said: Any, before: bytes = b"") -> Any:
    return of_other_tools(before + json.dumps(said).encode(), "file")


def values(run: Any) -> dict[str, tuple[float, str, str]]:
    told = {d.key: d for d in run.series}
    return {
        told[s.series].test: (
            float(s.value) if s.outcome == "value" else s.outcome,
            told[s.series].unit,
            told[s.series].better,
        )
        for s in run.samples
    }


def test_pytest_benchmark_keeps_every_repeat_and_the_commit() -> None:
    (run,) = read(PYTEST)

    assert values(run) == {
        "bench/test_step.py::test_step": (0.5, "s", "smaller"), "bench/test_step.py::test_few": (2.0, "s", "smaller"),
    }  # fmt: skip
    assert run.samples[0].timing.seconds == (0.6, 0.5, 0.7)
    assert (run.engine.name, run.engine.git_hash, run.machine.fingerprint) == (
        "ours",
        COMMIT,
        "Example, 4 cores",
    )


def test_google_benchmark_in_seconds_without_its_aggregates() -> None:
    (run,) = read(GOOGLE)

    assert values(run) == {
        "BM_Solve/64": (pytest.approx(2.5e-4), "s", "smaller"),
        "BM_Old": (pytest.approx(3e-9), "s", "smaller"),
    }
    assert len(run.samples[0].timing.seconds) == 2
    assert run.engine.name == "bench_solver"


def test_asv_with_parameters_and_what_is_no_time() -> None:
    (run,) = read(ASV)

    assert values(run) == {
        "bench.Suite.time_step": (0.25, "s", "smaller"), "bench.Suite.time_many(1)": (0.5, "s", "smaller"),
        "bench.Suite.time_many(2)": (FAILED, "s", "smaller"), "bench.Suite.time_many(3)": (1.5, "s", "smaller"),
        "bench.Suite.track_drift": (0.125, "1", "smaller"),
        "bench.Suite.time_broken": (FAILED, "s", "smaller"), "bench.Suite.time_skipped": ("not_supported", "s", "smaller"),
    }  # fmt: skip
    assert run.engine.git_hash == COMMIT


def test_github_action_benchmark_is_a_history() -> None:
    runs = read(ACTION, b"window.BENCHMARK_DATA = ")

    assert [next(iter(values(run).values())) for run in runs] == [
        (pytest.approx(5e-7), "s", "smaller"), (9.0, "bodies", "larger"), (7.0, "iter/s", "larger"),
    ]  # fmt: skip
    assert [run.engine.git_hash[0] for run in runs] == ["a", "b", "c"]


@pytest.mark.parametrize("said", [PYTEST, GOOGLE, ASV, ACTION])
def test_times_are_judged_as_noisy_and_decide_nothing(said: Any) -> None:
    for run in read(said):
        assert {(d.kind, d.role) for d in run.series} == {("time", "reported")}


@pytest.mark.parametrize(
    ("written", "value", "unit", "better"),
    [
        ("ops/s", 4.0, "ops/s", "larger"),
        ("ops/ms", 4e3, "ops/s", "larger"),
        ("ops/us", 4e6, "ops/s", "larger"),
        ("MB/s", 4e6, "B/s", "larger"),
        ("iter/sec", 4.0, "iter/s", "larger"),
        ("us/op", 4e-6, "s", "smaller"),
        ("B/op", 4.0, "B", "smaller"),
        ("msec", 4e-3, "s", "smaller"),
        ("KB", 4e3, "B", "smaller"),
        ("MiB", 4 * 2.0**20, "B", "smaller"),
        ("FPS", 4.0, "frames/s", "larger"),
        ("kHz", 4e3, "1/s", "larger"),
        ("GFLOPS", 4.0, "gflop/s", "larger"),
        ("m/s", 4.0, "m/s", "smaller"),
        ("bodies", 4.0, "bodies", "smaller"),
    ],
)
def test_a_unit_has_a_direction_and_one_form(written: str, value: float, unit: str, better: str) -> None:
    (run,) = read(action([{"name": "x", "value": 4.0, "unit": written}], tool="jmh"))

    assert values(run) == {"x": (pytest.approx(value), unit, better)}


def test_a_direction_that_the_tool_gives_counts_more_than_the_unit() -> None:
    (run,) = read(action([{"name": "x", "value": 4.0, "unit": "MB/s"}], tool="customSmallerIsBetter"))
    (other,) = read(action([{"name": "x", "value": 4.0, "unit": "ms"}], tool="customBiggerIsBetter"))

    assert values(run)["x"][2] == "smaller"
    assert values(other)["x"][2] == "larger"


@pytest.mark.parametrize(
    ("bad", "outcome"),
    [(None, FAILED), (math.nan, "not_finite"), (-1.0, "not_finite"), ("fast", "not_finite")],
)
def test_what_is_no_time_is_the_outcome_of_that_benchmark_alone(bad: Any, outcome: str) -> None:
    benches = [{"name": "x", "value": bad, "unit": "ns"}, {"name": "y", "value": 2e9, "unit": "ns"}]
    (run,) = read(action(benches))

    assert values(run) == {"x": (outcome, "s", "smaller"), "y": (2.0, "s", "smaller")}


def test_one_name_twice_in_a_run_loses_nothing() -> None:
    times = [{"name": "x", "value": v, "unit": "s"} for v in (3.0, 2.0)]
    sizes = [{"name": "x", "value": v, "unit": "MB"} for v in (3.0, 2.0)]
    (run,) = read(action(times + sizes))

    assert run.samples[0].timing.seconds == (3.0, 2.0)
    assert values(run) == {"x": (3e6, "B", "smaller"), "x (2)": (2e6, "B", "smaller")}


def action(benches: list[dict[str, Any]], tool: str = "cargo") -> dict[str, Any]:
    entry = ACTION["entries"]["Engine"][0] | {"tool": tool, "benches": benches}
    return ACTION | {"entries": {"Engine": [entry]}}


def test_local_changes_of_pytest_benchmark_make_another_run_and_no_version() -> None:
    clean, dirty = (
        read(PYTEST | {"commit_info": PYTEST["commit_info"] | {"dirty": dirty}})[0] for dirty in (False, True)
    )
    assert (clean.engine.dirty, dirty.engine.dirty) == (False, True)
    assert clean.id != dirty.id


def test_two_runs_with_repeats_are_compared_where_no_history_tells_their_noise() -> None:
    """So that a search of commits finds where a benchmark became slower."""
    stats = [0.5, 0.51, 0.52, 0.53]
    fast, slow = (
        read(
            PYTEST
            | {"benchmarks": [PYTEST["benchmarks"][0] | {"stats": {"data": [factor * s for s in stats]}}]}
        )[0]
        for factor in (1.0, 1.5)
    )
    told = compare_documents(fast, slow)

    assert [change.sentence for change in told.changes if change.red] == ["+50 % run time"]
    assert not any(change.red for change in compare_documents(slow, fast).changes)


def test_a_benchmark_twice_in_a_file_of_pytest_is_one_with_all_its_repeats() -> None:
    once, twice = (read(PYTEST | {"benchmarks": PYTEST["benchmarks"] * times})[0] for times in (1, 2))

    assert [d.key for d in twice.series] == [d.key for d in once.series]
    told = [len(run.samples[0].timing.seconds) for run in (once, twice) if run.samples[0].timing]
    assert told[1] == 2 * told[0] > 0


def test_another_version_of_an_asv_benchmark_is_another_question() -> None:
    other = ASV | {"results": {name: [*row[:2], "w"] for name, row in ASV["results"].items()}}
    versions = [{d.key: d.test_version for d in run.series} for (run,) in (read(ASV), read(other))]

    assert versions[0].keys() == versions[1].keys()
    assert all(versions[1][key] != version for key, version in versions[0].items())


def test_asv_parameters_are_known_by_their_values_and_not_by_their_places() -> None:
    more = {"bench.Suite.time_many": [[9.0, 0.5, 2.0, 1.5], [["0", "1", "2", "3"]], "v"]}
    (before,), (after,) = read(ASV), read(ASV | {"results": more})

    assert values(after)["bench.Suite.time_many(1)"] == values(before)["bench.Suite.time_many(1)"]
    assert values(after)["bench.Suite.time_many(3)"] == values(before)["bench.Suite.time_many(3)"]


def test_no_name_of_a_host_is_published_and_a_hosted_runner_has_one_lane() -> None:
    jobs = [
        PYTEST | {"machine_info": PYTEST["machine_info"] | {"node": node}}
        for node in ("fv-az1-2", "fv-az3-4")
    ]
    lanes = {read(said)[0].machine.fingerprint for said in jobs}
    hosts = [read(ASV | {"params": {"machine": name}})[0].machine for name in ("desk", "shelf")]

    assert lanes == {"Example, 4 cores"}
    assert hosts[0].fingerprint != hosts[1].fingerprint, "asv's machines are named by the team: two stay two"
    assert "desk" not in str(hosts[0]) + str(read(GOOGLE)[0].machine)
    assert "may mix" in read(GOOGLE)[0].machine.processor, "the doubt is said"


def asv_repository(folder: Path) -> Path:
    machine = folder / "results" / "m"
    machine.mkdir(parents=True)
    (folder / "asv.conf.json").write_text('{\n  // ours\n  "project": "gravel",\n}\n')
    listed = {"version": 2, "bench.Suite.track_drift": {"type": "track", "unit": "MB"}}
    (folder / "results" / "benchmarks.json").write_text(json.dumps(listed))
    (machine / "machine.json").write_text('{"machine": "m", "version": 1}')
    for day in range(3):
        said = ASV | {"date": ASV["date"] + day * 86_400_000, "commit_hash": f"{day}" * 40}
        (machine / f"{day}-env.json").write_text(json.dumps(said))
    return folder


@pytest.mark.parametrize("named", [".", "results", "results/m"])
def test_a_folder_of_asv_comes_in_as_it_is(named: str, tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/x.db"
    folder = asv_repository(tmp_path / "repository") / named
    done = CliRunner().invoke(main, ["import", "--db", database, str(folder)])
    out = CliRunner().invoke(main, ["export", "latest", "--db", database]).output

    assert done.output == "3 runs recorded, 0 were there already\n"
    assert json.loads(out)["engine"]["name"] == "gravel"
    drift = [s for s in json.loads(out)["series"] if s["test"].endswith("track_drift")]
    assert [s["unit"] for s in drift] == ["B"], "its unit is what benchmarks.json says"


@pytest.mark.parametrize("above", ["storage", "storage/Linux-CPython-3.12-64bit"])
def test_a_folder_of_a_folder_for_each_machine_comes_in_as_it_is(above: str, tmp_path: Path) -> None:
    """pytest-benchmark's storage; asv's results without the list of benchmarks are like it."""
    folder = tmp_path / "storage" / "Linux-CPython-3.12-64bit"
    folder.mkdir(parents=True)
    (folder / "0001_a.json").write_text(json.dumps(PYTEST))
    done = CliRunner().invoke(main, ["import", "--db", f"sqlite:///{tmp_path}/x.db", str(tmp_path / above)])

    assert done.output == "1 runs recorded, 0 were there already\n"


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.json", "[]", "no run is in"),
        ("a.jsonl", "", "no run is in"),
        ("data.js", 'window.BENCHMARK_DATA = {"repoUrl": "", "entries": {"x": []}}', "no run is in"),
        ("a.json", '{"mean": {"point_estimate": 1.5}}', "of no tool that is known here"),
        ("a.txt", "goos: linux\nBenchmarkFoo-8 \t 1000 \t 1042 ns/op\n", "what `go test -bench` prints"),
        (
            "a.json",
            '[{"jmhVersion": "1.37", "benchmark": "a.B", "mode": "thrpt"}]',
            "is JMH's, which tells no commit",
        ),
    ],
)
def test_a_file_without_a_run_is_one_sentence(name: str, content: str, words: str, tmp_path: Path) -> None:
    """What a nightly job brings in must not be lost without a word."""
    (tmp_path / name).write_text(content)
    done = CliRunner().invoke(main, ["import", "--db", f"sqlite:///{tmp_path}/x.db", str(tmp_path / name)])

    assert (done.exit_code, done.output.count("\n")) == (2, 1)
    assert words in done.output


def test_names_of_any_length_are_kept_apart_and_fit_a_series() -> None:
    long = ["x" * 400 + end for end in "yz"]
    (run,) = read(action([{"name": name, "unit": "ns", "value": 1.0} for name in (*long, "")]))

    names = [d.test for d in run.series]
    assert len(set(names)) == 3 and "unnamed" in names
    assert max(len(d.key) for d in run.series) <= 200
    assert [d.description for d in run.series][:2] == long


def test_engine_and_machine_can_be_named(tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/x.db"
    (tmp_path / "a.json").write_text(json.dumps(GOOGLE))
    named = ["--engine", "pebble", "--machine", "runner of four cores"]
    CliRunner().invoke(main, ["import", "--db", database, *named, str(tmp_path / "a.json")])
    out = json.loads(CliRunner().invoke(main, ["export", "latest", "--db", database]).output)

    assert (out["engine"]["name"], out["machine"]["fingerprint"]) == ("pebble", "runner of four cores")


def test_a_folder_without_runs_is_one_sentence(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["import", "--db", f"sqlite:///{tmp_path}/x.db", str(tmp_path)])

    assert done.exit_code == 2
    assert "holds no JSON files of runs" in done.output


def test_the_same_file_twice_is_one_run() -> None:
    assert read(PYTEST)[0].id == read(PYTEST)[0].id
    assert read(PYTEST)[0].id != read(PYTEST | {"datetime": "2026-11-02T11:00:00+00:00"})[0].id


@pytest.mark.parametrize("said", [{}, [], 3, {"benchmarks": []}, {"results": []}, {"schema_version": 1}])
def test_what_is_of_no_known_tool_is_left_to_others(said: Any) -> None:
    assert read(said) is None


@pytest.mark.parametrize(
    "said",
    [
        PYTEST | {"benchmarks": [{}]},
        PYTEST | {"benchmarks": [{"fullname": "x", "stats": {"data": ["fast"]}}]},
        GOOGLE | {"benchmarks": [{"name": "x", "real_time": 1.0, "time_unit": "years"}]},
        ASV | {"result_columns": 3},
        ASV | {"date": "yesterday"},
        ASV | {"date": 1e300},
        {name: value for name, value in ASV.items() if name != "result_columns"} | {"env_name": "older asv"},
        ACTION | {"entries": {"x": [{}]}},
        ACTION | {"entries": 3},
    ],
)
def test_what_makes_no_sense_is_one_sentence(said: Any) -> None:
    with pytest.raises(DocumentError) as refused:
        read(said)

    assert str(refused.value).startswith("file")
    assert len(str(refused.value)) < 400


@pytest.mark.parametrize(
    ("before", "said"),
    [(b"", PYTEST), (b"", GOOGLE), (b"", ASV), (b"window.BENCHMARK_DATA = ", ACTION)],
    ids=["pytest-benchmark", "google", "asv", "action"],
)
def test_the_command_takes_each_of_them(before: bytes, said: Any, tmp_path: Path) -> None:
    """A file of asv has results, like our own short form, and is not mistaken for one."""
    file = tmp_path / "said.json"
    file.write_bytes(before + json.dumps(said).encode())

    done = CliRunner().invoke(main, ["import", str(file), "--db", f"sqlite:///{tmp_path}/history.db"])

    assert done.exit_code == 0, done.output
    assert f"{len(read(said, before))} runs recorded" in done.output


def test_aggregates_alone_give_their_median_and_an_older_file_may_mix_machines() -> None:
    context = {"date": "2026-11-01T11:00:00+00:00", "num_cpus": 2}
    each = {"run_name": "BM", "run_type": "aggregate", "time_unit": "us"}
    told = [
        {"name": f"BM_{kind}", "aggregate_name": kind, "real_time": time} | each
        for kind, time in (("mean", 13.0), ("median", 12.0), ("stddev", 0.5))
    ]
    (run,) = read({"context": context, "benchmarks": told})

    assert values(run) == {"BM": (pytest.approx(1.2e-5), "s", "smaller")}
    assert "may mix processors" in run.machine.fingerprint


def test_what_failed_says_so_and_no_commit_is_made_up() -> None:
    (failed,) = read(ASV | {"results": ASV["results"] | {"bench.gone": None}})
    entry = ACTION["entries"]["Engine"][0]
    torn = entry | {"benches": [*entry["benches"], {"name": "nan", "value": None, "unit": "ms"}]}
    (kept,) = read(ACTION | {"entries": {"Engine": [torn]}}, b"window.BENCHMARK_DATA = ")
    (unknown,) = read(PYTEST | {"commit_info": {"id": "unversioned", "time": None}})

    assert values(failed)["bench.gone"] == (FAILED, "1", "smaller")
    assert [s.outcome for s in kept.samples] == ["value", FAILED]
    assert (unknown.engine.git_hash, unknown.engine.version) == ("", "unknown")

"""Folders as benchmark tools leave them, and records of any tool, come in by one command and lose nothing.

The files in tests/data/tools are ours, in the form of real ones: names, numbers and commits are made up.
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from spook_tracker.tracker import importing
from spook_tracker.tracker.cli.main import main
from tests.places import DATA

TOOLS = DATA / "tools"
COLUMNS = ["--column", "run_time=s", "--column", "step=us", "--column", "step.*=us", "--column", "*_memory=B"]


class Imported:
    """A database of what was imported, and what the command said."""

    def __init__(self, folder: Path, *words: Any) -> None:
        self.folder = folder
        self.said = self.tracker("import", *words)

    def tracker(self, *words: Any, code: int = 0) -> str:
        done = CliRunner().invoke(main, [*map(str, words), "--db", f"sqlite:///{self.folder}/x.db"])
        assert done.exit_code == code, done.output
        return str(done.output)

    def runs(self) -> list[dict[str, Any]]:
        self.tracker("export", "--out", self.folder / "out")
        told = [json.loads(file.read_text()) for file in (self.folder / "out").glob("*.json")]
        return sorted(told, key=lambda run: str(run["started"]))

    def of(self, place: int) -> dict[str, Any]:
        """Test and metric → its sample, in the run at that place."""
        run = self.runs()[place]
        named = {d["key"]: f"{d['test']} {d['metric']}" for d in run["series"]}
        return {named[s["series"]]: s for s in run["samples"]}


@pytest.mark.parametrize(
    ("files", "options", "runs", "values", "missing"),
    [
        ("pytest-benchmark/*.json", [], 2, 2, 0),
        ("google-benchmark", [], 1, 1, 0),
        ("asv", [], 3, 13, 2),
        ("github-action-benchmark/data.js", [], 3, 8, 1),
        ("json-lines/*.jsonl", COLUMNS, 3, 30, 6),
        ("csv/times.csv", ["--column", "solver=parameter"], 2, 4, 0),
    ],
)
def test_every_form_comes_in_whole(
    files: str, options: list[str], runs: int, values: int, missing: int, tmp_path: Path
) -> None:
    found = Imported(tmp_path, *options, *sorted(TOOLS.glob(files)))
    told = [sample["outcome"] for run in found.runs() for sample in run["samples"]]

    assert found.said.startswith(f"{runs} runs recorded, 0 were there already\n")
    assert (told.count("value"), told.count("missing")) == (values, missing)
    assert found.tracker("import", *options, *sorted(TOOLS.glob(files))).startswith("0 runs recorded")


def test_asv_keeps_its_own_number_with_the_repeats_or_quartiles_behind_it(tmp_path: Path) -> None:
    found = Imported(tmp_path, TOOLS / "asv").of(0)
    kept, summed = (found[f"heap.Heap.time_step('{solver}') run_time"] for solver in ("direct", "iterative"))

    assert (kept["value"], kept["timing"]["seconds"]) == (0.02, [0.0199, 0.02, 0.0202])
    assert (summed["value"], summed["timing"]["seconds"]) == (0.01, [0.0099, 0.01, 0.0102])
    assert (kept["timing"]["runs_per_repeat"], summed["timing"]["runs_per_repeat"]) == (1, 2)


def test_what_a_list_names_and_no_result_answers_is_missing_by_name(tmp_path: Path) -> None:
    found = Imported(tmp_path, TOOLS / "asv")
    nights = [{name: s["outcome"] for name, s in found.of(i).items()} for i in range(3)]

    assert nights[1]["heap.track_drift value"] == "crashed"
    assert nights[2]["rope.time_rope run_time"] == "missing"
    assert "rope.time_never run_time" not in nights[1] | nights[0], (
        "the list is of today, and so is what it misses"
    )
    assert nights[2]["rope.time_never run_time"] == "missing"


def test_a_benchmark_that_stops_while_others_go_on_is_missing_and_red_until_it_is_back(
    tmp_path: Path,
) -> None:
    found = Imported(tmp_path, TOOLS / "github-action-benchmark" / "data.js")
    told = found.tracker("judge", "latest", code=1)

    assert "rope/default/run_time: missing" in told
    assert "bad since 333333333333, last good 222222222222" in told
    accepted = tmp_path / "accepted.toml"
    accepted.write_text(
        '[[accepted]]\nseries = "rope/*"\nremoved = true\nwho = "me"\nwhy = "asked as cord"\n'
    )
    found.tracker("judge", "latest", "--accepted", accepted)


def test_it_is_missed_in_a_file_of_one_run_as_well(tmp_path: Path) -> None:
    """pytest-benchmark writes a file a night: what was there before is what the history has."""
    first, second = sorted((TOOLS / "pytest-benchmark").glob("*.json"))
    said = json.loads(first.read_text())
    also = [{**one, "fullname": f"{one['fullname']} again"} for one in said["benchmarks"]]
    (tmp_path / "first.json").write_text(json.dumps({**said, "benchmarks": [*said["benchmarks"], *also]}))
    found = Imported(tmp_path, tmp_path / "first.json")
    found.tracker("import", second)

    assert sorted(s["outcome"] for s in found.of(1).values()) == ["missing", "value"]


def test_a_run_of_a_few_benchmarks_misses_none_of_the_others(tmp_path: Path) -> None:
    said = json.loads((TOOLS / "github-action-benchmark" / "data.js").read_text().partition("=")[2])
    said["entries"]["Gravel"][2]["benches"] = said["entries"]["Gravel"][2]["benches"][:1]
    (tmp_path / "data.js").write_text("window.BENCHMARK_DATA = " + json.dumps(said))

    assert len(Imported(tmp_path, tmp_path / "data.js").of(2)) == 1


def test_thousands_of_repeats_are_thinned_by_rank(tmp_path: Path) -> None:
    """The least, the middle and the most stay; pytest-benchmark keeps all it took."""
    said = json.loads(next((TOOLS / "pytest-benchmark").glob("0001*")).read_text())
    said["benchmarks"][0]["stats"] |= {
        "data": [1e-6 * (1 + i * 7919 % 5000) for i in range(5000)],
        "iterations": 31,
    }
    (tmp_path / "many.json").write_text(json.dumps(said))
    ((sample,),) = (run["samples"] for run in Imported(tmp_path, tmp_path / "many.json").runs())
    seconds = sample["timing"]["seconds"]

    assert (len(seconds), sample["value"], sample["timing"]["runs_per_repeat"]) == (101, 1e-6, 31)
    assert (seconds[0], seconds[50], seconds[-1]) == pytest.approx((1e-6, 2.5e-3, 5e-3), rel=1e-3)


def test_what_failed_says_why_and_where_it_ran_is_kept(tmp_path: Path) -> None:
    broken = Imported(tmp_path, TOOLS / "google-benchmark").of(0)["BM_Mesh run_time"]

    assert (broken["outcome"], broken["failure"]) == ("crashed", "no such file")
    (tmp_path / "more").mkdir()
    run = Imported(tmp_path / "more", *(TOOLS / "pytest-benchmark").glob("0001*")).runs()[0]
    assert run["machine"]["operating_system"] == "Linux 6.11.0-1018-azure"
    assert run["machine"]["fingerprint"] == "Example Server Processor 7000, 4 cores"


def test_a_detached_head_is_no_branch(tmp_path: Path) -> None:
    """CI checks out a commit: what pytest-benchmark calls its branch then is none."""
    said = json.loads(next((TOOLS / "pytest-benchmark").glob("0001*")).read_text())
    said["commit_info"]["branch"] = "(detached head)"
    (tmp_path / "ci.json").write_text(json.dumps(said))
    found = Imported.__new__(Imported)
    found.folder = tmp_path

    assert "does not say on which branch" in found.tracker(
        "import", "--branch", "main", tmp_path / "ci.json", code=2
    )


def test_the_repository_says_what_lies_on_a_branch_where_a_file_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def git(*words: str) -> str:
        who = ("-c", "user.name=A", "-c", "user.email=a@example.org")
        done = subprocess.run(
            ["git", "-C", str(tmp_path), *who, *words], capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    git("init", "-q", "-b", "main")
    git("commit", "-q", "--allow-empty", "-m", "one")
    kept = git("rev-parse", "HEAD")
    git("checkout", "-q", "-b", "aside")
    git("commit", "-q", "--allow-empty", "-m", "two")
    said = json.loads((TOOLS / "github-action-benchmark" / "data.js").read_text().partition("=")[2])
    entries = said["entries"]["Gravel"][:2]
    for entry, commit in zip(entries, (kept, git("rev-parse", "HEAD")), strict=True):
        entry["commit"]["id"] = commit
    said["entries"]["Gravel"] = entries
    (tmp_path / "data.js").write_text("window.BENCHMARK_DATA = " + json.dumps(said))
    monkeypatch.chdir(tmp_path)

    found = Imported(tmp_path, "--branch", "main", "data.js")

    assert [run["engine"]["git_hash"] for run in found.runs()] == [kept]


def test_records_of_several_files_are_one_run_a_commit(tmp_path: Path) -> None:
    found = Imported(tmp_path, *COLUMNS, "--engine", "gravel", *(TOOLS / "json-lines").glob("*.jsonl"))
    run = found.runs()[0]
    told = {d["key"]: d for d in run["series"]}

    assert {d["test"] for d in run["series"]} == {"humanoid", "gripper"}
    assert (run["engine"]["name"], run["engine"]["git_hash"]) == ("gravel", "1" * 40)
    assert told["humanoid/default/steps_per_second"]["better"] == "larger"
    assert told["humanoid/default/step.solve"]["unit"] == "s"
    assert found.of(0)["humanoid step.solve"]["value"] == pytest.approx(1.2e-4)


def test_numbers_in_no_known_unit_explain_and_the_command_says_so(tmp_path: Path) -> None:
    found = Imported(tmp_path, *COLUMNS, TOOLS / "json-lines" / "humanoid.jsonl")

    assert "contacts_mean; give one with --column contacts_mean=UNIT" in found.said
    assert {d["role"] for d in found.runs()[0]["series"] if d["metric"] == "contacts_mean"} == {"explaining"}


def test_a_column_that_is_not_there_is_named(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text(f"commit,run_time\n{'a' * 40},0.1\n")
    said = Imported(tmp_path, "--column", "runtime=s", "--column", "run_*=s", tmp_path / "x.csv").said

    assert said.splitlines()[1:] == ["no record has a column runtime: --column has no effect on it"]


def test_one_environment_follows_another_and_nothing_is_missing(tmp_path: Path) -> None:
    """asv with a newer Python: a series that begins, and one that ends without being missed."""
    for name, run in (("a", asv("py3.11", 1)), ("b", asv("py3.12", 2))):
        (tmp_path / f"{name}.json").write_text(json.dumps(run))
    found = Imported(tmp_path, tmp_path / "a.json", tmp_path / "b.json")

    assert "1 are measured for the first time" in found.tracker("judge", "latest")


def asv(environment: str, day: int) -> dict[str, Any]:
    return {
        "commit_hash": f"{day}" * 40, "env_name": environment, "date": 86400000 * day, "params": {"machine": "desk"},
        "result_columns": ["result", "params", "version"], "version": 2, "results": {"time_x": [[0.5], [], "v"]},
    }  # fmt: skip


def test_rows_of_one_commit_are_told_apart_by_a_parameter(tmp_path: Path) -> None:
    found = Imported(tmp_path, "--column", "solver=parameter", TOOLS / "csv" / "times.csv")

    assert found.of(0)["heap(solver=direct) run_time"]["value"] == pytest.approx(0.0205)
    assert set(found.of(0)) == {"heap(solver=direct) run_time", "heap(solver=iterative) run_time"}


def test_records_that_differ_in_their_values_alone_are_repeats(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("commit,x_s,ops_per_s\n" + "".join(f"a,{x},{x}\n" for x in (3, 1, 8)))
    found = Imported(tmp_path, tmp_path / "x.csv").of(0)

    assert (found["x x_s"]["value"], found["x x_s"]["timing"]["seconds"]) == (1.0, [3.0, 1.0, 8.0])
    assert found["x ops_per_s"]["value"] == 3.0


def test_a_cell_that_says_it_failed_is_an_outcome_and_an_empty_one_nothing(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("commit,test,x_s\na,t,N/A\na,u,1\na,v,\n")
    found = Imported(tmp_path, tmp_path / "x.csv").of(0)

    assert {name: sample["outcome"] for name, sample in found.items()} == {
        "t x_s": "crashed",
        "u x_s": "value",
    }
    assert found["t x_s"]["failure"] == "the file says N/A"


def test_only_runs_of_a_branch(tmp_path: Path) -> None:
    files = sorted((TOOLS / "pytest-benchmark").glob("*.json"))
    found = Imported(tmp_path, "--branch", "main", *files)

    assert found.said == "1 runs recorded, 0 were there already\n"
    refused = found.tracker("import", "--branch", "main", TOOLS / "asv", code=2)
    assert "does not say on which branch 1111111111 was measured" in refused


@pytest.mark.parametrize(
    ("name", "content", "options", "words"),
    [
        ("a.jsonl", '{"x": 1}\n', [], "no column tells the commit or the version"),
        ("a.jsonl", '{"commit": "a", "x": \n', [], "line 1"),
        ("a.jsonl", "[1]\n[2]\n", [], "cannot be read as records"),
        ("a.jsonl", "3\n", [], "record 1 is no JSON object"),
        ("a.csv", "commit,x\na\n", [], "line 2 has not as many cells"),
        ("a.csv", "commit,x_s,x_s\na,1,2\n", [], "two columns are called 'x_s'"),
        ("a.csv", "commit,test,value,unit\na,t,fast,s\n", [], "value is 'fast' and no number"),
        (
            "a.csv",
            "commit,x_s,n\na,1,10\na,2,20\n",
            [],
            "a second value of a/x_s in one run, with another n; say --column n=parameter",
        ),
        ("a.csv", 'commit,x_s\na,"1,234"\n', [], "x_s is '1,234' and no number; correct it"),
        ("a.csv", "commit,x\na,1\n", ["x"], "gives no column a meaning"),
        ("a.csv", "commit,x\na,1\n", ["x=s,sideways"], "after the unit comes larger, smaller or explains"),
        ("a.csv", "commit,x_s,at\na,1,1e300\n", ["at=started"], "is no valid time"),
    ],
)
def test_records_that_make_no_sense_are_one_sentence_and_nothing_is_stored(
    name: str, content: str, options: list[str], words: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(content)
    columns = [word for option in options for word in ("--column", option)]
    found = Imported.__new__(Imported)
    found.folder = tmp_path
    said = found.tracker("import", *columns, tmp_path / name, code=2)

    assert words in said
    assert said.count("\n") == 1


def test_a_document_of_ours_is_not_read_as_another_tool_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A look at its top tells: reading each of a thousand nights once more in vain took a third of an import."""
    first = Imported(tmp_path, TOOLS / "asv")
    first.tracker("export", "--out", tmp_path / "ours")

    def never(*given: Any) -> None:
        raise AssertionError("it was read as another tool's")

    monkeypatch.setattr(importing, "of_other_tools", never)
    (tmp_path / "again").mkdir()

    assert Imported(tmp_path / "again", tmp_path / "ours").said.startswith("3 runs recorded")

"""The command line: what it prints, what it ends with, and how it fails."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import jsonschema
import msgspec
import pytest
from click.testing import CliRunner, Result

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.cli.options import OneLineErrors
from spook_tracker.tracker.document.schema import document_schema
from spook_tracker.tracker.judge.comparison_document import compare_schema
from tests.places import ROOT, TOYS
from tests.website.page_weights import too_heavy

GOOD, BAD = "a" * 40, "b" * 40
COMMANDS = [  # the contract
    "run", "nightly", "compare", "trend", "list", "show", "explain", "publish", "serve", "export", "import", "db", "schema",
    *(f"db {name}" for name in main.commands["db"].commands),
]  # fmt: skip


pytestmark = pytest.mark.usefixtures("toy_desk", "in_process")


def tracker(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments), prog_name="tracker")


def measure(monkeypatch: pytest.MonkeyPatch, *options: str, **toy: str) -> Result:
    """Run the toy engine as another version of itself."""
    with monkeypatch.context() as patch:
        for name, value in toy.items():
            patch.setenv(f"TOY_{name}", value)
        return tracker("run", "--workers", "0", *options)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Where the first test that needs both versions leaves them."""
    return tmp_path_factory.mktemp("kept") / "tracker.db"


@pytest.fixture
def two_versions(monkeypatch, kept):
    if not kept.exists():
        measure(monkeypatch, VERSION="1.0.0", HASH=GOOD)
        measure(monkeypatch, VERSION="1.1.0", HASH=BAD, PARENT=GOOD, ERROR="-0.2")
        shutil.copyfile("tracker.db", kept)
    shutil.copyfile(kept, "tracker.db")


def test_tracker_alone_teaches_the_three_ways_in():
    shown = tracker()

    assert shown.exit_code == 0
    for way in ("tracker nightly --out public", "tracker compare previous latest", "tracker serve public"):
        assert way in shown.output


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example_of_itself(command):
    shown = tracker(*command.split(), "--help")

    assert shown.exit_code == 0
    assert re.search(rf"Example:\n +tracker {command}\b", shown.output)


def test_a_green_run_prints_the_pass_table_and_ends_with_0(monkeypatch):
    shown = measure(monkeypatch, VERSION="1.0.0", HASH=GOOD)

    assert shown.exit_code == 0
    assert f"toy 1.0.0 · {GOOD[:10]}" in shown.output
    row = next(line for line in shown.output.splitlines() if "position_error" in line)
    for cell in ("position_error [plain]", "0.01", "-0.05 m", "≤ 0.1 m", "+50 %", "held", "✓ PASS"):
        assert cell in row
    assert "green: all 2 limits and set points hold" in shown.output
    assert shown.stderr.splitlines() == ["[1/2] fall", "[2/2] stand"]
    assert "\x1b[" not in shown.output


@pytest.mark.parametrize("columns", [80, 120])
def test_the_table_fits_its_terminal(monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    shown = measure(monkeypatch, "--all", "--no-record", "--sweep", "--stability")
    lines = shown.stdout.splitlines()

    assert max(len(line) for line in lines) <= columns
    assert "map fall map [plain]: 1 settled, 1 bounded" in lines
    assert columns > 80 or any(re.fullmatch(r"fall +h = 0\.01 s *", line) for line in lines)
    assert "≤ 0.1 m" in shown.stdout
    assert not Path("tracker.db").exists()


@pytest.mark.parametrize(
    ("toy", "words"),
    [
        ({"ERROR": "-0.2"}, ("✗ FAIL", "red: 1 of 2 limits broken")),
        ({"ERROR": "0.01"}, ("LEFT", "0 of 2 limits broken, 1 set points left")),  # inside the limit
        ({"FAULT": "raise"}, ("crashed: ValueError: the toy refuses",)),
    ],
)
def test_what_is_red_ends_with_1_and_is_told(monkeypatch, toy, words):
    shown = measure(monkeypatch, **toy)

    assert shown.exit_code == 1
    assert all(word in shown.stdout for word in words)
    assert "Traceback" not in shown.output


def test_run_writes_a_document_of_the_published_schema_and_junit(monkeypatch):
    measure(monkeypatch, "--json", "run.json", "--junit", "run.xml", ERROR="-0.2")
    document = json.loads(Path("run.json").read_text(encoding="utf-8"))
    suites = ElementTree.parse("run.xml").getroot()

    jsonschema.validate(document, document_schema())
    assert len(document["samples"]) == 3
    assert [suite.get("failures") for suite in suites] == ["1", "0"]


def test_compare_says_what_got_worse_since_which_commit_and_ends_with_1(two_versions):
    shown = tracker("compare", "1.0.0", "latest")
    line = next(line for line in shown.output.splitlines() if line.startswith("✗ fall position_error"))

    assert shown.exit_code == 1
    for part in ("limit crossed", "-0.05 → -0.25 m", "limit 0.1", f"first bad commit {BAD[:12]}", "fall"):
        assert part in line


def test_compare_ends_with_0_where_nothing_is_worse(two_versions):
    same = tracker("compare", "latest", "latest")

    assert same.exit_code == 0
    assert "identical: 5 identical" in same.output  # three answers, and the work of two tests


def test_compare_ends_with_2_for_an_unknown_version_and_for_no_data(two_versions):
    unknown = tracker("compare", "9.9.9", "latest")
    empty = tracker("compare", "previous", "latest", "--db", "sqlite:///nothing.db")

    assert (unknown.exit_code, empty.exit_code) == (2, 2)
    assert "'9.9.9'" in unknown.stderr
    assert len(unknown.stderr.splitlines()) == len(empty.stderr.splitlines()) == 1
    assert "tracker run" in empty.stderr


def test_compare_ends_with_3_where_nothing_can_be_compared(monkeypatch, two_versions):
    monkeypatch.setattr("spook_tracker.tracker.measure.machine.float_environment", lambda: "another")
    measure(monkeypatch, VERSION="1.2.0", HASH="c" * 40, PARENT=BAD)
    shown = tracker("compare", "1.1.0", "1.2.0")

    assert shown.exit_code == 3
    assert "different float environments" in shown.output


@pytest.mark.parametrize("form", ["markdown", "json", "junit", "table"])
def test_every_format_ends_with_the_same_code(two_versions, form):
    shown = tracker("compare", "1.0.0", "1.1.0", "--format", form)

    assert shown.exit_code == 1
    if form == "json":
        document = json.loads(shown.stdout)
        jsonschema.validate(document, compare_schema())
        assert document["changes"][0]["name"] == "limit crossed"
    if form == "junit":
        assert ElementTree.fromstring(shown.stdout).find(".//failure") is not None


def test_fail_on_decides_what_ends_with_1(monkeypatch, two_versions):
    measure(monkeypatch, VERSION="2.0.0", HASH="d" * 40, PARENT=BAD, ERROR="1e-13")
    assert tracker("compare", "1.0.0", "2.0.0").exit_code == 0
    assert tracker("compare", "1.0.0", "1.1.0", "--fail-on", "never").exit_code == 0
    assert tracker("compare", "1.0.0", "2.0.0", "--fail-on", "change").exit_code == 1
    assert tracker("compare", "1.1.0", "1.1.0", "--fail-on", "change").exit_code == 0


def test_an_accepted_level_is_not_red(two_versions):
    Path("accepted.toml").write_text(
        '[[accepted]]\nseries = "fall/*"\nrange = [-0.3, 0.0]\nwho = "me"\nwhy = "known"\n', encoding="utf-8"
    )
    shown = tracker("compare", "1.0.0", "1.1.0")

    assert shown.exit_code == 0
    assert "1 accepted, 1 improved, 1 changed" in shown.output


def test_trend_shows_the_series_names_the_bad_night_and_ends_as_judge_does(two_versions, monkeypatch):
    shown = tracker("trend", "fall", "position_error")

    assert (
        shown.exit_code
        == tracker("trend", "fall", "--json").exit_code
        == tracker("judge", "latest").exit_code
        == 1
    )
    assert "█▁" in shown.output
    assert "✗ red" in shown.output
    assert re.search(r"bbbbbbbbbbbb: crossed its limit$", shown.output, re.MULTILINE), (
        "said once, not by name as well"
    )
    assert tracker("trend", "fal").exit_code == 2
    assert "it has height, position_error" in tracker("trend", "fall", "nothing").stderr
    everything = tracker("trend", "fall").stdout
    assert everything.index("/position_error") < everything.index("/height"), "the gate comes first"
    measure(monkeypatch, VERSION="1.2.0", HASH="c" * 40, PARENT=BAD)
    assert tracker("trend", "fall").exit_code == 0


def test_last_green_is_a_version_before_the_latest(monkeypatch):
    """Compared with itself a version is never worse."""
    measure(monkeypatch, VERSION="1.0.0", HASH=GOOD)
    alone = tracker("compare", "last-green", "latest")
    assert (alone.exit_code, alone.stdout) == (2, "")
    assert "no version before the latest has kept every limit" in alone.stderr

    measure(monkeypatch, VERSION="1.1.0", HASH=BAD, PARENT=GOOD, ERROR="-0.2")
    red = tracker("compare", "last-green", "latest", "--format", "json")
    measure(monkeypatch, VERSION="1.2.0", HASH="c" * 40, PARENT=BAD)
    mended = tracker("compare", "last-green", "latest", "--format", "json")

    assert (red.exit_code, mended.exit_code) == (1, 0)
    assert (
        json.loads(red.stdout)["before"]["version"]
        == json.loads(mended.stdout)["before"]["version"]
        == "1.0.0"
    )


def test_list_show_and_explain_tell_what_is_asked_and_what_it_needs():
    assert "Where is the ball?" in tracker("list").output
    shown = tracker("show", "fall").output
    assert "≤ 0.1 m (method-specific: ½ g t h)" in shown
    stages = tracker("explain", "fall").output
    assert stages.startswith("fall: apply_gravity\n")
    assert re.search(r"left out +collision +no body has a shape", stages)
    assert re.search(
        r"kept +apply_gravity +takes \S+ \S+ +the scene has", tracker("explain", "fall", "--cost").output
    )


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["run", "fal"], "did you mean fall"),
        (["nonsense"], "tracker --help"),
        (["compare", "latest"], "tracker compare --help"),
        (["run", "--engine", "no_such_engine"], "name one of spook, mujoco"),
        (["run", "--catalogue", "nowhere:X"], "module:NAME"),
        (["serve", "."], "tracker publish"),
        (["import", "nothing.json"], "nothing.json"),
        (["run", "--db", "mysql://x"], "sqlite"),
    ],
)
def test_errors_are_one_line_that_names_what_to_do(arguments, hint):
    shown = tracker(*arguments)

    assert shown.exit_code == 2
    assert shown.stdout == ""
    assert len(shown.stderr.splitlines()) == 1
    assert hint in shown.stderr


def test_a_defect_is_one_line_too(monkeypatch):
    monkeypatch.setattr("spook_tracker.tracker.cli.report_catalogue.catalogue_table", lambda tests: 1 / 0)
    shown = tracker("list")

    assert shown.exit_code == 2
    assert len(shown.stderr.splitlines()) == 1
    assert "TRACKER_DEBUG=1" in shown.stderr
    assert issubclass(type(main), OneLineErrors)


def test_a_run_travels_by_export_and_import_and_twice_changes_nothing(two_versions):
    assert tracker("export", "--out", "runs").exit_code == 0
    first = tracker("import", "runs", "--db", "sqlite:///other.db")
    second = tracker("import", "runs", "--db", "sqlite:///other.db")

    assert "2 runs recorded, 0 were there already" in first.output
    assert "0 runs recorded, 2 were there already" in second.output
    assert tracker("compare", "1.0.0", "latest", "--db", "sqlite:///other.db").exit_code == 1


def test_the_database_can_be_checked_copied_and_counted(two_versions):
    assert tracker("db", "check").exit_code == 0
    assert tracker("db", "copy", "sqlite:///tracker.db", "sqlite:///copy.db").exit_code == 0
    assert "2 runs of toy" in tracker("db", "stats", "--db", "sqlite:///copy.db").output
    assert tracker("db", "upgrade").exit_code == 0


def test_a_night_measures_judges_and_publishes_and_tells_what_got_worse(monkeypatch):
    first = tracker("nightly", "--workers", "0", "--out", "public")
    monkeypatch.setenv("TOY_HASH", BAD)
    monkeypatch.setenv("TOY_PARENT", GOOD)
    monkeypatch.setenv("TOY_VERSION", "1.1.0")
    monkeypatch.setenv("TOY_ERROR", "0.0005")  # inside limit and set point, but worse
    second = tracker("nightly", "--quick", "--workers", "0", "--out", "public")

    assert first.exit_code == 0
    assert Path("public/index.html").is_file()
    assert too_heavy(Path("public")) == []
    assert second.exit_code == 1
    (red,) = [line for line in second.stdout.splitlines() if line.startswith("✗ stand/")]
    assert "worse than the history, 1 new tonight; the worst: stand/" in second.stdout.splitlines()[0]
    assert "✓ green" in second.stdout  # every limit holds: only the history knows
    for part in (
        "worse",
        "0.5 → 0.5005 m",
        "limit 20",
        f"first bad commit {BAD[:12]}",
        "public/tests/stand.html",
    ):
        assert part in red


def test_a_night_takes_the_levels_that_a_file_accepts(monkeypatch):
    tracker("nightly", "--quick", "--workers", "0", "--out", "public")
    for name, value in {"HASH": BAD, "PARENT": GOOD, "VERSION": "1.1.0", "ERROR": "0.0005"}.items():
        monkeypatch.setenv(f"TOY_{name}", value)
    Path("taken.toml").write_text(
        '[[accepted]]\nseries = "stand/*"\nrange = [0.0, 0.6]\nwho = "Ada"\nwhy = "known"\n'
    )
    asked = ("nightly", "--quick", "--workers", "0", "--out", "public")
    taken = tracker(*asked, "--accepted", "taken.toml")
    missing = tracker(*asked, "--accepted", "nowhere.toml")

    assert taken.exit_code == 0
    assert not [line for line in taken.stdout.splitlines() if line.startswith("✗ stand/")]
    assert missing.exit_code == 2


def test_a_trend_is_of_commits_and_not_of_a_build_with_local_changes_long_ago(monkeypatch, two_versions):
    measure(monkeypatch, VERSION="1.0.1.dev0", HASH=GOOD, DIRTY="1", ERROR="9.0")
    measure(monkeypatch, VERSION="1.2.0", HASH="c" * 40, PARENT=BAD, ERROR="-0.2")
    shown = tracker("trend", "fall", "position_error")

    assert "1.2.0" in [line for line in shown.output.splitlines() if line.strip()][-1]
    assert "1.0.1.dev0" not in shown.output


def test_an_imported_run_of_another_engine_that_became_worse_is_red(tmp_path):
    from spook_tracker.tracker.document.json_form import encode
    from tests.histories.synthetic import rival

    for version, door in (("1", 0.0125), ("2", 0.0125), ("3", 0.02)):
        Path(f"{version}.json").write_bytes(
            encode(msgspec.structs.replace(rival(version, door=door), trigger="import"))
        )
        assert tracker("import", f"{version}.json").exit_code == 0

    assert tracker("judge", "rival@2").exit_code == 0
    shown = tracker("judge", "rival@3")
    assert shown.exit_code == 1
    assert "door/" in shown.output


def test_list_tells_of_what_is_asked_for(two_versions):
    def listed(*options):
        told = json.loads(tracker("list", "--json", *options).output)
        return {one["test"]: {metric["role"] for metric in one["metrics"]} for one in told}

    every = listed()
    assert set(every) == {"fall", "stand"}
    for role in ("gate", "companion", "reported"):
        assert listed("--role", role) == {test: roles for test, roles in every.items() if role in roles}
    assert set(listed("--role", "gate")) == {"fall"}
    assert set(listed("--kind", "ladder")) == {"fall"}
    assert set(listed("--test", "s*")) == {"stand"}
    assert listed("--test", "s*", "--role", "gate") == {}


def test_rank_tells_of_the_tests_that_are_asked_for(two_versions, monkeypatch):
    measure(monkeypatch, "--sweep", VERSION="1.2.0", HASH=BAD[::-1], PARENT=BAD)
    every, fall, other = (tracker("rank", *asked) for asked in ((), ("--test", "f*"), ("--test", "stand")))

    assert "fall" in every.output
    assert fall.output == every.output
    assert "fall" not in other.output


def test_plain_letters_do_where_the_terminal_has_no_others(monkeypatch):
    done = subprocess.run(
        [sys.executable, "-m", "spook_tracker", "run", "--no-record", "--workers", "0"],
        capture_output=True,
        check=False,
        env={
            "PYTHONIOENCODING": "ascii",
            "PYTHONPATH": f"{ROOT}:{TOYS}",
            "TRACKER_ENGINE": "toy_engine",
            "TRACKER_CATALOGUE": "toy_questions:CATALOGUE",
        },
    )

    assert done.returncode == 0
    assert b"+ PASS" in done.stdout


def test_schema_prints_both_schemas():
    assert "samples" in json.loads(tracker("schema").output)["$defs"]["RunDocument"]["properties"]
    assert (
        "changes" in json.loads(tracker("schema", "compare").output)["$defs"]["CompareDocument"]["properties"]
    )

"""Histories that strangers bring, through the command line: their files in, what is told of them out."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main

DAY = 86_400_000  # ms
NIGHTS = 97
LAST = NIGHTS - 2  # where the last two nights begin
SPEED_UPS = [2.0, 1.9, 1.7, 1.5, 1.4, 1.2, 1.1]  # of a new project


def noise(seed: int, share: float = 0.005) -> Any:
    return 1.0 + share * np.random.default_rng(seed).standard_normal(NIGHTS)


def from_night(night: int, factor: float) -> Any:
    return np.where(np.arange(NIGHTS) < night, 1.0, factor)


STEPS = {f"step{n}": noise(n) * from_night(80, 1.03) for n in range(8)}
SERIES = {
    **STEPS,
    "fast": noise(20, 0.01) * from_night(40, 2.0) * np.where(np.arange(NIGHTS) == 70, 0.5, 1.0),
    "old": noise(21) * np.array([*SPEED_UPS, *[1.0] * 70, *[1.25] * 20]),
    "second": noise(22) * from_night(30, 1.1) * from_night(LAST, 10.0),
    "slow": noise(23) * from_night(LAST, 1.15),
    "back": noise(24) * from_night(60, 1.5) * from_night(LAST, 1.0 / 1.5),
    "known": noise(26) * from_night(50, 1.5),
}


def data(
    series: Mapping[str, Sequence[float | None]], units: Callable[[int], str] = lambda _: "ns/iter"
) -> str:
    """A history in the form of github-action-benchmark's page; None where a benchmark is not in a run."""
    entries = [
        {
            "commit": {"id": f"{night:04d}" + "a" * 36, "timestamp": "2025-01-01T00:00:00Z"},
            "date": 1735689600000 + night * DAY,
            "tool": "cargo",
            "benches": [
                {"name": name, "unit": units(night), "value": values[night]}
                for name, values in series.items()
                if night < len(values) and values[night] is not None
            ],
        }
        for night in range(max(map(len, series.values())))
    ]
    return "window.BENCHMARK_DATA = " + json.dumps({"repoUrl": "r", "entries": {"B": entries}})


class Strangers:
    """What the command says of a database."""

    def __init__(self, folder: Path) -> None:
        self.database = f"sqlite:///{folder}/x.db"

    def __call__(self, *words: object) -> tuple[int, str]:
        done = CliRunner().invoke(main, [*map(str, words), "--db", self.database])
        return done.exit_code, done.output

    def nights(self, test: str) -> list[dict[str, Any]]:
        return list(json.loads(self("trend", test, "--json")[1])[0]["nights"])


def imported(folder: Path, *contents: str) -> Strangers:
    """Each content a file, all of them imported by one command."""
    told, files = Strangers(folder), []
    for place, content in enumerate(contents):
        files.append(folder / f"{place}.{'json' if content.startswith('{') else 'js'}")
        files[-1].write_text(content)
    assert told("import", *files)[0] == 0
    return told


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> Strangers:
    series = {name: [1000.0 * float(value) for value in values] for name, values in SERIES.items()}
    return imported(tmp_path_factory.mktemp("strangers"), data(series))


def test_the_right_commit_is_named(told: Strangers) -> None:
    named = [told.nights(name)[-1]["first_bad"][:4] for name in STEPS]

    assert named.count("0080") >= 7


def test_one_fast_night_closes_no_red(told: Strangers) -> None:
    nights = told.nights("fast")

    assert {night["state"] for night in nights[42:]} == {"detected"}
    assert (sum(night["news"] for night in nights), nights[-1]["first_bad"][:4]) == (1, "0040")


def test_levels_of_long_ago_hide_no_change(told: Strangers) -> None:
    assert told.nights("old")[-1]["state"] == "detected"


def test_a_second_regression_on_a_red_run_time_is_new_and_blamed_on_its_own_commit(told: Strangers) -> None:
    code, said = told("judge", "latest", "--test", "second")

    assert (code, "1 new tonight" in said, f"bad since {LAST:04d}" in said) == (1, True, True)


def test_two_versions_are_compared_with_each_other(told: Strangers) -> None:
    """Both are slow, the second confirms the first: nothing became worse between them."""
    for more, ended in (((), 0), (("--against-history",), 1)):
        assert told("compare", f"{LAST:04d}", f"{LAST + 1:04d}", "--test", "slow", *more)[0] == ended
    code, said = told("compare", f"{LAST - 1:04d}", f"{LAST + 1:04d}", "--test", "slow")
    pair, percent = re.search(r"slow/default/run_time +([\d.e-]+) +([\d.e-]+) s +\+([\d.]+) %", said), 0.0
    assert pair is not None
    percent = 100.0 * (float(pair[2]) / float(pair[1]) - 1.0)

    assert (code, percent) == (1, pytest.approx(float(pair[3]), abs=0.1))


def test_a_night_says_what_recovered(told: Strangers) -> None:
    code, said = told("judge", "latest", "--test", "back")

    assert (code, "1 recovered" in said, "✓ back/default/run_time: recovered" in said) == (0, True, True)


def test_values_at_the_end_of_the_doubles_are_no_defect(tmp_path: Path) -> None:
    values = [*(1e307 * value for value in noise(25)[:-3].tolist()), *[1.7e308] * 3]
    code, said = imported(tmp_path, data({"x": values}))("judge", "latest")

    assert (code, "x/default/run_time: slower" in said) == (1, True)


def test_an_accepted_run_time_is_red_after_its_day(told: Strangers, tmp_path: Path) -> None:
    accepted = tmp_path / "accepted.toml"
    for until, ended in (("2025-04-07", 0), ("2025-04-06", 1)):
        accepted.write_text(
            f'[[accepted]]\nseries = "known/*"\nrange = [0.0, 1.0]\nwho = "a"\nwhy = "b"\nuntil = {until}\n'
        )
        assert told("judge", "latest", "--test", "known", "--accepted", accepted)[0] == ended


def test_where_time_alone_orders_commits_it_is_said(told: Strangers) -> None:
    assert "ordered by time, as neither parents nor git" in told("judge", "latest", "--test", "second")[1]


@pytest.mark.parametrize(
    ("units", "factor", "ended"),
    [
        (["ops/s"], 0.6, 1), (["ops/us"], 1.6, 0), (["MB/s"], 0.6, 1), (["KB", "MB"], 1.5e-3, 1), (["KB", "MB"], 1e-3, 0),
    ],
)  # fmt: skip
def test_units_have_a_direction_and_a_size(
    units: list[str], factor: float, ended: int, tmp_path: Path
) -> None:
    values = [
        float(1000.0 * value) * (factor if night >= 86 else 1.0) for night, value in enumerate(noise(1))
    ]
    told = imported(tmp_path, data({"x": values}, lambda night: units[-1 if night >= 86 else 0]))

    assert told("judge", "latest")[0] == ended


@pytest.mark.parametrize("bad", [math.nan, -1.0, None])
def test_one_bad_value_costs_its_own_benchmark_and_no_other(bad: float | None, tmp_path: Path) -> None:
    """NaN, a negative time, and a benchmark that is not there any more while its sibling is."""
    values = [float(1000.0 * value) for value in noise(1)]
    told = imported(tmp_path, data({"x": [*values[:-1], bad], "y": values}))
    code, said = told("judge", "latest")

    assert (code, "x/default/run_time: " in said, "y/default" in said) == (1, True, False)


def asv(night: int, results: Mapping[str, list[Any]]) -> str:
    return json.dumps(
        {
            "version": 2, "commit_hash": f"{night:04d}" + "d" * 36, "env_name": "e", "date": 1735689600000 + night * DAY,
            "params": {"machine": "m"}, "result_columns": ["result", "params", "version"], "results": results,
        }
    )  # fmt: skip


def test_what_is_measured_in_another_unit_now_is_missing_by_that_name(tmp_path: Path) -> None:
    history = data({name: [1000.0] * 5 for name in "rkm"}, lambda night: "ops/s")
    before, last = history.rsplit('{"name": "r", "unit": "ops/s"', 1)
    told = imported(tmp_path, before + '{"name": "r", "unit": "ms"' + last)

    assert "it is measured in s now, which is followed as r/default/run_time" in told("judge", "latest")[1]


def test_a_run_without_any_value_is_left_out_and_said(tmp_path: Path) -> None:
    (tmp_path / "x.js").write_text(data({"f": [1000.0, None, 1000.0]}))
    _, said = Strangers(tmp_path)("import", tmp_path / "x.js")

    assert said.startswith("2 runs recorded") and "they contain no value: 1 of" in said


def test_a_slow_night_as_there_are_now_and_then_is_called_flaky(tmp_path: Path) -> None:
    slow = np.random.default_rng(3).random(60) < 0.3
    slow[-1] = True
    told = imported(
        tmp_path,
        data({"f": [1000.0 * x * (1.3 if s else 1.0) for x, s in zip(noise(5), slow, strict=False)]}),
    )
    code, said = told("judge", "latest")

    assert (code, "; 1 flaky\n! f/default/run_time: flaky; " in said) == (0, True)
    pair = re.search(r"flaky; (\S+) → (\S+) s; no limit; \+(\S+) % for the worse", said)
    assert pair is not None
    assert float(pair[2]) / float(pair[1]) == pytest.approx(1.0 + 0.01 * float(pair[3]), abs=1e-3)
    assert json.loads(told("judge", "latest", "--json")[1])[0]["name"] == "flaky"


def test_memory_that_grows_is_not_slower(tmp_path: Path) -> None:
    told = imported(tmp_path, data({"f": [1000.0 * (1 + (n >= 25)) for n in range(30)]}, lambda _: "KB"))

    assert "f/default/value: worse; " in told("judge", "latest")[1]


def test_a_comparison_blames_no_commit_that_both_versions_have(tmp_path: Path) -> None:
    """Red since night 20; nights 40 and 50 both have that, and a noisy 50 is worse than 40."""
    values = [1000.0 * x * (1.3 if n >= 20 else 1.0) for n, x in enumerate(noise(3)[:51])]
    values[50] *= 1.5
    told = imported(tmp_path, data({"f": values}))
    version = {n: f"{n:04d}" + "a" * 6 for n in (10, 40, 50)}

    assert "bad since 0020" in told("compare", version[10], version[50])[1]
    assert "bad since" not in told("compare", version[40], version[50])[1]


def test_two_nights_of_a_young_history_are_compared_by_the_noise_that_is_known_today(tmp_path: Path) -> None:
    values = [1000.0 * x * (1.3 if n >= 3 else 1.0) for n, x in enumerate(noise(4)[:9])]
    told = imported(tmp_path, data({"heap/64": values}))
    code, said = told("compare", "0001" + "a" * 6, "0007" + "a" * 6)

    assert told("judge", "latest")[0] == code == 1, said
    assert "heap/64 run_time [default]: slower" in said


def test_a_benchmark_with_repeats_is_red_once(tmp_path: Path) -> None:
    rows = ["commit,date,heap_ms"]
    rows += [
        f"{n:04d}{'e' * 36},2025-01-{n + 1:02d},{x * (2.0 if n >= 28 else 1.0)}"
        for n in range(30)
        for x in (1.0, 1.01, 1.02)
    ]
    (tmp_path / "x.csv").write_text("\n".join(rows))
    told = Strangers(tmp_path)
    assert told("import", tmp_path / "x.csv")[0] == 0
    code, said = told("compare", "0010eeee", "0029eeee", "--format", "json", "--against-history")

    assert (code, [change["series"] for change in json.loads(said)["changes"] if change["red"]]) == (
        1,
        ["x/default/heap_ms"],
    )


@pytest.mark.parametrize("factor", [1.1, 1.3])
def test_a_version_of_a_young_history_is_not_held_to_what_it_tells_itself(
    factor: float, tmp_path: Path
) -> None:
    """Of five nights the fifth is the first that tells noise: judge and compare know none of it that night."""
    values = [1000.0 * x * (factor if n == 4 else 1.0) for n, x in enumerate(noise(4)[:5])]
    told = imported(tmp_path, data({"f": values}))

    assert (told("judge", "latest")[0], told("compare", "previous", "latest")[0]) == (0, 0)


def test_the_worst_is_what_became_most_times_worse(tmp_path: Path) -> None:
    steps = {"a": 1.2, "z": 3.0}
    told = imported(
        tmp_path,
        data({name: [1000.0 * x for x in noise(8) * from_night(LAST, by)] for name, by in steps.items()}),
    )
    said = told("judge", "latest")[1]

    assert re.findall(r"the worst: (\w)/", said) == ["z", "z"]
    assert re.findall(r"^✗ (\w)/", said, re.MULTILINE) == ["z", "a"]


def test_the_first_page_counts_a_series_once(tmp_path: Path) -> None:
    values = [1000.0 * x * (2.0 if n >= 60 else 1.2 if n >= 30 else 1.0) for n, x in enumerate(noise(6))]
    told = imported(tmp_path, data({"f": values}))
    assert told("publish", "--out", tmp_path / "site")[0] == 0

    assert "<h1>One series is red</h1>" in (tmp_path / "site" / "index.html").read_text()


def test_a_benchmark_of_asv_is_its_version_its_parameters_and_its_unit(tmp_path: Path) -> None:
    """Twelve nights, then another version four times as slow, a parameter put in front, and one that fails."""
    before = {"a.time_x": [[0.1], [], "v1"], "b.time_x": [[0.01, 0.1], [["'some'", "'many'"]], "v"]}
    after = {
        "a.time_x": [[0.4], [], "v2"],
        "b.time_x": [[0.001, 0.01, None], [["'few'", "'some'", "'many'"]], "v"],
    }
    told = imported(tmp_path, *(asv(night, before if night < 12 else after) for night in range(14)))
    code, said = told("judge", "latest")

    assert (code, said.count("✗ b.time_x('many')/e/run_time: crashed"), said.count("✗")) == (1, 1, 2)
    folder = tmp_path / "asv" / "results" / "m"
    folder.mkdir(parents=True)
    (folder / "0001-e.json").write_text(asv(20, before))
    (folder.parent / "benchmarks.json").write_text(json.dumps({"version": 2}))
    (folder / "machine.json").write_text(json.dumps({"machine": "m", "version": 1}))
    assert told("import", folder.parent)[0] == 0


def test_a_hosted_runner_has_a_baseline_whatever_it_is_called(tmp_path: Path) -> None:
    def night(number: int, seconds: float) -> str:
        cpu = {"brand_raw": "Example 7763 64-Core Processor", "count": 4}
        stats = {
            "min": seconds,
            "median": seconds,
            "max": 1.01 * seconds,
            "data": [seconds, seconds, 1.01 * seconds],
        }
        return json.dumps(
            {
                "machine_info": {"node": f"runner-{number}", "cpu": cpu, "system": "Linux"}, "version": "5.0.0",
                "commit_info": {"id": f"{number:04d}" + "c" * 36, "time": "2025-01-01T00:00:00+00:00", "project": "p"},
                "benchmarks": [{"name": "t", "fullname": "t", "params": None, "stats": stats}],
                "datetime": f"2025-01-{number + 1:02d}T03:00:00+00:00",
            }
        )  # fmt: skip

    told = imported(
        tmp_path, *(night(n, 1e-3 * float(noise(1)[n]) * (1.6 if n >= 20 else 1.0)) for n in range(22))
    )

    assert told("judge", "latest")[0] == 1


def csv(machines: int, factor: float) -> str:
    """A history of one benchmark on some machines a commit; the first is slower from night 20 on."""
    rows = ["commit,date,machine,benchmark,value,unit"]
    for night in range(30):
        for machine in range(machines):
            slower = factor if machine == 0 and night >= 20 else 1.0
            value = (machine + 1.0) * float(noise(machine)[night]) * slower
            rows.append(
                f"{night:04d}{'e' * 36},2025-01-{night + 1:02d}T0{machine}:00:00Z,m{machine},heap,{value},ms"
            )
    return "\n".join(rows)


@pytest.fixture(scope="module")
def machines(tmp_path_factory: pytest.TempPathFactory) -> Strangers:
    folder = tmp_path_factory.mktemp("machines")
    (folder / "x.csv").write_text(csv(3, 1.3))
    told = Strangers(folder)
    assert told("import", folder / "x.csv")[0] == 0
    return told


def test_a_version_is_judged_on_every_machine_that_measured_it(machines: Strangers, tmp_path: Path) -> None:
    for name in ("latest", "previous", f"{28:04d}"):
        code, said = machines("judge", name, "--json", "--junit", tmp_path / "x.xml")
        found = {finding["machine"][:2]: finding["red"] for finding in json.loads(said)}

        assert (code, found) == (1, {"m0": True, "m1": False, "m2": False})
        assert re.findall(r'name="default/run_time on (m\d)', (tmp_path / "x.xml").read_text())[0] == "m0"


def test_releases_without_commits_are_judged_on_every_machine(tmp_path: Path) -> None:
    rows = csv(3, 1.3).replace("commit,", "version,").replace("e" * 36, ".0")
    (tmp_path / "x.csv").write_text(rows)
    told = Strangers(tmp_path)
    assert told("import", tmp_path / "x.csv")[0] == 0
    code, said = told("judge", "latest")

    assert (code, "on m0" in said) == (1, True)
    assert "compared on 3 machines" in told("compare", "0015.0", "0029.0")[1]


def test_versions_are_compared_machine_by_machine(machines: Strangers) -> None:
    """The commit before the latest is the previous one, not another machine's run of the latest."""
    code, said = machines("compare", f"{15:04d}", "latest")
    document = json.loads(machines("compare", "previous", "latest", "--format", "json")[1])
    junit = machines("compare", f"{15:04d}", "latest", "--format", "junit")[1]

    assert (code, "✗ 1 worse" in said, "compared on 3 machines: m2" in said) == (1, True, True)
    assert "bad since 0020" in said
    assert [place[:2] for place in re.findall(r"heap run_time .* on (m\d)", said)] == ["m0"]
    assert (document["before"]["version"][:4], document["exit_code"]) == ("0028", 0)
    assert [change["machine"][:2] for change in document["changes"]] == ["m2", "m1", "m0"]
    assert (junit.count("<testcase"), junit.count("<failure")) == (3, 1)
    ids = re.findall(r'"run":"(\w+)"', json.dumps(document).replace(" ", ""))
    assert json.loads(machines("compare", *ids, "--format", "json")[1])["counts"] == {"same": 1}


def test_the_first_page_says_on_which_machine_it_is_slower(machines: Strangers, tmp_path: Path) -> None:
    assert machines("publish", "--out", tmp_path)[0] == 0
    still_red = (tmp_path / "index.html").read_text().partition('id="old"')[2].partition("</section>")[0]

    assert "1 worse in" in re.sub("<[^>]+>", "", still_red)
    assert "on <bdi>m0</bdi>" in still_red
    assert "Limits kept" not in (tmp_path / "index.html").read_text()


def test_a_comparison_for_ci_tells_what_it_left_out(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text(
        csv(2, 1.0).replace("0029" + "e" * 36 + ",2025-01-30T01:00:00Z,m1", "x,2025-01-30T01:00:00Z,m1")
    )
    told = Strangers(tmp_path)
    assert told("import", tmp_path / "x.csv")[0] == 0

    assert (
        "not compared, 1 machine that measured"
        in told("compare", "0028eeee", "0029eeee", "--format", "junit")[1]
    )


def test_what_one_version_alone_measured_is_named(tmp_path: Path) -> None:
    """A machine that is gone, and an environment of another; neither is a benchmark lost."""
    told = imported(
        tmp_path,
        *(
            asv(night, {"a.time_x": [[float(noise(place)[night])], [], "v"]}).replace('"e"', f'"py{place}"').replace('"m"', f'"{machine}"')
            for night in range(12)
            for place, machine in enumerate(("m", "m", "gone"))
            if night < 11 or place == 1
        ),
    )  # fmt: skip
    code, said = told("compare", "previous", "latest")

    assert (code, "1 machine that measured 0010dddddd alone: " in said, "only 0010dddddd has: a.time_x/py0" in said) == (0, True, True)  # fmt: skip


@pytest.mark.parametrize("slower", [0, 1])
def test_every_environment_of_a_commit_is_judged_and_compared(slower: int, tmp_path: Path) -> None:
    told = imported(
        tmp_path,
        *(
            asv(night, {"a.time_x": [[float(noise(place)[night]) * (1.5 if night >= 12 and place == slower else 1.0)], [], "v"]})
            .replace('"e"', f'"py{place}"')
            for night in range(18)
            for place in range(2)
        ),
    )  # fmt: skip
    for command in (("judge", "latest"), ("compare", f"{8:04d}", "latest")):
        code, said = told(*command)

        assert (code, "✗ 1 worse" in said, f"a.time_x/py{slower}/run_time, slower" in said) == (1, True, True)


@pytest.mark.parametrize("slower", ["A", "B"])
def test_every_suite_of_a_page_is_judged(slower: str, tmp_path: Path) -> None:
    entries = {}
    for place, suite in enumerate("AB"):
        steps = noise(place) * (from_night(80, 1.3) if suite == slower else 1.0)
        page = json.loads(data({"x": [1000.0 * float(value) for value in steps]}).partition("=")[2])
        entries[suite] = page["entries"]["B"]
    page = {"repoUrl": "https://example.org/o/proj", "entries": entries}
    told = imported(tmp_path, f"window.BENCHMARK_DATA = {json.dumps(page)}")
    code, said = told("judge", "latest")

    assert (code, f"x/{slower}/run_time, slower" in said) == (1, True)

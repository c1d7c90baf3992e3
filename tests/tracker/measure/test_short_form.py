"""A run in short form, from any language, becomes a run like every other; the example of the page is one."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.measure.short_form import is_short, whole
from spook_tracker.tracker.store.history import History
from tests.places import ROOT

PAGE = ROOT / "docs" / "engine-protocol.md"


def example() -> dict[str, Any]:
    found = re.search(r"```json\n(.+?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    given: dict[str, Any] = json.loads(found[1])
    return given


def call(*arguments: str) -> Any:
    return CliRunner().invoke(main, list(arguments))


def test_the_example_of_the_page_is_recorded_judged_and_compared(tmp_path: Path) -> None:
    database, file, later = f"sqlite:///{tmp_path}/t.db", tmp_path / "results.json", tmp_path / "later.json"
    given = example()
    file.write_text(json.dumps(given))
    worse = {
        **given,
        "version": "1.10.0",
        "started": "2020-01-01T00:00:00+00:00",
    }  # before the other: by its clock
    worse["results"] = [{**given["results"][0], "value": 0.0019}, *given["results"][1:]]
    later.write_text(json.dumps(worse))

    assert "2 runs recorded, 0 were there" in call("import", str(later), str(file), "--db", database).output
    assert "0 runs recorded, 1 were there" in call("import", str(file), "--db", database).output

    compared = call("compare", "ours@previous", "ours@latest", "--db", database)
    assert compared.exit_code == 1, compared.output
    assert "fall" in compared.output
    with History.open(database) as history:
        assert [run.engine.version for run in history.runs("ours")] == ["1.4.0", "1.10.0"]
        samples = history.samples(history.resolve("ours@1.4.0").id)
    definition, sample = samples["fall/default/error/h=0.01"]
    assert (definition.role, definition.limit, sample.value, sample.passed) == ("gate", 0.002, 0.0016, True)
    assert samples["fall/default/energy/h=0.01"][0].role == "reported"
    assert samples["stack/default/overlap"][1].outcome == "diverged"
    assert "box 3" in samples["stack/default/overlap"][1].failure


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"value": 0.0021}, ("out_of_limit", False)),
        ({"value": -0.0021}, ("out_of_limit", False)),
        ({"value": "nan"}, ("not_finite", False)),
        ({"value": 0.0021, "better": "larger"}, ("value", True)),
        ({"value": 3.0, "better": "inside", "limit": [2.0, 4.0]}, ("value", True)),
        ({"value": 0.001, "outcome": "unsettled"}, ("unsettled", False)),
    ],
)
def test_the_limit_judges_and_nothing_else(change: dict[str, Any], said: tuple[str, bool]) -> None:
    given = example()
    given["results"] = [{**given["results"][0], **change}]
    (sample,) = whole(json.dumps(given).encode(), "it").samples

    assert (sample.outcome, sample.passed) == said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"vlaue": 1.0}, "unknown field `vlaue` - at `\\$.results\\[0\\]`"),
        ({"value": None}, "fall/default/error/h=0.01 has no value"),
        ({"limit": [1.0, 2.0]}, "belong together"),
        ({"test": ""}, r"results\[0\]\.test"),
    ],
)
def test_a_mistake_is_named_with_its_place(change: dict[str, Any], said: str) -> None:
    given = example()
    given["results"][0] |= change
    with pytest.raises(DocumentError, match=said):
        whole(json.dumps(given).encode(), "it")


def test_only_what_has_results_and_no_schema_is_short() -> None:
    assert is_short(b'{"results": []}')
    assert not is_short(b'{"results": [], "schema_version": 1}')
    assert not is_short(b'{"engine": "ours"}')
    assert not is_short(b"[1, 2]")
    assert not is_short(b"{" * 100_000)


def import_nights(folder: Path, nights: Sequence[str]) -> str:
    """A run a night, of one machine, imported night by night: each letter is a benchmark."""
    database = f"sqlite:///{folder}/t.db"
    for night, names in enumerate(nights):
        results = [{"test": name, "metric": "run_time", "unit": "s", "value": 1.0, "noisy": True} for name in names]  # fmt: skip
        file = folder / f"{night}.json"
        file.write_text(json.dumps({"engine": "e", "version": f"1.{night}", "started": f"2020-01-0{night + 1}T00:00:00+00:00", "machine": "m", "results": results}))  # fmt: skip
        assert call("import", str(file), "--db", database).exit_code == 0
    return database


@pytest.mark.parametrize("left", ["bc", "ab", "b", "c"])
def test_run_times_that_stop_while_their_siblings_go_on_are_missing_and_red(
    tmp_path: Path, left: str
) -> None:
    database = import_nights(tmp_path, ["abc", "abc", "abc", left, left])

    told = call("judge", "latest", "--db", database)
    assert told.exit_code == 1, told.output
    for gone in {*"abc"} - {*left}:
        assert f"{gone}/default/run_time" in told.output
    assert "its siblings were measured and it was not" in told.output
    assert (
        call("judge", "latest", "--db", import_nights(tmp_path, ["abc"] * 6)).exit_code == 0
    )  # until it is back


@pytest.mark.parametrize("nights", [["abc", "b"], ["abc", "b", "abc", "b"], ["abc", "abc", "abc", "bx"]])
def test_a_run_of_some_benchmarks_misses_none_where_runs_were_of_some_before(
    tmp_path: Path, nights: list[str]
) -> None:
    assert call("judge", "latest", "--db", import_nights(tmp_path, nights)).exit_code == 0


@pytest.mark.parametrize(("days", "code"), [(0, 1), (3, 0)])
def test_the_latest_night_is_that_of_every_machine(tmp_path: Path, days: int, code: int) -> None:
    """The run that was recorded last is another machine's, and green: the red one of the same night is told, with where."""
    database = f"sqlite:///{tmp_path}/t.db"
    for night in range(24):
        for hour, machine in ((1, "slower"), (2, "the other")):
            slow = 1.5 if machine == "slower" and night > 21 else 1.0
            result = {"test": "fall", "metric": "run_time", "unit": "s", "value": slow + 0.001 * (night % 3), "noisy": True}  # fmt: skip
            begun = f"2020-01-{night + 1 + (days if hour == 2 else 0):02}T0{hour}:00:00+00:00"
            file = tmp_path / f"{night}{hour}.json"
            file.write_text(json.dumps({"engine": "e", "version": f"1.{night}", "started": begun, "machine": machine, "results": [result]}))  # fmt: skip
    assert call("import", *map(str, sorted(tmp_path.glob("*.json"))), "--db", database).exit_code == 0

    told = call("judge", "latest", "--db", database)
    as_json = json.loads(call("judge", "latest", "--json", "--db", database).output)

    assert told.exit_code == code, told.output
    assert ("✗ fall/default/run_time: slower" in told.output and "on slower" in told.output) == (code == 1)
    others = [(f["machine"][:6], f["red"]) for f in as_json if "machine" in f]
    assert others == [("slower", True), ("the ot", False)][: 2 * code]
    assert len(as_json) == 1 + code

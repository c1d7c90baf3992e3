"""A run in short form, from any language, becomes a run like every other; the example of the page is one."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.measure.short_form import is_short, whole
from spook_tracker.tracker.store.history import History

PAGE = Path(__file__).parent.parent / "docs" / "engine-protocol.md"


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


@pytest.mark.parametrize("gone", ["a", "c"])
def test_a_run_time_that_stops_while_its_siblings_go_on_is_missing_and_red(tmp_path: Path, gone: str) -> None:
    database = f"sqlite:///{tmp_path}/t.db"
    for night in range(4):
        names = [name for name in "abc" if night < 3 or name != gone]
        results = [{"test": name, "metric": "run_time", "unit": "s", "value": 1.0, "noisy": True} for name in names]  # fmt: skip
        file = tmp_path / f"{night}.json"
        file.write_text(json.dumps({"engine": "e", "version": f"1.{night}", "started": f"2020-01-0{night + 1}T00:00:00+00:00", "machine": "m", "results": results}))  # fmt: skip
        assert call("import", str(file), "--db", database).exit_code == 0

    told = call("judge", "latest", "--db", database)
    assert told.exit_code == 1, told.output
    assert f"{gone}/default/run_time" in told.output
    assert "its siblings were measured and it was not" in told.output

"""The page of engines that are wrong on purpose: what was broken, which test noticed, and what none noticed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from bench import mutants as bench
from spook_tracker.tracker import library
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.website.options import SiteOptions
from spook_tracker.tracker.website.page_mutants import RecordError, read_mutants
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import history
from tests.places import ROOT

RECORD = ROOT / "bench" / "mutants.json"


def entry(name: str, **changes: Any) -> dict[str, Any]:
    fields = {
        "name": name, "room": "joints", "story": "a hinge pushes the wrong way", "caught_by": "pendulum", "caught": True,
        "said": "limit crossed", "commit": "c" * 40, "day": "2026-11-22",
    }  # fmt: skip
    return fields | changes


def test_the_page_names_each_what_was_broken_and_which_test_caught_it(tmp_path: Path) -> None:
    file = tmp_path / "record.json"
    missed = entry("sly", caught=False, said="<b>nothing</b> is worse", caught_by="tests/test_x.py::test_y")
    file.write_text(json.dumps([entry("bold"), missed]))
    report = publish(history(2), tmp_path / "public", options=SiteOptions(mutants=file))

    assert not report.failed
    page = (tmp_path / "public" / "mutants.html").read_text()
    assert "1 of 2 were caught, 1 missed" in page
    assert page.index('id="sly"') < page.index('id="bold"')
    assert "a hinge pushes the wrong way" in page
    assert 'href="tests/pendulum.html"' in page
    assert "<bdi>test y</bdi>" in page and "<bdi>tests/test_x.py</bdi>" in page
    assert "&lt;b&gt;nothing&lt;/b&gt; is worse" in page
    assert "<code>cccccccccccc</code>" in page
    assert 'href="mutants.html"' in (tmp_path / "public" / "regressions.html").read_text()


def test_without_a_record_there_is_no_page_and_no_way_to_it(tmp_path: Path) -> None:
    publish(history(2), tmp_path / "public")

    assert not (tmp_path / "public" / "mutants.html").exists()
    assert "mutants.html" not in (tmp_path / "public" / "regressions.html").read_text()


@pytest.mark.parametrize("content", ["", "{}", '[{"name": 1}]', "\xff"])
def test_a_file_that_is_no_record_is_one_sentence(tmp_path: Path, content: str) -> None:
    (tmp_path / "record.json").write_text(content, encoding="latin-1")

    with pytest.raises(RecordError, match=r"record\.json is no record of mutants"):
        read_mutants(tmp_path / "record.json")
    with pytest.raises(RecordError, match="make mutants"):
        read_mutants(tmp_path / "nowhere.json")


@pytest.mark.parametrize("command", [["nightly", "--engine", "spook,mujoco"], ["ci", "night"]])
def test_no_night_is_measured_in_vain_when_the_record_cannot_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    def measured(*asked: Any, **named: Any) -> None:
        raise AssertionError("it was measured")

    monkeypatch.setattr("spook_tracker.tracker.measure.apart.run", measured)
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, [*command, "--mutants", "nowhere.json", "--db", "sqlite:///tracker.db"])

    assert done.exit_code == 2
    assert "tracker: nowhere.json: No such file or directory; `make mutants` writes it" in done.output
    with pytest.raises(RecordError, match="nowhere"):
        library.nightly(
            "sqlite:///tracker.db", Path("public"), site=SiteOptions(mutants=Path("nowhere.json"))
        )


def test_the_record_is_of_the_mutants_there_are() -> None:
    """What was tried is listed, and everything that is listed was tried."""
    told = {mutant.name: mutant for mutant in read_mutants(RECORD)}

    assert told.keys() == {mutant.name for mutant in bench.MUTANTS}
    for mutant in bench.MUTANTS:
        assert (told[mutant.name].story, told[mutant.name].caught_by) == (mutant.story, mutant.caught_by)


def test_a_few_tried_again_take_the_place_of_what_the_record_said_of_them(tmp_path: Path) -> None:
    file = tmp_path / "record.json"
    day = bench.datetime.date(2026, 11, 22)
    first, second, *_ = bench.MUTANTS
    bench.recorded(file, [(second, False, "nothing is worse"), (first, True, "red")], "a" * 40, day)
    bench.recorded(file, [(second, True, "red")], "b" * 40, day)

    assert [(m.name, m.caught, m.commit[0]) for m in read_mutants(file)] == [
        (first.name, True, "a"),
        (second.name, True, "b"),
    ]

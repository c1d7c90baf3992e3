"""One answer of the wrong form is the outcome of what was asked, and costs nothing else of the run."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.store.history import History

HERE = Path(__file__).parent
ODD = """
import dataclasses, toy_engine
from toy_engine import build_info
def simulate(scene, **more):
    result = toy_engine.simulate(scene, **more)
    if more.get("time_step") != 0.01:  # of the one question alone
        return result
    return {answer}
"""
ANSWERS = {
    "a status that is none": "dataclasses.replace(result, status='splendid', failure='so it says')",
    "a count of 400 digits": "dataclasses.replace(result, counters={'steps': 10**400})",
    "a count of 20 digits": "dataclasses.replace(result, counters={'steps': 10**19})",
    "a hash that is no text": "dataclasses.replace(result, state_hash=7)",
    "counters that are none": "dataclasses.replace(result, counters={'steps': None})",
    "no result at all": "None",
    "text without end": "dataclasses.replace(result, state_hash='x' * 100_000)",
}


@pytest.fixture(autouse=True)
def _desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(HERE))
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("TRACKER_DB", raising=False)


def asked(engine: str) -> tuple[int, RunDocument, str]:
    Path("odd.py").write_text(engine)
    command = ["run", "--engine", "odd", "--catalogue", "toy_questions", "--workers", "1"]
    done = CliRunner().invoke(main, command, prog_name="tracker")
    assert Path("tracker.db").exists(), done.output
    with History.open("sqlite:///tracker.db") as history:
        (found,) = history.runs()
        return done.exit_code, history.document(found.id), done.output


@pytest.mark.parametrize("what", ANSWERS)
def test_an_answer_of_the_wrong_form_costs_its_own_sample(what: str) -> None:
    code, document, told = asked(ODD.format(answer=ANSWERS[what]))

    outcomes = {sample.series.split("/")[0]: sample for sample in document.samples}
    assert (outcomes["fall"].outcome, outcomes["fall"].passed) == ("crashed", False), told
    assert outcomes["stand"].outcome == "value", "another question's answer is lost with it"
    assert code == 1


def test_text_that_is_none_is_made_readable_and_costs_nothing() -> None:
    _, document, told = asked(ODD.format(answer="dataclasses.replace(result, state_hash='\\ud800x')"))

    assert {sample.outcome for sample in document.samples} == {"value"}, told

"""One answer of the wrong form is the outcome of what was asked, and costs nothing else of the run."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.store.history import History

ODD = """
import dataclasses, toy_engine
from toy_engine import build_info
ODD = {odd}
def simulate(scene, **more):
    result = toy_engine.simulate(scene, **more)
    return eval(ODD[more["time_step"]])
"""
QUESTIONS = """
from dataclasses import replace
from toy_questions import PLAIN, STAND, error
def asked(step):
    (one,) = STAND.measurements
    return replace(STAND, measurements=(replace(one, measure=lambda simulate: {{"sag": error(simulate, step, PLAIN)}}),))
CATALOGUE = {{name: asked(step) for name, step in {steps}.items()}}
"""
WRONG = {
    "a status that is none": "dataclasses.replace(result, status='splendid', failure='so it says')",
    "a count of 400 digits": "dataclasses.replace(result, counters={'steps': 10**400})",
    "a count of 20 digits": "dataclasses.replace(result, counters={'steps': 10**19})",
    "a hash that is no text": "dataclasses.replace(result, state_hash=7)",
    "counters that are none": "dataclasses.replace(result, counters={'steps': None})",
    "no result at all": "None",
    "text without end": "dataclasses.replace(result, state_hash='x' * 100_000)",
}
READABLE = {"text that is none": "dataclasses.replace(result, state_hash='\\ud800x')", "an answer": "result"}


@pytest.mark.usefixtures("desk")
def test_an_answer_of_the_wrong_form_costs_its_own_sample_and_text_that_can_be_made_readable_none() -> None:
    """All of them in one run, each to a question of its own."""
    answers = WRONG | READABLE
    steps = {name: 0.1 / (k + 1) for k, name in enumerate(answers)}
    Path("odd.py").write_text(ODD.format(odd={step: answers[name] for name, step in steps.items()}))
    Path("asked.py").write_text(QUESTIONS.format(steps=steps))

    command = ["run", "--engine", "odd", "--catalogue", "asked", "--workers", "1"]
    done = CliRunner().invoke(main, command, prog_name="tracker")

    assert done.exit_code == 1
    with History.open("sqlite:///tracker.db") as history:
        (found,) = history.runs()
        samples = {s.series.split("/")[0]: s for s in history.document(found.id).samples}
    assert {name: (s.outcome, s.passed) for name, s in samples.items()} == {
        **dict.fromkeys(WRONG, ("crashed", False)), **dict.fromkeys(READABLE, ("value", True)),
    }, done.output  # fmt: skip

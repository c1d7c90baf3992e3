"""An engine that answers well and fails only while it is timed: its class is recorded, and the night is red."""

from __future__ import annotations

import math
from functools import cache

import pytest
from click import unstyle
from click.testing import CliRunner

from spook_tracker.engine.find import find
from spook_tracker.tracker import library
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.cli.report_table import pass_table
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.measure.ladder import error_points, untimed_series
from spook_tracker.tracker.measure.questions import Questions
from spook_tracker.tracker.measure.workers import Lost

ASKED = {
    "catalogue": "toy_questions:CATALOGUE", "engine": "toy_engine", "sweep": True, "repeats": 2,
    "workers": 1, "time_limit": 1.0,
}  # fmt: skip
HERE_TOO = ASKED | {"workers": 0}  # of an engine that leaves its process as it was
RUNGS = "fall/{}/ladder:end-error/h={}"
FAILED = RUNGS.format("plain", "0.05")
REACHED = "fall/{}/ladder:end-error:time-to-error"
HERE = 0.05  # s, the time step at which it fails


pytestmark = pytest.mark.usefixtures("toys", "in_process")


def failing(patch: pytest.MonkeyPatch, fault: str, step: float = HERE) -> None:
    patch.setenv("TOY_HASH", "b" * 40)
    patch.setenv("TOY_PARENT", "a" * 40)
    patch.setenv("TOY_FAULT_TIMED", fault)
    patch.setenv("TOY_FAULT_STEP", str(step))


@cache
def document(fault: str) -> RunDocument:
    """A run with this fault."""
    with pytest.MonkeyPatch.context() as patch:
        failing(patch, fault)
        return library.run(**(HERE_TOO if fault in ("raise", "diverge") else ASKED))


def by_key(document: RunDocument):
    return {sample.series: sample for sample in document.samples}


@pytest.mark.parametrize(
    ("fault", "outcome", "sentence"),
    [
        ("die", "crashed", "while it was timed: the engine's process died while answering"),
        ("hang", "timed_out", "while it was timed: no answer within 1 s, so its process was ended"),
        ("hog", "crashed", "while it was timed: the test ran out of memory"),
        ("raise", "crashed", "while it was timed: ValueError: the toy refuses"),
        ("diverge", "diverged", "while it was timed: body 'ball' left the finite numbers at step 7"),
    ],
)
def test_the_rung_that_fails_has_the_class_of_how_it_failed(fault, outcome, sentence):
    samples = by_key(document(fault))

    failed = samples[FAILED]
    assert (failed.outcome, failed.passed, failed.timing) == (outcome, False, None)
    assert failed.failure == sentence
    assert math.isnan(failed.value)
    for step in ("0.1", "0.025", "0.0125"):
        assert samples[RUNGS.format("plain", step)].outcome == "value"
    assert samples["fall/plain/position_error/h=0.01"].outcome == "value"
    assert samples["fall/plain/ladder:end-error:order"].outcome == "value", "its errors were measured"


def test_what_was_to_be_read_off_the_clock_says_why_it_is_not():
    for configuration in ("plain", "half-step"):
        lost = by_key(document("die"))[REACHED.format(configuration)]
        assert (lost.outcome, lost.passed) == ("crashed", False)
        assert lost.failure == (
            "not timed: the engine's process died while answering, with [plain] at h = 0.05 s"
        )
    table = unstyle(pass_table(document("die"), room=120))
    assert "too slow" not in table and "never" not in table
    assert "crashed" in table


def test_a_death_at_an_unknown_place_is_told_of_every_rung():
    test = Questions(catalogue="toy_questions:CATALOGUE", engine="toy_engine").tests()["fall"]
    (ladder,) = test.ladders
    errors = {
        ("fall", 0, j): error_points(ladder, one, find("toy_engine").simulate)
        for j, one in enumerate(ladder.configurations)
    }
    lost = Lost("timed_out", "the process never began")

    rungs = [s for d, s in untimed_series({"fall": test}, errors, lost) if d.kind == "ladder"]

    assert len(rungs) == 8
    assert {(s.outcome, s.failure) for s in rungs} == {
        ("timed_out", "while it was timed: the process never began")
    }


@pytest.mark.parametrize(("fault", "word"), [("die", "crashed"), ("hang", "timed out")])
def test_the_night_the_comparison_and_the_pages_are_red_with_the_same_word(
    monkeypatch, tmp_path, fault, word
):
    url, out = f"sqlite:///{tmp_path / 'tracker.db'}", tmp_path / "public"
    assert not library.nightly(url, out, **HERE_TOO).red
    failing(monkeypatch, fault)

    report = library.nightly(url, out, **ASKED)

    assert report.red
    (red,) = [finding for finding in report.findings if finding.red]
    assert (red.series, red.name, red.judged.stands) == (FAILED, word, "fail")
    assert f"value became {word}: while it was timed" in red.verdict.sentence
    told = CliRunner().invoke(main, ["compare", "previous", "latest", "--db", url])
    assert told.exit_code == 1
    assert f"{word}" in told.output
    for page in ("regressions.html", "tests/fall.html", "compare.html"):
        assert f"value became {word}: while it was timed" in (out / page).read_text(encoding="utf-8")
    assert "One commit lost one value tonight" in (out / "index.html").read_text(encoding="utf-8")


def test_a_night_that_is_timed_again_is_green_again(monkeypatch, tmp_path):
    url, out = f"sqlite:///{tmp_path / 'tracker.db'}", tmp_path / "public"
    library.nightly(url, out, **HERE_TOO)
    with monkeypatch.context() as patch:
        failing(patch, "die")
        assert library.nightly(url, out, **ASKED).red
    monkeypatch.setenv("TOY_HASH", "c" * 40)
    monkeypatch.setenv("TOY_PARENT", "b" * 40)

    mended = library.nightly(url, out, **HERE_TOO)

    assert not mended.red
    (fixed,) = [f for f in mended.findings if f.series == FAILED]
    assert (fixed.judged.state, fixed.verdict.word) == ("recovered", "identical")

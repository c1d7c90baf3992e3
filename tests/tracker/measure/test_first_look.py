"""A first look at a model file ends in time, asks what tells most first, and says what it left out."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.measure import apart, first_look
from spook_tracker.tracker.measure import run as measuring
from spook_tracker.tracker.measure.questions import Questions
from spook_tracker.tracker.measure.request import Request

pytest.importorskip("mujoco")

SLIDE = """<mujoco><option timestep=".01"/><worldbody><geom type="plane" size="1 1 1"/>
<body name="ball" pos="0 0 .1"><freejoint/><geom type="sphere" size=".1"/></body></worldbody></mujoco>"""
QUESTIONS = ["rest", "cost", "repeated", "motion", "books", "finest"]


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A model, and a clock that goes on by a second with each simulation."""
    ticks = itertools.count()
    monkeypatch.setattr(
        first_look, "_spent", lambda: 0.5 * next(ticks)
    )  # which is asked before each and after
    monkeypatch.setattr(first_look, "_looks", {})
    monkeypatch.chdir(tmp_path)
    model = tmp_path / "ball.xml"
    model.write_text(SLIDE)
    return model


def _looked(file: Path, seconds: float | None) -> Any:
    return measuring.run(
        Questions(catalogue=str(file), engine="mujoco"), Request(workers=0, look=seconds, apart=False)
    )


def _known(document: Any) -> list[str]:
    return [name for name in QUESTIONS if any(one.configuration == name for one in document.series)]


def test_what_tells_most_is_known_first_and_the_rest_is_named(file: Path) -> None:
    document = _looked(file, 8.0)

    assert document.partial
    assert _known(document)[:3] == ["rest", "cost", "repeated"]
    left = [name for name in QUESTIONS if name not in _known(document)]
    assert left
    assert all(name in document.tests[0].lacks["look"] for name in [*left, "replay"])


def test_a_second_look_in_the_same_process_has_its_own_time(file: Path) -> None:
    first, second = _looked(file, 8.0), _looked(file, 8.0)

    assert _known(first) == _known(second)
    assert first.tests[0].lacks == second.tests[0].lacks


def test_a_look_with_time_enough_leaves_nothing_out(file: Path) -> None:
    whole, looked = _looked(file, None), _looked(file, 1e6)

    assert not looked.partial
    assert "look" not in looked.tests[0].lacks
    assert _known(looked) == QUESTIONS
    values = [{s.series: s.value for s in document.samples} for document in (whole, looked)]
    assert {k for k in values[0] if values[0][k] != values[1][k]} <= {
        s.key for s in whole.series if s.kind == "time"
    }


def test_a_run_that_takes_too_long_is_broken_off(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that is looked at every few steps to see whether it has settled."""
    monkeypatch.undo()
    file.write_text(SLIDE.replace(".01", ".000011").replace("0 0 .1", "0 0 9"))
    from spook_tracker.engine.find import find

    class Impatient:
        def __call__(self, run: Any, **how: Any) -> Any:
            return find("mujoco").simulate(run, **how | {"time_limit": 0.05})

    (test,) = Questions(catalogue=str(file), engine="mujoco").tests().values()
    asked = test.measurements[0].measure.args[0]  # type: ignore[attr-defined]
    from spook_tracker.scalar_tests.model_file.facts import watched

    run = watched(asked, Impatient())
    assert run.status == "timed_out"


def test_of_a_look_that_is_not_whole_nothing_is_recorded_and_all_asks_the_rest(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("spook_tracker.tracker.cli.options.LOOK", 8.0)
    monkeypatch.setattr(
        apart, "run", lambda source, request, watch: measuring.run(source, replace(request, workers=0), watch)
    )
    asked = ["run", "--model", str(file), "--engine", "mujoco", "--db", f"sqlite:///{file.parent}/a.db"]
    look = CliRunner().invoke(main, asked, prog_name="tracker")
    before = CliRunner().invoke(main, ["export", *asked[-2:]], prog_name="tracker")
    whole = CliRunner().invoke(main, [*asked, "--all"], prog_name="tracker")

    assert "ball: left out of this first look: " in look.output
    assert "nothing is recorded; --all asks all" in look.output
    assert "left out" not in whole.output
    assert look.exit_code == whole.exit_code == 0
    after = CliRunner().invoke(main, ["export", *asked[-2:]], prog_name="tracker")
    assert not before.output
    assert '"ball"' in after.output


def test_where_nothing_comes_to_an_end_that_is_said(file: Path) -> None:
    with pytest.raises(
        measuring.RunError, match=r"^nothing was measured: mujoco did not finish ball .*--all"
    ):
        _looked(file, 1e-9)

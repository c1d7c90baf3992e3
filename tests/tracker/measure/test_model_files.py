"""Model files as tests: how they are named and set, and what a difference of their values means."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from spook_tracker.scalar_tests.case import Estimate
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import Sensitivity
from spook_tracker.tracker.judge.compare import ComparedRun, compare
from spook_tracker.tracker.judge.comparison_document import Side
from spook_tracker.tracker.judge.release_notes import visible
from spook_tracker.tracker.judge.verdict import judge
from spook_tracker.tracker.measure.catalogues import find
from spook_tracker.tracker.measure.model_files import ModelFileError, catalogue
from spook_tracker.tracker.measure.question import measure, metric_series
from tests.histories.documents import gate
from tests.tracker.judge.test_verdict import sample

BALL = """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
<body name="ball" pos="0 0 {height}"><freejoint/><geom type="sphere" size=".1"/></body></worldbody>
<actuator/><keyframe><key name="up" qpos="0 0 2 1 0 0 0"/></keyframe></mujoco>"""


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    file = tmp_path / "ball.xml"
    file.write_text(BALL.format(height=".1"))
    return file


def _versions(name: str) -> set[str]:
    return {
        metric_series("t", test, m, metric).test_version
        for test in catalogue(name).values()
        for m in test.measurements
        for metric in m.metrics
    }


def test_a_file_is_a_test_and_its_content_is_its_definition(ball: Path, tmp_path: Path) -> None:
    (test,) = catalogue(str(ball)).values()
    metrics = {metric.name for m in test.measurements for metric in m.metrics}

    assert {"ball.place@0.05s", "ball.turn@5s", "ball.rest_z", "settled", "load", "differing_runs"} <= metrics
    before = _versions(str(ball))
    (tmp_path / "copy").mkdir()
    (tmp_path / "copy/ball.xml").write_text(ball.read_text())
    assert _versions(str(tmp_path / "copy/ball.xml")) == before
    ball.write_text(BALL.format(height=".2"))
    assert not _versions(str(ball)) & before


def test_a_page_says_where_in_its_folder_a_model_lies_and_nothing_of_the_machine(tmp_path: Path) -> None:
    for folder, said in (
        ("lib/site-packages/robots/arms", "robots/arms/ball.xml"),
        ("repository/models", "models/ball.xml"),
        ("alone", "ball.xml"),
    ):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / "repository/.git").mkdir(parents=True, exist_ok=True)
        (tmp_path / folder / "ball.xml").write_text(BALL.format(height=".1"))
        (test,) = catalogue(str(tmp_path / folder / "ball.xml")).values()

        assert dict(test.parameters)["file"] == said
        assert "1 body with joints; watched: ball." in test.model


def test_a_model_called_as_a_question_of_ours_gets_another_name(ball: Path) -> None:
    assert list(catalogue(f"pendulum={ball}")) == ["pendulum_model"]
    assert list(catalogue(f"bowl 2={ball}")) == ["bowl_2"]


def test_beside_our_questions_it_is_one_more(ball: Path) -> None:
    found = find(f"standard,{ball}")

    assert {"ball", "pendulum"} <= set(found)
    assert found["ball"].as_given


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("", "names no file"),
        ('file = "gone.xml"', "gone.xml is no file"),
        ('file = "ball.xml"\nspeed = 2', "no setting 'speed'"),
        ('file = "ball.xml"\nduration = 0', "duration must be positive"),
        ('file = "ball.xml"\nduration = 1e9', "60 s at most"),
        ('file = "ball.xml"\ntolerance = nan', "tolerance must be positive"),
        ('file = "ball.xml"\nkeyframe = "down"', "no keyframe 'down'; it has up"),
        ('file = "ball.xml"\nwatch = []', "watch must name bodies"),
        ('file = "ball.xml"\ncontrol = "wild"', "control cannot be 'wild'"),
        ('file = "ball.xml"\ncontrol = "gone.csv"', "is no table of controls"),
        ('file = "ball.xml"\ncontrol = "words.csv"', "is no table of controls"),
        ('file = "ball.xml"\ncontrol = "back.csv"', "times in"),
        ('file = "ball.xml"\ncontrol = "no_such_module:f"', "there is no module"),
        ('file = "ball.xml"\ncontrol = "no.such.module:f"', "there is no module"),
        ('file = "ball.xml"\ncontrol = { amplitude = 1.0 }', "a sinusoid is"),
        ('file = "ball.xml"\ncontrol = { amplitude = nan, frequency = 1.0 }', "a sinusoid is"),
        ('file = "ball.xml"\n[[model]]\nfile = "ball.xml"', "is there already"),
        ('file = "ball.xml"\nfolder = "below"', "lies outside"),
    ],
)
def test_what_is_wrong_in_a_table_is_one_sentence(ball: Path, tmp_path: Path, table: str, said: str) -> None:
    (tmp_path / "below").mkdir()
    (tmp_path / "words.csv").write_text("t,a\n0,1\nx,2\n")
    (tmp_path / "back.csv").write_text("t,a\n1,0\n0,0\n")
    (tmp_path / "tracker.toml").write_text(f"[[model]]\n{table}\n")

    with pytest.raises(ModelFileError, match=said) as raised:
        catalogue(str(tmp_path / "tracker.toml"))

    assert "\n" not in str(raised.value)


def test_controls_and_start_are_a_part_of_the_definition(ball: Path, tmp_path: Path) -> None:
    (tmp_path / "moves.csv").write_text("time,one\n0,0.5\n1,0\n")
    seen = [_versions(str(ball))]
    for more in (
        'control = "hold"',
        'control = "moves.csv"',
        'keyframe = "up"',
        "control = {amplitude=1.0, frequency=2.0}",
        "push = 0.01",
        "push = 0.01\nseed = 2",
    ):
        (tmp_path / "tracker.toml").write_text(f'[[model]]\nfile = "ball.xml"\n{more}\n')
        assert not any(_versions(str(tmp_path / "tracker.toml")) & other for other in seen)
        seen.append(_versions(str(tmp_path / "tracker.toml")))


def test_the_settings_file_puts_its_models_among_the_questions(
    ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tracker.toml").write_text('[[model]]\nfile = "ball.xml"\n')
    monkeypatch.chdir(tmp_path)
    listed = CliRunner().invoke(main, ["list"], prog_name="tracker")
    alone = CliRunner().invoke(main, ["list", "--model", "other=ball.xml"], prog_name="tracker")

    assert "ball" in listed.output and "pendulum" in listed.output
    assert "other" in alone.output and "pendulum" not in alone.output


def test_an_engine_that_reads_no_such_file_says_so(tmp_path: Path) -> None:
    file = tmp_path / "ball.sdf"
    file.write_text('<sdf version="1.9"><model name="m"><link name="ball"/></model></sdf>')
    ran = CliRunner().invoke(main, ["run", "--model", str(file), "--no-record", "--workers", "0", "--all"])

    assert "spook reads MJCF and URDF, no SDF" in ran.output
    assert ran.exit_code == 2  # neither green nor red: nothing was measured


@pytest.mark.parametrize(("file", "said"), [("ball.txt", "no model file"), ("a,b.xml", "a comma")])
def test_a_name_that_cannot_be_a_model_is_refused(file: str, said: str) -> None:
    ran = CliRunner().invoke(main, ["run", "--model", file], prog_name="tracker")

    assert ran.exit_code == 2
    assert said in ran.output


KNOWN = Sensitivity(rounding=Number(1e-14), step_error=Number(1e-5), scale=Number(0.5))


def _judged(before: float, after: float, tolerance: float = 0.0, known: Sensitivity = KNOWN):
    definition = gate(better="inside", role="reported", tolerance=tolerance, sensitivity=known)
    return judge(definition, sample(before, state="a"), sample(after, state="b"))


def test_three_things_are_told_apart() -> None:
    assert judge(gate(sensitivity=KNOWN), sample(1.0, state="a"), sample(1.0, state="a")).word == "identical"
    assert _judged(0.1, 0.1 + 9e-15).word == "same"
    assert "rounding" in _judged(0.1, 0.1 + 9e-15).sentence
    changed = _judged(0.1, 0.1 + 1e-9)  # far below what halving the step changes, and a change all the same
    assert (changed.word, changed.red) == ("changed", False)
    assert "1e-04 times what halving the time step changes" in changed.sentence
    assert "2e-09 of the size" in changed.sentence
    assert "40 times" in _judged(0.1, 0.1004).sentence


def test_a_change_beyond_the_teams_tolerance_is_red() -> None:
    assert _judged(0.1, 0.1004, tolerance=1e-3).word == "changed"
    assert _judged(0.1, 0.102, tolerance=1e-3).red


@pytest.mark.parametrize(("more", "role"), [("", "gate"), ("push = 0.01\n", "reported")])
def test_what_is_pushed_all_the_time_is_held_to_its_motion_alone(
    ball: Path, tmp_path: Path, more: str, role: str
) -> None:
    (tmp_path / "tracker.toml").write_text(f'[[model]]\nfile = "ball.xml"\ntolerance = 0.001\n{more}')

    (test,) = catalogue(str(tmp_path / "tracker.toml")).values()
    roles = {
        m.configuration: {q.role for q in m.metrics if q.unit == "m" and q.better == "inside"}
        for m in test.measurements
    }

    assert roles["motion"] == {"gate"}
    assert roles["rest"] == {role}


def test_beyond_the_predictable_time_no_place_is_compared() -> None:
    chaos = Sensitivity(rounding=Number(math.inf), step_error=Number(0.3), scale=Number(0.5))

    assert _judged(0.1, 5.0, tolerance=1e-3, known=chaos).word == "same"


def _side(run: str) -> Side:
    return Side(
        run=run, engine="e", version=run, git_hash="", dirty=False, started="2026-01-01T00:00:00+00:00", machine="m",
        float_environment="f",
    )  # fmt: skip


@pytest.mark.parametrize(("after", "seen"), [(0.1 + 9e-15, False), (0.1 + 1e-9, True), (0.1, False)])
def test_between_releases_rounding_is_no_news_and_a_change_is_however_small(after: float, seen: bool) -> None:
    definition = gate(better="inside", role="reported", sensitivity=KNOWN)
    before, later = (
        ComparedRun(side=_side(name), samples={"t/c/m": (definition, sample(value, state=name))})
        for name, value in (("a", 0.1), ("b", after))
    )
    (change,) = compare(before, later).changes

    assert visible(change) is seen


def test_an_estimate_is_recorded_with_what_moves_it(ball: Path) -> None:
    (test,) = catalogue(str(ball)).values()
    rest = next(m for m in test.measurements if m.configuration == "rest")
    values = {m.name: Estimate(1.0, rounding=1e-15, step_error=2e-3, scale=0.2) for m in rest.metrics}
    values["settled"] = Estimate(10.0, rounding=0.04, unsettled="still moves at 1 m/s after 10 s")

    found = {d.metric: (d, s) for d, s in measure("t", test, replace(rest, measure=lambda _: values), None)}

    definition, value = found["ball.rest_z"]
    assert definition.sensitivity == Sensitivity(
        rounding=Number(1e-15), step_error=Number(2e-3), scale=Number(0.2)
    )
    assert value.outcome == "value"
    assert found["settled"][1].outcome == "unsettled"  # the value is kept, and is not passed off as a rest

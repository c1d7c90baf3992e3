"""The model files of a package are listed: models, parts of models, what is refused; and what an engine loads."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from spook_tracker.engine.model_reading import read
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.cli.report_models import markdown_of
from spook_tracker.tracker.measure import model_agreement, model_packages, model_standing
from spook_tracker.tracker.measure.model_agreement import agreement
from spook_tracker.tracker.measure.model_files import ModelFileError
from spook_tracker.tracker.measure.model_packages import files_of, loaded, looked_at, stood
from spook_tracker.tracker.measure.model_standing import Standing

MODEL = '<mujoco><worldbody><body><freejoint/><geom size=".1"/></body></worldbody></mujoco>'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in {
        "a/ball.xml": MODEL,
        "a/part.xml": "<mujocoinclude/>",
        "b/broken.xml": "<mujoco>",
        "b/nonsense.xml": MODEL.replace("<geom", "<nonsense/><geom"),
        "b/notes.txt": "",
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_folder_is_listed_and_each_file_is_what_it_is(folder: Path) -> None:
    found = {path.name: looked_at(path).word for path in files_of(str(folder))}

    assert found == {
        "ball.xml": "model",
        "part.xml": "part",
        "broken.xml": "refused",
        "nonsense.xml": "model",
    }


def test_an_installed_package_is_found_by_its_name_or_by_that_of_its_import() -> None:
    assert files_of("msgspec") == []
    assert files_of("_pytest") == files_of("pytest")
    with pytest.raises(ModelFileError, match="no package 'no-such-thing' is installed"):
        files_of("no-such-thing")


def test_an_engine_loads_and_steps_what_it_can_and_says_why_not_the_rest(folder: Path) -> None:
    pytest.importorskip(
        "mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'"
    )

    found = {one.path.name: one for one in loaded(files_of(str(folder)), "mujoco", workers=1)}

    assert {name: one.word for name, one in found.items()} == {
        "ball.xml": "runs",
        "part.xml": "part",
        "broken.xml": "refused",
        "nonsense.xml": "refused",
    }
    assert "mujoco refuses nonsense.xml" in found["nonsense.xml"].sentence


def test_the_command_counts_them(folder: Path) -> None:
    ran = CliRunner().invoke(main, ["models", str(folder)], prog_name="tracker")

    assert ran.exit_code == 0
    assert "4 files: 2 model" in ran.output
    assert "part.xml" not in ran.output


SWING = '<mujoco><worldbody><body pos="0 0 2"><joint axis="0 1 0"/><geom type="capsule" size=".02 .3" pos=".3 0 0"/></body></worldbody></mujoco>'
SOFT = """<mujoco><worldbody><geom type="plane" size="1 1 1"/><body name="ball" pos="0 0 .4"><freejoint/>
<geom size=".1" solref="-500 -20"/></body></worldbody></mujoco>"""


LEANS = """<mujoco><worldbody><body pos="0 0 2"><joint name="arm" axis="0 1 0" {joint}/>
<geom type="capsule" size=".02 .3" pos=".3 0 0"/></body></worldbody></mujoco>"""
FILES = {
    "swing": SWING,
    "soft": SOFT,
    "outside": LEANS.format(joint='limited="true" range="20 90"'),  # where its limit pushes it back
    "rubs": LEANS.format(joint='frictionloss="2" solreffriction=".3 1"'),
    "broken": "<mujoco>",
}


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Standing | str]:
    """Of each file where three engines take it, one of which is none."""
    pytest.importorskip(
        "mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'"
    )
    folder = tmp_path_factory.mktemp("models")
    for name, text in FILES.items():
        (folder / f"{name}.xml").write_text(text)
    return {path.name: one for path, one in stood(files_of(str(folder)), ("mujoco", "spook", "no_such"))}


def test_of_several_engines_it_is_told_which_stand_together(told: dict[str, Standing | str]) -> None:
    swing, soft = told["swing.xml"], told["soft.xml"]
    assert isinstance(swing, Standing) and isinstance(soft, Standing)
    assert {one.groups for one in swing.checkpoints} == {(("mujoco", "spook"),)}
    assert swing.cause is None
    assert soft.checkpoints[-1].groups == (("mujoco",), ("spook",))  # one sinks in, the other lies on top
    assert soft.checkpoints[-1].apart("spook", "mujoco") > 5e-4
    assert "no_such" in swing.refused


def test_of_several_engines_it_is_told_how_a_model_ends_in_each(told: dict[str, Standing | str]) -> None:
    swing, soft = told["swing.xml"], told["soft.xml"]
    assert isinstance(swing, Standing) and isinstance(soft, Standing)
    for engine in ("mujoco", "spook"):
        assert not swing.ends[engine].rests and soft.ends[engine].rests
        assert soft.falls(engine) and soft.ends[engine].sunk == pytest.approx(0.3, abs=2e-3)
    assert not swing.rests_alike("mujoco", "spook")
    assert soft.rests_alike("mujoco", "spook") and soft.rest_apart("spook", "mujoco") > 5e-4
    assert not replace(soft, size=0.05).rests_alike("mujoco", "spook")


@pytest.mark.parametrize(
    ("name", "part", "gives_way"),
    [("soft", "contacts", True), ("outside", "limits", True), ("rubs", "dry friction", False)],
)
def test_the_part_is_named_over_which_two_engines_part(
    told: dict[str, Standing | str], name: str, part: str, gives_way: bool
) -> None:
    found = told[f"{name}.xml"]

    assert isinstance(found, Standing) and found.cause
    assert found.cause.parts == (part,)
    assert found.cause.left < 0.1 * found.cause.apart
    if gives_way:  # rigid in both, they hardly part
        assert found.cause.rigid is not None and found.cause.rigid < 0.1 * found.cause.apart
    else:
        assert found.cause.rigid is None


@pytest.mark.parametrize("breaks", ["refuses", "stops"])
def test_engines_that_cannot_be_asked_without_a_part_are_told_to_part_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, breaks: str
) -> None:
    pytest.importorskip(
        "mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'"
    )
    (tmp_path / "soft.xml").write_text(SOFT.replace("0 0 .4", "0 0 .1"))
    monkeypatch.chdir(tmp_path)
    ran = model_standing._ran

    def broken(model, engine, step, times, without=(), rigid=False, elsewhere=False, rests=False):
        assert Path(model.path).is_absolute()  # DART takes no other
        if without and breaks == "refuses":
            raise NotSupported("not without")
        return ran(model, engine, step, (1e9,) if without else times, without, rigid, rests=rests)

    monkeypatch.setattr(model_standing, "_ran", broken)
    monkeypatch.setattr(model_standing, "LIMIT", 0.2)
    file = Path("soft.xml")
    found = model_standing.standing(model_packages._model(file, read(file)), ("mujoco", "spook"), 0.1)

    assert found.cause is not None and found.cause.parts == ()


def test_a_table_says_up_to_when_engines_stand_with_the_first_and_why_not_longer(
    told: dict[str, Standing | str],
) -> None:
    lines = list(markdown_of(("mujoco", "spook", "no_such"), told))

    half = lines.index("How each ends:")
    rows, ends = (
        {line.split("|")[1].strip(" `"): line for line in part if line.startswith("| `")}
        for part in (lines[:half], lines[half:])
    )
    assert set(rows) == {f"{name}.xml" for name in FILES if name != "broken"}
    assert [cell.strip() for cell in rows["swing.xml"].split("|")[3:6]] == ["5 s", "=", "-"]
    assert re.search(r"\| = to 0.5 s, then 0.00[0-9]+ m \| - \|$", rows["soft.xml"])
    assert ends["swing.xml"] == "| `swing.xml` | moves | moves | - |"
    assert re.search(
        r"\| falls, rests from \d.\d s \| falls, rests from \d.\d s = \| - \|$", ends["soft.xml"]
    )
    said = "\n".join(lines)
    assert re.search(
        r"- spook takes 4 of .* Of 2 that rest in mujoco 2 rest alike and 0 elsewhere, 0 move; of 2 that move 1 move",
        said,
    )
    assert (
        "- `soft.xml`: mujoco and spook part at" in said
        and "rigid and without rebound in mujoco, too, " in said
    )
    assert re.search(
        "- no_such: there is no engine .*: `outside.xml`, `rubs.xml`, `soft.xml`, `swing.xml`.", said
    )
    assert "the file is no XML" in said and "`broken.xml`." in said


@pytest.mark.timeout(120)  # s: fewer than the 300 that a worker is waited for
def test_what_is_no_model_by_itself_is_left_out_at_once(folder: Path) -> None:
    """A worker that came to nothing is not waited for as if it were still at work."""
    paths = [folder / name for name in ("a/part.xml", "b/broken.xml")]

    assert [path.name for path, _ in stood(paths, ("spook", "no_such_engine"))] == ["broken.xml"]


def test_the_command_says_it_at_each_time(tmp_path: Path) -> None:
    pytest.importorskip(
        "mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'"
    )
    file = tmp_path / "soft.xml"
    file.write_text(SOFT)
    ran = CliRunner().invoke(main, ["models", str(file), "--engine", "mujoco", "--engine", "spook"])
    alone = CliRunner().invoke(main, ["models", str(file), "--markdown"])

    assert ran.exit_code == 0, ran.output
    assert "5.00 s  mujoco" in ran.output
    assert "of both errors" in ran.output
    assert "over contacts" in ran.output
    assert alone.exit_code == 2 and "several engines" in alone.output


def test_a_swing_is_compared_with_mujocos(tmp_path: Path) -> None:
    pytest.importorskip(
        "mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'"
    )
    (tmp_path / "swing.xml").write_text(SWING)
    ran = CliRunner().invoke(main, ["models", str(tmp_path), "--engine", "spook", "--agree"])
    alone = CliRunner().invoke(main, ["models", str(tmp_path), "--agree"])

    assert "1 swing as in MuJoCo" in ran.output
    assert "0 swing otherwise; of 0 the steps say too little; 0 out of time" in ran.output
    assert alone.exit_code == 2


def test_a_swing_that_breaks_off_at_long_steps_is_compared_at_shorter_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[float] = []

    def ran(model: object, engine: str, step: float, end: float) -> tuple[np.ndarray, float]:
        asked.append(step)
        if engine == "spook" and step > 0.004:
            raise model_agreement.BrokeOff("spook: diverged")
        return np.full((1, 3), (1e-8 if engine == "spook" else 0.0) + 1e-12 * step), 1.0

    monkeypatch.setattr(model_agreement, "_ran", ran)
    found = agreement(None, "spook")  # type: ignore[arg-type]

    assert found.apart == pytest.approx(np.sqrt(3.0) * 1e-8, rel=1e-4) and found.resolved
    assert asked == [1e-3, 5e-4, 1e-2, 5e-3, 2.5e-3, 1.25e-3]


def test_a_swing_that_takes_longer_than_there_is_time_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip(
        "mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'"
    )
    (tmp_path / "swing.xml").write_text(SWING)
    monkeypatch.setattr(model_packages, "agreement", partial(agreement, budget=0.0))

    (found,) = (model_packages._compared("spook", path) for path in files_of(str(tmp_path)))

    assert found.word == "runs" and found.out_of_time and not found.agrees
    assert found.sentence == "out of time: mujoco needs steps of 0.001 s or less"


def test_a_step_that_an_engine_takes_in_the_same_parts_is_halved_further(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[float] = []

    def ran(_model: object, _engine: str, step: float, _end: float) -> tuple[np.ndarray, float]:
        asked.append(step)
        return np.array([[1.0 if step > 0.3 else 1e-8 * step, 0.0, 0.0]]), 1.0

    monkeypatch.setattr(model_agreement, "_ran", ran)
    there, changed, _ = model_agreement._resolved(None, "parts", 1.0, 0.0)  # type: ignore[arg-type]

    assert asked == [1.0, 0.5, 0.25, 0.125]
    assert there[0, 0] == 1.25e-9 and 0.0 < changed < 1e-8

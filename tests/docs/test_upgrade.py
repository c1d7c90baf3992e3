"""The page "Before you upgrade your engine" goes as it says, with a release in which gravity is another one."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

import spook_tracker.tracker.measure.releases as releases
from spook_tracker.tracker.cli.main import main
from tests.docs.test_commands import typed
from tests.docs.test_site import blocks

pytest.importorskip("mujoco", reason="the extra mujoco is not installed: pip install 'spook-tracker[mujoco]'")

PAGE = "docs/how-to/upgrade.md"
ROBOT = """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
<body name="ball" pos="0 0 .1"><freejoint/><geom size=".1"/></body>
<body name="arm" pos="1 0 1"><joint axis="0 1 0" damping=".1"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/></body>
</worldbody><keyframe><key name="home" qpos="0 0 .1 1 0 0 0 .1"/></keyframe></mujoco>"""
STRONGER = """import importlib.util, sys
from importlib.machinery import PathFinder
from pathlib import Path

here = Path(__file__).resolve().parent.parent
spec = PathFinder.find_spec("mujoco", [place for place in sys.path if Path(place).resolve() != here])
true = importlib.util.module_from_spec(spec)
sys.modules["mujoco"] = true
spec.loader.exec_module(true)
step = true.mj_step

def stronger(m, d, count=1):
    m.opt.gravity[2] = -9.9
    step(m, d, count)

true.mj_step = stronger
"""


@pytest.fixture
def team(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a robot, and releases of which only the third has another gravity."""
    (tmp_path / "robot.xml").write_text(ROBOT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("TRACKER_DB", raising=False)

    def install(engine: str, version: str, folder: Path) -> Path:
        place = folder / f"{engine}-{version}"
        told = place / f"mujoco-{version}.dist-info"
        told.mkdir(parents=True, exist_ok=True)
        (told / "METADATA").write_text(f"Metadata-Version: 2.1\nName: mujoco\nVersion: {version}\n")
        if version == "3.4.0":
            (place / "mujoco").mkdir(exist_ok=True)
            (place / "mujoco/__init__.py").write_text(STRONGER)
        return place

    monkeypatch.setattr(releases, "released", lambda engine: ("3.3.6", "3.3.7", "3.4.0"))
    monkeypatch.setattr(releases, "install", install)
    return tmp_path


def invoke(line: str) -> Any:
    return CliRunner().invoke(main, shlex.split(line)[1:], prog_name="tracker")


def test_the_page_goes_as_it_says_and_finds_what_the_release_changed(team: Path) -> None:
    """Then a release that does the same as the one before it, and one that is asked again, and about another model."""
    look, backfill, publish, *_ = (line for line in typed(PAGE) if line.startswith("tracker "))

    short, seen, asked, published = invoke(look), invoke(f"{look} --all"), invoke(backfill), invoke(publish)

    assert "can be predicted for" in short.output
    assert "left out" not in short.output
    assert (seen.exit_code, asked.exit_code, published.exit_code) == (0, 0, 0), seen.output + asked.output
    for name in ("ball.rest_z", "arm.place@0.5s", "differing_runs", "step_time"):
        assert name in seen.output
    assert "mujoco 3.4.0 after 3.3.7" in asked.output
    assert re.search(r"robot: ball rests \S+ m lower", asked.output)  # stronger gravity, softer rest
    assert re.search(r"robot: moves otherwise from 0.05 s on: arm by ", asked.output)
    page = (team / "public/tests/robot.html").read_text(encoding="utf-8")
    assert "What changed with which version" in page
    assert "m lower" in page

    alike = invoke("tracker backfill --engine mujoco 3.3.6 3.3.7 --model robot.xml")
    assert "mujoco 3.3.7 after 3.3.6: no changes" in alike.output
    assert "the same bits: robot" in alike.output
    assert re.search(r"3\.3\.6\b.* values in", alike.output)
    assert re.search(r"3\.3\.7\b.* recorded already", alike.output)

    (team / "other.xml").write_text(ROBOT)
    other = invoke("tracker backfill --engine mujoco 3.3.6 --model other.xml")
    assert "values in" in other.output and "recorded already" not in other.output


def test_the_table_of_the_page_is_understood(team: Path) -> None:
    (table,) = blocks("how-to/upgrade.md", "toml")
    (team / "assets").mkdir()
    (team / "assets/scene.xml").write_text(ROBOT.replace("ball", "bowl").replace("arm", "ramekin"))
    (team / "tracker.toml").write_text(table)

    listed = invoke("tracker list")
    shown = invoke("tracker show kitchen")

    assert "kitchen" in listed.output and "pendulum" in listed.output
    assert "keyframe home" in shown.output and "bowl, ramekin" in shown.output

"""Model files in Drake and DART, by their own parsers: what is read is what a hand calculation gives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine.find import EngineMissing, find
from spook_tracker.engine.model_file import Drive, ModelFile, ModelRun
from spook_tracker.engine.model_reading import read
from spook_tracker.engine.protocol import NotSupported

BAR = '<inertial><origin xyz="{x} 0 0"/><mass value="1"/><inertia ixx=".001" iyy=".001" izz=".001" ixy="0" ixz="0" iyz="0"/></inertial>'
ARM = (
    f'<robot name="arm"><link name="base"/><link name="bar">{BAR.format(x=0.5)}</link>'
    '<joint name="axle" type="continuous"><parent link="base"/><child link="bar"/><axis xyz="0 1 0"/></joint></robot>'
)
BOX = """<robot name="r"><link name="floor"><collision><origin xyz="0 0 -.5"/><geometry><box size="4 4 1"/></geometry></collision>
<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="carrier"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="ball"><collision><geometry><sphere radius=".1"/></geometry></collision>
<inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="prismatic"><parent link="floor"/><child link="carrier"/><origin xyz="0 0 2"/><axis xyz="1 0 0"/>
<limit lower="-9" upper="9" effort="1" velocity="9"/></joint>
<joint name="b" type="prismatic"><parent link="carrier"/><child link="ball"/><origin xyz="0 0 -1.85"/><axis xyz="0 0 1"/>
<limit lower="-9" upper="9" effort="1" velocity="9"/></joint></robot>"""


@pytest.fixture(params=["drake", "dart"])
def engine(request: pytest.FixtureRequest) -> Any:
    try:
        return find(request.param)
    except EngineMissing as missing:
        pytest.skip(str(missing))


def _model(folder: Path, text: str, suffix: str = "urdf", **facts: Any) -> ModelFile:
    folder.mkdir(exist_ok=True)
    file = folder / f"model.{suffix}"
    file.write_text(text)
    found = read(file)
    return ModelFile(
        path=str(file), format=found.format, digest=found.digest, time_step=found.time_step, watched=found.watched,
        gravity=found.gravity, **facts,
    )  # fmt: skip


def test_a_pendulum_swings_with_its_period(tmp_path: Path, engine: Any) -> None:
    """1 kg at .5 m with .001 kg m², let go level: a quarter of 2 π √(I/(m g l)) times 1.18034 for 90 degrees."""
    quarter = 1.18034 * 0.5 * np.pi * np.sqrt((0.25 + 0.001) / (0.5 * 9.81))
    asked = ModelRun(model=_model(tmp_path, ARM), samples=(quarter,))
    turn = engine.simulate(asked, time_step=0.001, duration=quarter)["orientation"][-1, 0]

    assert 2.0 * np.arctan2(abs(turn[2]), abs(turn[0])) == pytest.approx(0.5 * np.pi, abs=0.01)


def test_a_ball_comes_to_lie_on_the_floor_and_is_carried_by_it(tmp_path: Path, engine: Any) -> None:
    model = _model(tmp_path, BOX)
    end = engine.simulate(ModelRun(model=model, samples=(2.0,)), time_step=0.001, duration=2.0)

    assert end["position"][-1][0][2] == pytest.approx(0.1, abs=2e-3)
    assert float(end["load"]) == pytest.approx(0.5, abs=0.02)  # the carrier's half is carried by its rail
    assert float(end["size"]) > 1.85


def test_the_same_bits_come_twice_and_pushes_move_it(tmp_path: Path, engine: Any) -> None:
    model = _model(tmp_path, ARM)
    runs = [
        engine.simulate(
            ModelRun(model=model, samples=(0.2,), push=push, seed=1), time_step=0.001, duration=0.2
        )
        for push in (0.0, 0.0, 1e-3)
    ]

    assert runs[0].state_hash == runs[1].state_hash != runs[2].state_hash


WORLD = """<sdf version="1.6"><world name="w"><physics type="ode"><max_step_size>.002</max_step_size></physics><gravity>0 0 -9.81</gravity>
<model name="floor"><static>1</static><link name="link">{inertial}<collision name="c"><pose>0 0 -.5 0 0 0</pose><geometry><box>
<size>9 9 1</size></box></geometry></collision></link></model>{balls}</world></sdf>"""
INERTIAL = "<inertial><mass>1</mass><inertia><ixx>.01</ixx><iyy>.01</iyy><izz>.01</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>"
BALL = '<model name="{}"><pose>{} 0 {} 0 0 0</pose><link name="link">{}<collision name="c"><geometry><sphere><radius>.15</radius></sphere></geometry></collision></link></model>'


@pytest.mark.parametrize("name", ["drake", "dart", "pybullet"])
def test_links_of_one_name_in_several_models_are_told_apart(tmp_path: Path, name: str) -> None:
    """Every model of an SDF world may call its link so: two balls fall a little, and the floor carries both."""
    try:
        simulate = find(name).simulate
    except EngineMissing as missing:
        pytest.skip(str(missing))
    balls = "".join(BALL.format(f"ball{k}", k, 0.16 + 0.02 * k, INERTIAL) for k in (0, 1))
    model = _model(tmp_path, WORLD.format(inertial=INERTIAL, balls=balls), suffix="sdf")
    found = simulate(ModelRun(model=model, samples=(0.0, 1.5)), time_step=0.002, duration=1.5)

    assert [one.name for one in model.watched] == ["ball0::link", "ball1::link"]
    assert pytest.approx(np.array([[0.0, 0.16], [1.0, 0.18]]), abs=1e-6) == found["position"][0, :, [0, 2]].T
    assert found["position"][-1, :, 2] == pytest.approx(0.15, abs=3e-3)
    assert float(found["load"]) == pytest.approx(1.0, abs=0.02)


LIAR = b"x" * 80 + b"\xff" * 4 + bytes(50)  # an STL of one triangle that says it has four thousand million


@pytest.mark.parametrize("name", ["drake", "dart", "pybullet"])
def test_a_broken_mesh_is_one_sentence_and_nothing_is_loaded(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    try:
        simulate = find(name).simulate
    except EngineMissing as missing:
        pytest.skip(str(missing))
    capfd.readouterr()
    monkeypatch.chdir(tmp_path)
    Path("mesh.stl").write_bytes(LIAR)
    shape = '<collision><geometry><mesh filename="mesh.stl"/></geometry></collision>'
    model = _model(Path(), ARM.replace('<link name="bar">', f'<link name="bar">{shape}'))
    with pytest.raises(NotSupported, match=r"model\.urdf") as raised:
        simulate(ModelRun(model=model), time_step=0.001, duration=0.1)

    assert "mesh" in str(raised.value).lower() and "\n" not in str(raised.value)
    sound = _model(Path(), ARM)
    assert simulate(ModelRun(model=sound), time_step=0.001, duration=0.01).completed
    assert capfd.readouterr() == ("", "")


def test_dart_says_that_it_would_weld_what_is_free(tmp_path: Path) -> None:
    try:
        simulate = find("dart").simulate
    except EngineMissing as missing:
        pytest.skip(str(missing))
    text = '<mujoco model="m"><worldbody><body name="ball">{}<geom type="sphere" size=".1"/></body></worldbody></mujoco>'
    free, named = _model(tmp_path, text.format('<joint type="free"/>')), tmp_path / "named"
    fallen = simulate(ModelRun(model=free, samples=(1.0,)), time_step=0.001, duration=1.0)["position"][-1]

    assert fallen[0, 2] == pytest.approx(-0.5 * 9.81, abs=0.01)
    with pytest.raises(NotSupported, match="freejoint"):
        simulate(ModelRun(model=_model(named, text.format("<freejoint/>"))), time_step=0.001, duration=0.1)


def test_a_shape_that_drake_asserts_on_is_refused(tmp_path: Path) -> None:
    try:
        simulate = find("drake").simulate
    except EngineMissing as missing:
        pytest.skip(str(missing))
    inverted = _model(tmp_path, BOX.replace('radius=".1"', 'radius="-1"'))
    unread = _model(tmp_path / "other", ARM.replace('xyz="0 1 0"', 'xyz="up"'))

    for model, said in ((inverted, "radius = -1"), (unread, "Expected 3 values")):
        with pytest.raises(NotSupported, match=said):
            simulate(ModelRun(model=model), time_step=0.001, duration=0.1)


def test_what_it_cannot_be_asked_is_said(tmp_path: Path, engine: Any) -> None:
    driven = _model(tmp_path, ARM, drive=Drive(kind="hold"))
    broken = _model(tmp_path, ARM)
    Path(broken.path).write_text(ARM.replace("<robot", "<robot><link/>", 1))

    for elsewhere in (False, True):
        asked = ModelRun(model=broken, elsewhere=elsewhere)
        with pytest.raises(NotSupported, match=r"model.urdf"):
            engine.simulate(asked, time_step=0.001, duration=0.1)
    with pytest.raises(NotSupported, match="without controls"):
        engine.simulate(ModelRun(model=driven), time_step=0.001, duration=0.1)

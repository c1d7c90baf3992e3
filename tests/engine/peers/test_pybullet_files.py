"""Model files in PyBullet, by its own importers: what is read is what a hand calculation gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spook_tracker.engine.find import find
from spook_tracker.engine.model_file import Drive, ModelFile, ModelRun
from spook_tracker.engine.model_reading import read
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests.model_file import cost, rest
from spook_tracker.scalar_tests.model_file.facts import Asked

pytest.importorskip(
    "pybullet", reason="the extra pybullet is not installed: pip install 'spook-tracker[pybullet]'"
)

BOX = """<mujoco><worldbody><geom type="plane" size="2 2 .1"/>
<body name="box" pos="0 0 .25"><freejoint/><geom type="box" size=".25 .25 .25" mass="1"/></body></worldbody></mujoco>"""
ARM = """<robot name="arm"><link name="base"/><link name="bar"><inertial><origin xyz=".5 0 0"/><mass value="1"/>
<inertia ixx="1e-6" ixy="0" ixz="0" iyy="1e-6" iyz="0" izz="1e-6"/></inertial></link>
<joint name="axle" type="continuous"><parent link="base"/><child link="bar"/><axis xyz="0 1 0"/></joint></robot>"""


def _model(folder: Path, name: str, text: str, **facts) -> ModelFile:
    file = folder / name
    file.write_text(text)
    found = read(file)
    return ModelFile(
        path=str(file), format=found.format, digest=found.digest, time_step=found.time_step, watched=found.watched,
        gravity=found.gravity, **facts,
    )  # fmt: skip


def _run(model: ModelFile, duration: float, **asked):
    return find("pybullet").simulate(
        ModelRun(model=model, **asked), time_step=model.time_step, duration=duration
    )


def test_a_box_rests_carried_by_its_contacts(tmp_path: Path) -> None:
    found = rest.measure(
        Asked(model=_model(tmp_path, "box.xml", BOX), duration=1.0), find("pybullet").simulate
    )

    assert found["load"] == pytest.approx(1.0, abs=1e-3)
    assert found["box.rest_z"] == pytest.approx(0.25, abs=1e-3)
    assert found["box.rest_z"].unsettled == ""


def test_the_gravity_of_the_file_counts(tmp_path: Path) -> None:
    still = BOX.replace("<worldbody>", '<option gravity="0 0 1"/><worldbody>')

    rises = _run(_model(tmp_path, "box.xml", still), 1.0, samples=(0.0, 1.0))["position"][:, 0, 2]

    assert rises[1] - rises[0] == pytest.approx(0.5, abs=0.01)


def test_a_pendulum_swings_with_its_period_and_no_motor_holds_it(tmp_path: Path) -> None:
    """A point of 1 kg at .5 m, let go level: a quarter of 2 π √(l/g) times 1.1803 for 90 degrees."""
    quarter = 1.18034 * 0.5 * np.pi * np.sqrt(0.5 / 9.81)

    turn = _run(_model(tmp_path, "arm.urdf", ARM), quarter, samples=(quarter,))["orientation"][-1, 0]

    assert 2.0 * np.arctan2(abs(turn[2]), turn[0]) == pytest.approx(0.5 * np.pi, abs=0.02)


def test_it_repeats_its_bits_here_and_in_another_process(tmp_path: Path) -> None:
    asked = Asked(model=_model(tmp_path, "arm.urdf", ARM), duration=0.2)

    assert cost.repeatability(asked, find("pybullet").simulate) == {"differing_runs": 0.0}


def test_what_it_is_not_asked_is_not_supported_by_name(tmp_path: Path) -> None:
    with pytest.raises(NotSupported, match="without controls"):
        _run(_model(tmp_path, "arm.urdf", ARM, drive=Drive(kind="hold")), 0.1)
    with pytest.raises(NotSupported, match=r"pybullet refuses broken\.urdf"):
        _run(_model(tmp_path, "broken.urdf", ARM.replace("<link name=\"base\"/>", "<link name=\"base\"><inertial/></link>").replace("continuous", "revolute")), 0.1)  # fmt: skip
